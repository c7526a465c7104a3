"""Motions with the noise of their inputs taken out, to evaluate effects' changes on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from winchkit.diagnosis.denoise import agreed, quiet
from winchkit.diagnosis.repeats import Repeats
from winchkit.model.line import Line, Motion
from winchkit.model.stages import Signals

__all__ = ["calm_motions"]

Array = NDArray[np.float64]


def calm_motions(
    line: Line, signals: Sequence[Signals], motions: Sequence[Motion], repeats: Sequence[Repeats]
) -> list[Motion]:
    """Motions whose rope force and temperature carry no noise, one per run.

    The acceleration of the rope is what repeats agree on; a measured force is what follows it
    and, of the rest, what repeats agree on; a known weight's force follows it alone.
    """
    out = list(motions)
    for group in repeats:
        weights = [_unit_weight(line, signals[index]) for index in group.runs]
        follow = [w.mean() + s for w, s in zip(weights, _shared(weights, group), strict=True)]
        forces = _forces([signals[index] for index in group.runs], follow, group)
        for index, force in zip(group.runs, forces, strict=True):
            out[index] = _with(out[index], force, signals[index].temperature)
    return out


def _unit_weight(line: Line, signals: Signals) -> Array:
    """What one kilogram would pull, m/s²."""
    weight = line.motion(replace(signals, load=None, tension=None, load_mass=1.0)).load
    assert weight is not None
    return weight


def _shared(values: Sequence[Array], group: Repeats) -> list[Array]:
    """What repeats agree on, about each one's mean."""
    return agreed([value - value.mean() for value in values], group.rows)


def _forces(
    signals: Sequence[Signals], follow: Sequence[Array], group: Repeats
) -> list[Array | None]:
    """Rope force of every run of a group; None where none is known."""
    measured = [s.load if s.load is not None else s.tension for s in signals]
    known = [s.load_mass if s.load is None else None for s in signals]
    if all(mass is not None for mass in known):
        return [mass * f for mass, f in zip(known, follow, strict=True) if mass is not None]
    values = [value for value in measured if value is not None]
    if len(values) < len(signals):
        return [None] * len(signals)
    followed = [_followed(v, f) for v, f in zip(values, follow, strict=True)]
    rest = agreed([v - f for v, f in zip(values, followed, strict=True)], group.rows)
    return [f + r for f, r in zip(followed, rest, strict=True)]


def _followed(force: Array, weight: Array) -> Array:
    """The part of a force that is constant or follows the rope's acceleration."""
    columns = np.column_stack([np.ones_like(force), weight - weight.mean()])
    return np.asarray(columns @ np.linalg.lstsq(columns, force, rcond=None)[0])


def _with(motion: Motion, force: Array | None, temperature: Array | None) -> Motion:
    """A motion with a calm rope force and temperature."""
    at = motion.at
    if temperature is not None:
        at = replace(at, temperature=quiet(temperature))
    if force is None:
        return replace(motion, at=at)
    return replace(
        motion,
        at=replace(at, tension=force),
        load=None if motion.load is None else force,
        drum_tension=None if motion.drum_tension is None else force,
    )
