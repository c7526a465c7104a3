"""Columns that are arithmetic of columns: ``tau_meas-tau_model``, ``(tau_a-tau_b)/2``.

A recursive-descent parser of sums, products, quotients and brackets. The unit of a sum is that of
its columns, numbers have none, and a product or quotient of columns has none.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from winchkit.arrays import Array
from winchkit.errors import UsageError
from winchkit.runs.importing.formats.cells import number
from winchkit.runs.importing.table import ColumnTable, FileColumn
from winchkit.runs.importing.units.spelling import read_unit

_OPERATOR = re.compile(r"[-+*/()]")
_NUMBER = re.compile(r"(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?(?=\s*(?:[-+*/)]|$))")
_DEEPEST = 20
"""Brackets within brackets, far from the limit of Python's recursion."""


@dataclass(frozen=True)
class _Value:
    """Numbers of a part of an expression, and of what they are made."""

    values: Array | float
    unit: str = ""
    columns: tuple[FileColumn, ...] = ()
    is_sum: bool = False
    """Whether columns were added to others or to numbers."""

    @property
    def is_scaled_column(self) -> bool:
        """Whether it is one column by a number."""
        return len(self.columns) == 1 and not self.is_sum


def is_expression(source: str) -> bool:
    """Whether a text has an operator or a bracket behind its first character."""
    return bool(_OPERATOR.search(source.strip()[1:]))


def with_derived(table: ColumnTable, sources: Iterable[str]) -> ColumnTable:
    """The table with a further column for every source that is an expression of its columns.

    A source with an operator that is the name of a column is that column.
    """
    added: list[FileColumn] = []
    for source in dict.fromkeys(sources):
        if table.column(source) is None and is_expression(source):
            derived = _derived(table, source, len(table.columns) + len(added) + 1)
            added += [] if derived is None else [derived]
    return replace(table, columns=(*table.columns, *added)) if added else table


def scaled_column(table: ColumnTable, source: str) -> tuple[str, float] | None:
    """Column and factor of an expression of one column and numbers; None for another text."""
    if table.column(source) is not None or not is_expression(source):
        return None
    try:
        found = _Parser(table, source).whole()
    except UsageError:
        return None
    if not found.is_scaled_column:
        return None
    [column] = found.columns
    unit = replace(column, values=np.ones(1))
    alone = replace(table, columns=tuple(unit if c is column else c for c in table.columns))
    factor = float(np.ravel(_Parser(alone, source).whole().values)[0])
    is_product = np.allclose(found.values, factor * column.values, rtol=1e-9, equal_nan=True)
    return (column.source, factor) if is_product and math.isfinite(factor) else None


def _derived(table: ColumnTable, source: str, place: int) -> FileColumn | None:
    """The column of an expression; None where a part of it is unknown or the units differ."""
    try:
        found = _Parser(table, source).whole()
    except UsageError:
        return None
    if not found.columns:
        return None
    first = found.columns[0]
    array = np.broadcast_to(np.asarray(found.values, dtype=np.float64), (len(first),))
    wrong = {row: (row, text) for column in found.columns for row, text in column.wrong}
    return FileColumn(
        source,
        array,
        found.unit,
        wrong=tuple(wrong[row] for row in sorted(wrong)),
        group=first.group,
        number=place,
        source=source,
        is_derived=True,
    )


def fault_of(table: ColumnTable, source: str) -> str:
    """Why an expression is no column of a table."""
    try:
        found = _Parser(table, source).whole()
    except UsageError as error:
        return str(error)
    return "" if found.columns else f"'{source}' has no column of the file"


class _Parser:
    """Recursive descent: a sum of products of operands, each a column, a number or brackets."""

    def __init__(self, table: ColumnTable, source: str) -> None:
        self._table = table
        self._source = source.strip()
        self._at = 0
        self._depth = 0
        named = [*(item.source for item in table.columns), *table.constants]
        self._names = sorted(filter(None, named), key=len, reverse=True)

    def whole(self) -> _Value:
        """Value of the expression; raises UsageError for one that is none."""
        with np.errstate(all="ignore"):
            found = self._sum()
        if self._at < len(self._source):
            raise self._fault(f"'{self._source[self._at :]}' is left over")
        return found

    def _sum(self) -> _Value:
        negative = self._take("+-") == "-"
        found = self._product()
        found = replace(found, values=-found.values) if negative else found
        while operator := self._take("+-"):
            found = self._added(found, self._product(), operator)
        return found

    def _product(self) -> _Value:
        found = self._operand()
        while operator := self._take("*/"):
            other = self._operand()
            is_number = not other.columns
            if operator == "/" and is_number and other.values == 0:
                raise self._fault("it divides by 0")
            values = found.values * other.values if operator == "*" else found.values / other.values
            # A number leaves the unit; of two columns, and below a column, there is none.
            unit = (
                found.unit if is_number else "" if found.columns or operator == "/" else other.unit
            )
            columns = self._together(found, other)
            is_quotient = operator == "/" and not is_number
            found = _Value(values, unit, columns, found.is_sum or other.is_sum or is_quotient)
        return found

    def _operand(self) -> _Value:
        rest = self._source[self._at :]
        name = next((n for n in self._names if rest.startswith(n) and self._ends(n)), None)
        if name is None and self._take("("):
            self._depth += 1
            if self._depth > _DEEPEST:
                raise self._fault(f"it has more than {_DEEPEST} brackets in each other")
            found = self._sum()
            if not self._take(")"):
                raise self._fault("a bracket is not closed")
            self._depth -= 1
            return found
        plain = _NUMBER.match(rest)
        value = number(plain[0].replace(",", "."), ".") if plain else None
        # A column that is named by a number is meant by that number alone, without arithmetic.
        if plain and value is not None and math.isfinite(value):
            self._at += plain.end()
            self._skip()
            return _Value(value)
        name = name or _OPERATOR.split(rest)[0].strip()
        column = self._table.column(name)
        if column is None and name not in self._table.constants:
            raise self._unknown(name)
        self._at += len(name)
        self._skip()
        if column is None:
            return _Value(self._table.constants[name])
        if column.texts is not None:
            raise self._fault(f"column '{name}' has text and no numbers")
        return _Value(column.values, column.unit, (column,))

    def _added(self, one: _Value, other: _Value, operator: str) -> _Value:
        sign = -1.0 if operator == "-" else 1.0
        columns = self._together(one, other)
        unit, left, right = one.unit or other.unit, 1.0, 1.0
        if one.columns and other.columns and one.unit != other.unit:
            units = [read_unit(part.unit) for part in (one, other)]
            first, second = units
            if (
                first is None
                or second is None
                or first.dimension != second.dimension
                or first.offset
                or second.offset
            ):
                texts = " and ".join(f"[{part.unit or '1'}]" for part in (one, other))
                raise self._fault(f"a sum of {texts} has no unit")
            unit = min(one.unit, other.unit)
            common = first if unit == one.unit else second
            left, right = first.factor / common.factor, second.factor / common.factor
        values = one.values * left + sign * (other.values * right)
        return _Value(values, unit, columns, is_sum=True)

    def _together(self, one: _Value, other: _Value) -> tuple[FileColumn, ...]:
        columns = (*one.columns, *other.columns)
        if len({(column.group, len(column)) for column in columns}) > 1:
            raise self._fault("its columns are not sampled together")
        return columns

    def _take(self, marks: str) -> str:
        """The next mark, if it is one of some; blanks around it are skipped."""
        rest = self._source[self._at :]
        mark = rest.lstrip()[:1]
        if not mark or mark not in marks:
            return ""
        self._at = len(self._source) - len(rest.lstrip()[1:].lstrip())
        return mark

    def _skip(self) -> None:
        self._at = len(self._source) - len(self._source[self._at :].lstrip())

    def _ends(self, name: str) -> bool:
        """Whether a name is the whole operand."""
        rest = self._source[self._at + len(name) :].lstrip()
        return not rest or rest[0] in "+-*/)"

    def _unknown(self, word: str) -> UsageError:
        has = ", ".join(repr(item.source) for item in self._table.columns)
        if not word:
            return self._fault("a column or a number is missing")
        return UsageError(f"there is no column '{word}' for '{self._source}'; the file has {has}")

    def _fault(self, reason: str) -> UsageError:
        return UsageError(
            f"'{self._source}' is no sum, product or quotient of columns and numbers: {reason}"
        )
