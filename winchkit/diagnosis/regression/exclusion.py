"""Samples that an effect which was found jerks by how much nobody knows.

Teeth that meet again after a play give the drum its speed at once: how hard that pulls at a hanging
weight depends on what gives way, and when it was between two samples nobody recorded. Where these
samples take part, what they leave is taken for ripples and frictions that are not there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from winchkit.diagnosis.data.dataset import Dataset, Recording
from winchkit.diagnosis.data.transients import around
from winchkit.diagnosis.regression.hypothesis import Hypothesis, started
from winchkit.effects.term import Term

__all__ = ["without_impacts"]

_FORCES = ("tension", "motor_torque")
_MOST = 0.25


def without_impacts(dataset: Dataset, found: Hypothesis) -> Dataset | None:
    """The dataset without force and torque around such samples; None where there are none, or
    more than a quarter of all.
    """
    recordings = tuple(
        _without_impacts(recording, started(found, run))
        for run, recording in enumerate(dataset.recordings)
    )
    if all(a is b for a, b in zip(recordings, dataset.recordings, strict=True)):
        return None
    names = ", ".join(t.label for t in found.terms if t.effect.shakes is not None)
    share = 1 - _compared(recordings) / max(1, _compared(dataset.recordings))
    if share > _MOST:
        return None  # No few moments: what is left would tell nothing any more.
    note = (
        f"force and torque are not compared in the moments in which {names} jerks them "
        f"({share:.1%} of the samples): how hard depends on what gives way"
    )
    return replace(dataset, recordings=recordings, notes=(*dataset.notes, note))


def _compared(recordings: Sequence[Recording]) -> int:
    """Samples of the torque, or of the force where no torque is measured."""
    valid = [r.valid.get("motor_torque", r.valid.get("tension")) for r in recordings]
    return sum(int(np.count_nonzero(good)) for good in valid if good is not None)


def _without_impacts(recording: Recording, terms: Sequence[Term]) -> Recording:
    """Without what the terms jerk: the torque, and the tension that a weight makes of it."""
    at = recording.raw.at
    shaken = np.zeros(len(at.time), dtype=bool)
    for term in terms:
        if term.effect.shakes is not None:
            shaken |= term.effect.shakes(at, term.values)
    known_weight = recording.raw.load_mass is not None
    left = set(_FORCES if known_weight else _FORCES[1:]) & recording.valid.keys()
    if not shaken.any() or not left:
        return recording
    near = around(shaken, at.time)
    valid = {
        output: good & ~near if output in left else good for output, good in recording.valid.items()
    }
    return replace(recording, valid=valid)
