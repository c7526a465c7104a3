"""Cells of text as numbers, with decimal commas and separators of thousands, or with a unit each.

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

from winchkit.arrays import Array
from winchkit.runs.importing.table import FileColumn
from winchkit.runs.importing.units.known import SpelledUnit
from winchkit.runs.importing.units.spelling import read_unit

_MISSING = {
    *("", "nan", "-nan", "+nan", "n/a", "na", "#n/a", "#nv", "#na", "null", "none", "-", "--"),
    *("---", "invalid", "no data", "nodata", "1.#qnan", "-1.#ind", "1.#ind", "missing", "?"),
    *("nan(ind)", "-nan(ind)", "nv", "k.a."),
}
_STARS = re.compile(r"[*#]+|-{2,}")
_ERROR = re.compile(r"#[^\W\d_]+(/0)?[!?]", re.IGNORECASE)
"""Errors of a spreadsheet in any language: ``#DIV/0!``, ``#WERT!``, ``#NAME?``."""
_POINT = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_COMMA = re.compile(r"[+-]?(\d+,?\d*|,\d+)([eE][+-]?\d+)?", re.ASCII)
_GROUPED = {
    ".": re.compile(r"[+-]?\d{1,3}(,\d{3})+\.\d+", re.ASCII),
    ",": re.compile(r"[+-]?\d{1,3}(\.\d{3})+,\d+", re.ASCII),
}
"""Separators of thousands, which are certain only before a decimal sign of the other kind."""
_ODD = re.compile("[\u00a0\u202f\u2009']")
"""Blanks and apostrophes that separate thousands."""
_INFINITE = re.compile(r"[+-]?(inf|infinity|1\.#inf|∞)", re.IGNORECASE)


def is_missing(cell: str) -> bool:
    """Whether a cell stands for a missing value."""
    text = cell.strip()
    return text.casefold() in _MISSING or bool(_STARS.fullmatch(text) or _ERROR.fullmatch(text))


def number(cell: str, decimal: str) -> float | None:
    """Value of a cell; NaN for a missing value, None for another text."""
    text = _ODD.sub("", cell.strip().strip('"').strip()).replace("−", "-")
    if (_COMMA if decimal == "," else _POINT).fullmatch(text):
        return float(text.replace(",", ".") if decimal == "," else text)
    if _GROUPED[decimal].fullmatch(text):
        return float(text.replace("." if decimal == "," else ",", "").replace(",", "."))
    if is_missing(text):
        return math.nan
    if _INFINITE.fullmatch(text):
        return -math.inf if text.startswith("-") else math.inf
    return None


def numbers(cells: Sequence[str], decimal: str) -> tuple[Array, list[int]]:
    """Values (n,) of a column, NaN for a missing value and a text, and the rows with a text."""
    try:
        plain = [cell.replace(",", ".") for cell in cells] if decimal == "," else cells
        values = np.array(list(map(float, plain)), dtype=np.float64)
    except ValueError:
        pass
    else:
        doubtful = decimal == "," and any("." in cell for cell in cells)
        if not doubtful and not any("_" in cell for cell in cells):
            return values, []
    read = [number(cell, decimal) for cell in cells]
    wrong = [row for row, value in enumerate(read) if value is None]
    return np.array([math.nan if v is None else v for v in read], dtype=np.float64), wrong


_QUANTITY = re.compile(r"([+\-−]?[\d.,'\s]*\d[.,]?(?:[eE][+-]?\d+)?)\s*([^\d\s.,+\-][^\d]{0,11})")
_SHARE = 0.8
"""Least share of the cells with text that have a number and a unit; others are faults."""
_FEWEST = 5
"""Least number of different texts without a decimal sign."""


def has_unit(cell: str, decimal: str) -> bool:
    """Whether a cell is a number with its unit."""
    return _read_quantity(cell, decimal) is not None


def with_cell_units(column: FileColumn) -> FileColumn:
    """A column of text whose cells have units as one of numbers, in their most frequent unit."""
    if column.texts is None:
        return column
    for decimal in ".,":
        found = _converted(column, column.texts, decimal)
        if found is not None:
            return found
    return column


def _converted(column: FileColumn, texts: Sequence[str], decimal: str) -> FileColumn | None:
    given = [row for row, text in enumerate(texts) if not is_missing(text)]
    if not given or _read_quantity(texts[given[0]], decimal) is None:
        return None
    quantities = {row: _read_quantity(texts[row], decimal) for row in given}
    read = {row: found for row, found in quantities.items() if found is not None}
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


def _read_quantity(cell: str, decimal: str) -> tuple[float, SpelledUnit, str] | None:
    """Value, unit and spelling of a cell."""
    found = _QUANTITY.fullmatch(cell.strip())
    if found is None:
        return None
    value, unit = number(found[1], decimal), read_unit(found[2])
    if value is None or not math.isfinite(value) or unit is None:
        return None
    return value, unit, found[2].strip()
