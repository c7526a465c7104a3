"""Exclusion of samples near backlash impacts, which the fitted model does not predict.

Where gear teeth meet again, the force depends on the compliance of the drive train, which is not
modelled, and on the time between two samples. A fit of these samples would explain them by spurious
ripple and friction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from winchkit.diagnosis.data.dataset import Dataset, Recording
from winchkit.diagnosis.data.transients import with_neighbours
from winchkit.diagnosis.regression.hypothesis import Hypothesis, started
from winchkit.effects.term import Term

_FORCES = ("tension", "motor_torque")
_MOST = 0.25
"""Share of samples beyond which impacts are not left out; screened."""


def without_impacts(dataset: Dataset, hypothesis: Hypothesis) -> Dataset | None:
    """Data set without force and torque near impacts of the fitted effects; None where no sample is
    affected, or more than a quarter of all are."""
    recordings = tuple(
        _without_impacts(recording, started(hypothesis, run))
        for run, recording in enumerate(dataset.recordings)
    )
    if all(a is b for a, b in zip(recordings, dataset.recordings, strict=True)):
        return None
    names = ", ".join(t.label for t in hypothesis.terms if t.effect.impacts is not None)
    share = 1 - _compared(recordings) / max(1, _compared(dataset.recordings))
    if share > _MOST:
        return None  # The remaining samples would not determine the effects.
    note = (
        f"force and torque are not compared at the impacts of {names} ({share:.1%} of the "
        "samples): their size depends on compliances that the model does not have"
    )
    return replace(dataset, recordings=recordings, notes=(*dataset.notes, note))


def _compared(recordings: Sequence[Recording]) -> int:
    """Number of compared samples of the torque, or of the tension where that is missing."""
    valid = [r.valid.get("motor_torque", r.valid.get("tension")) for r in recordings]
    return sum(int(np.count_nonzero(good)) for good in valid if good is not None)


def _without_impacts(recording: Recording, terms: Sequence[Term]) -> Recording:
    """Run without torque near impacts and, under a known weight, without tension."""
    at = recording.raw.at
    impacts = np.zeros(len(at.time), dtype=bool)
    for term in terms:
        if term.effect.impacts is not None:
            impacts |= term.effect.impacts(at, term.values)
    known_weight = recording.raw.load_mass is not None
    left = set(_FORCES if known_weight else _FORCES[1:]) & recording.valid.keys()
    if not impacts.any() or not left:
        return recording
    near = with_neighbours(impacts, recording.raw.clock)
    valid = {
        output: good & ~near if output in left else good for output, good in recording.valid.items()
    }
    return replace(recording, valid=valid)
