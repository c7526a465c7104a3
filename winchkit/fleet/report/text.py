"""Maintenance report of a fleet: changes, their dates, their costs, and the actions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from math import isfinite

import numpy as np

from winchkit.fleet.diagnosis.changes import LEAST_SESSIONS
from winchkit.fleet.diagnosis.history import FleetHistory, FleetParameter, WinchHistory
from winchkit.fleet.diagnosis.partial_pooling import LEAST_WINCHES, partial_pooling
from winchkit.fleet.diagnosis.swapped_profiles import Swap
from winchkit.model.stages import RESULT_UNITS
from winchkit.quantity_text import quantity, scale_for, with_std
from winchkit.report.words.columns import paragraph
from winchkit.report.words.vocabulary import OUTPUT_NAMES, clause

_DO = {
    "cell": "calibrate the load cell with known weights, look for damage and moisture of its cable",
    "cable": "measure the cable with a known length and load, look for broken wires; shorten or "
    "replace it",
    "drum": "measure the drum, and look how the cable lies on it",
    "layer": "measure the drum, and look how the cable lies on it",
    "pulley": "turn the pulleys by hand, clean and lubricate or replace their bearings",
    "motor": "look at lubricant, temperature and brake of motor and gearbox",
    "gear": "measure the backlash at the drum, look at oil and teeth",
    "torque": "compare the drive's torque with a known load; check its settings",
    "length": "compare the length instrument with a known length",
    "payload": "weigh the load",
}
"""What to do, by the first word of an effect."""
_US = "%Y-%m-%d"


@dataclass(frozen=True)
class ChangeText:
    """Words of one change."""

    cause: str
    size: str
    since: str
    now: str
    cost: str
    """Empty where the change causes no error in the runs."""
    limit: str
    """Empty without a limit."""
    advice: str


def history_text(
    history: FleetHistory, swapped: Sequence[Swap] = (), left_out: Sequence[str] = ()
) -> str:
    """Report of a fleet's history for a terminal; ``left_out`` has a sentence for each session or
    run that is not in it, or was cut short."""
    lines = [line for pair in history.changed for line in _changed(*pair)]
    lines += [beyond_text(*pair) for pair in history.beyond_limit if not pair[1].changed]
    lines += [line for pair in history.odd for line in odd_texts(*pair)]
    lines += [swap_text(swap) for swap in swapped]
    if not lines:
        beside = " in the sessions that were fitted" if left_out else ""
        lines = paragraph(f"{nothing_text(history, beside)}.")
    tested = sum(len(parameter.winches) for parameter in history.parameters)
    lines += ["", f"{tested} series of estimates; false discovery rate 1 % ({history.procedure})."]
    if history.undetermined:
        lines.append(f"{history.undetermined} estimates left out: their runs leave the value open.")
    if left_out:
        lines += ["", "left out or cut short:", *(f"  {text}" for text in left_out)]
    return "\n".join(lines)


def nothing_text(history: FleetHistory, beside: str = "") -> str:
    """What was looked for and not found, and what too few sessions or winches leave open; without
    the last full stop."""
    winches = [winch for parameter in history.parameters for winch in parameter.winches]
    changes = any(winch.change is not None for winch in winches)
    odd = any(isfinite(winch.odd_q_value) for winch in winches)
    change_takes = f"a change over time takes {LEAST_SESSIONS} sessions of a winch"
    odd_takes = f"a winch that differs from the others takes {LEAST_WINCHES} winches"
    if changes and odd:
        return f"No change over time, and no winch that differs from the others{beside}"
    if changes:
        return f"No change over time{beside}. Not tested: {odd_takes}"
    if odd:
        return f"No winch differs from the others{beside}. Not tested: {change_takes}"
    return f"Nothing was tested: {change_takes}, {odd_takes}"


def change_text(parameter: FleetParameter, winch: WinchHistory) -> ChangeText:
    """Words of a change that was tested."""
    change = winch.change
    assert change is not None, "a change that was tested is there"
    since = "over the sessions"
    if change.date is not None and winch.kind != "trend":
        date = change.date
        ends = f"95 %: {day_text(date.earliest)} to {day_text(date.latest)}"
        since = f"since {day_text(date.date)} ({ends})"
    costs = [
        f"{quantity(size, RESULT_UNITS.get(output, ''))} in the {OUTPUT_NAMES.get(output, output)}"
        for output, size in winch.cost.items()
        if size > 0
    ]
    return ChangeText(
        clause(parameter.effect),
        _value(change.size, change.size_std, parameter),
        since,
        _value(winch.value, winch.std, parameter),
        ", ".join(costs),
        _limit(winch, parameter.unit),
        _do(parameter.effect),
    )


def _changed(parameter: FleetParameter, winch: WinchHistory) -> Iterator[str]:
    text = change_text(parameter, winch)
    name = f"{parameter.effect} {parameter.parameter}"
    yield f"winch {winch.winch}: {text.cause}: {name} changed by {text.size} {text.since}"
    yield (
        f"  {winch.kind}; q = {winch.change_q_value:.1g}; now {text.now}, all winches "
        f"{_value(parameter.common, parameter.common_std, parameter)}"
    )
    if text.cost:
        yield f"  costs {text.cost} (rms over the runs)"
    if text.limit:
        yield f"  {text.limit}"
    yield f"  do: {text.advice}"


def odd_texts(parameter: FleetParameter, winch: WinchHistory) -> Iterator[str]:
    """Two lines of a winch that differs from the others."""
    own = _value(winch.value, winch.std, parameter)
    rest = [(one.value, one.std) for one in parameter.winches if one is not winch]
    common = partial_pooling(*np.array(rest).T)
    others = _value(common.common, common.common_std, parameter)
    name = f"{parameter.effect} {parameter.parameter}"
    yield f"winch {winch.winch} differs from the others: {name} {own}, the others {others}"
    yield (
        f"  q = {winch.odd_q_value:.1g}; pooled "
        f"{_value(winch.pooled, winch.pooled_std, parameter)}; do: "
        f"{_do(parameter.effect)}; or is it another winch's profile?"
    )


def beyond_text(parameter: FleetParameter, winch: WinchHistory) -> str:
    """Sentence on a winch beyond a limit."""
    own = _value(winch.value, winch.std, parameter)
    name = f"{parameter.effect} {parameter.parameter}"
    return f"winch {winch.winch}: {name} {own}, {_limit(winch, parameter.unit)}"


def swap_text(swap: Swap) -> str:
    """Sentence on exchanged profiles."""
    names, p_value = swap.winches, f"p = {swap.p_value:.1g}"
    following = (*names[1:], names[0])
    pairs = [f"{own} fits that of {other}" for own, other in zip(names, following, strict=True)]
    return (
        f"winches {', '.join(names[:-1])} and {names[-1]} have exchanged profiles: "
        f"{', '.join(pairs)} ({p_value}); do: compare drums and files, and exchange the profiles"
    )


def _limit(winch: WinchHistory, unit: str) -> str:
    """Sentence on the limit of a winch; empty where there is nothing to say."""
    value, limit = winch.limit_value, winch.limit
    if value is None or (limit is None and not winch.is_beyond_limit):
        return ""
    known = f"limit of {_plain(value, unit)}"
    if limit is None:
        return f"beyond the {known}"
    verb = "passed" if limit.date <= winch.series.times[-1] else "reaches"
    ends = f"95 %: {day_text(limit.earliest)} to {day_text(limit.latest)}"
    return f"{verb} the {known} on {day_text(limit.date)} ({ends})"


def _plain(value: float, unit: str) -> str:
    return f"{100 * value:.4g} %" if unit == "1" else quantity(value, unit)


def _value(value: float, std: float, parameter: FleetParameter) -> str:
    """A value with its deviation; all of a parameter in the unit of their common value."""
    unit = "%" if parameter.unit == "1" else parameter.unit
    return with_std(value, std, unit, scale_for((parameter.common, parameter.common_std), unit))


def day_text(time: float) -> str:
    """Date of a time in s since 1970 (UTC), ``2026-03-01``; in words where there is none."""
    if not isfinite(time):
        return "no earlier bound" if time < 0 else "no later bound"
    try:
        return datetime.fromtimestamp(time, UTC).strftime(_US)
    except (OverflowError, ValueError, OSError):
        return "beyond the calendar"


def _do(effect: str) -> str:
    first = effect.partition("-")[0]
    return _DO.get(first, "measure it again on the winch")
