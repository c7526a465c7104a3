"""Cells of text as numbers: decimal commas, separators of thousands, missing values."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np

from winchkit.arrays import Array

_MISSING = {
    *("", "nan", "-nan", "+nan", "n/a", "na", "#n/a", "#nv", "#na", "null", "none", "-", "--"),
    *("---", "invalid", "no data", "nodata", "1.#qnan", "-1.#ind", "1.#ind", "missing", "?"),
    *("nan(ind)", "-nan(ind)", "nv", "k.a."),
}
_STARS = re.compile(r"[*#]+|-{2,}")
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
    return text.casefold() in _MISSING or bool(_STARS.fullmatch(text))


def number(cell: str, decimal: str) -> float | None:
    """Value of a cell; NaN for a missing value, None for another text.

    ``decimal``: ``.`` or ``,``.
    """
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
    """Values of a column, and the rows that have another text.

    ``decimal``: ``.`` or ``,``. Returns: ``values`` (n,): NaN for a missing value and for a text.
    """
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
