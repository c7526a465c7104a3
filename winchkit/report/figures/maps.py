"""Residual maps as figures and as text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from winchkit.diagnosis.residuals.maps import ResidualMap, residual_maps, same_cells
from winchkit.model.variables import ANGLES
from winchkit.report.figures.plots import Residuals
from winchkit.report.html.chart import Axis, Chart, Reading, legend, reading
from winchkit.report.html.markup import Markup, element
from winchkit.report.words.numbers import Scale, percent, significant, unbroken
from winchkit.report.words.vocabulary import OUTPUT_NAMES, VARIABLE_NAMES

__all__ = [
    "map_reading",
    "map_text",
    "maps_drawn",
    "signed",
]


def map_text(drawn: ResidualMap, scale: Scale) -> str:
    """``over free length and load 93 %, most +1.2 mm at 3 m, 196 N``."""
    across, up = drawn.largest
    mean = float(drawn.mean[across, up])
    places = [
        _place(map_reading(name), float(np.mean(edges[at : at + 2])))
        for name, edges, at in zip(drawn.over, drawn.edges, (across, up), strict=True)
    ]
    names = " and ".join(_name(name) for name in drawn.over)
    share = percent(drawn.share)
    return f"over {names} {share}, most {signed(mean, scale)} at {', '.join(places)}"


def map_reading(variable: str) -> Reading:
    """Axis text of a map's variable; an angle is taken within its turn."""
    return reading(variable, within_turn=variable in ANGLES)


def _name(variable: str) -> str:
    return VARIABLE_NAMES.get(variable, variable.replace("_", " "))


def _place(how: Reading, value: float) -> str:
    return Scale(how.unit, 1.0).text(float(how.shown(value)), 2)


def signed(value: float, scale: Scale) -> str:
    """A value with its sign: ``+1.2 mm``."""
    text = scale.text(value, 2)
    return f"+{text}" if value > 0 else text


_FAINTEST = 0.04
_MOST = 2
_ABOVE_NOISE = 2.0
"""Least value of full colour as a multiple of the noise, so that values near it are pale."""


def maps_drawn(residuals: Residuals, scales: Mapping[str, Scale]) -> dict[str, list[Markup]]:
    """Maps per output: the two with the largest shares, or the first before and after a change."""
    out: dict[str, list[Markup]] = {}
    for output, scale in scales.items():
        found = [
            m for m in residual_maps(residuals.regression, residuals.before) if m.output == output
        ]
        if not found:
            continue
        noise = residuals.noise.get(output) or 0.0
        peak = max(float(np.nanmax(np.abs(found[0].mean))), _ABOVE_NOISE * noise)
        after = residuals.after
        changed = None if after is None else same_cells(residuals.regression, after, found[0])
        if changed is None:
            out[output] = [_figure("", drawn, peak, scale) for drawn in found[:_MOST]]
        else:
            states = ((", before,", found[0]), (", after,", changed))
            out[output] = [_figure(name, drawn, peak, scale) for name, drawn in states]
    return out


def _figure(state: str, drawn: ResidualMap, peak: float, scale: Scale) -> Markup:
    readings = [map_reading(name) for name in drawn.over]
    shown = [r.shown(edges) for r, edges in zip(readings, drawn.edges, strict=True)]
    output = OUTPUT_NAMES.get(drawn.output, drawn.output)
    caption = (
        f"Mean residual of the {output}{state} {map_text(drawn, scale)}. "
        "Empty without measurements."
    )
    axes = [
        Axis(r.label, float(e[0]), float(e[-1]), r.logarithmic)
        for r, e in zip(readings, shown, strict=True)
    ]
    chart = Chart(axes[0], axes[1], caption)
    cells = [
        chart.cell(
            (float(shown[0][i]), float(shown[0][i + 1])),
            (float(shown[1][j]), float(shown[1][j + 1])),
            "below" if drawn.mean[i, j] < 0 else "above",
            max(_FAINTEST, min(1.0, abs(float(drawn.mean[i, j])) / peak)),
            _said(drawn, (i, j), readings, scale),
        )
        for i, j in np.argwhere(np.isfinite(drawn.mean)).tolist()
    ]
    ends = [
        ("below", f"{signed(-peak, scale)} or less"),
        ("above", f"{signed(peak, scale)} or more"),
    ]
    words = element("figcaption", unbroken(caption))
    return element("figure", chart.draw(*cells), legend(ends), words)


def _said(
    drawn: ResidualMap, cell: tuple[int, int], readings: Sequence[Reading], scale: Scale
) -> str:
    ends = [
        f"{significant(float(r.shown(e[at])))} to {significant(float(r.shown(e[at + 1])))} {r.unit}"
        for r, e, at in zip(readings, drawn.edges, cell, strict=True)
    ]
    mean = signed(float(drawn.mean[cell]), scale)
    return f"{', '.join(part.strip() for part in ends)}: {mean} ({drawn.count[cell]} samples)"
