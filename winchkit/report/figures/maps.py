"""Residual maps as figures and as text."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from winchkit.diagnosis.residuals.maps import ResidualMap, residual_maps, same_cells
from winchkit.model.variables import ANGLES
from winchkit.quantity_text import PrintScale, percent
from winchkit.report.figures.axes import AxisLabel, reading
from winchkit.report.figures.figure import Figure, GridCells, Panel
from winchkit.report.figures.layout import signed_levels
from winchkit.report.figures.residuals import Residuals
from winchkit.report.words.vocabulary import output_name, variable_name


def map_text(drawn: ResidualMap, scale: PrintScale) -> str:
    """``over free length and load 93 %, up to +1.2 mm at 3 m, 196 N``."""
    names = " and ".join(variable_name(name) for name in drawn.over)
    return f"over {names} {percent(drawn.share)}, {largest_text(drawn, scale)}"


def largest_text(drawn: ResidualMap, scale: PrintScale, *, named: bool = False) -> str:
    """``up to +1.2 mm at 3 m, 196 N``; ``named`` with the names of the variables."""
    across, up = drawn.largest
    mean = float(drawn.mean[across, up])
    places = [
        (f"{variable_name(name)} " if named else "")
        + _place(map_reading(name), float(np.mean(edges[at : at + 2])))
        for name, edges, at in zip(drawn.over, drawn.edges, (across, up), strict=True)
    ]
    return f"up to {signed(mean, scale)} at {', '.join(places)}"


def map_reading(variable: str) -> AxisLabel:
    """Axis text of a map's variable; an angle is taken within its turn."""
    return reading(variable, within_turn=variable in ANGLES)


def _place(how: AxisLabel, value: float) -> str:
    return PrintScale(how.unit, 1.0).text(float(how.shown(value)), 2)


def signed(value: float, scale: PrintScale) -> str:
    """A value with its sign: ``+1.2 mm``."""
    text = scale.text(value, 2)
    return f"+{text}" if value > 0 else text


_MOST = 2
"""Maps that a page draws; a third explains little more."""
_ABOVE_NOISE = 2.0
"""Least value of full colour as a multiple of the noise, so that values near it are pale."""


def map_figures(residuals: Residuals, scales: Mapping[str, PrintScale]) -> dict[str, list[Figure]]:
    """Maps per output: the two with the largest shares, or the first before and after a change."""
    out: dict[str, list[Figure]] = {}
    for output, scale in scales.items():
        found = [
            m for m in residual_maps(residuals.regression, residuals.before) if m.output == output
        ]
        if not found:
            continue
        noise = residuals.noise.get(output) or 0.0
        peak = max(float(np.nanmax(np.abs(found[0].mean))), _ABOVE_NOISE * noise) / scale.worth
        after = residuals.after
        changed = None if after is None else same_cells(residuals.regression, after, found[0])
        if changed is None:
            drawn = [(str(n), "", one) for n, one in enumerate(found[:_MOST], start=1)]
        else:
            drawn = [
                ("today", ", present model", found[0]),
                ("with", f", {residuals.changed}", changed),
            ]
        out[output] = [
            _figure(f"map-{output}-{name}", state, one, peak, scale=scale, source=residuals.source)
            for name, state, one in drawn
        ]
    return out


def _figure(
    name: str, state: str, drawn: ResidualMap, peak: float, *, scale: PrintScale, source: str
) -> Figure:
    readings = [map_reading(name) for name in drawn.over]
    x, y = (np.asarray(r.shown(edges)) for r, edges in zip(readings, drawn.edges, strict=True))
    output = output_name(drawn.output)
    over = " and ".join(variable_name(name) for name in drawn.over)
    cells = GridCells(
        "mean residual",
        scale.label,
        x,
        y,
        drawn.mean / scale.worth,
        signed_levels(peak),
        signed=True,
        counts=drawn.count.astype(float),
    )
    axes = [
        r.axis((float(edges[0]), float(edges[-1])))
        for r, edges in zip(readings, (x, y), strict=True)
    ]
    return Figure(
        name,
        f"Mean residual of the {output} over {over}{state}",
        f"Mean residual of the {output}{state} {map_text(drawn, scale)}. "
        "Empty without measurements; cells with a minus are negative.",
        axes[0],
        (Panel(axes[1], cells=cells),),
        source=source,
    )
