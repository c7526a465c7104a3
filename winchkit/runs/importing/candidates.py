"""Candidate columns of every channel, by name and dimension, and the choice among them."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from winchkit.runs.columns import column_dimension
from winchkit.runs.importing.answers import permitted
from winchkit.runs.importing.assignment import ChannelCandidate, Choice, Question
from winchkit.runs.importing.clocks.row_order import rows_in_order
from winchkit.runs.importing.formats.cells import number
from winchkit.runs.importing.formats.stamps import epoch_unit, read_stamps
from winchkit.runs.importing.names import CURRENT, IGNORED, NamedChannel, meaning_of
from winchkit.runs.importing.orientation import (
    body_of,
    chosen_body,
    complete_sets,
    is_turned_axis,
    quaternion_names,
    quaternion_order,
    vector_names,
)
from winchkit.runs.importing.source_stamps import is_source_stamp
from winchkit.runs.importing.table import ColumnTable, FileColumn, are_whole
from winchkit.runs.importing.units.known import (
    BRIDGE,
    COUNT_RATE,
    COUNTS,
    SHARE,
    SpelledUnit,
    is_of_two_quantities,
)
from winchkit.runs.importing.units.spelling import named_unit, read_unit, unit_as_name
from winchkit.runs.importing.winches import FEWEST, choose_channels
from winchkit.schema.linear_axis import CHANNELS, ROTARY
from winchkit.schema.mapping import ANGLES, DATE, MATRIX, POSE_DIMENSIONS, QUATERNION

_BY_DIMENSION = {
    "time": "time",
    "angle": "motor_angle",
    COUNTS: "motor_angle",
    "angular speed": "motor_velocity",
    "torque": "motor_torque",
    "force": "tension",
    "mass": "tension",
    BRIDGE: "tension",
    "length": "cable_length",
    "speed": "velocity",
    "temperature": "temperature",
    "current": "motor_torque",
}
_LINEAR = {**CHANNELS, "cable_length": "position", "tension": "force", "load": "force"}
"""Channel of a linear axis for what a name or a unit stands for."""
_COORDINATES = {f"platform_{axis}" for axis in "xyz"}
_IN_SPACE = {*POSE_DIMENSIONS, *MATRIX}
_ALONG = NamedChannel("cable_length", 2, "the only coordinate")
_TURNING = {"angle", "angular speed", "torque", COUNTS, COUNT_RATE, SHARE}
"""Dimensions of a motor that turns."""
_BY_RANK, _BY_UNIT, _BY_ORDER = 3, 4, 5
"""Ranks of candidates after those by a whole name: a component or part of a name, the unit alone,
the order of the columns."""
_UNKNOWN = "unknown name"
_NOT_USED = "set point, prediction, error, state, counter, constant or a quantity of another body"
_SCALAR = {"tension", "load", "motor_torque", "force"}
"""Channels of a cable or a shaft, which have no components along x, y and z."""
_UNEVEN = 0.5
"""Range of the steps of a clock over their median."""


def choose(
    table: ColumnTable,
    given: Mapping[str, str],
    body: str | None,
    without: Collection[str] = (),
    *,
    orientation: str = "",
    motion: str = "",
) -> Choice:
    """Choose the columns of all channels; every column is in ``chosen`` or in ``unused``.

    ``given``: channel by the unique name of a column, as the user gave it; empty for an unused one.
    ``without``: channels that the file does not have, as the user says.
    """
    choice = Choice()
    linear, lone = is_linear(table, given, motion), _lone_coordinate(table)
    numbered = _numbered(table, given, orientation, choice)
    vectors = vector_names([item.name for item in table.columns])
    free: list[ChannelCandidate] = []
    longest = max((len(item) for item in table.columns), default=0)
    for column in table.columns:
        if column.source in given:
            channel, unit = given[column.source], read_unit(column.unit)
            (choice.chosen if channel else choice.unused).append(
                ChannelCandidate(column, channel, 0, unit, "given")
            )
        else:
            along = _ALONG if linear and column is lone else None
            found = _candidate(column, numbered, along, linear=linear)
            if len(column) < min(FEWEST, longest / FEWEST):
                few = f"{len(column)} values, of a parameter: others have {longest}"
                found = ChannelCandidate(column, "", reason=few)
            if found.channel in _SCALAR and column.name in vectors:
                found = replace(found, rank=_BY_RANK, reason=f"{found.reason}, one of x, y, z")
            (free if found.channel else choice.unused).append(found)
            choice.notes += _unread(column)
    taken = {item.channel for item in choice.chosen}
    free = _left_after(taken, free, choice)
    free = _left_after(without, free, choice, "has no column, by --column")
    times = [item for item in free if item.channel in {"time", DATE}]
    if "time" not in {*taken, *without} and all(_counts_rows(item) for item in times):
        even = _even_clock(choice)
        if even:
            free = [item for item in free if item not in times]
            choice.leave(times, "number of the row")
        times = even or times
    poses = [item for item in free if item.channel in (*POSE_DIMENSIONS, *MATRIX)]
    if not any(item.channel == QUATERNION[0] for item in poses):
        angle = dict(zip(QUATERNION[1:], ANGLES, strict=True))
        poses = [
            replace(item, channel=angle[item.channel]) if is_turned_axis(item.column) else item
            for item in poses
        ]
        free = [*(item for item in free if item.channel not in (*POSE_DIMENSIONS, *MATRIX)), *poses]
    exact = [item for item in free if item.rank == 0 and item not in times]
    others = [i for i in free if i not in times and i not in poses and i not in exact]
    _choose_times(table, times, choice)
    _choose_pose([*poses], body, choice)
    choice.chosen += [item for item in exact if item not in poses]
    others = _left_after({item.channel for item in choice.chosen}, others, choice)
    choose_channels(others, choice, without)
    return choice


def _numbered(
    table: ColumnTable, given: Mapping[str, str], orientation: str, choice: Choice
) -> dict[str, str]:
    """Channels of a numbered quaternion, whose order its values say or which is asked."""
    names = [item.name for item in table.columns]
    found = list(quaternion_names(names))
    columns = [item for name in found for item in table.columns if item.name == name]
    if not found or any(item.source in given for item in columns):
        return quaternion_names(names)
    order = orientation if orientation in {"wxyz", "xyzw"} else ""
    order = order or quaternion_order(columns[0].values, columns[-1].values)
    if not order:
        text = f"'{found[0]}' to '{found[-1]}' are a quaternion: is its first or last part real?"
        options = ("--orientation wxyz", "--orientation xyzw")
        choice.questions.append(Question(text, options, "orientation"))
    elif not orientation:
        choice.notes.append(f"'{found[0]}' to '{found[-1]}' are {', '.join(order)} by their values")
    return quaternion_names(names, order or "wxyz")


def _left_after(
    taken: Collection[str],
    free: list[ChannelCandidate],
    choice: Choice,
    words: str = "is given otherwise",
) -> list[ChannelCandidate]:
    for item in free:
        if item.channel in taken:
            choice.leave([item], f"{item.channel} {words}")
    return [item for item in free if item.channel not in taken]


def is_linear(table: ColumnTable, given: Mapping[str, str], motion: str = "") -> bool:
    """Whether a file is of a linear axis: a position in m and a force in N, nothing that turns.

    A coordinate without others (``x``) is a position.
    """
    bases = {channel.rpartition(".")[2] for channel in given.values()}
    if motion or bases & ROTARY.keys():
        return motion != "rotary"
    if bases & (CHANNELS.keys() | _LINEAR.keys() | POSE_DIMENSIONS.keys()):
        return False
    found, lone = set(), _lone_coordinate(table)
    for column in table.columns:
        meaning, unit = meaning_of(column.name, column.labels), read_unit(column.unit)
        meaning = _ALONG if column is lone else meaning
        if meaning is None or not meaning.channel or column.texts is not None:
            continue
        base, dimension = meaning.channel.rpartition(".")[2], unit.dimension if unit else ""
        if base in CHANNELS and dimension in _TURNING:
            return False
        is_named = base in CHANNELS or (base in _LINEAR and meaning.rank > 1)
        if is_named and column_dimension(_LINEAR.get(base, "")) == dimension:
            found.add(_LINEAR[base])
    return found >= {"position", "force"}


def _lone_coordinate(table: ColumnTable) -> FileColumn | None:
    """The column of a coordinate, where the file has one only, and no angle of a pose."""
    meanings = [(item, meaning_of(item.name, item.labels)) for item in table.columns]
    found = [(item, one.channel) for item, one in meanings if one and one.channel in _IN_SPACE]
    return found[0][0] if len(found) == 1 and found[0][1] in _COORDINATES else None


def _candidate(
    column: FileColumn,
    numbered: Mapping[str, str],
    along: NamedChannel | None = None,
    *,
    linear: bool = False,
) -> ChannelCandidate:
    """Channel of one column by its name, its unit, or its values.

    ``along``: meaning of a coordinate that is the position of a linear axis.
    """
    unit = read_unit(column.unit)
    meaning = along or meaning_of(column.name, column.labels)
    if column.texts is not None:
        return _of_text(column)
    if not np.any(np.isfinite(column.values)):
        return ChannelCandidate(column, "", reason="no values")
    if column.name in numbered:
        return ChannelCandidate(column, numbered[column.name], 1, unit, f"'{column.name}'")
    if linear and meaning is not None:
        meaning = replace(meaning, channel=_LINEAR.get(meaning.channel, meaning.channel))
    if meaning is None and not column.unit:
        unit = unit_as_name(column.name)
    found = _by_unit(column, unit) if meaning is None else _by_name(column, meaning, unit)
    return replace(found, channel=_LINEAR.get(found.channel, found.channel)) if linear else found


def _by_name(
    column: FileColumn, meaning: NamedChannel, unit: SpelledUnit | None
) -> ChannelCandidate:
    """Channel that the name stands for, or that of the unit where the two contradict each other."""
    base = meaning.channel.rpartition(".")[2]
    if base == IGNORED:
        return ChannelCandidate(column, "", reason=f"'{meaning.text}': {_NOT_USED}")
    if base == CURRENT:
        base, unit = "motor_torque", unit or _current_unit(column)
    unit = unit or named_unit(column.name, permitted(base)) if not column.unit else unit
    channel = base if meaning.channel == CURRENT else meaning.channel
    dimension = column_dimension(base)
    fits = unit is None or unit.dimension in permitted(base) or dimension == "ratio"
    if base == "time" and not _is_clock(column):
        return ChannelCandidate(column, "", reason=f"'{meaning.text}', and no clock")
    if base == DATE:
        return _by_unit(column, unit)
    if fits:
        return ChannelCandidate(column, channel, meaning.rank, unit, f"'{meaning.text}'")
    if is_of_two_quantities(column.unit):
        return ChannelCandidate(column, channel, meaning.rank, None, f"'{meaning.text}'")
    found = _by_unit(column, unit)
    return replace(found, rank=_BY_RANK) if found.channel else found


def _current_unit(column: FileColumn) -> SpelledUnit | None:
    """A for a current without a unit; of an unknown size where the numbers are whole."""
    is_whole = are_whole(column.known)
    return SpelledUnit("", "current", math.nan) if is_whole else read_unit("A")


def _by_unit(column: FileColumn, unit: SpelledUnit | None) -> ChannelCandidate:
    """Channel of a dimension; the time of a first column without a name that increases."""
    channel = "" if unit is None else _BY_DIMENSION.get(unit.dimension, "")
    if channel and (channel != "time" or _is_clock(column)):
        return ChannelCandidate(
            column, channel, _BY_UNIT, unit, f"unit {column.unit or column.name}"
        )
    if column.number == 1 and column.name.isdecimal() and _is_clock(column, steady=True):
        return ChannelCandidate(column, "time", _BY_ORDER, None, "first column, increasing")
    known = _UNKNOWN if unit is None else f"{_UNKNOWN}, {unit.dimension}"
    return ChannelCandidate(column, "", reason=known)


def _unread(column: FileColumn) -> list[str]:
    """Note on a column that is named like a channel and has text that seems to be numbers."""
    meaning = None if column.texts is None else meaning_of(column.name, column.labels)
    if column.texts is None or meaning is None or meaning.rank > 2:
        return []
    cells = [text for text in column.texts if text.strip()]
    is_numeric = 2 * sum(any(map(str.isdigit, text)) for text in cells) > len(cells)
    if meaning.channel in {IGNORED, CURRENT, "time", DATE} or not is_numeric:
        return []
    unread = (text for text in cells if None in (number(text, "."), number(text, ",")))
    return [
        f"'{column.source}' is named like {meaning.channel} and is left out: it has cells that are "
        f"no numbers, such as '{next(unread, cells[0])}'"
    ]


def _of_text(column: FileColumn) -> ChannelCandidate:
    stamps = read_stamps(column.texts or ())
    count = len(column.texts or ())
    if not count or len(stamps.wrong) > 0.1 * count or not np.any(np.isfinite(stamps.values)):
        return ChannelCandidate(column, "", reason="text")
    channel = "time" if stamps.has_clock else DATE
    return ChannelCandidate(column, channel, 1, None, "dates and times of day as text")


def _is_clock(column: FileColumn, *, steady: bool = False) -> bool:
    """Whether values increase, or only decrease; a ``steady`` clock does so in most rows."""
    steps = np.diff(column.known)
    if not len(steps):
        return False
    increases = float(np.mean(steps < 0)) < 0.05 and bool(np.any(steps > 0))
    if steady and 2 * np.count_nonzero(steps) < len(steps):
        return False
    return increases or bool(np.all(steps < 0))


def _even_clock(choice: Choice) -> list[ChannelCandidate]:
    """The only column of an unknown name whose values increase evenly, in a file without a time."""
    found = [item for item in choice.unused if _increases_evenly(item)]
    if len(found) != 1:
        return []
    choice.unused.remove(found[0])
    return [replace(found[0], channel="time", rank=_BY_ORDER, reason="increases evenly")]


def _counts_rows(item: ChannelCandidate) -> bool:
    """Whether a first column without a name is a number of the row and may be no time."""
    return item.rank == _BY_ORDER and bool(np.all(np.diff(item.column.values) == 1))


def _increases_evenly(item: ChannelCandidate) -> bool:
    """Whether an unnamed column may be a clock: whole numbers are counters as well."""
    values = item.column.values
    if item.unit is not None or item.column.texts is not None or len(values) < FEWEST:
        return False
    if not item.reason.startswith(_UNKNOWN) or not np.all(np.isfinite(values)):
        return False
    steps = np.diff(values)
    return not are_whole(values) and bool(
        np.all(steps > 0) and np.ptp(steps) < _UNEVEN * np.median(steps)
    )


def _choose_times(table: ColumnTable, times: Sequence[ChannelCandidate], choice: Choice) -> None:
    """One time column per group, or one before each block of channels of its own rate."""
    dates = [item for item in times if item.channel == DATE]
    clocks = [item for item in times if item.channel == "time"]
    for group in dict.fromkeys(item.column.group for item in clocks):
        own = [item for item in clocks if item.column.group == group]
        best = min(item.rank for item in own)
        stamps = [item for item in own if is_source_stamp(item.column)]
        others = [item for item in own if item.rank > best and [item] != stamps]
        choice.leave(others, "another column is time")
        own = [item for item in own if item not in others]
        for block in _blocks(table, own):
            kept = max(block, key=_quality)
            choice.chosen.append(kept)
            choice.leave((item for item in block if item is not kept), "another column is time")
            day = next((d for d in dates if d.column.group == group), None)
            if day is not None and _needs_date(kept):
                choice.chosen.append(day)
                dates.remove(day)
    choice.leave(dates, "date without use")


def _blocks(table: ColumnTable, clocks: Sequence[ChannelCandidate]) -> list[list[ChannelCandidate]]:
    """Time columns without another column between them are alternatives."""
    blocks: list[list[ChannelCandidate]] = []
    used = {item.column.number for item in clocks}
    for item in sorted(clocks, key=lambda c: c.column.number):
        before = blocks[-1][-1].column.number if blocks else 0
        is_between = any(
            before < column.number < item.column.number and column.number not in used
            for column in table.columns
            if np.any(np.isfinite(column.values))
        )
        if blocks and not is_between:
            blocks[-1].append(item)
        else:
            blocks.append([item])
    return blocks


def _quality(item: ChannelCandidate) -> tuple[bool, bool, bool, int]:
    """That of the source first, an absolute one, one with a unit, then the finest."""
    values = item.column.values
    if item.column.texts is not None:
        stamps = read_stamps(item.column.texts)
        values, absolute = stamps.values, stamps.has_date
    else:
        absolute = epoch_unit(values) is not None
    distinct, known = len(np.unique(values)), values[np.isfinite(values)]
    # A few rows out of order are left out.
    steps = np.diff(known[rows_in_order(known)])
    complete = distinct >= 0.99 * len(values) and not (np.any(steps < 0) and np.any(steps > 0))
    is_source = is_source_stamp(item.column)
    return (
        complete and is_source,
        complete and absolute,
        complete and item.unit is not None,
        distinct,
    )


def _needs_date(item: ChannelCandidate) -> bool:
    return item.column.texts is not None and not read_stamps(item.column.texts[:50]).has_date


def _choose_pose(poses: list[ChannelCandidate], body: str | None, choice: Choice) -> None:
    """Pose channels of one body, where they are complete with those that are given."""
    if not poses:
        return
    given = [item for item in choice.chosen if item.channel in (*POSE_DIMENSIONS, *MATRIX)]
    if body is None and given:
        body = body_of(given[0].column)
    chosen, bodies = chosen_body([item.column for item in (*given, *poses)], body)
    if chosen is None:
        wanted = f"no body '{body}'" if body is not None else "which body is the platform?"
        options = tuple(f'--body "{name}"' for name in bodies)
        choice.questions.append(Question(f"{wanted} The file has {', '.join(bodies)}", options))
        choice.leave(poses, "one of several bodies")
        return
    own = {item.channel: item for item in given}
    for item in poses:
        if body_of(item.column) == chosen:
            own.setdefault(item.channel, item)
    complete = complete_sets(own)
    for item in poses:
        if own.get(item.channel) is item and item.channel in complete:
            choice.chosen.append(item)
        else:
            is_own = body_of(item.column) == chosen
            reason = "not a complete pose" if is_own else f"of another body than '{chosen}'"
            choice.leave([item], reason)
