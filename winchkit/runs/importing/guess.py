"""Guess of channels, units and factors of a table, and the questions that remain.

Order: columns by name and dimension; units in the file; constants of the user or the file; the
ratio of angle and velocity; conventions. A unit that none of these gives is asked.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

from winchkit.errors import some_of
from winchkit.runs.columns import column_dimension
from winchkit.runs.importing.answers import Answers, ColumnAnswer, fits
from winchkit.runs.importing.assignment import (
    Assignment,
    Choice,
    ChosenColumn,
    Guess,
    Question,
    Work,
    clock_of,
    is_counted,
    is_whole,
)
from winchkit.runs.importing.candidates import choose
from winchkit.runs.importing.consistency import beyond_rating, from_velocity
from winchkit.runs.importing.formats.arithmetic import (
    fault_of,
    is_expression,
    scaled_column,
    with_derived,
)
from winchkit.runs.importing.long_table import (
    axes_of,
    by_kind,
    has_kinds,
    likely_axis,
    marker_column,
)
from winchkit.runs.importing.orientation import settle_orientation
from winchkit.runs.importing.source_stamps import delays, has_two_clocks, without_stamps
from winchkit.runs.importing.stored.settling import settle_stored
from winchkit.runs.importing.table import ColumnTable, FileColumn
from winchkit.runs.importing.unit_settling import as_others, by_convention, is_alike, started
from winchkit.runs.importing.units.known import BRIDGE, COUNT_RATE, COUNTS, SHARE
from winchkit.runs.importing.units.spelling import read_unit
from winchkit.schema.mapping import CHANNELS, DATE
from winchkit.units import UNITS

_SHOWN = 8
"""Names listed in a question; about one line."""


def _ask_current(work: Work, item: ChosenColumn) -> None:
    name, channel, unit = item.column.source, item.candidate.channel, item.candidate.unit
    current = channel.replace("motor_torque", "motor_current")
    if unit is not None and not math.isnan(unit.factor):
        kept = f'--column "{current}={name} [{unit.text}]"'
        _ask(work, f"'{name}' is a current: which torque constant?", "torque_constant", kept)
        return
    text = f"'{name}' ({channel}) is a current in whole numbers without a unit"
    options = (f"{channel}={name}*FACTOR [N m]", f"{current}={name} [mA]")
    work.questions.append(Question(text, tuple(f'--column "{option}"' for option in options)))


_OPTIONS = {
    "counts_per_turn": ("--counts-per-turn 4096", "counts"),
    "rated_torque": ('--rated-torque "2.4 N m"', "torque"),
    "torque_constant": ('--torque-constant "0.12 N m/A"', "torque constant"),
    "sensitivity": ('--sensitivity "2 mV/V"', "bridge"),
    "capacity": ('--capacity "500 N"', "force"),
}


_OTHER_UNITS = {
    "motor_torque": ("% (of a rated torque)", "A (a current)"),
    "tension": ("kg", "mV/V", "V"),
}
"""Units of a drive and of an amplifier, for which a constant is asked then."""


def axis_question(table: ColumnTable, key: FileColumn) -> Question:
    """Question whether a column names the axis or the kind of each row."""
    by = key.source
    names = ", ".join(list(axes_of(table, by))[:_SHOWN])
    words, options = ("axis", "kind"), (f'--axis "{by}"', f'--kind "{by}"')
    if has_kinds(table, key):
        words, options = words[::-1], options[::-1]
    what = f"one {words[0]} or {words[1]}"
    text = f"each row seems to be of {what}, which column '{by}' names ({names})"
    return Question(text, (*options, '--axis ""'), "axis")


def ask_units(work: Work) -> None:
    """Ask the unit or constant of each column without one; of columns named alike, of the first."""
    unknown = [item for item in work.columns if item.factor is None]
    for number, item in enumerate(unknown):
        if any(is_alike(o, item) for o in unknown[:number]):
            continue
        _ask_unit(work, item)


def _ask_unit(work: Work, item: ChosenColumn) -> None:
    name, channel, unit = item.column.source, item.candidate.channel, item.candidate.unit
    dimension = unit.dimension if unit is not None else ""
    own = f'--column "{channel}={name} [UNIT]"'
    if dimension == "voltage" or (dimension == COUNTS and item.base != "motor_angle"):
        one = next(iter(UNITS[column_dimension(item.base) or "ratio"]))
        text = f"'{name}' ({channel}) is in {item.unit or item.column.unit}: how many {one} is 1?"
        work.questions.append(Question(text, (f'--column "{channel}={name}*FACTOR [{one}]"',)))
    elif dimension in {COUNTS, COUNT_RATE} or (item.base == "motor_angle" and is_whole(item)):
        is_known = dimension in {COUNTS, COUNT_RATE} or is_counted(item)
        what = "is in counts" if is_known else f"({channel}) has no unit and whole numbers"
        _ask(work, f"'{name}' {what}: how many in a motor turn?", "counts_per_turn", own)
    elif dimension == SHARE:
        _ask(
            work,
            f"'{name}' is in {unit.text if unit else '%'}: of which torque?",
            "rated_torque",
            own,
        )
    elif dimension == "current":
        _ask_current(work, item)
    elif dimension == BRIDGE:
        for key in ("sensitivity", "capacity"):
            if getattr(work.answers, key) is None:
                _ask(work, f"'{name}' is in mV/V: which {key} of the load cell?", key, own)
    else:
        si = column_dimension(item.base)
        units = ", ".join((*UNITS[si], *_OTHER_UNITS.get(item.base, ()))) if si else "1"
        spelled = item.column.unit
        had = f"has the unknown unit '{spelled}'" if spelled else "has no unit"
        text = f"'{name}' ({channel}) {had}; one of {units}{work.doubts.get(name, '')}"
        if name in work.measured:
            measured = f"{work.measured[name]:.4g}"
            text += f"; by its ratio to the angle 1 is {measured} rad/s"
            own = f'--column "{channel}={name}*{measured} [rad/s]"'
            work.questions.append(Question(text, (own, f'--column "{channel}="')))
            return
        if item.base != "time":
            text += f'; --column "{channel}=" where it is none of them'
        work.questions.append(Question(text, (own,), "", si or ""))


def _ask(work: Work, text: str, key: str, own: str) -> None:
    option, dimension = _OPTIONS[key]
    work.questions.append(Question(text, (option, own), key, dimension))


def ask_columns(work: Work, choice: Choice) -> None:
    """Questions for a time or a motor angle that no column has."""
    channels = {item.candidate.channel for item in work.columns}
    bases = {item.base for item in work.columns}
    asked = " ".join(option for q in work.questions for option in q.options)
    has_rate = work.answers.sample_rate or work.table.interval
    is_pose = "--body" in asked or any(
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
        names = some_of([repr(c.column.source) for c in choice.unused])
        there = f"; there are {names}" if names else ": the file has times only"
        work.questions.append(
            Question(
                f"no column is a channel of a run by its name{there}",
                (
                    '--column "motor_angle=COLUMN [deg]"',
                    '--column "motor_torque=COLUMN [N m]"',
                    '--column "tension=COLUMN [N]"',
                ),
            )
        )


def guess_columns(table: ColumnTable, answers: Answers | None = None) -> Guess:
    """Guess what the columns of a table are."""
    answers = answers or Answers()
    if answers.axis is None and not answers.kind and (marker := marker_column(table)) is not None:
        answers = replace(answers, kind=marker.source)
    if answers.kind:
        kinds = by_kind(table, answers.kind)
        found = guess_columns(kinds, replace(answers, kind="", axis=answers.axis or ""))
        return replace(found, kind=answers.kind, whole=table)
    if answers.axis:
        return _of_axes(table, answers, answers.axis)
    if answers.axis is None and (axis := likely_axis(table)) is not None:
        open_yet = [Assignment(item.source, "", item.unit) for item in table.columns]
        return Guess(table, tuple(open_yet), (axis_question(table, axis),))
    answers = replace(answers, columns=tuple(_whole(item, table) for item in answers.columns))
    table = with_derived(table, [item.source for item in answers.columns])
    given, unknown = _given(table, answers)
    channels = {source: item.channel for source, item in given.items()}
    without = {item.channel for item in answers.columns if not item.source}
    choice = choose(
        table,
        channels,
        answers.body,
        without,
        orientation=answers.orientation,
        motion=answers.motion,
    )
    work = Work(table, answers, questions=[*unknown, *choice.questions], notes=[*choice.notes])
    for candidate in choice.chosen:
        work.columns.append(started(work, candidate, given.get(candidate.column.source)))
    settle_stored(work)
    as_others(work)
    from_velocity(work)
    by_convention(work)
    # A unit by convention gives others by the ratio, or the ratio contradicts it.
    from_velocity(work)
    as_others(work)
    _drop_clocks(work)
    if has_two_clocks(work):
        logged, note = without_stamps(table)
        again = guess_columns(logged, answers)
        return replace(again, notes=(note, *again.notes))
    work.notes += delays(work)
    beyond_rating(work)
    settle_orientation(work)
    ask_units(work)
    rate = _rate(work)
    ask_columns(work, choice)
    assigned = {item.column.source: _assignment(item) for item in work.columns}
    unused = {
        item.column.source: Assignment(item.column.source, "", item.column.unit, reason=item.reason)
        for item in (*choice.chosen, *choice.unused)
    }
    return Guess(
        table,
        tuple({**unused, **assigned}[column.source] for column in table.columns),
        # The time first: of a file without it nothing else can be judged.
        tuple(sorted(dict.fromkeys(work.questions), key=lambda item: item.key != "sample_rate")),
        tuple(dict.fromkeys(work.notes)),
        rate,
    )


def _of_axes(table: ColumnTable, answers: Answers, by: str) -> Guess:
    """Assignments of a table in long form: those of its first axis, which hold for all."""
    axes = axes_of(table, by)
    guess = guess_columns(next(iter(axes.values())), replace(answers, axis=""))
    note = f"each row is of one axis, by column '{by}': {', '.join(axes)}"
    return replace(guess, axis=by, whole=table, notes=(note, *guess.notes))


def _given(table: ColumnTable, answers: Answers) -> tuple[dict[str, ColumnAnswer], list[Question]]:
    """Answers by the unique name of their column; a question for a column that is not there."""
    found: dict[str, ColumnAnswer] = {}
    missing: list[Question] = []
    for item in answers.columns:
        column = table.column(item.source) if item.source else None
        missing += [*_contradictions(found, column, item), *_wrong_unit(column, item)]
        if column is not None and item.constant and item.constant not in table.constants:
            known = ", ".join(f"{k} = {v:g}" for k, v in table.constants.items()) or "none"
            text = f"there is no constant '{item.constant}'; the file has {known}"
            missing.append(Question(text, (f"--column {item.channel}={item.source}*FACTOR",)))
        elif column is not None:
            found[column.source] = item
        elif is_expression(item.source):
            text = fault_of(table, item.source)
            missing.append(Question(text, (f'--column "{item.channel}=COLUMN"',)))
        elif item.source:
            names = ", ".join(repr(c.source) for c in table.columns)
            text = f"there is no column '{item.source}'; the file has {names}"
            missing.append(Question(text, (f"--column {item.channel}=COLUMN",)))
    return found, missing


def _whole(item: ColumnAnswer, table: ColumnTable) -> ColumnAnswer:
    """An answer with its sign and factor as parts of its expression, which they are of a sum."""
    is_column = item.constant and item.constant not in table.constants
    if not (is_column and table.column(item.constant) is not None) and (
        table.column(item.source) is not None or not is_expression(item.source)
    ):
        return item
    times = item.constant or ("" if item.factor is None else f"{item.factor!r}")
    source = "-" * (item.sign < 0) + item.source + (f"*{times}" if times else "")
    scaled = scaled_column(table, source)
    if scaled is not None:
        name, size = scaled
        factor = None if abs(size) == 1 else abs(size)
        return replace(item, source=name, factor=factor, constant="", sign=math.copysign(1, size))
    return replace(item, source=source, factor=None, constant="", sign=1.0)


def _wrong_unit(column: FileColumn | None, item: ColumnAnswer) -> Iterator[Question]:
    """Question for a column whose unit is none of the channel: it, or that of its factor."""
    spelled = None if column is None or item.unit else read_unit(column.unit)
    if column is None or spelled is None:
        return
    dimension = CHANNELS.get(item.channel) or "number"
    if item.factor is not None or item.constant:
        if spelled.dimension != dimension or (spelled.factor == 1 and not spelled.offset):
            return
        size = item.constant or f"{item.factor:.12g}"
        si = next(iter(UNITS[dimension]))
        text = f"column '{column.source}' is in {column.unit}: in which unit is it times {size}?"
        sign = "-" * (item.sign < 0)
        yield Question(
            text,
            tuple(
                f'--column "{item.channel}={sign}{item.source}*{size} [{unit}]"'
                for unit in (column.unit, si)
            ),
        )
        return
    if fits(item.channel, spelled.dimension):
        return
    text = (
        f"column '{column.source}' is in {column.unit}, a unit of {spelled.dimension}, and "
        f"{item.channel} is a {dimension}"
    )
    unit = next(iter(UNITS[dimension])) if dimension in UNITS else "UNIT"
    option = f'--column "{item.channel}=ANOTHER COLUMN"'
    yield Question(text, (option, f'--column "{item.channel}={item.source} [{unit}]"'))


def _contradictions(
    found: Mapping[str, ColumnAnswer], column: FileColumn | None, item: ColumnAnswer
) -> Iterator[Question]:
    """Questions for a column that is given twice, and for a channel of two columns."""
    if column is None:
        return
    before = found.get(column.source)
    own = f'--column "{item.channel}={item.source}"'
    if before is not None and before.channel != item.channel:
        text = f"column '{column.source}' is given as {before.channel} and as {item.channel}"
        yield Question(text, (f'--column "{before.channel}={before.source}"', own))
    others = [s for s, o in found.items() if o.channel == item.channel and s != column.source]
    if others and item.channel not in {"time", DATE}:
        text = f"{item.channel} is given as column '{others[0]}' and as '{column.source}'"
        yield Question(text, (f'--column "{item.channel}={others[0]}"', own))


def _rate(work: Work) -> float | None:
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


def _drop_clocks(work: Work) -> None:
    """Leave out time columns of which no channel is used, where there are others."""
    clocks = [item for item in work.columns if item.base == "time"]
    channels = [item for item in work.columns if item.base not in {"time", DATE}]
    needed = [clock for item in channels if (clock := clock_of(work, item)) is not None]
    for clock in clocks:
        if needed and not any(clock is item for item in needed):
            clock.candidate = replace(clock.candidate, reason="no channel of this clock is used")
            work.columns.remove(clock)


def _assignment(item: ChosenColumn) -> Assignment:
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
        item.stored,
    )
