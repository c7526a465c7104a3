"""What a drive and a logger record of a machine: filters, samples, noise, an encoder's counts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, lfilter, lfilter_zi

from campaign.family.machine import STEP, Machine
from campaign.record import Recording, instrument_noise
from campaign.truth import OUTPUTS, TURN, Shown
from winchkit.arrays import Array

Random = np.random.Generator
LATEST = 0.4
"""Start of a late recording, s: every motion begins at rest for longer than that."""


@dataclass(frozen=True)
class Chain:
    """What lies between a machine and a file."""

    drive: float = 0.0
    """Time constant of the drive's velocity filter, s: its torque and velocity are so late."""
    cut_off: float = 0.0
    """Of the logger's low-pass of second order, the same for every channel, Hz."""
    velocity: bool = False
    """Whether the drive's velocity is recorded."""
    late: bool = False
    """Whether each recording begins at another time, with another phase of the samples."""


def draw_chain(random: Random, rate: float) -> Chain:
    """Any chain of a logger of ``rate`` (Hz)."""
    return Chain(
        drive=float(random.choice([0.0, 1e-3, 3e-3, 6e-3])),
        cut_off=float(random.choice([0.0, 0.0, 0.45, 0.2])) * rate,
        velocity=bool(random.random() < 0.25),
        late=bool(random.random() < 0.5),
    )


def _recorded(
    random: Random, machine: Machine, chain: Chain, motor: Array, shown: Shown
) -> dict[str, Array]:
    """Channels of one file, the time first; each (samples,)."""
    rate = np.gradient(motor, STEP)
    fine = {"motor_angle": motor, **({"motor_velocity": rate} if chain.velocity else {})}
    fine |= {output: getattr(shown, output) for output in OUTPUTS}
    if machine.load == "load":
        fine["load"] = shown.load
    if chain.drive:
        for name in fine.keys() & {"motor_torque", "motor_velocity"}:
            fall = np.exp(-STEP / chain.drive)
            fine[name] = _filtered([1 - fall], [1.0, -fall], fine[name])
    if chain.cut_off:
        b, a = butter(2, chain.cut_off, fs=1 / STEP)
        fine = {name: _filtered(b, a, x) for name, x in fine.items()}
    every = round(1 / (machine.rate * STEP))
    # The last steps' differences are one-sided.
    first = int(random.integers(0, round(LATEST / STEP))) if chain.late else 0
    channels = {name: x[first:-2:every] for name, x in fine.items()}
    count = len(channels["motor_angle"])
    for name, rms in machine.noise.items():
        if name in channels:
            noise = instrument_noise(random, count, rms, machine.colour)
            channels[name] = channels[name] + noise
    if machine.counts:
        step = TURN / machine.counts
        channels["motor_angle"] = np.round(channels["motor_angle"] / step) * step
    return {"time": np.arange(count) / machine.rate, **channels}


def _filtered(b: Array | list[float], a: Array | list[float], x: Array) -> Array:
    """Causal, at rest at the start."""
    return np.asarray(lfilter(b, a, x, zi=lfilter_zi(b, a) * x[0])[0])


def _metadata(machine: Machine, number: int, mass: float) -> dict[str, str]:
    """Of a run of motion ``number``."""
    known = {"load_mass": f"{mass} kg"} if machine.load == "mass" else {}
    return {"programme": f"moves-{number}", **known}


def runs_of(
    random: Random,
    machine: Machine,
    chain: Chain,
    shown: Mapping[tuple[int, float], Shown],
    repeats: int,
    *,
    zero: float | None = None,
) -> list[Recording]:
    """Every motion with every load, each ``repeats`` times; the length counts from one zero.

    That zero (m) is drawn where it is not given.
    """
    offset = random.normal(0, 0.02) if zero is None else zero
    out = []
    for (number, mass), ideal in shown.items():
        for _ in range(repeats):
            motor = machine.motions[number][1]
            channels = _recorded(random, machine, chain, motor, ideal)
            channels["cable_length"] = channels["cable_length"] + offset
            out.append(Recording(channels, _metadata(machine, number, mass)))
    return out
