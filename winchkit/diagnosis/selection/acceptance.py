"""Whether a grown model holds where it was not fitted: the gate of the search."""

from __future__ import annotations

import numpy as np

from winchkit.diagnosis.regression.cross_validation import (
    held_out,
    held_out_rms,
    signed_rank_p_value,
)
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.noise import Noise
from winchkit.diagnosis.selection.engine import SelectionEngine, Trial
from winchkit.effects.parametrization import Coordinates

__all__ = ["MIN_GAIN", "RELEVANT_RATIO", "best_accepted", "is_accepted"]

_LEVEL = 0.02
MIN_GAIN = 2.0
"""By how much a criterion must fall for a change to be worth it."""
_NO_WORSE = 1.02
RELEVANT_RATIO = 0.98
"""Of some held-out error, what may be left for a change to matter to anyone."""


def best_accepted(
    engine: SelectionEngine, present: Fit, noise: Noise, trials: list[Trial]
) -> Fit | None:
    """The best of the short list that passes the gate, all refitted; None where none does."""
    before = engine.criterion(present)
    for trial in sorted(trials, key=lambda t: t.criterion):
        if trial.criterion < before - MIN_GAIN and is_accepted(engine, present, trial.fit, noise):
            return trial.fit
    return None


def is_accepted(
    engine: SelectionEngine, present: Fit, grown: Fit, noise: Noise, matters: float = RELEVANT_RATIO
) -> bool:
    """Whether the gain holds on blocks left out, by rank, and on groups left out, in sum.

    An effect that shows in few blocks, such as those of one kind of move, cannot be certain by
    rank; that it pays for itself in every single group, none of which it was fitted on, can.
    """
    regression = engine.regression
    blocks = regression.blocks
    before = held_out(regression, present, noise, blocks)
    after = held_out(regression, grown, noise, blocks)
    groups = engine.folds(grown, noise)
    gain = held_out(regression, present, noise, groups) - held_out(regression, grown, noise, groups)
    pays = engine.grouped(groups) and bool(
        np.min(gain) > engine.penalty_per_parameter * _added(present, grown)
    )
    if np.sum(before - after) <= 0 or (signed_rank_p_value(before, after) > _LEVEL and not pays):
        return False
    was = held_out_rms(regression, present, noise, groups)
    now = held_out_rms(regression, grown, noise, groups)
    ratios = [now[output] / was[output] for output in regression.outputs]
    # What is certain and changes nothing, such as a clock a millisecond off, is not worth a name.
    return bool(np.sum(gain) > 0 and min(ratios) < matters and max(ratios) < _NO_WORSE)


def _added(present: Fit, grown: Fit) -> int:
    """Degrees of freedom that a grown model has more than the present model, one at least."""
    after, before = (
        sum(Coordinates(term.effect).n_parameters for term in fitted.hypothesis.terms)
        for fitted in (grown, present)
    )
    return max(1, after - before)
