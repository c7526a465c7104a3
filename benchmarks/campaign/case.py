"""One case: a winch, its runs, what it hides and at what size, written into a folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from campaign.bench import Bench, draw_bench
from campaign.record import record
from campaign.sizes import CATALOGUE, OUTSIDE, Sized, allowed, draw
from campaign.truth import OUTPUTS, Hidden, Shown, show
from campaign.winch import write_profile
from winchkit.arrays import Array

Random = np.random.Generator
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
    runs: tuple[Path, ...]
    profile: Path
    scene: str


def make_case(seed: int, plan: Plan, folder: Path) -> Case | None:
    """Draw a case and write it, the same for the same seed and plan.

    None where no winch drawn can have the wanted effect at the wanted size.
    """
    for attempt in range(ATTEMPTS):
        random = np.random.default_rng([seed, attempt])
        bench = draw_bench(random, plan.kind != "norepeat", plan.small)
        names = draw_effects(random, plan, bench)
        if names is None:
            continue
        hidden = size_effects(random, plan, bench, names)
        if hidden is not None:
            folder.mkdir(parents=True, exist_ok=True)
            profile = folder / "winch.toml"
            write_profile(bench.winch, profile)
            runs = record(random, bench, hidden, folder)
            return Case(seed, plan.kind, plan.snr, hidden, runs, profile, bench.words)
    return None


def draw_effects(random: Random, plan: Plan, bench: Bench) -> tuple[str, ...] | None:
    """What a bench is to hide; None where it cannot."""
    known, loads = bench.load != "cell", len(bench.scene.masses)
    if plan.effects:
        ok = all(allowed(e, bench.winch, known, bench.warms, loads) for e in plan.effects)
        return plan.effects if ok else None
    pool = OUTSIDE if plan.kind == "outside" else CATALOGUE
    fit = [e for e in pool if allowed(e, bench.winch, known, bench.warms, loads)]
    chosen = random.choice(fit, size=KINDS[plan.kind], replace=False)
    return tuple(str(e) for e in chosen)


def size_effects(
    random: Random, plan: Plan, bench: Bench, names: tuple[str, ...]
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


def _difference(bench: Bench, plain: list[Shown], hidden: Hidden) -> Array:
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


def _snr(bench: Bench, plain: list[Shown], hidden: Hidden) -> float:
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
    snr: float, bench: Bench, name: str, sized: Sized, plain: list[Shown]
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
