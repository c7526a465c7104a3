"""Reasons why a fitted effect is not certain although it fits: what it implies cannot be seen.

The plausible range of an axis follows its torque and acceleration: what an effect contributes to an
output must be of the size of that output, and a law must be seen over a part of its variable, or a
time, in which it differs from a straight line.
"""

from __future__ import annotations

import numpy as np

from winchkit.diagnosis.regression.base import Regression
from winchkit.diagnosis.regression.conditioning import (
    CANCELLED,
    change_by,
    ranges_of_changes,
    value_range,
)
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.effects.effect import Effect
from winchkit.effects.series import orders_of
from winchkit.model.drum import Archimedean, Spiral, drum_of
from winchkit.model.stages import OUTPUT_UNITS
from winchkit.quantity_text import quantity

_LARGEST_RATIO = 2.0
"""Range of an effect's change over that of the output itself, from which other effects must cancel
it; rule of thumb: a balancer cancels most of a weight."""
_LEAST_TRAVEL = 0.5
"""Range of an angle, rad, below which a sine differs from a straight line by less than 1 %
(h²/6 for half a range h): any smooth law fits there."""
_LEAST_TURNS = 0.5
"""Turns below which a wrong number of turns on the drum is no explanation: they are counted."""
_STANDSTILL = 0.01
"""Share of the highest speed below which the axis is not in motion."""
_LEAST_RESOLVED = 0.5
"""Share of the time in motion in which an order must lie within the band: below it the order rests
on the slow parts, in which friction also has a pattern over the angle."""
_OF_LOAD = frozenset({"pulley friction", "gear friction", "load friction"})
"""Families of friction in proportion to the load."""


def oversized(regression: Regression, fit: Fit, index: int) -> str | None:
    """Whether an effect changes an output by far more than that varies, in words."""
    if not isinstance(regression, TimeSeriesRegression):
        return None
    for output, (own, together) in ranges_of_changes(regression, fit, index).items():
        unit, name = OUTPUT_UNITS[output], output.replace("_", " ")
        samples = regression.measured_samples(output)
        whole = value_range(np.concatenate([values[valid] for values, valid in samples]))
        changes = f"it changes the {name} by {quantity(own, unit)}, "
        if own > _LARGEST_RATIO * whole:
            return f"{changes}which varies by {quantity(whole, unit)}: other effects cancel it"
        if own > CANCELLED * together > 0.0:
            rest = quantity(together, unit)
            return f"{changes}and all effects together by {rest}: most of it is cancelled"
    return None


def short_record(regression: Regression, fit: Fit, index: int) -> str | None:
    """Whether a smooth law was seen over too small a part of a turn or of its time, in words."""
    term = fit.hypothesis.terms[index]
    if not isinstance(regression, TimeSeriesRegression):
        return None
    motions, slow = regression.motions, term.values.get("time_constant", 0.0)
    longest = max(float(np.ptp(motion.time)) for motion in motions)
    if slow > longest:
        return (
            f"its time constant is {quantity(slow, 's')}, and the longest run lasts "
            f"{quantity(longest, 's')}: in so short a time it may be a law without memory"
        )
    # The position of a linear axis has no turn.
    if term.effect.variable != "drum_angle" or regression.dataset.profile.is_linear:
        return None
    travel = max(float(np.ptp(motion.drum_angle)) for motion in motions)
    if travel >= _LEAST_TRAVEL:
        return None
    return (
        f"the axis turned by {np.degrees(travel):.2g}° only, over which any smooth law is a "
        "straight line"
    )


def miscounted_turns(regression: Regression, fit: Fit, index: int) -> str | None:
    """Whether a wrong radius is that of another number of turns on the drum, in words.

    Turns that are missing at the reference change the radius of every layer by as many layers.
    """
    error = fit.hypothesis.terms[index].values.get("radius_error")
    if error is None or not isinstance(regression, TimeSeriesRegression):
        return None
    profile = regression.dataset.profile
    drum, wound = drum_of(profile), profile.reference.wound_turns
    growth = drum.growth if isinstance(drum, Spiral | Archimedean) else 0.0
    if not growth or not _LEAST_TURNS <= abs(turns := error / growth) <= max(wound, 1.0):
        return None
    return (
        f"{wound + turns:.3g} turns on the drum at the reference instead of {wound:.3g} would "
        "explain the same: count them"
    )


def unresolved_order(regression: Regression, fit: Fit, index: int) -> str | None:
    """Whether an order lies above the band for most of the motion, in words."""
    term = fit.hypothesis.terms[index]
    orders = orders_of(term)
    if not orders or not isinstance(regression, TimeSeriesRegression):
        return None
    resolved = []
    for segment in regression.segments:
        if segment.output in term.effect.outputs:
            turns = np.abs(regression.motions[segment.run].motor_rate) / (2 * np.pi)
            band = segment.band
            inside = max(orders) * turns < (band.cut_off or band.rate / 2)
            resolved.append(inside[turns > _STANDSTILL * np.max(turns)])
    share = float(np.mean(np.concatenate(resolved)))
    if share >= _LEAST_RESOLVED:
        return None
    return (
        f"the band of the comparison contains its order in {100 * share:.0f} % of the time in "
        "motion only: run more slowly, or sample faster"
    )


def asymmetric_friction(regression: Regression, fit: Fit, index: int) -> str | None:
    """Whether a gain is smaller than a friction in proportion to the load in its outputs, in words.

    A friction F (μ s + δ s²), s the direction, that differs between the directions by δ below μ is
    one that does not, and the gain δ.
    """
    terms = fit.hypothesis.terms
    own = terms[index].effect
    if "gain_error" not in own.null:
        return None

    def outputs_of(effect: Effect) -> set[str]:
        return set(regression.outputs) & set(effect.outputs)

    frictions = [
        place
        for place, term in enumerate(terms)
        if term.effect.family in _OF_LOAD and outputs_of(term.effect) == outputs_of(own)
    ]
    if not frictions:
        return None
    rows = regression.rows_of(outputs_of(own))

    def size_of(place: int) -> float:
        change = change_by(regression, fit, place)
        return float(np.linalg.norm(np.concatenate([change[one] for one in rows])))

    if size_of(index) > sum(map(size_of, frictions)):
        return None
    name = terms[frictions[0]].effect.id
    return f"{name} that differs between the directions by as much would make the same"
