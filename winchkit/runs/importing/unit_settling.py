"""Units of chosen columns: of the user, of the file, and by convention."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from winchkit.arrays import Array
from winchkit.runs.columns import column_dimension
from winchkit.runs.importing.answers import ColumnAnswer
from winchkit.runs.importing.assignment import (
    ChannelCandidate,
    ChosenColumn,
    Confidence,
    Work,
    is_counted,
    is_whole,
)
from winchkit.runs.importing.consistency import CLOCKS
from winchkit.runs.importing.formats.stamps import epoch_of, epoch_unit, read_stamps
from winchkit.runs.importing.names import words_of
from winchkit.runs.importing.table import ColumnTable, are_whole
from winchkit.runs.importing.units.known import BRIDGE, COUNT_RATE, COUNTS, SHARE, SpelledUnit
from winchkit.runs.importing.units.spelling import read_unit
from winchkit.runs.importing.winches import stem_of
from winchkit.schema.mapping import ANGLES, DATE, EXCEL, MATRIX, POSITION, STAMP
from winchkit.units import GRAVITY, UNITS

_TURN = 2 * math.pi
_AXES = (set(POSITION), set(ANGLES))
_TURNS = {"motor_angle": "turn", "motor_velocity": "turn/s"}
_SI_LAYOUTS = ("MAT", "HDF5", "NPZ", "NPY", "MCAP", "MCAP, JSON")
_SI_WORDS = {"q", "dq", "qd", "qdot", "qm", "tau", "theta", "omega", "thetadot", "dtheta", "rvec"}
_GAINS = {"gtau", "ktau", "kt", "km", "torqueconstant", "torquegain", "gf", "forcegain"}

_LARGEST_OF_JOINT = 1.02 * 2 * math.pi
"""Joints of arms are limited to one turn to either side at most; 2 % for the overrun."""
_LARGEST_IN_DEGREES = 720.0
"""A joint's degrees are within two turns; a larger range is that of a motor."""
_COARSE = 0.01
"""0.01 rad is 0.6 deg: too coarse for a resolver or encoder, and usual for degrees."""


def started(work: Work, candidate: ChannelCandidate, answer: ColumnAnswer | None) -> ChosenColumn:
    """A column with the unit that the user or the file gives."""
    if answer is not None and answer.unit:
        candidate = replace(candidate, unit=read_unit(answer.unit))
    item = ChosenColumn(candidate, reason=candidate.reason)
    confidence: Confidence = "named" if candidate.rank <= 2 else "derived"
    unit, text = candidate.unit, candidate.column.unit
    is_scaled = answer is not None and (answer.factor is not None or bool(answer.constant))
    if answer is not None:
        confidence = "given"
        factor = answer.factor if answer.factor is not None else 1.0
        if answer.constant:
            factor = work.table.constants.get(answer.constant, math.nan)
        if is_scaled or answer.sign != 1.0:
            item.scale = factor * answer.sign
        if answer.unit:
            text = answer.unit
        elif is_scaled:
            si = column_dimension(item.base) or "ratio"
            item.settle(1.0, next(iter(UNITS[si])), "given", "--column")
            return item
    if candidate.channel in {"time", DATE}:
        _settle_clock(work, item, unit, confidence)
    elif column_dimension(item.base) == "ratio" or item.base in MATRIX:
        item.settle(1.0, "1", confidence, candidate.reason)
    elif unit is not None and _is_raw(item, unit):
        item.unit = unit.text
        if is_scaled:
            item.settle(1.0, unit.text, "given", "--column")
    elif unit is not None:
        _settle_unit(work, item, unit, confidence)
        item.unit = item.unit or text
    elif item.base == "motor_angle" and work.answers.counts_per_turn and is_whole(item):
        counts = work.answers.counts_per_turn or math.nan
        item.settle(_TURN / counts, "counts", "given", f"{counts:g} counts per turn")
    return item


def _is_raw(item: ChosenColumn, unit: SpelledUnit) -> bool:
    """Whether a unit is that of an amplifier or converter, of which only a user knows the scale."""
    is_counted = unit.dimension == COUNTS and item.base != "motor_angle"
    return unit.dimension == "voltage" or is_counted


def _settle_clock(
    work: Work, item: ChosenColumn, unit: SpelledUnit | None, confidence: Confidence
) -> None:
    if item.column.texts is not None:
        item.settle(1.0, STAMP, confidence, "dates and times of day as text")
        if not read_stamps(item.column.texts).has_date and item.base == "time":
            item.reason = "times of day"
        return
    epoch = epoch_of(item.column.values)
    if epoch is not None and unit is None:
        unit, is_assumed = read_unit(epoch.unit), epoch.is_assumed
        confidence = "assumed" if is_assumed else "named"
        item.reason = f"{epoch.unit} since {epoch.name}{' by its numbers' * is_assumed}"
    if unit is not None:
        item.settle(unit.factor, unit.text, confidence, item.reason)
        if epoch is not None and unit.text == epoch.unit:
            item.offset = epoch.offset
    elif epoch_unit(item.column.values) == EXCEL:
        item.settle(86_400.0, EXCEL, "derived", "days of a spreadsheet")
    else:
        steps = np.diff(item.column.known)
        usual = float(np.median(steps)) if len(steps) else math.nan
        declared = work.table.interval
        matching = [
            name
            for name, value in CLOCKS.items()
            if declared and abs(usual * value / declared - 1) < 0.2
        ]
        if len(matching) == 1:
            reason = f"steps of {usual:g}, declared interval {declared:g} s"
            item.settle(CLOCKS[matching[0]], matching[0], "named", reason)


def _settle_unit(work: Work, item: ChosenColumn, unit: SpelledUnit, confidence: Confidence) -> None:
    """Factor of a known unit; units without an SI value need a constant."""
    answers, dimension = work.answers, unit.dimension
    item.unit = unit.text
    if dimension in {COUNTS, COUNT_RATE}:
        if answers.counts_per_turn:
            text = f"{answers.counts_per_turn:g} counts per turn"
            item.settle(_TURN / answers.counts_per_turn, unit.text, "given", text)
    elif dimension == SHARE:
        if answers.rated_torque:
            factor = answers.rated_torque * unit.factor
            item.settle(factor, unit.text, "given", f"of {answers.rated_torque:g} N m")
    elif dimension == "current":
        _settle_current(work, item, unit, confidence)
    elif dimension == BRIDGE:
        if answers.sensitivity and answers.capacity:
            factor = answers.capacity / answers.sensitivity * unit.factor
            text = f"{answers.capacity:g} N at {answers.sensitivity:g} mV/V"
            item.settle(factor, unit.text, "given", text)
    elif dimension == "mass":
        item.settle(unit.factor * GRAVITY, unit.text, confidence, f"weight at {GRAVITY} m/s^2")
    else:
        item.settle(unit.factor, unit.text, confidence, item.reason)
        item.offset = unit.offset


def _settle_current(
    work: Work, item: ChosenColumn, unit: SpelledUnit, confidence: Confidence
) -> None:
    """Factor of a current, or of the torque that it gives."""
    if math.isnan(unit.factor):
        return
    if item.base != "motor_torque":
        item.settle(unit.factor, unit.text, confidence, item.reason)
        return
    constant = work.answers.torque_constant or _gain(work.table)
    if constant:
        origin: Confidence = "given" if work.answers.torque_constant else "derived"
        text = f"{constant:g} N m/A"
        if not item.column.unit and item.candidate.rank:
            origin, text = "assumed", f"{text}; a current without a unit: A"
        item.settle(constant * unit.factor, unit.text, origin, text)


def _gain(table: ColumnTable) -> float | None:
    """Torque constant among the variables of the file."""
    found = {
        value
        for name, value in table.constants.items()
        if words_of(name.rpartition(".")[2]).replace(" ", "") in _GAINS and value > 0
    }
    return found.pop() if len(found) == 1 else None


def as_others(work: Work) -> None:
    """Units of columns that are named like one of another winch, and of the axes of a pose."""
    for item in work.columns:
        winch = item.candidate.channel.rpartition(".")[0]
        is_one_of_several = winch or any(item.base in axes for axes in _AXES)
        if item.factor is not None or not is_one_of_several or item.column.unit:
            continue
        for other in work.columns:
            is_known = other.factor is not None and not other.column.unit
            if is_known and is_alike(item, other):
                text = f"as '{other.column.source}'"
                known = abs(other.factor or math.nan)
                si = known if item.scale is None else known / other.size
                item.settle(si, other.unit, "derived", text)
                break


def is_alike(one: ChosenColumn, other: ChosenColumn) -> bool:
    """Whether two columns have one unit: names that differ in the winch only, axes of a pose."""
    if any({one.base, other.base} <= axes for axes in _AXES):
        return True
    if one.base != other.base:
        return False
    pairs = [(item.column, item.candidate.channel) for item in (one, other)]
    return stem_of(*pairs[0]) == stem_of(*pairs[1])


def by_convention(work: Work) -> None:
    """Units by convention: SI in files of arrays and for names of robotics, °C, seconds."""
    for item in work.columns:
        if item.factor is not None or item.candidate.unit is not None or item.column.unit:
            continue
        if item.column.is_derived:
            continue
        words = words_of(item.column.name)
        declared = _declared(work.table, column_dimension(item.base))
        if declared is not None:
            item.settle(declared.factor, declared.text, "named", "unit of the whole file")
        elif item.base == "time":
            if _is_in_seconds(item.column.known):
                item.settle(1.0, "s", "assumed", "steps below 1, not whole numbers")
        elif item.base == "temperature":
            item.settle(1.0, "degC", "assumed", "temperatures are in degC")
        elif item.base in _TURNS and (
            words in {"pos estimate", "vel estimate"} or "odrive" in item.column.name.lower()
        ):
            item.settle(_TURN, _TURNS[item.base], "assumed", "ODrive counts in turns")
        elif _is_si(work.table, item.column.name) and not (
            item.base == "motor_angle" and is_counted(item)
        ):
            dimension = column_dimension(item.base)
            if doubt := _doubt(work, item):
                work.doubts[item.column.source] = doubt
            elif dimension is not None:
                unit = next(iter(UNITS[dimension]))
                item.settle(1.0, unit, "assumed", "no unit in the file: SI by convention")


def _doubt(work: Work, item: ChosenColumn) -> str:
    """Why an angle may not be in rad; messages of ROS are in rad."""
    if item.base != "motor_angle" or _is_of_ros(work.table):
        return ""
    return _doubt_of_radians(item.column.known)


def _doubt_of_radians(known: Array) -> str:
    """Why values that are rad by convention may be degrees; empty where they are rad.

    The names of robotics (``q1``, ``theta``) and the formats of arrays stand for rad. Degrees of a
    joint and radians of a motor that turns have the same range, beyond 2π and within 720; no
    column but a velocity with a unit distinguishes them.
    """
    largest = float(np.max(np.abs(known), initial=0.0))
    if not _LARGEST_OF_JOINT < largest <= _LARGEST_IN_DEGREES:
        return ""
    if _is_in_steps(known):
        return (
            f"; its values of {known.min():g} to {known.max():g} have steps of {_COARSE:g} or more"
        )
    return f"; its values of {known.min():.4g} to {known.max():.4g} may be deg or rad"


def _is_in_steps(values: Array) -> bool:
    steps = values / _COARSE
    return bool(np.all(np.abs(steps - np.round(steps)) < 1e-6 * np.maximum(1.0, np.abs(steps))))


def _declared(table: ColumnTable, dimension: str | None) -> SpelledUnit | None:
    """Unit of a dimension that is declared above the header: ``Length Units, Millimeters``."""
    if dimension not in {"length", "angle", "force", "torque"}:
        return None
    for key, value in table.metadata.items():
        if not {"unit", "units", "einheit", "einheiten"} & set(words_of(key).split()):
            continue
        for word in value.replace(",", " ").replace(";", " ").split():
            unit = read_unit(word)
            if unit is not None and unit.dimension == dimension:
                return unit
    return None


def _is_si(table: ColumnTable, name: str) -> bool:
    """Whether a name or a format has SI units by convention."""
    words = words_of(name).split()
    return table.layout in _SI_LAYOUTS or bool(set(words) & _SI_WORDS) or _is_of_ros(table)


def _is_of_ros(table: ColumnTable) -> bool:
    """Whether a table has ROS topics, with slashes; its messages are in SI units (REP 103)."""
    names = [item.name for item in table.columns]
    is_named = any(name.startswith("/") or "effort" in words_of(name).split() for name in names)
    return table.layout == "MCAP" or is_named


def _is_in_seconds(values: Array) -> bool:
    steps = np.diff(values)
    return len(steps) > 0 and not are_whole(values) and float(np.median(steps)) < 1.0
