"""A figure's SVG file read back into data by an own reader: places of the ticks give the scales."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

SVG = "{http://www.w3.org/2000/svg}"
Array = NDArray[np.float64]


@dataclass
class Drawn:
    """Texts and marks of a file, px."""

    texts: list[tuple[float, float, str, str]] = field(default_factory=list)
    """x, y, text, anchor."""
    paths: list[tuple[dict[str, str], str]] = field(default_factory=list)
    """Attributes and path data of the marks inside of panels, in order."""
    clips: list[tuple[float, float, float, float]] = field(default_factory=list)


def drawn(svg: str) -> Drawn:
    """Parse a file; it has to be well-formed XML."""
    out = Drawn()
    root = ET.fromstring(svg)
    for text in root.iter(f"{SVG}text"):
        anchor = text.get("text-anchor", "start")
        words = "".join(text.itertext())
        out.texts.append((float(text.get("x", 0)), float(text.get("y", 0)), words, anchor))
    for clip in root.iter(f"{SVG}clipPath"):
        (box,) = clip
        out.clips.append(tuple(float(box.get(k, 0)) for k in ("x", "y", "width", "height")))  # type: ignore[arg-type]
    for group in root.iter(f"{SVG}g"):
        if group.get("clip-path"):
            out.paths += [(dict(p.attrib), p.get("d", "")) for p in group.iter(f"{SVG}path")]
    return out


def number(text: str) -> float | None:
    """The number of a tick; None for other texts."""
    try:
        return float(text.replace("−", "-"))
    except ValueError:
        return None


def across(figure: Drawn) -> tuple[float, float]:
    """Slope and offset from px to values of the x axis."""
    ticks = [
        (x, v) for x, _, t, a in figure.texts if a == "middle" and (v := number(t)) is not None
    ]
    return _line(ticks)


def down(figure: Drawn, panel: int) -> tuple[float, float]:
    """The same of the y axis of a panel; labels are 4 px below their line."""
    _, top, _, height = figure.clips[panel]
    ticks = [
        (y - 4, v)
        for _, y, t, a in figure.texts
        if a == "end" and top - 1 <= y - 4 <= top + height + 1 and (v := number(t)) is not None
    ]
    return _line(ticks)


def polylines(data: str) -> list[Array]:
    """Points of every polyline of a path, px."""
    parts = [part for part in data.split("M") if part]
    return [
        np.array([float(v) for v in re.findall(r"-?[\d.]+", part)]).reshape(-1, 2) for part in parts
    ]


def _line(ticks: list[tuple[float, float]]) -> tuple[float, float]:
    assert len(ticks) >= 2
    slope, offset = np.polyfit(*np.array(ticks).T, 1)
    return float(slope), float(offset)
