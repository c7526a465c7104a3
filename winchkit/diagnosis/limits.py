"""What a set of runs cannot show, said before anything is concluded from it."""

from __future__ import annotations

import numpy as np

from winchkit.diagnosis.problem import Problem
from winchkit.diagnosis.repeats import mean_load

__all__ = ["what_runs_cannot_show"]

_DIFFERENT_LOADS = 0.05
_ONE_WAY = 0.02
_WARMED = 1.0


def what_runs_cannot_show(problem: Problem) -> list[str]:
    """Sentences on missing repeats, loads, directions, speeds and temperatures."""
    dataset = problem.dataset
    notes = []
    if not dataset.repeated:
        notes.append(
            "no run repeats another: the noise is what no known effect explains, so an effect "
            "outside the catalogue cannot be excluded; record one programme twice"
        )
    loads = [m for m in (mean_load(r.signals) for r in dataset.recordings) if m is not None]
    if not loads:
        notes.append("no load and no tension: what depends on the rope's force cannot be seen")
    elif max(loads) - min(loads) < _DIFFERENT_LOADS * max(abs(x) for x in loads):
        notes.append(
            "one load only: rope elasticity and frame compliance, cell gain and offset are hard "
            "to tell apart; repeat a run under another load"
        )
    if loads and all(r.raw.load is None for r in dataset.recordings):
        notes.append(
            "no load known: pulley friction and cell errors cannot be seen; give load_mass or "
            "a second cell"
        )
    speed = np.concatenate([r.raw.at.speed for r in dataset.recordings])
    moving = np.abs(speed) > 1e-3
    inwards = float(np.mean(speed[moving] > 0)) if moving.any() else 0.0
    if not _ONE_WAY < inwards < 1 - _ONE_WAY:
        notes.append(
            "one direction only: friction and backlash cannot be told from gains and offsets; "
            "run back as well"
        )
    warmth = [r.signals.temperature for r in dataset.recordings]
    if any(t is None for t in warmth):
        notes.append("no temperature measured: thermal effects cannot be seen")
    elif np.ptp(np.concatenate([t for t in warmth if t is not None])) < _WARMED:
        notes.append("temperature nearly constant: thermal effects cannot be seen")
    return notes
