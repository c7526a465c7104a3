"""A figure as data in the units of its axes: series, bands, cells and labels, not drawn."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from winchkit.arrays import Array
from winchkit.plain_json import significant

_DIGITS = 7
"""Significant digits of data in a file: the float of the run, without its rounding errors."""
_FORMULA_SIGNS = ("=", "+", "-", "@", "\t", "\r")


@dataclass(frozen=True)
class FigureAxis:
    """Name, unit and range of an axis."""

    name: str
    unit: str = ""
    logarithmic: bool = False
    limits: tuple[float, float] | None = None
    """Ends of the axis; None for those of the data with a margin."""
    zero: bool = False
    """Whether zero is within the range."""
    categories: tuple[tuple[float, str], ...] = ()
    """Places and names, for an axis without numbers."""

    @property
    def label(self) -> str:
        """Name with the unit: ``time [s]``."""
        return headed(self.name, self.unit)


@dataclass(frozen=True)
class FigureSeries:
    """Values over the x axis, (n,) each; NaN where there is none."""

    name: str
    tone: str
    """``measured``, ``today`` (present model), ``with`` (changed model) or ``plain``."""
    x: Array
    y: Array
    mark: Literal["line", "mean", "dots", "points"] = "line"
    """``mean`` is a thick line, ``dots`` are many samples, ``points`` a few."""
    legend: str = ""
    """Name in the legend, where series of several panels have one style; else ``name``."""


@dataclass(frozen=True)
class GridCells:
    """A value per cell of a grid: numbers of samples, or signed means."""

    name: str
    unit: str
    x_edges: Array
    """(across + 1,)"""
    y_edges: Array
    """(up + 1,)"""
    values: Array
    """(across, up); NaN for an empty cell."""
    levels: tuple[float, ...]
    """Lower limits of the classes of colour; of signed values those above zero."""
    signed: bool = False
    counts: Array | None = None
    """Samples per cell of a mean, (across, up)."""


@dataclass(frozen=True)
class Panel:
    """Series over one y axis."""

    y: FigureAxis
    series: tuple[FigureSeries, ...] = ()
    band: float | None = None
    """Half width of the noise band around zero."""
    cells: GridCells | None = None
    floor: float | None = None
    """Value of x up to which the panel is shaded: the noise floor of a ratio."""
    share: float = 1.0
    """Height relative to the other panels."""


@dataclass(frozen=True)
class RunMark:
    """Start of a run on the x axis."""

    at: float
    run: str
    label: str = ""
    """Programme and load; empty for a repeat of the run before."""


@dataclass(frozen=True)
class FigureData:
    """The data of a figure as columns; texts are references into ``words``."""

    head: tuple[str, ...]
    columns: tuple[list[float | None], ...]
    words: tuple[str, ...] = ()
    """Texts of the first column, whose values are their numbers; empty for a numeric column."""

    def to_json(self) -> dict[str, Any]:
        """Data that the page embeds."""
        return {"head": self.head, "columns": self.columns, "words": self.words}

    def csv(self) -> str:
        """Comma-separated values with one line of names; empty cells for missing values."""
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow([_plain(name) for name in self.head])
        for row in zip(*self.columns, strict=True):
            first = self.words[int(row[0] or 0)] if self.words else None
            cells = ["" if v is None else f"{v:.{_DIGITS}g}" for v in row]
            writer.writerow(cells if first is None else [_plain(first), *cells[1:]])
        return out.getvalue()


@dataclass(frozen=True)
class Figure:
    """Panels over one x axis, with title, caption and the start of every run."""

    id: str
    """Name of its files."""
    title: str
    caption: str
    """Text alternative and figure caption."""
    x: FigureAxis
    panels: tuple[Panel, ...]
    marks: tuple[RunMark, ...] = ()
    left_out: tuple[tuple[float, float], ...] = ()
    """Intervals of x that are shaded: samples that are not compared."""
    zoom: bool = False
    """Whether a part of the x axis can be selected on the page."""
    source: str = ""
    """Profile, runs and version, for files."""
    names: tuple[str, ...] = ()
    """Names of the x values 1, 2 …; empty where x is a quantity."""
    height: float = 268.0
    """Of all panels together, px."""

    def table(self) -> FigureData:
        """All data of the figure."""
        cells = next((p.cells for p in self.panels if p.cells is not None), None)
        if self.panels[0].y.categories:
            return _category_table(self)
        if cells is None:
            return _series_table(self)
        return _joined(_cells_table(self, cells), _series_table(self))


def _series_table(figure: Figure) -> FigureData:
    """Rows of every set of series with one x, in sequence; a column per series."""
    every = [(panel, one) for panel in figure.panels for one in panel.series if one.name]
    groups: dict[int, list[int]] = {}
    for index, (_, one) in enumerate(every):
        groups.setdefault(id(one.x), []).append(index)
    x = np.concatenate([np.zeros(0), *(every[own[0]][1].x for own in groups.values())])
    columns = [np.full(len(x), np.nan) for _ in every]
    at = 0
    for own in groups.values():
        end = at + len(every[own[0]][1].x)
        for index in own:
            columns[index][at:end] = every[index][1].y
        at = end
    head = [figure.x.label, *(headed(one.name, panel.y.unit) for panel, one in every)]
    data = [_numbers(column) for column in (x, *columns)]
    if figure.names:
        places: list[float | None] = [int(place) - 1 for place in x]
        return FigureData((figure.x.name, *head[1:]), (places, *data[1:]), figure.names)
    if not figure.marks:
        return FigureData(tuple(head), tuple(data))
    starts = [mark.at for mark in figure.marks]
    runs = np.maximum(np.searchsorted(starts, x, side="right") - 1, 0)
    number: list[float | None] = [int(run) for run in runs]
    return FigureData(("run", *head), (number, *data), tuple(mark.run for mark in figure.marks))


def _category_table(figure: Figure) -> FigureData:
    """A row per category of the y axis; a column per named series with its x."""
    panel = figure.panels[0]
    names = tuple(name for _, name in panel.y.categories)
    number: list[float | None] = list(range(len(names)))
    columns, head = [number], ["output"]
    for one in (one for one in panel.series if one.name):
        found = dict(zip(one.y.tolist(), one.x.tolist(), strict=True))
        values = [found.get(place, float("nan")) for place, _ in panel.y.categories]
        columns.append(_numbers(values))
        head.append(headed(f"{figure.x.name}, {one.name}", figure.x.unit))
    return FigureData(tuple(head), tuple(columns), names)


def _joined(first: FigureData, second: FigureData) -> FigureData:
    """Rows of two numeric tables below each other, with the columns of both."""
    if len(second.head) < 2:
        return first
    rows = [len(table.columns[0]) for table in (first, second)]
    before = [[*column, *([None] * rows[1])] for column in first.columns]
    after = [[*([None] * rows[0]), *column] for column in second.columns]
    return FigureData((*first.head, *second.head), (*before, *after))


def _cells_table(figure: Figure, cells: GridCells) -> FigureData:
    """A row per cell that holds a value."""
    across, up = np.nonzero(np.isfinite(cells.values))
    y = figure.panels[0].y
    head = [
        f"{axis.name}, {end} [{axis.unit or '1'}]"
        for axis in (figure.x, y)
        for end in ("from", "to")
    ]
    columns = [
        cells.x_edges[across],
        cells.x_edges[across + 1],
        cells.y_edges[up],
        cells.y_edges[up + 1],
        cells.values[across, up],
    ]
    head.append(headed(cells.name, cells.unit))
    if cells.counts is not None:
        head.append("samples")
        columns.append(cells.counts[across, up].astype(float))
    return FigureData(tuple(head), tuple(_numbers(column) for column in columns))


def headed(name: str, unit: str) -> str:
    """``name [unit]``, or the name alone without a unit."""
    return f"{name} [{unit}]" if unit else name


def _numbers(values: Sequence[float] | Array) -> list[float | None]:
    return significant(np.asarray(values, dtype=float).tolist(), _DIGITS)


def _plain(text: str) -> str:
    """Text that a spreadsheet does not read as a formula."""
    return f"'{text}" if text.startswith(_FORMULA_SIGNS) else text
