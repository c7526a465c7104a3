"""Plausibility of fitted values: values at a bound of the fit, or beyond what a machine can have.

A value beyond its range means that the effect imitates another cause, mostly a wrong input: the
sign or unit of a channel, the torque constant, or gravity. Such an effect is no explanation.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import inf, isfinite
from operator import attrgetter

from winchkit.diagnosis.results import Estimate
from winchkit.effects.effect import Parameter, parameter_name, parameter_unit
from winchkit.effects.term import Term
from winchkit.quantity_text import plain, scale_for
from winchkit.schema.profiles.axis import AxisProfile
from winchkit.schema.profiles.winch import WinchProfile

_ROUNDING = 1e-6
"""Distance from a bound, in typical sizes, that counts as at the bound; numerical."""
_CHECK = "check the sign and unit of each channel, the torque constant, and gravity"
_OTHER_LAW = "the law is probably another one; look at the residual without it"


def implausible(
    term: Term, values: Mapping[str, Estimate], profile: WinchProfile | None
) -> str | None:
    """Reason why the values of an effect are implausible; None where they are plausible.

    A value is implausible at a bound of the fit other than the null, and where its whole 95 %
    interval is beyond its plausible range. A value that the data do not determine (NaN standard
    deviation) is judged only where a shape is held at an end of its range: there the law is that of
    another effect, such as a spring or an offset of Dahl's. The inertia of an axis has no range: it
    includes the arm or carriage that the axis moves.
    """
    advice = _OTHER_LAW if term.effect.reduces_to else _CHECK
    reasons = (
        implausible_value(term.effect.parameter(name), estimate, profile, advice)
        for name, estimate in values.items()
    )
    return next((reason for reason in reasons if reason is not None), None)


def implausible_value(
    parameter: Parameter,
    estimate: Estimate,
    profile: WinchProfile | None,
    what_to_do: str = _CHECK,
) -> str | None:
    """Reason why one value is implausible; None where it is plausible."""
    if parameter.whole or not isfinite(estimate.value):
        return None
    shown = f"{parameter_name(parameter.name)} = {_text(estimate.value, parameter)}"
    known = plausible_range(parameter, profile)
    judged = parameter.role == "shape" or isfinite(estimate.std)
    if known is not None and judged and _is_held(estimate.value, known[:2], parameter):
        advice = _OTHER_LAW if parameter.role == "shape" else what_to_do
        return f"{shown} is at the end of the plausible range ({known[2]}): {advice}"
    if not isfinite(estimate.std):
        return None
    if _is_held(estimate.value, (parameter.low, parameter.high), parameter):
        return f"{shown} is at a bound of the fit: {what_to_do}"
    low, high, reason = known or (-inf, inf, "")
    bottom, top = estimate.interval or (estimate.value, estimate.value)
    if max(top, estimate.value) < low or min(bottom, estimate.value) > high:
        span = f"{_text(low, parameter)} to {_text(high, parameter)}"
        return f"{shown} is beyond the plausible range ({span}; {reason}): {what_to_do}"
    return None


def _is_held(value: float, ends: tuple[float, float], parameter: Parameter) -> bool:
    """Whether a value is at one of two ends, other than the null."""
    bounds = [b for b in ends if b != parameter.null and isfinite(b)]
    size = abs(parameter.typical - parameter.null) if isfinite(parameter.null) else 1.0
    return any(abs(value - b) <= _ROUNDING * max(size, abs(b)) for b in bounds)


def plausible_range(
    parameter: Parameter, profile: WinchProfile | None
) -> tuple[float, float, str] | None:
    """Plausible range of a parameter in its unit, with its reason; None where none is known."""
    declared = parameter.plausible
    if declared is None or (declared.of_winch and isinstance(profile, AxisProfile)):
        return None
    size = 1.0
    if declared.of:
        number = None if profile is None else attrgetter(declared.of)(profile)
        if number is None:
            return None
        size = float(number)
    return declared.low * size, declared.high * size, declared.reason


def _text(value: float, parameter: Parameter) -> str:
    scale = scale_for(value, parameter_unit(parameter.name, parameter.unit))
    return scale.labelled(plain(value / scale.worth))
