"""Figures as SVG: for a page, in two widths with shared marks, and as a file on its own.

On a page colours are classes of the style sheet, and the marks of every panel are in a square of
1000 units whose view box the script narrows to enlarge a part. A file has px and the colours of the
light theme as attributes, which every editor of drawings reads.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from winchkit.arrays import Array
from winchkit.report.figures.figure import Figure
from winchkit.report.figures.layout import NARROW, WIDE, Area, Scene, Shape, Text, scene_of
from winchkit.report.figures.tokens import LIGHT, STYLES
from winchkit.report.html.markup import Markup, compact, element, join

_UNIT = 1000.0
"""Side of the view box of an area, whose shapes are in shares of it; 1000 is a tenth of a pixel."""
_FONT = "Inter, system-ui, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif"


def page_svg(figure: Figure, width: float = WIDE) -> Markup:
    """A figure for a page: wide and narrow, of which the style sheet shows one."""
    wide, narrow = scene_of(figure, width), scene_of(figure, NARROW)
    marks = [
        element("g", *(_shape(s, _UNIT, _UNIT) for s in area.shapes), id=f"{figure.id}-{number}")
        for number, area in enumerate(wide.areas)
    ]
    shared = element("svg", element("defs", *marks), class_="shared", aria_hidden="true")
    return join([shared, _of_page(figure, wide, "at-wide"), _of_page(figure, narrow, "at-narrow")])


def file_svg(figure: Figure) -> str:
    """A figure as an SVG file in the light theme, with its source below."""
    scene = scene_of(figure, source=True)
    drawn = element(
        "svg",
        element("title", figure.title),
        element("desc", figure.caption),
        *_body(figure, scene, styled=False),
        xmlns="http://www.w3.org/2000/svg",
        width=_px(scene.width + 24),
        height=_px(scene.height + 16),
        viewBox=f"-12 -8 {_px(scene.width + 24)} {_px(scene.height + 16)}",
        font_family=_FONT,
        role="img",
    )
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{drawn}\n'


def _of_page(figure: Figure, scene: Scene, name: str) -> Markup:
    inside = list(_body(figure, scene, styled=True))
    area = scene.areas[-1] if scene.areas else Area(0, 0, scene.width, scene.height, ())
    where = {
        "left": round(area.x, 1),
        "width": round(area.width, 1),
        "low": scene.x_range.low,
        "high": scene.x_range.high,
        "tick": round(scene.tick_y, 1),
        "top": round(scene.areas[0].y, 1) if scene.areas else 0,
        "bottom": round(area.y + area.height, 1),
    }
    return element(
        "svg",
        *inside,
        viewBox=f"0 0 {_px(scene.width)} {_px(scene.height)}",
        class_=f"drawn {name}",
        role="img",
        aria_label=f"{figure.title}. {figure.caption}",
        style=f"max-width:{(1.35 if scene.width >= WIDE else 1.1) * scene.width:.0f}px",
        data_axis=compact(where),
    )


def _body(figure: Figure, scene: Scene, *, styled: bool) -> Iterable[Markup]:
    if not styled:
        size = {"width": _px(scene.width + 24), "height": _px(scene.height + 16)}
        yield element("rect", x="-12", y="-8", **size, **_style("ground", styled=styled))
    for rule in scene.rules:
        ends = {"x1": rule.x1, "y1": rule.y1, "x2": rule.x2, "y2": rule.y2}
        own = {k: _px(v) for k, v in ends.items()}
        name = "xmark" if rule.style == "axis" and rule.x1 == rule.x2 else ""
        yield element("line", **own, **_style(rule.style, styled=styled, more=name))
    for number, area in enumerate(scene.areas):
        yield _zoomed(figure, number, area) if styled else _clipped(f"{figure.id}-{number}", area)
    for number, area in enumerate(scene.swatches):
        yield _clipped(f"{figure.id}-s{number}", area, styled=styled, clip=False)
    yield element(
        "g", *(_tick(text, at, scene, styled) for at, text in scene.x_ticks), class_="xticks"
    )
    for text in scene.texts:
        yield _text(text, styled=styled)


def _tick(text: str, at: float, scene: Scene, styled: bool) -> Markup:
    return _text(Text(at, scene.tick_y, text, "tick", "middle"), styled=styled)


def _zoomed(figure: Figure, number: int, area: Area) -> Markup:
    """A panel of a page: its marks enlarged from the unit square, clipped by its frame."""
    return element(
        "svg",
        element("use", href=f"#{figure.id}-{number}"),
        **_box(area),
        viewBox=f"0 0 {_UNIT:g} {_UNIT:g}",
        preserveAspectRatio="none",
        class_="area",
    )


def _clipped(name: str, area: Area, *, styled: bool = False, clip: bool = True) -> Markup:
    """The marks of an area in px, clipped by its frame in a figure's panel."""
    shapes = [
        _shape(s, area.width, area.height, (area.x, area.y), styled=styled) for s in area.shapes
    ]
    if not clip:
        return element("g", *shapes)
    frame = element("clipPath", element("rect", **_box(area)), id=f"clip-{name}")
    return join([frame, element("g", *shapes, clip_path=f"url(#clip-{name})")])


def _box(area: Area) -> dict[str, str]:
    return {
        "x": _px(area.x),
        "y": _px(area.y),
        "width": _px(area.width),
        "height": _px(area.height),
    }


def _shape(
    shape: Shape,
    width: float,
    height: float,
    corner: tuple[float, float] = (0.0, 0.0),
    *,
    styled: bool = True,
) -> Markup:
    """One path for all marks of a style."""
    scale, start = np.array([width, height]), np.array(corner)
    if shape.kind == "cells":
        d = "".join(_rectangle(row.reshape(2, 2) * scale + start) for row in shape.parts[0])
    elif shape.kind == "dots":
        d = "".join(f"M{_px(x)} {_px(y)}h0" for x, y in shape.parts[0] * scale + start)
    else:
        d = "".join(_polyline(part * scale + start) for part in shape.parts)
    return element("path", d=d, **_style(shape.style, styled=styled))


def _polyline(points: Array) -> str:
    """A path through points; a single point is drawn by its round cap."""
    first, *others = [f"{_px(x)} {_px(y)}" for x, y in points]
    return f"M{first}L{' '.join(others or [first])}"


def _rectangle(corners: Array) -> str:
    (a, b), (c, d) = corners
    return f"M{_px(a)} {_px(b)}L{_px(c)} {_px(b)} {_px(c)} {_px(d)} {_px(a)} {_px(d)}Z"


def _text(text: Text, *, styled: bool) -> Markup:
    place = {"x": _px(text.x), "y": _px(text.y)}
    if text.anchor != "start":
        place["text_anchor"] = text.anchor
    return element("text", text.text, **place, **_style(text.style, styled=styled))


def _style(name: str, *, styled: bool, more: str = "") -> dict[str, str]:
    if styled:
        return {"class_": f"f-{name} {more}".rstrip()}
    return {k.replace("-", "_"): v for k, v in STYLES[name].attributes(LIGHT).items()}


def _px(value: float) -> str:
    """A coordinate to a tenth."""
    return f"{value:.1f}".removesuffix(".0") if value else "0"
