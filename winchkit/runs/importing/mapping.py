"""Mappings: assignments of columns as a file, and a table read with one."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from winchkit.errors import Fault, RunError
from winchkit.runs.files import write_whole
from winchkit.runs.importing.assignment import Assignment, Guess
from winchkit.runs.importing.formats.arithmetic import with_derived
from winchkit.runs.importing.long_table import axes_of, by_kind
from winchkit.runs.importing.table import ColumnTable, FileColumn
from winchkit.runs.importing.units.spelling import read_unit
from winchkit.schema.file_text import file_text
from winchkit.schema.mapping import MODULO, ImportMapping, MappedColumn, MappedLog


def mapping_of(name: str, guesses: Sequence[tuple[str, Guess]]) -> ImportMapping:
    """Mapping of the logs that were imported; files with the same columns are one log."""
    logs: list[MappedLog] = []
    wraps = {
        (item.source, item.channel): item.stored
        for _, guess in guesses
        for item in guess.used
        if item.stored.startswith(MODULO)
    }
    for title, guess in guesses:
        columns = tuple(
            MappedColumn(
                item.source,
                item.channel,
                item.unit,
                item.factor,
                item.offset,
                item.stored or wraps.get((item.source, item.channel), ""),
                _written(guess.table, item.source, item.unit),
            )
            for item in guess.used
        )
        own = (columns, guess.sample_rate, guess.axis, guess.kind)
        if own not in [(log.column, log.sample_rate, log.axis, log.kind) for log in logs]:
            logs.append(MappedLog(title, *own))
    return ImportMapping(name, tuple(logs))


def _written(table: ColumnTable, source: str, unit: str) -> str:
    """Unit in the header of a column, where it is known and another one than ``unit``."""
    column = table.column(source)
    text = "" if column is None or column.is_derived else column.unit
    own, other = read_unit(text), read_unit(unit)
    if own is None or (
        other is not None
        and (own.dimension, own.factor, own.offset) == (other.dimension, other.factor, other.offset)
    ):
        return ""
    return text


def _other_unit(item: MappedColumn, column: FileColumn, mapping: ImportMapping) -> str:
    return (
        f"column '{column.source}' is in {column.unit}, and the mapping "
        f"'{mapping.path or mapping.name}' has {item.unit or 'a factor'}: import the file without "
        f'the mapping, or add written = "{column.unit}" to the column there, if that unit is wrong'
    )


def mapping_id(mapping: ImportMapping) -> str:
    """Identifier of columns, units and factors, 12 hexadecimal digits."""
    content = json.dumps([asdict(log) for log in mapping.log], sort_keys=True)
    return hashlib.sha256(content.encode()).hexdigest()[:12]


def write_mapping(mapping: ImportMapping, path: Path) -> None:
    """Write a mapping file; raises FileError."""
    write_whole(path, file_text("mapping", mapping).encode())


def guess_by(whole: ColumnTable, mapping: ImportMapping) -> Guess:
    """Assignments of a table by the log of a mapping whose columns it has; raises RunError.

    Of logs with the same columns it is the one with the name of the file.
    """
    if kinds := [log.kind for log in mapping.log if log.kind and whole.column(log.kind)]:
        whole = by_kind(whole, kinds[0])
    whole = with_derived(whole, [item.source for log in mapping.log for item in log.column])
    for log in _fitting(whole, mapping)[:1]:
        table = next(iter(axes_of(whole, log.axis).values())) if log.axis else whole
        found = [(item, table.column(item.source)) for item in log.column]
        faults = [
            Fault(_other_unit(item, column, mapping), whole.path)
            for item, column in found
            if column is not None
            and _written(table, item.source, item.unit) not in {"", item.written}
        ]
        if faults:
            raise RunError(faults)
        by_source = {
            column.source: Assignment(
                column.source,
                item.channel,
                item.unit,
                item.si if item.si is not None else 1.0,
                item.offset,
                "given",
                f"mapping '{mapping.name}'",
                item.stored,
            )
            for item, column in found
            if column is not None
        }
        assignments = [
            by_source.get(c.source, Assignment(c.source, "", c.unit, reason="not in the mapping"))
            for c in table.columns
        ]
        return Guess(
            table,
            tuple(assignments),
            sample_rate=log.sample_rate,
            axis=log.axis,
            whole=whole if log.axis else None,
        )
    raise RunError(
        [Fault(_lacking(whole, log, mapping), whole.path) for log in mapping.log]
        or [Fault("the mapping has no log", whole.path)]
    )


def _fitting(whole: ColumnTable, mapping: ImportMapping) -> list[MappedLog]:
    """Logs whose columns a file has, the one that is used first."""
    logs = [
        log
        for log in mapping.log
        if all(whole.column(n) is not None for n in _names(log)) and log.column
    ]
    alike = [log for log in logs if set(_names(log)) == set(_names(logs[0]))]
    named = [log for log in alike if log.name == Path(whole.path).stem]
    if len(alike) > 1 and len(named) != 1:
        names = " and ".join(f"'{log.name}'" for log in alike)
        message = (
            f"fits the logs {names} of the mapping '{mapping.path or mapping.name}', which have "
            "the same columns; leave one of them, or give it the name of this file"
        )
        raise RunError(Fault(message, whole.path))
    return named if len(alike) > 1 else logs


def _names(log: MappedLog) -> list[str]:
    return [item.source for item in log.column] + [log.axis] * bool(log.axis)


def _lacking(table: ColumnTable, log: MappedLog, mapping: ImportMapping) -> str:
    names = _names(log)
    lacking = [repr(name) for name in names if table.column(name) is None]
    has = ", ".join(repr(column.source) for column in table.columns[:20])
    return (
        f"is no log '{log.name}' of the mapping '{mapping.path or mapping.name}': it lacks the "
        f"columns {', '.join(lacking)}; it has {has}"
    )
