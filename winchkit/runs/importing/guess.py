"""Guess of channels, units and factors of a table, and the questions that remain.

Order: columns by name and dimension; units in the file; constants of the user or the file; the
ratio of angle and velocity; conventions. A unit that none of these gives is asked.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from winchkit.arrays import Array
from winchkit.runs.columns import column_dimension
from winchkit.runs.importing.answers import Answers, ColumnAnswer
from winchkit.runs.importing.assignment import Assignment, Confidence, Guess, Question
from winchkit.runs.importing.candidates import Candidate, Choice, choose
from winchkit.runs.importing.consistency import Ratio, likely_counts, ratio_of
from winchkit.runs.importing.formats.stamps import epoch_unit, read_stamps
from winchkit.runs.importing.long_table import axes_of, likely_axis
from winchkit.runs.importing.names import words_of
from winchkit.runs.importing.table import Column, Table
from winchkit.runs.importing.unit_spelling import (
    BRIDGE,
    COUNT_RATE,
    COUNTS,
    GRAVITY,
    SHARE,
    SpelledUnit,
    read_unit,
)
from winchkit.schema.mapping import DATE, EXCEL, MATRIX, STAMP
from winchkit.units import UNITS

__all__ = ["guess_columns"]

_TURN = 2 * math.pi
_ANGLES = {"rad": 1.0, "deg": math.pi / 180, "turn": _TURN}
_SPEEDS = {"rad/s": 1.0, "deg/s": math.pi / 180, "rpm": _TURN / 60, "turn/s": _TURN}
_CLOCKS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_SHOWN = 8
_TURNS = {"motor_angle": "turn", "motor_velocity": "turn/s"}
_SI_LAYOUTS = ("MAT", "HDF5", "NPZ", "NPY", "MCAP")
_SI_WORDS = {"q", "dq", "qd", "qdot", "qm", "tau", "theta", "omega", "effort", "thetadot", "dtheta"}
_GAINS = {"gtau", "ktau", "kt", "km", "torqueconstant", "torquegain", "gf", "forcegain"}


@dataclass(eq=False)
class _Column:
    """A chosen column while its unit is determined."""

    candidate: Candidate
    factor: float | None = None
    """None while unknown."""
    offset: float = 0.0
    unit: str = ""
    confidence: Confidence = "named"
    reason: str = ""

    @property
    def column(self) -> Column:
        return self.candidate.column

    @property
    def base(self) -> str:
        """Channel without a winch's name."""
        return self.candidate.channel.rpartition(".")[2]

    def settle(self, factor: float, unit: str, confidence: Confidence, reason: str) -> None:
        """Set the factor with its origin."""
        self.factor, self.unit, self.reason = factor, unit, reason
        self.confidence = confidence


@dataclass
class _Work:
    table: Table
    answers: Answers
    columns: list[_Column] = field(default_factory=list)
    questions: list[Question] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    measured: dict[str, float] = field(default_factory=dict)
    """SI value of 1 of a velocity without a unit, by its ratio to the angle; by column."""


def guess_columns(table: Table, answers: Answers | None = None) -> Guess:
    """Guess what the columns of a table are.

    Parameters
    ----------
    table : Table
        A file's columns.
    answers : Answers, optional
        What the user knows.

    Returns
    -------
    Guess
        An assignment for every column, and what cannot be known.
    """
    answers = answers or Answers()
    if answers.axis:
        return _of_axes(table, answers, answers.axis)
    if answers.axis is None and (axis := likely_axis(table)) is not None:
        open_yet = [Assignment(item.source, "", item.unit) for item in table.columns]
        return Guess(table, tuple(open_yet), (_axis_question(table, axis.source),))
    given, unknown = _given(table, answers)
    channels = {source: item.channel for source, item in given.items()}
    without = {item.channel for item in answers.columns if not item.source}
    choice = choose(table, channels, answers.body, without)
    work = _Work(table, answers, questions=[*unknown, *choice.questions], notes=[*choice.notes])
    for candidate in choice.chosen:
        work.columns.append(_started(work, candidate, given.get(candidate.column.source)))
    _from_velocity(work)
    _by_convention(work)
    _drop_clocks(work)
    _ask_units(work)
    rate = _rate(work)
    _ask_columns(work, choice)
    assigned = {item.column.source: _assignment(item) for item in work.columns}
    unused = {
        item.column.source: Assignment(item.column.source, "", item.column.unit, reason=item.reason)
        for item in (*choice.chosen, *choice.unused)
    }
    return Guess(
        table,
        tuple({**unused, **assigned}[column.source] for column in table.columns),
        tuple(dict.fromkeys(work.questions)),
        tuple(work.notes),
        rate,
    )


def _of_axes(table: Table, answers: Answers, by: str) -> Guess:
    """Assignments of a table in long form: those of its first axis, which hold for all."""
    axes = axes_of(table, by)
    guess = guess_columns(next(iter(axes.values())), replace(answers, axis=""))
    note = f"each row is of one axis, by column '{by}': {', '.join(axes)}"
    return replace(guess, axis=by, whole=table, notes=(note, *guess.notes))


def _axis_question(table: Table, by: str) -> Question:
    names = ", ".join(list(axes_of(table, by))[:_SHOWN])
    text = f"each row seems to be of one axis, which column '{by}' names ({names})"
    return Question(text, (f'--axis "{by}"', '--axis ""'), "axis")


def _given(table: Table, answers: Answers) -> tuple[dict[str, ColumnAnswer], list[Question]]:
    """Answers by the unique name of their column; a question for a column that is not there."""
    found: dict[str, ColumnAnswer] = {}
    missing = []
    for item in answers.columns:
        column = table.column(item.source) if item.source else None
        if column is not None and item.constant and item.constant not in table.constants:
            known = ", ".join(f"{k} = {v:g}" for k, v in table.constants.items()) or "none"
            text = f"there is no constant '{item.constant}'; the file has {known}"
            missing.append(Question(text, (f"--column {item.channel}={item.source}*FACTOR",)))
        elif column is not None:
            found[column.source] = item
        elif item.source:
            names = ", ".join(repr(c.source) for c in table.columns)
            text = f"there is no column '{item.source}'; the file has {names}"
            missing.append(Question(text, (f"--column {item.channel}=COLUMN",)))
    return found, missing


def _started(work: _Work, candidate: Candidate, answer: ColumnAnswer | None) -> _Column:
    """A column with the unit that the user or the file gives."""
    item = _Column(candidate, reason=candidate.reason)
    confidence: Confidence = "named" if candidate.rank <= 2 else "derived"
    unit, text = candidate.unit, candidate.column.unit
    scale = 1.0
    if answer is not None:
        confidence = "given"
        scale = answer.factor if answer.factor is not None else 1.0
        if answer.constant:
            scale = work.table.constants.get(answer.constant, math.nan)
        scale *= answer.sign
        if answer.unit:
            unit, text = read_unit(answer.unit), answer.unit
        elif answer.factor is not None or answer.constant:
            si = column_dimension(item.base) or "ratio"
            item.settle(scale, next(iter(UNITS[si])), "given", "--column")
            return item
    if candidate.channel in {"time", DATE}:
        _settle_clock(work, item, unit, scale, confidence)
    elif column_dimension(item.base) == "ratio" or item.base in MATRIX:
        item.settle(scale, "1", confidence, candidate.reason)
    elif unit is not None:
        _settle_unit(work, item, unit, scale, confidence)
        item.unit = item.unit or text
    elif item.base == "motor_angle" and work.answers.counts_per_turn and _is_counted(item):
        counts = work.answers.counts_per_turn or math.nan
        item.settle(_TURN / counts * scale, "counts", "given", f"{counts:g} counts per turn")
    return item


def _settle_clock(
    work: _Work, item: _Column, unit: SpelledUnit | None, scale: float, confidence: Confidence
) -> None:
    if item.column.texts is not None:
        item.settle(1.0, STAMP, confidence, "dates and times of day as text")
        if not read_stamps(item.column.texts).has_date and item.base == "time":
            item.reason = "times of day"
        return
    epoch = epoch_unit(item.column.values)
    if epoch == EXCEL and unit is None:
        item.settle(86_400.0, EXCEL, "derived", "days of a spreadsheet")
    elif unit is not None:
        item.settle(scale * unit.factor, unit.text, confidence, item.reason)
    elif epoch is not None:
        item.settle(_CLOCKS[epoch], epoch, "named", f"{epoch} since 1970")
    else:
        steps = np.diff(item.column.values[np.isfinite(item.column.values)])
        usual = float(np.median(steps)) if len(steps) else math.nan
        declared = work.table.interval
        matching = [
            name
            for name, value in _CLOCKS.items()
            if declared and abs(usual * value / declared - 1) < 0.2
        ]
        if len(matching) == 1:
            reason = f"steps of {usual:g}, declared interval {declared:g} s"
            item.settle(_CLOCKS[matching[0]], matching[0], "named", reason)


def _settle_unit(
    work: _Work, item: _Column, unit: SpelledUnit, scale: float, confidence: Confidence
) -> None:
    """Factor of a known unit; units without an SI value need a constant."""
    answers, dimension = work.answers, unit.dimension
    item.unit = unit.text
    if dimension == "voltage" or (dimension == COUNTS and item.base != "motor_angle"):
        if item.candidate.rank == 0 and scale != 1.0:
            item.settle(scale, unit.text, "given", "--column")
    elif dimension in {COUNTS, COUNT_RATE}:
        if answers.counts_per_turn:
            text = f"{answers.counts_per_turn:g} counts per turn"
            item.settle(_TURN / answers.counts_per_turn * scale, unit.text, "given", text)
    elif dimension == SHARE:
        if answers.rated_torque:
            factor = answers.rated_torque * unit.factor * scale
            item.settle(factor, unit.text, "given", f"of {answers.rated_torque:g} N m")
    elif dimension == "current" and item.base == "motor_torque":
        constant = answers.torque_constant or _gain(work.table)
        if constant:
            origin: Confidence = "given" if answers.torque_constant else "derived"
            item.settle(constant * unit.factor * scale, unit.text, origin, f"{constant:g} N m/A")
    elif dimension == BRIDGE:
        if answers.sensitivity and answers.capacity:
            factor = answers.capacity / answers.sensitivity * unit.factor * scale
            text = f"{answers.capacity:g} N at {answers.sensitivity:g} mV/V"
            item.settle(factor, unit.text, "given", text)
    elif dimension == "mass":
        item.settle(unit.factor * GRAVITY * scale, unit.text, confidence, "weight at 9.80665 m/s^2")
    else:
        item.settle(unit.factor * scale, unit.text, confidence, item.reason)
        item.offset = unit.offset


def _gain(table: Table) -> float | None:
    """Torque constant among the variables of the file."""
    found = {
        value
        for name, value in table.constants.items()
        if words_of(name.rpartition(".")[2]).replace(" ", "") in _GAINS and value > 0
    }
    return found.pop() if len(found) == 1 else None


def _from_velocity(work: _Work) -> None:
    """Units, counts and sense from the ratio of the angle to the integral of the velocity."""
    for velocity in [item for item in work.columns if item.base == "motor_velocity"]:
        winch = velocity.candidate.channel.rpartition(".")[0]
        wanted = f"{winch}.motor_angle" if winch else "motor_angle"
        angle = next((i for i in work.columns if i.candidate.channel == wanted), None)
        clock = _clock_of(work, velocity)
        if angle is None or clock is None or len(angle.column) != len(velocity.column):
            continue
        times = _clock_values(clock)
        if len(times) != len(angle.column):
            continue
        ratio = ratio_of(times, angle.column.values, velocity.column.values)
        if ratio is not None:
            _apply_ratio(work, ratio, angle, velocity, clock)


def _apply_ratio(
    work: _Work, ratio: Ratio, angle: _Column, velocity: _Column, clock: _Column
) -> None:
    if angle.factor is not None and velocity.factor is not None and clock.factor is not None:
        expected = velocity.factor * clock.factor / angle.factor
        if not ratio.agrees(abs(expected)):
            share = abs(ratio.value) / abs(expected)
            work.notes.append(
                f"'{angle.column.source}' changes {share:.4g} times as much as the integral of "
                f"'{velocity.column.source}': is a unit, a gear ratio or a resolution wrong?"
            )
            return
    else:
        matches = list(_matches(ratio, angle, velocity, clock))
        for item, index in ((angle, 0), (velocity, 1), (clock, 2)):
            options = {match[index] for match in matches}
            if item.factor is None and len(options) == 1:
                unit, factor = options.pop()
                text = f"ratio of angle and velocity (correlation {abs(ratio.correlation):.4f})"
                item.settle(factor, unit, "derived", text)
        if velocity.factor is None and angle.factor is not None and clock.factor is not None:
            measured = ratio.value * angle.factor / clock.factor
            work.measured[velocity.column.source] = measured
    if None not in (angle.factor, velocity.factor) and ratio.value * (velocity.factor or 1) < 0:
        velocity.factor = -(velocity.factor or 1)
        velocity.reason += "; sense reversed: it is opposite to the angle"
        work.notes.append(
            f"'{velocity.column.source}' has the opposite sense of '{angle.column.source}'; its "
            "sign is changed"
        )


def _matches(
    ratio: Ratio, angle: _Column, velocity: _Column, clock: _Column
) -> Iterator[tuple[tuple[str, float], tuple[str, float], tuple[str, float]]]:
    """Combinations of units that agree with the ratio."""
    speeds = _options(velocity, _SPEEDS)
    clocks = _options(clock, _CLOCKS)
    counted = _is_counted(angle)
    for speed in speeds:
        for stamp in clocks:
            if angle.factor is None and counted:
                counts = likely_counts(_TURN * abs(ratio.value) / (speed[1] * stamp[1]))
                if counts:
                    yield (f"1/{counts} turn", _TURN / counts), speed, stamp
                continue
            for turn in _options(angle, _ANGLES):
                if ratio.agrees(abs(speed[1] * stamp[1] / turn[1])):
                    yield turn, speed, stamp


def _options(item: _Column, units: dict[str, float]) -> list[tuple[str, float]]:
    return [(item.unit, item.factor)] if item.factor is not None else list(units.items())


def _is_counted(item: _Column) -> bool:
    """Whether an angle is in counts, by its unit or as whole numbers of more than a turn's."""
    unit = item.candidate.unit
    if unit is not None:
        return unit.dimension == COUNTS
    values = item.column.values[np.isfinite(item.column.values)]
    return bool(np.all(values == np.round(values))) and float(np.ptp(values)) > 300


def _by_convention(work: _Work) -> None:
    """Units by convention: SI in files of arrays and for names of robotics, °C, seconds."""
    for item in work.columns:
        if item.factor is not None or item.candidate.unit is not None or item.column.unit:
            continue
        words = words_of(item.column.name)
        declared = _declared(work.table, column_dimension(item.base))
        if declared is not None:
            item.settle(declared.factor, declared.text, "named", "unit of the whole file")
        elif item.base == "time":
            if _is_in_seconds(item.column.values):
                item.settle(1.0, "s", "assumed", "steps below 1, not whole numbers")
        elif item.base == "temperature":
            item.settle(1.0, "degC", "assumed", "temperatures are in degC")
        elif item.base in _TURNS and (
            words in {"pos estimate", "vel estimate"} or "odrive" in item.column.name.lower()
        ):
            item.settle(_TURN, _TURNS[item.base], "assumed", "ODrive counts in turns")
        elif _is_si(work.table, item.column.name) and not (
            item.base == "motor_angle" and _is_counted(item)
        ):
            dimension = column_dimension(item.base)
            if dimension is not None:
                unit = next(iter(UNITS[dimension]))
                item.settle(1.0, unit, "assumed", "no unit in the file: SI by convention")


def _declared(table: Table, dimension: str | None) -> SpelledUnit | None:
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


def _is_si(table: Table, name: str) -> bool:
    """Whether a name or a format has SI units by convention; names with slashes are of ROS."""
    words = words_of(name).split()
    return table.layout in _SI_LAYOUTS or name.startswith("/") or bool(set(words) & _SI_WORDS)


def _is_in_seconds(values: Array) -> bool:
    finite = values[np.isfinite(values)]
    steps = np.diff(finite)
    is_whole = bool(np.all(finite == np.round(finite)))
    return len(steps) > 0 and not is_whole and float(np.median(steps)) < 1.0


def _ask_units(work: _Work) -> None:
    for item in work.columns:
        if item.factor is not None:
            continue
        name, channel, unit = item.column.source, item.candidate.channel, item.candidate.unit
        dimension = unit.dimension if unit is not None else ""
        own = f'--column "{channel}={name} [UNIT]"'
        if dimension == "voltage" or (dimension == COUNTS and item.base != "motor_angle"):
            one = next(iter(UNITS[column_dimension(item.base) or "ratio"]))
            text = f"'{name}' ({channel}) is in {item.column.unit}: how many {one} is 1?"
            work.questions.append(Question(text, (f'--column "{channel}={name}*FACTOR [{one}]"',)))
        elif dimension in {COUNTS, COUNT_RATE} or (
            item.base == "motor_angle" and _is_counted(item)
        ):
            _ask(work, f"'{name}' is in counts: how many in a motor turn?", "counts_per_turn", own)
        elif dimension == SHARE:
            _ask(
                work,
                f"'{name}' is in {unit.text if unit else '%'}: of which torque?",
                "rated_torque",
                own,
            )
        elif dimension == "current":
            kept = f'--column "motor_current={name} [{unit.text if unit else "A"}]"'
            _ask(work, f"'{name}' is a current: which torque constant?", "torque_constant", kept)
        elif dimension == BRIDGE:
            for key in ("sensitivity", "capacity"):
                if getattr(work.answers, key) is None:
                    _ask(work, f"'{name}' is in mV/V: which {key} of the load cell?", key, own)
        else:
            si = column_dimension(item.base)
            units = ", ".join(UNITS[si]) if si else "1"
            spelled = item.column.unit
            had = f"has the unknown unit '{spelled}'" if spelled else "has no unit"
            text = f"'{name}' ({channel}) {had}; one of {units}"
            if name in work.measured:
                measured = f"{work.measured[name]:.4g}"
                text += f"; by its ratio to the angle 1 is {measured} rad/s"
                own = f'--column "{channel}={name}*{measured} [rad/s]"'
                work.questions.append(Question(text, (own, f'--column "{channel}="')))
                continue
            if item.base != "time":
                text += f'; --column "{channel}=" where it is none of them'
            work.questions.append(Question(text, (own,), "", si or ""))


_OPTIONS = {
    "counts_per_turn": ("--counts-per-turn 4096", "counts"),
    "rated_torque": ('--rated-torque "2.4 N m"', "torque"),
    "torque_constant": ('--torque-constant "0.12 N m/A"', "torque constant"),
    "sensitivity": ('--sensitivity "2 mV/V"', "bridge"),
    "capacity": ('--capacity "500 N"', "force"),
}


def _ask(work: _Work, text: str, key: str, own: str) -> None:
    option, dimension = _OPTIONS[key]
    work.questions.append(Question(text, (option, own), key, dimension))


def _rate(work: _Work) -> float | None:
    """Rate of equal steps: given, or declared by a file without times; else None."""
    clocks = [item for item in work.columns if item.base == "time"]
    if work.answers.sample_rate:
        for item in clocks:
            work.columns.remove(item)
        return work.answers.sample_rate
    if not clocks and work.table.interval:
        work.notes.append(
            f"no time column; the declared interval of {work.table.interval:g} s is used"
        )
        return 1 / work.table.interval
    return None


def _drop_clocks(work: _Work) -> None:
    """Leave out time columns of which no channel is used, where there are others."""
    clocks = [item for item in work.columns if item.base == "time"]
    channels = [item for item in work.columns if item.base not in {"time", DATE}]
    needed = [clock for item in channels if (clock := _clock_of(work, item)) is not None]
    for clock in clocks:
        if needed and not any(clock is item for item in needed):
            clock.candidate = replace(clock.candidate, reason="no channel of this clock is used")
            work.columns.remove(clock)


def _ask_columns(work: _Work, choice: Choice) -> None:
    """Questions for a time or a motor angle that no column has."""
    channels = {item.candidate.channel for item in work.columns}
    bases = {item.base for item in work.columns}
    asked = " ".join(option for q in work.questions for option in q.options)
    has_rate = work.answers.sample_rate or work.table.interval
    is_pose = any(
        name.startswith("platform_") or name.endswith(".motor_angle") for name in channels
    )
    if not channels & {"time"} and not has_rate and not is_pose and "time=" not in asked:
        work.questions.append(
            Question(
                "no column is time",
                ('--sample-rate "1 kHz"', '--column "time=COLUMN [ms]"'),
                "sample_rate",
                "frequency",
            )
        )
    if not bases - {"time", DATE} and not choice.questions:
        names = ", ".join(repr(c.column.source) for c in choice.unused)
        work.questions.append(
            Question(
                f"no column is a channel of a run by its name; there are {names}",
                (
                    '--column "motor_angle=COLUMN [deg]"',
                    '--column "motor_torque=COLUMN [N m]"',
                    '--column "tension=COLUMN [N]"',
                ),
            )
        )


def _clock_of(work: _Work, item: _Column) -> _Column | None:
    """The time column of a column: the last one before it in its group, else the first."""
    clocks = [c for c in work.columns if c.base == "time" and c.column.group == item.column.group]
    before = [c for c in clocks if c.column.number < item.column.number]
    return before[-1] if before else clocks[0] if clocks else None


def _clock_values(clock: _Column) -> Array:
    if clock.column.texts is not None:
        return read_stamps(clock.column.texts).values
    return clock.column.values


def _assignment(item: _Column) -> Assignment:
    factor = item.factor if item.factor is not None else math.nan
    confidence = item.confidence if item.factor is not None else "unused"
    reason = item.reason if item.factor is not None else "its unit is not known"
    return Assignment(
        item.column.source,
        item.candidate.channel,
        item.unit or item.column.unit,
        factor,
        item.offset,
        confidence,
        reason,
    )
