"""Faults of loggers: what a data logger does to the runs that it records.

Every fault changes recorded channels and nothing else, with numpy alone, and says which channel it
was, which samples the file still has of what the instruments showed, and how exactly.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from campaign.bench import Bench
from campaign.record import Recording
from campaign.truth import OUTPUTS
from winchkit.arrays import Array

Random = np.random.Generator
KEPT = (0.6, 0.95)
"""Share of a run that an excerpt has."""
SLOW = 20.0
"""Rate of a slow logger, Hz."""


@dataclass(frozen=True)
class Logged:
    """One file of a logger."""

    recording: Recording
    run: int
    """Which run of the bench."""
    rows: NDArray[np.intp]
    """Samples of that run that the file has."""
    copy: bool = False
    """Whether another file has the same samples."""
    spikes: Mapping[str, NDArray[np.bool_]] = field(default_factory=dict)
    """Samples of a channel that the file has not, though something else in their place."""


@dataclass(frozen=True)
class Fault:
    """What a logger did, and the files that it wrote."""

    name: str
    words: str
    files: tuple[Logged, ...]
    channel: str = ""
    """The one with a wrong sign or unit."""
    steps: Mapping[str, float] = field(default_factory=dict)
    """Resolutions, SI."""
    zeroed: frozenset[str] = frozenset()
    """Outputs with an offset of their own in every run."""


def fault_of(name: str, random: Random, bench: Bench, runs: Sequence[Recording]) -> Fault | None:
    """The files of a logger with a fault; None where the bench cannot have it."""
    files = tuple(
        Logged(run, index, np.arange(len(run.channels["time"]))) for index, run in enumerate(runs)
    )
    return _FAULTS[name](random, bench, files)


def _changed(file: Logged, **channels: Array) -> Logged:
    """A file with other values of some channels."""
    recording = replace(file.recording, channels={**file.recording.channels, **channels})
    return replace(file, recording=recording)


def _only(file: Logged, rows: NDArray[np.intp]) -> Logged:
    """A file with some of its rows."""
    channels = {name: x[rows] for name, x in file.recording.channels.items()}
    return replace(file, recording=replace(file.recording, channels=channels), rows=file.rows[rows])


def _nothing(_: Random, __: Bench, files: tuple[Logged, ...]) -> Fault:
    return Fault("none", "", files)


def _quantised(random: Random, bench: Bench, files: tuple[Logged, ...]) -> Fault:
    """Half to eight times the noise; an encoder of 2¹⁴ to 2²⁰ counts a turn."""
    chosen = [name for name in OUTPUTS if random.random() < 0.6]
    steps = {
        name: float(f"{bench.noise[name] * np.exp(random.uniform(np.log(0.5), np.log(8.0))):.1e}")
        for name in chosen or [str(random.choice(OUTPUTS))]
    }
    if random.random() < 0.4:
        steps["motor_angle"] = 2 * np.pi / 2.0 ** random.integers(14, 21)
    rounded = [
        _changed(
            file,
            **{
                name: np.round(file.recording.channels[name] / step) * step
                for name, step in steps.items()
            },
        )
        for file in files
    ]
    words = ", ".join(f"{name} {step:.3g}" for name, step in steps.items())
    return Fault("quantised", words, tuple(rounded), steps=steps)


def _jittered(random: Random, _: Bench, files: tuple[Logged, ...]) -> Fault:
    """Even samples, stamped late or early by up to 5 to 45 % of an interval."""
    share = random.uniform(0.05, 0.45)
    out = []
    for file in files:
        time = file.recording.channels["time"]
        late = random.uniform(-share, share, len(time)) * (time[1] - time[0])
        out.append(_changed(file, time=time + late))
    return Fault("jittered", f"by {share:.0%} of an interval", tuple(out))


def _gappy(random: Random, _: Bench, files: tuple[Logged, ...]) -> Fault:
    """A gap of 0.2 to 1.5 s every 4 to 12 s, and up to 3 % of the other samples lost."""
    every, alone = random.uniform(4, 12), random.uniform(0, 0.03)
    out = []
    for file in files:
        time = file.recording.channels["time"]
        kept = random.random(len(time)) >= alone
        at = time[0] + random.exponential(every)
        while at < time[-1]:
            long = random.uniform(0.2, 1.5)
            kept &= (time < at) | (time > at + long)
            at += long + 0.5 + random.exponential(every)
        out.append(_only(file, np.flatnonzero(kept)))
    return Fault("gappy", f"a gap every {every:.0f} s, {alone:.1%} of the rest", tuple(out))


def _zeroed(random: Random, bench: Bench, files: tuple[Logged, ...]) -> Fault:
    """The length's zero anew in every run, by 10 to 100 times its noise, or the tension's."""
    of = "cable_length" if bench.load == "cell" else str(random.choice(OUTPUTS[:2]))
    size = bench.noise[of] * np.exp(random.uniform(np.log(3.0), np.log(100.0)))
    moved = [
        _changed(file, **{of: file.recording.channels[of] + random.normal(0, size)})
        for file in files
    ]
    return Fault("zeroed-anew", f"{of} by {size:.3g}", tuple(moved), zeroed=frozenset({of}))


def _spiky(random: Random, bench: Bench, files: tuple[Logged, ...]) -> Fault:
    """Single samples, 0.1 to 1 %, that read zero or are off by 30 to 3000 times the noise."""
    names = [name for name in OUTPUTS if random.random() < 0.5] or [str(random.choice(OUTPUTS))]
    share, dropped = random.uniform(1e-3, 1e-2), random.random() < 0.3
    far = np.exp(random.uniform(np.log(30.0), np.log(3000.0)))
    out = []
    for file in files:
        changed, spikes = {}, {}
        for name in names:
            values = file.recording.channels[name]
            hit = random.random(len(values)) < share
            # Single ones: none at the ends, none beside another.
            hit[:5] = hit[-5:] = False
            hit[1:] &= ~hit[:-1]
            off = random.choice([-1.0, 1.0], len(values)) * far * bench.noise[name]
            wrong = 0.0 if dropped else values + off * random.uniform(0.5, 1.5, len(values))
            changed[name], spikes[name] = np.where(hit, wrong, values), hit
        out.append(replace(_changed(file, **changed), spikes=spikes))
    how = "zeros" if dropped else f"{far:.0f} times the noise"
    return Fault("spikes", f"{', '.join(names)}: {share:.2%}, {how}", tuple(out))


def _excerpts(random: Random, bench: Bench, files: tuple[Logged, ...]) -> Fault:
    """Excerpts, every second row or rounded values of a run in the place of its repeat."""
    how = str(random.choice(["excerpt", "every second row", "rounded"]))
    out: list[Logged] = []
    for first in files[::2]:
        out.append(first)
        count = len(first.rows)
        if how == "excerpt":
            long = int(random.uniform(*KEPT) * count)
            start = int(random.integers(0, count - long))
            other = _only(first, np.arange(start, start + long))
            time = other.recording.channels["time"]
            other = _changed(other, time=time - time[0])
        elif how == "rounded":
            other = _changed(
                first,
                **{
                    name: np.round(first.recording.channels[name] / step) * step
                    for name, step in ((n, bench.noise[n] / 4) for n in OUTPUTS)
                },
            )
        else:
            other = _only(first, np.arange(0, count, 2))
        out.append(replace(other, copy=True))
    return Fault("excerpts", how, tuple(out))


def _unrepeated(_: Random, __: Bench, files: tuple[Logged, ...]) -> Fault:
    return Fault("no-repeats", "", files[::2])


def _slow(random: Random, _: Bench, files: tuple[Logged, ...]) -> Fault | None:
    """Of 50 Hz every third row, or those that come first after every 1/20 s."""
    time = files[0].recording.channels["time"]
    if round(1 / (time[1] - time[0])) <= 2 * SLOW:
        return None
    polled = random.random() < 0.5
    out = []
    for file in files:
        time = file.recording.channels["time"]
        ticks = np.floor((time - time[0]) * SLOW + 1e-6)
        fresh = np.flatnonzero(np.diff(ticks, prepend=-1.0) > 0)
        out.append(_only(file, fresh if polled else np.arange(0, len(time), 3)))
    return Fault("20-Hz", "every 1/20 s" if polled else "every third row", tuple(out))


def _inverted(random: Random, bench: Bench, files: tuple[Logged, ...]) -> Fault:
    channel = str(random.choice(_misreadable(bench)))
    turned = [_changed(f, **{channel: -f.recording.channels[channel]}) for f in files]
    return Fault("inverted-sign", channel, tuple(turned), channel)


def _misreadable(bench: Bench) -> list[str]:
    return [*OUTPUTS, "motor_angle", *(["load"] if bench.load == "load" else [])]


_UNITS: Mapping[str, Mapping[str, float]] = {
    "cable_length": {"mm": 1e-3, "cm": 0.01, "inch": 0.0254, "ft": 0.3048},
    "tension": {"kgf": 9.80665, "lbf": 4.4482216, "kN": 1e3, "daN": 10.0},
    "load": {"kg": 9.80665, "lbf": 4.4482216, "kN": 1e3},
    "motor_torque": {"N cm": 0.01, "mN m": 1e-3, "lbf in": 0.1129848, "kgf cm": 0.0980665},
    "motor_angle": {"deg": np.pi / 180, "turn": 2 * np.pi, "1/4096 turn": 2 * np.pi / 4096},
}
"""SI of one of the unit. Of all of them a factor lies beyond that of any effect."""


def _unit(random: Random, bench: Bench, files: tuple[Logged, ...]) -> Fault:
    """Values in another unit than the file says; of a torque also per cent of a rated one."""
    channel = str(random.choice(_misreadable(bench)))
    units = dict(_UNITS[channel])
    if channel == "motor_torque":
        largest = max(float(np.abs(f.recording.channels[channel]).max()) for f in files)
        rated = largest * random.uniform(0.5, 1.5) / 100
        units |= {"% of rated": rated} if not 0.4 < rated < 2.5 else {}
    unit = str(random.choice(list(units)))
    scaled = [_changed(f, **{channel: f.recording.channels[channel] / units[unit]}) for f in files]
    return Fault("wrong-unit", f"{channel} in {unit}", tuple(scaled), channel)


_FAULTS: Mapping[str, Callable[[Random, Bench, tuple[Logged, ...]], Fault | None]] = {
    "none": _nothing,
    "quantised": _quantised,
    "jittered": _jittered,
    "gappy": _gappy,
    "zeroed-anew": _zeroed,
    "spikes": _spiky,
    "excerpts": _excerpts,
    "inverted-sign": _inverted,
    "wrong-unit": _unit,
    "no-repeats": _unrepeated,
    "20-Hz": _slow,
}
FAULTS = tuple(_FAULTS)
MISREAD = ("inverted-sign", "wrong-unit")
"""Faults that must be named instead of an effect."""
