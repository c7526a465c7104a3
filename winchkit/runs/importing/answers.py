"""Facts that a file lacks and its user supplies: constants, and the column of a channel."""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from winchkit.errors import UsageError, suggest
from winchkit.runs.columns import column_dimension
from winchkit.runs.importing.formats.arithmetic import with_derived
from winchkit.runs.importing.long_table import by_kind, marker_column
from winchkit.runs.importing.table import ColumnTable
from winchkit.runs.importing.units.known import BRIDGE, COUNT_RATE, COUNTS, SHARE
from winchkit.runs.importing.units.spelling import read_unit
from winchkit.schema.linear_axis import CHANNELS as LINEAR
from winchkit.schema.mapping import CHANNELS, EXCEL, STAMP
from winchkit.schema.plausible import typed_quantity
from winchkit.units import UNITS

_COLUMN = re.compile(
    r"\s*(?:(?P<file>[^=]+):)?\s*(?P<channel>[\w.]+)\s*=\s*(?P<minus>-\s*(?=\S))?(?P<source>.*?)\s*"
    r"(?:\*\s*(?:(?P<factor>[-+]?\d*[.,]?\d+(?:[eE][-+]?\d+)?)|(?P<constant>[A-Za-z][\w.]*)))?\s*"
    r"(?:(?!(?<=\S)\[\d+\]\s*$)\[\s*(?P<unit>[^\[\]]*)\s*\])?\s*"
)
"""A number in brackets at the end of a name is an index of it: ``tau[0]``."""


_PERMITTED: dict[str, tuple[str, ...]] = {
    "time": ("time",),
    "motor_angle": ("angle", COUNTS),
    "motor_velocity": ("angular speed", COUNT_RATE),
    "motor_torque": ("torque", "current", SHARE, "voltage", COUNTS),
    "tension": ("force", "mass", BRIDGE, "voltage", COUNTS),
    "load": ("force", "mass", BRIDGE, "voltage", COUNTS),
    "cable_length": ("length", "voltage", COUNTS),
    "position": ("length", "voltage", COUNTS),
    "velocity": ("speed",),
    "force": ("force", "mass", BRIDGE, "voltage", COUNTS),
}
"""Dimensions that a column of a channel may have, where they are not that of the channel alone.

The output of an amplifier (V) or converter (counts) needs a factor that only the user knows."""


def permitted(channel: str) -> tuple[str, ...]:
    """Dimensions of the columns that a channel may have."""
    base = channel.rpartition(".")[2]
    dimension = column_dimension(base)
    return _PERMITTED.get(base, () if dimension is None else (dimension,))


def fits(channel: str, dimension: str) -> bool:
    """Whether a column in a unit of a dimension may be a channel."""
    return dimension in permitted(channel) or column_dimension(channel) in {"ratio", None}


CONSTANTS: dict[str, str] = {
    "rated_torque": "torque",
    "torque_constant": "torque constant",
    "counts_per_turn": "ratio",
    "sensitivity": "ratio",
    "capacity": "force",
    "sample_rate": "frequency",
}
"""Dimension of each constant of :class:`Answers`; a sensitivity is a number of mV/V."""
_COUNTED = re.compile(r"\s*(mV/V|counts?)\s*$")
"""Units of constants that are numbers, which need not be written."""


def read_constant(key: str, text: str) -> float:
    """A constant of :data:`CONSTANTS` in SI, ``"2.4 N m"``; raises UsageError at zero or below."""
    dimension = CONSTANTS[key]
    option = f"--{key.replace('_', '-')}"
    plain = _COUNTED.sub("", text) if dimension == "ratio" else text
    try:
        value = typed_quantity(as_ours(plain, dimension), dimension)
    except UsageError as error:
        raise UsageError(f"{option}: {error}") from None
    if value <= 0:
        raise UsageError(f"{option} '{text}' must be above 0")
    return value


def as_ours(text: str, dimension: str) -> str:
    """``2,4 Nm`` as ``2.4 N m``; UsageError where a comma may separate thousands."""
    plain = _with_point(text)
    number = re.match(r"\s*[\d.]+\s*", plain)
    unit = read_unit(plain[number.end() :]) if number else None
    is_ours = unit is not None and unit.text in UNITS[dimension]
    return f"{number[0].strip()} {unit.text}" if number and unit and is_ours else plain


def _with_point(text: str) -> str:
    if re.match(r"\s*[1-9]\d{0,2},\d{3}(?!\d)", text):
        raise UsageError(f"the comma of '{text}' may separate thousands; write a point")
    return re.sub(r"^(\s*\d+),(?=\d)", r"\1.", text)


@dataclass(frozen=True)
class ColumnAnswer:
    """Column of a channel; an empty ``source`` says that the file has none."""

    channel: str
    source: str
    unit: str
    """As given; empty for the unit that the column has in the file."""
    factor: float | None
    """Multiplier of the numbers before the unit; None where none was given."""
    constant: str = ""
    """Name of a variable of the file that is the multiplier."""
    sign: float = 1.0
    """-1 for a column of the other sign."""
    file: str = ""
    """Name of the only file that it is of, with or without folder and suffix; empty for all."""


@dataclass(frozen=True)
class Answers:
    """Constants and columns that the user gives; SI."""

    columns: tuple[ColumnAnswer, ...] = ()
    rated_torque: float | None = None
    """Torque of 100 %, N m."""
    torque_constant: float | None = None
    """N m/A."""
    counts_per_turn: float | None = None
    """Counts of the encoder in a turn of the motor."""
    sensitivity: float | None = None
    """Output of the load cell at its capacity, mV/V."""
    capacity: float | None = None
    """N."""
    sample_rate: float | None = None
    """Hz; replaces the time stamps."""
    body: str | None = None
    """Body or marker of a tracker's export."""
    axis: str | None = None
    """Column that names the axis of each row; empty for a table whose rows are of all axes."""
    kind: str = ""
    """Column that names the kind of each row, where rows have different quantities."""
    unsigned: tuple[str, ...] = ()
    """Columns whose numbers have no sign, although they look like signed ones that lost it."""
    signed: tuple[str, ...] = ()
    """Columns whose sign is lost and restored."""
    orientation: str = ""
    """``vector``, ``angles`` or ``xyz`` for ``rx``, ``ry``, ``rz``; ``wxyz`` or ``xyzw`` for ``q0``
    to ``q3``; empty where the values say it."""
    motion: str = ""
    """``linear`` for a position and a force, ``rotary`` for an angle and a torque; empty where the
    columns say it."""
    modulo: tuple[tuple[str, float], ...] = ()
    """Columns with the number at which they wrap; 0 for one that does not."""


def read_answers(given: Mapping[str, Any]) -> Answers:
    """Answers as a user writes them, in SI; what is empty is not given.

    ``given``: fields of :class:`Answers`, ``columns`` as texts of the command line, and ``options``
    that answer a question (``--signed "torque"``). Raises UsageError.
    """
    try:
        columns = tuple(read_column(str(text)) for text in given.get("columns") or ())
    except UsageError as error:
        raise UsageError(f"--column: {error}") from None
    pairs = [(item.channel, item.source, item.file) for item in columns if item.source]
    for channel, source, file in pairs:
        if pairs.count((channel, source, file)) > 1:
            raise UsageError(f"--column: {channel}={source} is given twice; give it once")
    fields: dict[str, Any] = {key: given.get(key) for key in ("body", "axis")}
    fields |= {key: given.get(key) or "" for key in ("orientation", "motion", "kind")}
    fields |= {key: tuple(given.get(key) or ()) for key in ("unsigned", "signed")}
    fields |= {
        key: read_constant(key, str(given[key]))
        for key in CONSTANTS
        if str(given.get(key) or "").strip()
    }
    moduli = tuple(map(read_modulo, given.get("modulo") or ()))
    own = Answers(columns=columns, modulo=moduli, **fields)
    return with_options(own, map(str, given.get("options") or ()))


def answers_of(table: ColumnTable, tables: Sequence[ColumnTable], answers: Answers) -> Answers:
    """Answers without the columns that are those of other files.

    A column is that of the files that have its name; where none has, of those that have its number;
    where none has that either, of all, so that each says so. Raises UsageError for the name of a
    file that is none of them.
    """
    for item in answers.columns:
        if item.file and not any(_is_named(t, item.file) for t in tables):
            has = ", ".join(t.path for t in tables)
            raise UsageError(f"--column: there is no file '{item.file}'; there are {has}")

    def is_own(item: ColumnAnswer) -> bool:
        if item.file:
            return _is_named(table, item.file)
        having = [t for t in tables if any(c.source == item.source for c in t.columns)]
        having = having or [t for t in tables if with_derived(t, [item.source]) is not t]
        having = having or [t for t in tables if t.column(item.source) is not None]
        having = having or [t for t in tables if _of_bodies(t, item.source)]
        return not item.source or not having or any(t is table for t in having)

    own = tuple(item for item in answers.columns if is_own(item))
    answers = replace(answers, columns=own)

    def is_of_others(by: str | None) -> bool:
        return bool(by and not table.column(by) and any(t.column(by) for t in tables))

    if is_of_others(answers.axis):
        answers = replace(answers, axis=None)
    if is_of_others(answers.kind):
        answers = replace(answers, kind="")
    return answers


def _of_bodies(table: ColumnTable, source: str) -> bool:
    """Whether a column is one of a body, of a table whose rows are of several."""
    marker = marker_column(table)
    return marker is not None and by_kind(table, marker.source).column(source) is not None


def _is_named(table: ColumnTable, name: str) -> bool:
    return name in {table.path, Path(table.path).name, Path(table.path).stem}


def read_modulo(text: str) -> tuple[str, float]:
    """Read ``Position=65536``: a column and the number at which it wraps; raises UsageError."""
    name, _, size = text.rpartition("=")
    try:
        value = float(size)
    except ValueError:
        value = math.nan
    if not name or not 0 <= value < math.inf:
        raise UsageError(f"--modulo: '{text}' is not COLUMN=NUMBER, e.g. 'Position=65536'")
    return name.strip(), value


STORAGE = ("signed", "modulo", "orientation", "axis")
"""Keys of the questions that an option as it stands answers."""


def with_options(answers: Answers, options: Iterable[str]) -> Answers:
    """Answers with options of the command line that answer a question of :data:`STORAGE`.

    ``options``: ``--signed "speed 3"``, ``--modulo "Position=65536"``, ``--orientation vector``,
    ``--axis "joint"``. Raises UsageError for another option.
    """
    for text in options:
        try:
            words = shlex.split(text)
        except ValueError:
            words = []
        for option, value in zip(words[::2], words[1::2], strict=False):
            name = option.removeprefix("--")
            if name not in {"signed", "unsigned", "modulo", "orientation", "axis", "kind"}:
                raise UsageError(f"'{text}' is no option that answers a question of a file")
            given: Any = read_modulo(value) if name == "modulo" else value
            if name in {"signed", "unsigned", "modulo"}:
                given = (*getattr(answers, name), given)
            answers = replace(answers, **{name: given})
    return answers


def read_column(text: str) -> ColumnAnswer:
    """Read ``motor_angle=Pos [deg]``, ``motor_torque=u*35.15`` or ``FILE:motor_torque=-u``.

    The factor is a number or a variable of the file; without a column the file does not have the
    channel. Raises UsageError for another text.
    """
    found = _COLUMN.fullmatch(text)
    if found is None:
        raise UsageError(f"'{text}' is not CHANNEL=COLUMN, e.g. 'motor_angle=Pos [deg]'")
    channel, unit = found["channel"], (found["unit"] or "").strip()
    known = channel in CHANNELS or column_dimension(channel) is not None
    if not known:
        raise UsageError(
            f"'{channel}' is no channel of a run; use one of {', '.join(CHANNELS)}"
            + suggest(channel, list(CHANNELS))
        )
    dimension = column_dimension(channel)
    spelled = read_unit(unit)
    if unit and unit not in {STAMP, EXCEL} and spelled is None:
        units = ", ".join(UNITS[dimension]) if dimension else "1"
        raise UsageError(f"'{unit}' in '{text}' is no known unit; use one of {units}")
    if spelled is not None and not fits(channel, spelled.dimension):
        known_units = list(UNITS[dimension or "ratio"])
        use = f"use {', '.join(known_units)}"
        linear = LINEAR.get(channel, "")
        if linear and column_dimension(linear) == spelled.dimension:
            use += f"; of a linear axis this is {linear}={found['source']} [{unit}]"
        elif spelled.dimension == "current" and found["factor"] is None:
            use += f", with a factor: '{channel}={found['source']}*35.1 [{known_units[0]}]'"
        raise UsageError(
            f"'{unit}' in '{text}' is a unit of {spelled.dimension}, not of {dimension}; {use}"
        )
    factor = float(_with_point(found["factor"])) if found["factor"] else None
    source, constant = found["source"], found["constant"] or ""
    if constant and re.fullmatch(r"\d*[.,]?\d+", source):
        source, factor, constant = constant, float(_with_point(source)), ""  # the number first
    sign, file = -1.0 if found["minus"] else 1.0, (found["file"] or "").strip()
    return ColumnAnswer(channel, source, unit, factor, constant, sign, file)
