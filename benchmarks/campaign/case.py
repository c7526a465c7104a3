"""One case: a winch, its runs, what it hides and at what size, written into a folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from campaign.files import write_run
from campaign.motion import programme
from campaign.sizes import CATALOGUE, OUTSIDE, Scene, Sized, allowed, draw
from campaign.truth import Hidden, Shown, Situation, show
from campaign.winch import Winch, draw_winch, turns_for, write_profile

__all__ = ["Case", "Plan", "make_case"]

Array = NDArray[np.float64]
Random = np.random.Generator
OUTPUTS = ("cable_length", "tension", "motor_torque")
KINDS = {"none": 0, "single": 1, "pair": 2, "triple": 3, "norepeat": 1, "outside": 1}
TOO_ALIKE = 0.9
ATTEMPTS = 200


@dataclass(frozen=True)
class Plan:
    """What a case is to be."""

    kind: str
    snr: float
    effects: tuple[str, ...] = ()
    """Drawn at random where empty."""
    small: bool = False


@dataclass(frozen=True)
class Case:
    """A case on disk and what is true of it."""

    seed: int
    kind: str
    snr: float
    hidden: Hidden
    noise: dict[str, float]
    winch: Winch
    runs: tuple[Path, ...]
    profile: Path
    scene: str


@dataclass(frozen=True)
class _Bench:
    winch: Winch
    situations: tuple[Situation, ...]
    programmes: tuple[int, ...]
    scene: Scene
    load: str
    warms: bool
    measures_temperature: bool
    noise: dict[str, float]
    colour: float


def make_case(seed: int, plan: Plan, folder: Path) -> Case | None:
    """Draw a case and write it, the same for the same seed and plan.

    None where no winch drawn can have the wanted effect at the wanted size.
    """
    for attempt in range(ATTEMPTS):
        random = np.random.default_rng([seed, attempt])
        bench = _draw_bench(random, plan)
        names = _draw_effects(random, plan, bench)
        if names is None:
            continue
        hidden = _sized(random, plan, bench, names)
        if hidden is not None:
            return _write(random, seed, plan, bench, hidden, folder)
    return None


def _draw_bench(random: Random, plan: Plan) -> _Bench:
    winch = draw_winch(random)
    # Physics in finer steps than the samples, or in steps as coarse as they are.
    every = int(random.choice([1, 4]))
    rate = every * float(random.choice([20.0, 25.0, 50.0]))
    seconds = float(random.uniform(60, 100 if plan.small else 200))
    stroke = float(random.uniform(0.5, 5))
    # The rope stays on the drum and its first layer.
    stroke = min(stroke, 0.8 * 2 * np.pi * winch.wound_turns * winch.radius)
    heaviest = float(random.uniform(15, 60))
    masses = tuple(
        round(heaviest * part, 2) for part in (1.0, 0.35, 0.6)[: int(random.integers(2, 4))]
    )
    load = str(random.choice(["load", "mass", "load", "mass", "cell"]))
    repeats = "none" if plan.kind == "norepeat" else str(random.choice(["perfect", "imperfect"]))
    warms = bool(random.random() < 0.5)
    situations, programmes = [], []
    moves = [programme(random, rate, seconds, stroke) for _ in range(int(random.integers(1, 3)))]
    wander = _slow_curve(random, len(moves[0][0]))
    for index, (time, wound) in enumerate(moves):
        angle = turns_for(winch, 1.0) * wound
        motor = winch.motor_reference + winch.direction * winch.ratio * angle
        for mass in masses if index == 0 else masses[:2]:
            for again in range(1 if repeats == "none" else 2):
                late = bool(again and repeats == "imperfect")
                drop = every * int(random.integers(0, rate / every)) if late else 0
                start = float(random.uniform(0, 9)) if late else 0.0
                kept = slice(0, len(time) - drop)
                warm = _temperature(random, time, warms, late)
                situations.append(
                    Situation(
                        time[kept] + start, motor[kept], mass, warm[kept], wander[kept], every
                    )
                )
                programmes.append(index)
    torque = 9.8 * heaviest * winch.radius / winch.ratio
    return _Bench(
        winch,
        tuple(situations),
        tuple(programmes),
        Scene(seconds, stroke, masses),
        load,
        warms,
        bool(warms or random.random() < 0.3),
        {
            "cable_length": float(random.uniform(5e-5, 3e-4)),
            "tension": float(random.uniform(0.2, 1.5)),
            "motor_torque": float(random.uniform(0.003, 0.01) * torque),
            "load": float(random.uniform(0.1, 1.0)),
        },
        float(random.choice([0.0, 0.3, 0.6])),
    )


def _slow_curve(random: Random, count: int) -> Array:
    knots = np.cumsum(random.normal(size=7))
    curve = np.interp(np.linspace(0, 6, count), np.arange(7), knots)
    width = count // 8
    padded = np.pad(curve, width, mode="edge")
    curve = np.convolve(padded, np.hanning(width) / np.hanning(width).sum(), mode="same")
    curve = curve[width:-width] - curve.mean()
    return np.asarray(curve / np.std(curve))


def _temperature(random: Random, time: Array, warms: bool, late: bool) -> Array:
    level = 20.0 + (random.uniform(-3, 6) if late else random.uniform(0, 1))
    if not warms:
        return np.full_like(time, level)
    span = random.uniform(4, 12)
    return np.asarray(level + span * np.sin(np.pi * time / time[-1] * random.uniform(0.8, 1.7)))


def _draw_effects(random: Random, plan: Plan, bench: _Bench) -> tuple[str, ...] | None:
    known, loads = bench.load != "cell", len(bench.scene.masses)
    if plan.effects:
        ok = all(allowed(e, bench.winch, known, bench.warms, loads) for e in plan.effects)
        return plan.effects if ok else None
    pool = OUTSIDE if plan.kind == "outside" else CATALOGUE
    fit = [e for e in pool if allowed(e, bench.winch, known, bench.warms, loads)]
    chosen = random.choice(fit, size=KINDS[plan.kind], replace=False)
    return tuple(str(e) for e in chosen)


def _sized(
    random: Random, plan: Plan, bench: _Bench, names: tuple[str, ...]
) -> dict[str, dict[str, float]] | None:
    """Every effect at the size that gives the wanted SNR; None where no sane size does."""
    plain = [show(bench.winch, s, {}) for s in bench.situations]
    hidden, shapes = {}, []
    for name in names:
        sized = draw(name, random, bench.winch, bench.scene)
        values = _size_for(plan.snr, bench, name, sized, plain)
        if values is None:
            return None
        hidden[name] = values
        shapes.append(_difference(bench, plain, {name: values}))
    for i, a in enumerate(shapes):
        for b in shapes[:i]:
            if abs(a @ b) > TOO_ALIKE * np.sqrt((a @ a) * (b @ b)):
                return None
    return hidden


def _difference(bench: _Bench, plain: list[Shown], hidden: Hidden) -> Array:
    """What an effect changes, in units of the noise, less what a length offset explains."""
    rows = []
    other = [show(bench.winch, s, hidden) for s in bench.situations]
    for output in OUTPUTS:
        if output == "tension" and bench.load == "cell":
            continue
        change = np.concatenate(
            [getattr(b, output) - getattr(a, output) for a, b in zip(plain, other, strict=True)]
        )
        if output == "cable_length":
            change = change - change.mean()
        rows.append(change / bench.noise[output])
    return np.concatenate(rows)


def _snr(bench: _Bench, plain: list[Shown], hidden: Hidden) -> float:
    """On the most affected output; of what is outside the catalogue only the part that is."""
    change = _difference(bench, plain, hidden)
    count = sum(len(s.time[:: s.every]) for s in bench.situations)
    parts = change.reshape(-1, count)
    if "gear-backlash" in hidden:
        # Its torque does not scale with the gap.
        parts = parts[:1]
    elif any(name.startswith("outside-") for name in hidden):
        turned = np.concatenate([s.motor_angle[:: s.every] for s in bench.situations])
        turned = (turned - turned.mean()) / np.ptp(turned)
        kin = np.column_stack([np.ones(count), turned, turned**2])
        # Radius, ratio and layers are in reach of the length, an offset of the other outputs.
        inside = [kin, *[kin[:, :1]] * (len(parts) - 1)]
        parts = np.array(
            [
                p - k @ np.linalg.lstsq(k, p, rcond=None)[0]
                for p, k in zip(parts, inside, strict=True)
            ]
        )
    return float(np.max(np.sqrt(np.mean(parts**2, axis=1))))


def _size_for(
    snr: float, bench: _Bench, name: str, sized: Sized, plain: list[Shown]
) -> dict[str, float] | None:
    size = 1.0
    for _ in range(12):
        got = _snr(bench, plain, {name: sized(size)})
        if not np.isfinite(got):
            return None
        if abs(np.log(max(got, 1e-12) / snr)) < 0.02:
            break
        size *= float(np.clip(snr / max(got, 1e-9), 0.1, 10.0))
        if not 1e-5 < size < 60:
            return None
    else:
        return None
    values = sized(size)
    sane = values.get("friction", 0) < 0.3 and values.get("static", 0) < 0.4
    sane = sane and values.get("efficiency", 1) > 0.4 and values.get("time_constant", 1) < 1e4
    return values if sane else None


def _write(
    random: Random, seed: int, plan: Plan, bench: _Bench, hidden: Hidden, folder: Path
) -> Case:
    folder.mkdir(parents=True, exist_ok=True)
    profile = folder / "winch.toml"
    write_profile(bench.winch, profile)
    offset = random.normal(0, 0.02)
    paths = []
    for index, (run, number) in enumerate(zip(bench.situations, bench.programmes, strict=True)):
        ideal = show(bench.winch, run, hidden)
        time = run.time[:: run.every]
        channels = {"time": time, "motor_angle": run.motor_angle[:: run.every]}
        for output in OUTPUTS:
            noise = _noise(random, len(time), bench.noise[output], bench.colour)
            channels[output] = getattr(ideal, output) + noise
        channels["cable_length"] = channels["cable_length"] + offset
        if bench.load == "load":
            channels["load"] = ideal.load + random.normal(0, bench.noise["load"], len(time))
        if bench.measures_temperature:
            channels["temperature"] = run.temperature[:: run.every] + random.normal(
                0, 0.02, len(time)
            )
        metadata = {"programme": f"moves-{number}"}
        if bench.load == "mass":
            metadata["load_mass"] = f"{run.mass} kg"
        path = folder / f"run-{index}.csv"
        write_run(path, channels, metadata)
        paths.append(path)
    w = bench.winch
    scene = (
        f"{w.kind} dir {w.direction} ratio {w.ratio} pulleys {len(w.wraps)} {bench.load} "
        f"{len(paths)} runs {len(bench.situations[0].time)} steps of 1/{bench.situations[0].every} samples "
        f"masses {bench.scene.masses} warms {bench.warms} colour {bench.colour}"
    )
    return Case(seed, plan.kind, plan.snr, hidden, bench.noise, w, tuple(paths), profile, scene)


def _noise(random: Random, count: int, rms: float, colour: float) -> Array:
    """White noise, of which ``colour`` (a share of the power) is AR(1)."""
    white = random.normal(size=count)
    drive = random.normal(size=count) * np.sqrt(1 - 0.9**2)
    slow, y = [], float(random.normal())
    for d in drive.tolist():
        y = 0.9 * y + d
        slow.append(y)
    return np.asarray(rms * (np.sqrt(1 - colour) * white + np.sqrt(colour) * np.array(slow)))
