"""Figures as files: SVG and CSV, and PNG by matplotlib (extra ``plot``)."""

from __future__ import annotations

import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from winchkit.errors import Fault, FileError, UsageError
from winchkit.report.figures.figure import Figure
from winchkit.report.figures.layout import Area, Scene, Shape, scene_of
from winchkit.report.figures.tokens import LIGHT, STYLES
from winchkit.report.html.svg import file_svg

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_POINTS_PER_INCH = 72.0
"""Of PostScript and matplotlib."""
_DPI = 192.0
"""Twice the 96 dots per inch of a screen."""
_PX = _POINTS_PER_INCH / 96.0
"""Points in a pixel of CSS, of which an inch has 96."""
_ANCHORS = {"start": "left", "middle": "center", "end": "right"}
_MARGIN = (12.0, 8.0)
"""px across and down, the padding of the page's cards."""


def require_png() -> None:
    """Raise UsageError where matplotlib, which writes PNG, is not installed."""
    try:
        import matplotlib as _  # noqa: F401
    except ImportError as error:
        raise UsageError(
            "--figures: PNG needs matplotlib; install it with pip install 'winchkit[plot]'"
        ) from error


def write_figures(figures: Iterable[Figure], folder: Path, prefix: str = "") -> list[Path]:
    """Write every figure as SVG, PNG and CSV; raises FileError."""
    written = []
    try:
        folder.mkdir(exist_ok=True)
        for figure in figures:
            stem = folder / f"{prefix}{figure.id}"
            contents = {
                ".svg": file_svg(figure).encode(),
                ".png": png(figure),
                ".csv": figure.table().csv().encode(),
            }
            for suffix, content in contents.items():
                path = stem.with_name(stem.name + suffix)
                path.write_bytes(content)
                written.append(path)
    except OSError as error:
        reason = error.strerror or error
        raise FileError(
            Fault(f"the figures cannot be written: {reason}; name another folder", str(folder))
        ) from error
    return written


def png(figure: Figure) -> bytes:
    """A figure as PNG at 192 dots per inch, in the light theme on white ground."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Canvas

    scene = scene_of(figure, source=True)
    across, down = scene.width + 2 * _MARGIN[0], scene.height + 2 * _MARGIN[1]
    canvas = Canvas(figsize=(across / 96.0, down / 96.0), dpi=_DPI, facecolor=LIGHT["surface"])
    FigureCanvasAgg(canvas)
    axes = canvas.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_xlim(-_MARGIN[0], scene.width + _MARGIN[0])
    axes.set_ylim(scene.height + _MARGIN[1], -_MARGIN[1])
    _draw(axes, scene)
    out = io.BytesIO()
    canvas.savefig(out, format="png", metadata={"Title": figure.title, "Source": figure.source})
    return out.getvalue()


def _draw(axes: Axes, scene: Scene) -> None:
    for rule in scene.rules:
        style = STYLES[rule.style]
        axes.plot(
            [rule.x1, rule.x2],
            [rule.y1, rule.y2],
            color=LIGHT[style.stroke],
            linewidth=style.width * _PX,
            zorder=1,
        )
    for area in (*scene.areas, *scene.swatches):
        for shape in area.shapes:
            _shape(axes, area, shape)
    for text in scene.texts:
        _text(axes, (text.x, text.y), text.text, text.style, text.anchor)
    for at, words in scene.x_ticks:
        _text(axes, (at, scene.tick_y), words, "tick", "middle")


def _shape(axes: Axes, area: Area, shape: Shape) -> None:
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.lines import Line2D
    from matplotlib.patches import Rectangle

    style = STYLES[shape.style]
    scale, corner = np.array([area.width, area.height]), np.array([area.x, area.y])
    frame = Rectangle((area.x, area.y), area.width, area.height, transform=axes.transData)
    if shape.kind == "cells":
        low, high = shape.parts[0][:, :2] * scale + corner, shape.parts[0][:, 2:] * scale + corner
        corners = [
            [(a, b), (c, b), (c, d), (a, d)]
            for (a, b), (c, d) in zip(low.tolist(), high.tolist(), strict=True)
        ]
        cells = PolyCollection(
            corners, facecolors=LIGHT[style.fill], alpha=style.opacity, linewidths=0, zorder=2
        )
        axes.add_collection(cells)
        cells.set_clip_path(frame)
        return
    colour = LIGHT[style.stroke]
    if shape.kind == "dots":
        points = shape.parts[0] * scale + corner
        dots = Line2D(
            points[:, 0],
            points[:, 1],
            linestyle="none",
            marker="o",
            markersize=style.width * _PX,
            markeredgewidth=0,
            color=colour,
            alpha=style.opacity,
            zorder=3,
        )
        axes.add_line(dots)
        dots.set_clip_path(frame)
        return
    lines = LineCollection(
        [part * scale + corner for part in shape.parts],
        colors=colour,
        alpha=style.opacity,
        linewidths=style.width * _PX,
        linestyles=_dashes(style.dash),
        capstyle="butt" if style.dash else "round",
        zorder=3,
    )
    axes.add_collection(lines)
    lines.set_clip_path(frame)


def _dashes(dash: str) -> str | tuple[float, Sequence[float]]:
    return (0.0, [float(part) for part in dash.split()]) if dash else "solid"


def _text(axes: Axes, place: tuple[float, float], words: str, style: str, anchor: str) -> None:
    own = STYLES[style]
    axes.text(
        *place,
        words,
        color=LIGHT[own.fill],
        fontsize=own.size * _PX,
        fontweight="bold" if own.bold else "normal",
        ha=_ANCHORS[anchor],
        va="baseline",
        parse_math=False,
        zorder=4,
    )
