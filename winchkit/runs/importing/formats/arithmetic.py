"""Columns that are sums, differences and products of columns: ``tau_meas-tau_model``."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import replace
from functools import reduce

import numpy as np

from winchkit.arrays import Array
from winchkit.runs.importing.formats.cells import number
from winchkit.runs.importing.table import ColumnTable, FileColumn
from winchkit.runs.importing.unit_spelling import read_unit

_OPERATOR = re.compile(r"\s*([-+*])\s*")


def is_expression(source: str) -> bool:
    """Whether a text has an operator between other characters, or a sign and an operator."""
    return bool(_OPERATOR.search(source.strip()[1:]))


def with_derived(table: ColumnTable, sources: Iterable[str]) -> ColumnTable:
    """The table with a further column for every source that is an expression of its columns.

    ``sources``: names, numbers of columns, and expressions; only the last are added. Returns: the
    unit of a sum is that of its columns, which is the same for all or convertible; a product of
    columns has none. A name with an operator is that column.
    """
    added: list[FileColumn] = []
    for source in dict.fromkeys(sources):
        if table.column(source) is None and is_expression(source):
            derived = _derived(table, source, len(table.columns) + len(added) + 1)
            added += [] if derived is None else [derived]
    return replace(table, columns=(*table.columns, *added)) if added else table


def _derived(table: ColumnTable, source: str, place: int) -> FileColumn | None:
    """The column of an expression; None where a part of it is unknown or the units differ."""
    parts = _OPERATOR.split(source.strip())
    signed = parts[1:] if not parts[0] else ["+", *parts]
    operators, operands = signed[::2], signed[1::2]
    terms: list[list[str]] = []
    for operator, operand in zip(operators, operands, strict=True):
        if operator == "*" and terms:
            terms[-1].append(operand)
        elif operator != "*":
            terms.append([operator, operand])
        else:
            return None
    found = [_term(table, term[0] == "-", term[1:]) for term in terms]
    columns = [term for term in found if term is not None]
    if len(columns) < len(found) or not any(group for _, _, group in columns):
        return None
    units = {unit for _, unit, group in columns if group}
    unit = next(iter(units)) if len(units) == 1 else _common(units)
    groups = {group[0].group for _, _, group in columns if group}
    lengths = {len(group[0]) for _, _, group in columns if group}
    if unit is None or len(groups) > 1 or len(lengths) > 1:
        return None
    values = sum(values * _scale(own, unit) for values, own, _ in columns)
    array = np.broadcast_to(np.asarray(values, dtype=np.float64), (lengths.pop(),))
    return FileColumn(source, array, unit, group=groups.pop(), number=place, source=source)


def fault_of(table: ColumnTable, source: str) -> str:
    """Why an expression is no column of a table."""
    names = [name for name in _OPERATOR.split(source.strip())[::2] if name]
    found = {name: table.column(name) for name in names if number(name, ".") is None}
    unknown = [n for n, item in found.items() if item is None and n not in table.constants]
    if unknown:
        has = ", ".join(repr(item.source) for item in table.columns)
        return f"there is no column '{unknown[0]}' for '{source}'; the file has {has}"
    units = ", ".join(f"'{n}' [{item.unit or '1'}]" for n, item in found.items() if item)
    return f"'{source}' is no sum of numbers of one rate in one unit or convertible ones: {units}"


def _term(
    table: ColumnTable, is_negative: bool, factors: list[str]
) -> tuple[Array | float, str, list[FileColumn]] | None:
    """Product of columns, constants of the file and numbers; its unit, and its columns."""
    columns, values = [], []
    for text in factors:
        column = table.column(text) if not text.replace(".", "", 1).isdecimal() else None
        plain = number(text, ".")
        if column is not None and column.texts is None:
            columns.append(column)
        elif text in table.constants:
            values.append(table.constants[text])
        elif plain is not None and math.isfinite(plain):
            values.append(plain)
        else:
            return None
    scale = math.prod(values) * (-1 if is_negative else 1)
    if not columns:
        return scale, "", []
    product = reduce(lambda left, right: left * right, [column.values for column in columns])
    return product * scale, columns[0].unit if len(columns) == 1 else "", columns


def _common(units: Iterable[str]) -> str | None:
    """One of several units of one dimension without an offset; None for others."""
    known = [read_unit(unit) for unit in sorted(units)]
    dimensions = {unit.dimension for unit in known if unit is not None and not unit.offset}
    is_one = all(unit is not None and not unit.offset for unit in known) and len(dimensions) == 1
    return min(units) if is_one else None


def _scale(unit: str, common: str) -> float:
    own, wanted = read_unit(unit), read_unit(common)
    return own.factor / wanted.factor if own and wanted and unit != common else 1.0
