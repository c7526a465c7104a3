"""Numbers with a unit in each cell: ``5deg``, ``12.3 N``, ``0,5 mm``.

A column of text is one of numbers where its cells are numbers with units of one dimension. A few
such texts (``1A``, ``2A``) may be labels, so that a decimal sign or several values are needed.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from winchkit.runs.importing.formats.cells import is_missing, number
from winchkit.runs.importing.table import Column
from winchkit.runs.importing.unit_spelling import SpelledUnit, read_unit

_QUANTITY = re.compile(r"([+\-−]?[\d.,'\s]*\d[.,]?(?:[eE][+-]?\d+)?)\s*([^\d\s.,+\-][^\d]{0,11})")
_SHARE = 0.8
"""Least share of the cells with text that have a number and a unit; others are faults."""
_FEWEST = 5
"""Least number of different texts without a decimal sign."""


def has_unit(cell: str, decimal: str) -> bool:
    """Whether a cell is a number with its unit.

    ``decimal``: decimal sign.
    """
    return _read(cell, decimal) is not None


def with_cell_units(column: Column) -> Column:
    """A column of text whose cells have units as one of numbers; another one unchanged.

    Returns: in the most frequent unit of the cells. Cells with another text are in ``wrong``.
    """
    if column.texts is None:
        return column
    for decimal in ".,":
        found = _converted(column, column.texts, decimal)
        if found is not None:
            return found
    return column


def _converted(column: Column, texts: Sequence[str], decimal: str) -> Column | None:
    given = [row for row, text in enumerate(texts) if not is_missing(text)]
    if not given or _read(texts[given[0]], decimal) is None:
        return None
    read = {row: found for row in given if (found := _read(texts[row], decimal)) is not None}
    distinct = {texts[row] for row in read}
    is_label = len(distinct) < _FEWEST and not any(set(text) & {".", ","} for text in distinct)
    dimensions = {unit.dimension for _, unit, _ in read.values()}
    if len(read) < _SHARE * len(given) or is_label or len(dimensions) > 1:
        return None
    spelling = Counter(text for _, _, text in read.values()).most_common(1)[0][0]
    usual = read_unit(spelling)
    if usual is None:
        return None
    values = np.full(len(texts), math.nan)
    for row, (value, unit, _) in read.items():
        values[row] = (value * unit.factor + unit.offset - usual.offset) / usual.factor
    wrong = tuple((row, texts[row]) for row in given if row not in read)
    return replace(column, values=values, unit=spelling, texts=None, wrong=wrong)


def _read(cell: str, decimal: str) -> tuple[float, SpelledUnit, str] | None:
    """Value, unit and spelling of a cell."""
    found = _QUANTITY.fullmatch(cell.strip())
    if found is None:
        return None
    value, unit = number(found[1], decimal), read_unit(found[2])
    if value is None or not math.isfinite(value) or unit is None:
        return None
    return value, unit, found[2].strip()
