"""Layout of a figure: the place of every text, rule and mark, for every output format alike.

A :class:`Scene` is in px from its upper left corner; the marks of an :class:`Area` are in its unit
square, so that a part of it can be enlarged without a new layout.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from math import floor, isfinite, log10
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.quantity_text import plain
from winchkit.report.figures.axes import Range, range_of
from winchkit.report.figures.figure import (
    Figure,
    FigureAxis,
    FigureSeries,
    GridCells,
    Panel,
    headed,
)
from winchkit.report.figures.tokens import STYLES

WIDE, NARROW = 700, 340
"""Widths of the two layouts of a page, px."""
_MARGIN_LEFT, _MARGIN_RIGHT = 50, 12
"""px beside the axes: labels of the ticks, and half of the last one."""
_TITLE, _LINE, _SWATCH = 20, 18, 22
"""px: lines of the title, of the legend, and its swatches."""
_RUNS, _HEADING, _TICKS, _GAP = 18, 18, 36, 10
"""px: names of the runs, headings, ticks with their label, and between two axes."""
_CHARACTER = 0.55
"""Mean width of a character in its height, of sans-serif fonts."""
_BOLD = 1.16
"""Width of bold text over that of regular text, of the widest usual sans-serif (DejaVu)."""
_PER_TICK_X, _PER_TICK_Y = 80, 48
"""px between two ticks at least, so that their labels do not touch."""
_SCALE_STEP = 34
"""Width of a class on the colour scale, px."""


@dataclass(frozen=True)
class Text:
    """A text at its baseline."""

    x: float
    y: float
    text: str
    style: str = "tick"
    anchor: Literal["start", "middle", "end"] = "start"


@dataclass(frozen=True)
class Rule:
    """A straight line."""

    x1: float
    y1: float
    x2: float
    y2: float
    style: str = "rule"


@dataclass(frozen=True)
class Shape:
    """Marks of one style in the unit square of their area, y downwards."""

    style: str
    kind: Literal["line", "dots", "cells"]
    parts: tuple[Array, ...]
    """A polyline each, (n, 2); for dots and cells one array: (n, 2), or (n, 4) of two corners."""


@dataclass(frozen=True)
class Area:
    """The frame of a panel with its marks, which are clipped at its edges."""

    x: float
    y: float
    width: float
    height: float
    shapes: tuple[Shape, ...]


@dataclass(frozen=True)
class Scene:
    """A whole figure with places."""

    width: float
    height: float
    rules: tuple[Rule, ...]
    areas: tuple[Area, ...]
    texts: tuple[Text, ...]
    swatches: tuple[Area, ...]
    """Samples of the styles in the legend."""
    x_range: Range
    x_ticks: tuple[tuple[float, str], ...]
    """Places in px and texts of the x axis, beside ``texts``."""
    tick_y: float


@dataclass
class _Build:
    """A scene under construction."""

    width: float
    rules: list[Rule] = field(default_factory=list)
    areas: list[Area] = field(default_factory=list)
    texts: list[Text] = field(default_factory=list)
    swatches: list[Area] = field(default_factory=list)


def scene_of(figure: Figure, width: float = WIDE, *, source: bool = False) -> Scene:
    """The layout of a figure."""
    build = _Build(width)
    left, right = _left(figure), width - _MARGIN_RIGHT
    down = _head(build, figure)
    x = range_of(figure.x, _every(figure, "x"))
    if any(mark.label for mark in figure.marks):
        down += _RUNS
    top = down
    shares = sum(panel.share for panel in figure.panels)
    for number, panel in enumerate(figure.panels):
        if panel.y.name:
            down += _HEADING
            build.texts.append(Text(left, down - 6, _heading(panel), "label"))
        height = figure.height * panel.share / shares
        _panel(build, figure, number, (left, down, right - left, height), x)
        down += height + _GAP
    bottom = down - _GAP
    _run_marks(build, figure, x, (left, right, top))
    build.rules.append(Rule(left, bottom, right, bottom, "axis"))
    ticks = _x_ticks(figure.x, x, left, right - left)
    build.rules += [Rule(at, bottom, at, bottom + 4, "axis") for at, _ in ticks]
    build.texts.append(Text(right, bottom + 31, figure.x.label, "tick", "end"))
    height = bottom + _TICKS
    height = _scale(build, figure, left, height)
    if source and figure.source:
        for line in _wrapped(figure.source, width, STYLES["source"].size):
            height += 14
            build.texts.append(Text(0, height - 2, line, "source"))
        height += 4
    return Scene(
        width,
        height,
        tuple(build.rules),
        tuple(build.areas),
        tuple(build.texts),
        tuple(build.swatches),
        x,
        tuple(ticks),
        bottom + 17,
    )


def _left(figure: Figure) -> float:
    """Left margin: that of numbers, or of the longest name on the y axis."""
    longest = max((len(t) for p in figure.panels for _, t in p.y.categories), default=0)
    return max(_MARGIN_LEFT, min(12 + _text_width("x" * longest, 12), 170))


def _heading(panel: Panel) -> str:
    text = panel.y.label
    if panel.band is not None:
        unit = f" {panel.y.unit}" if panel.y.unit else ""
        text += f"; band: noise floor ±{plain(panel.band, 3)}{unit}"
    return text


def _head(build: _Build, figure: Figure) -> float:
    """Title and legend; returns the y below them."""
    down = 0.0
    for line in _wrapped(figure.title, build.width / _BOLD, STYLES["title"].size):
        down += _TITLE
        build.texts.append(Text(0, down - 6, line, "title"))
    at, row = 0.0, down + _LINE
    entries = list(_legend(figure))
    for name, samples in entries:
        room = _SWATCH + 6 + _text_width(name, 12) + 16
        if at > 0 and at + room > build.width:
            at, row = 0.0, row + _LINE
        build.swatches.append(Area(at, row - 11, _SWATCH, 10, samples))
        build.texts.append(Text(at + _SWATCH + 6, row - 2, name, "label"))
        at += room
    return row + 4 if entries else down + 4


def _legend(figure: Figure) -> Iterator[tuple[str, tuple[Shape, ...]]]:
    """A name and the sample of its style for every distinct series."""
    across = np.array([[0.05, 0.5], [0.95, 0.5]])
    middle = np.array([[0.5, 0.5]])
    seen = set()
    for panel in figure.panels:
        for one in panel.series:
            name = one.legend or one.name
            if name and (name, one.tone, one.mark) not in seen:
                seen.add((name, one.tone, one.mark))
                dotted = one.mark in {"dots", "points"}
                yield name, _marks(one, (middle if dotted else across,))


def _marks(
    one: FigureSeries, parts: tuple[Array, ...], *, cased: bool = False
) -> tuple[Shape, ...]:
    """The shapes of a series: a mean over cells has a casing, points of ``with`` are rings."""
    style = f"{one.tone}-{one.mark}"
    if one.mark in {"line", "mean"}:
        own = Shape(style, "line", parts)
        return (Shape("casing", "line", parts), own) if cased else (own,)
    own = Shape(style, "dots", parts)
    ring = one.tone == "with" and one.mark == "points"
    return (own, Shape("inside", "dots", parts)) if ring else (own,)


def _panel(
    build: _Build,
    figure: Figure,
    number: int,
    box: tuple[float, float, float, float],
    x: Range,
) -> None:
    panel = figure.panels[number]
    left, top, width, height = box
    y = range_of(panel.y, _every(figure, "y", number))
    shapes: list[Shape] = []
    if panel.band is not None and isfinite(panel.band):
        shapes += _band(panel.band, y)
    if panel.floor is not None:
        at = x.share(panel.floor)
        shapes += [
            Shape("band", "cells", (np.array([[0.0, 0.0, at, 1.0]]),)),
            Shape("limit", "line", (np.array([[at, 0.0], [at, 1.0]]),)),
        ]
    if figure.left_out:
        shaded = [(x.share(low), 0.0, x.share(high), 1.0) for low, high in figure.left_out]
        shapes.append(Shape("band", "cells", (np.array(shaded),)))
    for at, text in _y_ticks(panel.y, y, height):
        down = top + (1 - y.share(at)) * height
        if not y.logarithmic and abs(at) < 1e-6 * (y.high - y.low):
            shapes.append(Shape("zero", "line", (_across(1 - y.share(at)),)))
        else:
            build.rules.append(Rule(left, down, left + width, down, "rule"))
        build.texts.append(Text(left - 6, down + 4, text, "tick", "end"))
    if panel.cells is not None:
        shapes += _cell_shapes(panel.cells, x, y)
    between = [np.array([[x.share(m.at), 0.0], [x.share(m.at), 1.0]]) for m in figure.marks[1:]]
    if between:
        shapes.append(Shape("run", "line", tuple(between)))
    starts = [mark.at for mark in figure.marks]
    for one in panel.series:
        shapes += _marks(one, _parts(one, x, y, starts), cased=panel.cells is not None)
    build.areas.append(Area(left, top, width, height, tuple(shapes)))


def _band(half: float, y: Range) -> list[Shape]:
    low, high = (1 - y.share(v) for v in (-half, half))
    edges = (_across(low), _across(high))
    return [
        Shape("band", "cells", (np.array([[0.0, high, 1.0, low]]),)),
        Shape("floor", "line", edges),
    ]


def _across(at: float) -> Array:
    """A horizontal line through the whole area."""
    return np.array([[0.0, at], [1.0, at]])


def _parts(one: FigureSeries, x: Range, y: Range, starts: Sequence[float]) -> tuple[Array, ...]:
    """Polylines between gaps and starts of runs, or all dots."""
    points = np.column_stack([x.shares(one.x), 1 - y.shares(one.y)])
    good = np.isfinite(points).all(axis=1)
    if one.mark in {"dots", "points"}:
        return (points[good],)
    run = np.searchsorted(np.asarray(starts), one.x, side="right")
    run = np.where(good, run, -1)
    breaks = np.flatnonzero(np.diff(run) != 0) + 1
    return tuple(
        part
        for part, there in zip(
            np.split(points, breaks), np.split(good, breaks), strict=True
        )
        if there[:1].all() and len(part)
    )  # fmt: skip


def _cell_shapes(cells: GridCells, x: Range, y: Range) -> list[Shape]:
    """Cells by class of colour; a minus on the negative ones, for print in grey."""
    classes: dict[str, list[tuple[float, float, float, float]]] = {}
    across, up = np.nonzero(np.isfinite(cells.values))
    left, right = x.shares(cells.x_edges)[across], x.shares(cells.x_edges)[across + 1]
    low, high = 1 - y.shares(cells.y_edges)[up], 1 - y.shares(cells.y_edges)[up + 1]
    names = [_class(float(v), cells) for v in cells.values[across, up]]
    for name, *corners in zip(names, left, high, right, low, strict=True):
        classes.setdefault(name, []).append((corners[0], corners[1], corners[2], corners[3]))
    shapes = [Shape(name, "cells", (np.array(own),)) for name, own in sorted(classes.items())]
    strong = [
        np.array([[(3 * a + c) / 4, (b + d) / 2], [(a + 3 * c) / 4, (b + d) / 2]])
        for name, own in classes.items()
        if name.startswith("below")
        for a, b, c, d in own
    ]
    return [*shapes, Shape("minus", "line", tuple(strong))] if strong else shapes


def _class(value: float, cells: GridCells) -> str:
    number = int(np.searchsorted(cells.levels, abs(value) * (1 + 1e-9), side="right"))
    if cells.signed:
        return f"{'below' if value < 0 else 'above'}-{number}" if number else "neutral"
    return f"density-{number - 1}"


def density_levels(most: int) -> tuple[float, ...]:
    """Lower limits of at most five classes of sample counts, round and about even in ratio."""
    if most <= 5:
        return tuple(float(n) for n in range(1, most + 1))
    for steps in ((1, 2, 5, 10, 20), (1, 3, 10, 30, 100)):
        if most < 3 * steps[-1]:
            return tuple(float(s) for s in steps if s <= most)
    ratio = 10.0 if most < 10**6 else 100.0
    return tuple(ratio**n for n in range(5) if ratio**n <= most)


def signed_levels(peak: float) -> tuple[float, float, float]:
    """Three even, round limits above zero, of which the largest is at most ``peak``."""
    if not peak > 0:
        return (1.0, 2.0, 3.0)
    third = peak / 3
    power = 10.0 ** floor(log10(third))
    step = max(
        s for s in (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0) if s * power <= third * 1.001
    )
    return tuple(float(f"{n * step * power:.6g}") for n in (1, 2, 3))  # type: ignore[return-value]


def _scale(build: _Build, figure: Figure, left: float, height: float) -> float:
    """The colour scale with its numbers; returns the height below it."""
    cells = next((p.cells for p in figure.panels if p.cells is not None), None)
    if cells is None:
        return height
    name = headed(cells.name, cells.unit)
    if cells.signed:
        count = len(cells.levels)
        styles = [f"below-{n}" for n in range(count, 0, -1)] + ["neutral"]
        styles += [f"above-{n}" for n in range(1, count + 1)]
        numbers = [f"−{plain(v)}" for v in reversed(cells.levels)]
        numbers += [f"+{plain(v)}" for v in cells.levels]
        places = range(1, 2 * count + 1)
    else:
        styles = [f"density-{n}" for n in range(len(cells.levels))]
        numbers = [f"{v:,.0f}".replace(",", "\u202f") for v in cells.levels]
        places = range(len(cells.levels))
    top = height + 6
    build.texts.append(Text(left, top + 10, name, "tick"))
    step = max(_SCALE_STEP, 8 + max(_text_width(number, 12) for number in numbers))
    at = left + _text_width(name, 12) + 12
    if at + len(styles) * step > build.width - 8:
        at, top = left, top + 18
    for n, style in enumerate(styles):
        full = np.array([[0.0, 0.0, 1.0, 1.0]])
        shape = Shape(style, "cells", (full,))
        build.swatches.append(Area(at + n * step, top, step, 12, (shape,)))
    anchor: Literal["start", "middle"] = "middle" if cells.signed else "start"
    for place, number in zip(places, numbers, strict=True):
        build.texts.append(Text(at + place * step, top + 26, number, "tick", anchor))
    return top + 32


def _run_marks(build: _Build, figure: Figure, x: Range, box: tuple[float, float, float]) -> None:
    """Labels of runs above the first panel, where there is room."""
    left, right, top = box
    width = right - left
    labelled = [m for m in figure.marks if m.label]
    free = left - 1.0
    for n, mark in enumerate(labelled):
        begin = left + x.share(mark.at) * width
        end = left + x.share(labelled[n + 1].at) * width if n + 1 < len(labelled) else right
        text = _fitting(mark.label, end - begin - 4)
        if text and begin >= free:
            build.texts.append(Text(begin + 2, top - 5, text, "run-label"))
            free = begin + _text_width(text, 12)


def _fitting(text: str, room: float) -> str:
    """Text cut to a width with an ellipsis; empty where not even three characters fit."""
    most = int(room / (12 * _CHARACTER))
    if len(text) <= most:
        return text
    return f"{text[: most - 1]}…" if most >= 4 else ""


def _x_ticks(axis: FigureAxis, x: Range, left: float, width: float) -> list[tuple[float, str]]:
    if axis.categories:
        ticks = list(axis.categories)
    elif axis.unit == "°" and axis.limits == (0.0, 360.0):
        ticks = [(float(angle), f"{angle}") for angle in range(0, 361, 90)]
    else:
        ticks = x.ticks(max(2, min(6, int(width / _PER_TICK_X))))
    inside = [(left + x.share(v) * width, t) for v, t in ticks if -1e-9 <= x.share(v) <= 1 + 1e-9]
    if x.logarithmic and len(inside) * 40 > width:
        inside = inside[:: -(-len(inside) * 40 // int(width))]
    return inside


def _y_ticks(axis: FigureAxis, y: Range, height: float) -> list[tuple[float, str]]:
    if axis.categories:
        return list(axis.categories)
    ticks = y.ticks(max(3, min(5, int(height / _PER_TICK_Y))))
    return [(v, t) for v, t in ticks if -1e-9 <= y.share(v) <= 1 + 1e-9]


def _every(figure: Figure, side: Literal["x", "y"], number: int | None = None) -> list[float]:
    """All finite values along x, or along y of one panel; only their ends."""
    panels = figure.panels if number is None else [figure.panels[number]]
    out: list[float] = []
    for panel in panels:
        every: list[NDArray[np.float64]] = [getattr(one, side) for one in panel.series]
        if panel.cells is not None:
            every.append(panel.cells.x_edges if side == "x" else panel.cells.y_edges)
        for values in every:
            good = values[np.isfinite(values)]
            if figure.x.logarithmic and side == "x":
                good = good[good > 0]
            if len(good):
                out += [float(good.min()), float(good.max())]
        if side == "y" and panel.band is not None and isfinite(panel.band):
            out += [-panel.band, panel.band]
    return out


def _text_width(text: str, size: float) -> float:
    return len(text) * size * _CHARACTER


def _wrapped(text: str, width: float, size: float) -> list[str]:
    """Lines of a text that fit a width."""
    most = max(8, int(width / (size * _CHARACTER)))
    lines: list[str] = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".strip()
        if len(longer) > most and lines[-1]:
            lines.append(word)
        else:
            lines[-1] = longer
    return [line if len(line) <= most else f"{line[: most - 1]}…" for line in lines if line]
