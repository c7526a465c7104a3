"""Questions on what a file does not have: units, constants, and columns."""

from __future__ import annotations

import math

from winchkit.errors import some_of
from winchkit.runs.columns import column_dimension
from winchkit.runs.importing.assignment import (
    Choice,
    ChosenColumn,
    Question,
    Work,
    is_counted,
    is_whole,
)
from winchkit.runs.importing.long_table import axes_of, has_kinds
from winchkit.runs.importing.table import ColumnTable, FileColumn
from winchkit.runs.importing.unit_settling import is_alike
from winchkit.runs.importing.units.known import BRIDGE, COUNT_RATE, COUNTS, SHARE
from winchkit.schema.mapping import DATE
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
