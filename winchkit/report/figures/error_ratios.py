"""Error of every output over its noise, today and with the changed model, on one axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, nan

import numpy as np

from winchkit.diagnosis.results import Comparison, Diagnosis, OutputError, OutputFit
from winchkit.report.figures.figure import Figure, FigureAxis, FigureSeries, Panel
from winchkit.report.words.headline import worst_outputs
from winchkit.report.words.sentence import capital
from winchkit.report.words.vocabulary import output_name

_ROW = 30.0
"""px per output: a line of text and a bar."""
_LEAST, _MOST = 0.8, 1.3
"""Ends of the axis: below the noise, and beyond the largest ratio by this factor."""


@dataclass(frozen=True)
class _ErrorRow:
    """Errors over the noise of one row."""

    name: str
    before: float
    after: float


def error_ratios(
    outputs: Mapping[str, OutputError] | Mapping[str, OutputFit],
    *,
    extended: bool = False,
    changed: str = "with the effect",
    source: str = "",
) -> Figure | None:
    """Error over the noise of one winch; the worst output first, None where no noise is known."""
    rows = [
        row
        for name in worst_outputs(outputs)
        if (row := _row(output_name(name), outputs[name])) is not None
    ]
    if not rows:
        return None
    held = isinstance(next(iter(outputs.values())), OutputFit)
    title = f"{'Held-out error' if held else 'Error'} over the noise"
    return _figure("errors", title, rows, changed if extended else "", source)


def fleet_error_ratios(found: Mapping[str, Comparison] | Mapping[str, Diagnosis]) -> list[Figure]:
    """A figure per output with a row per winch, the output with the largest ratio first."""
    out: list[tuple[float, Figure]] = []
    for output in dict.fromkeys(name for one in found.values() for name in one.outputs):
        rows = [
            row
            for winch, one in found.items()
            if output in one.outputs
            and (row := _row(winch or "the winch", one.outputs[output], _named(one))) is not None
        ]
        if rows:
            name = output_name(output)
            extended = any(_named(one) for one in found.values())
            title = capital(f"{name}: error over the noise")
            changed = "with named effects" if extended else ""
            worst = max(row.before for row in rows)
            out.append((worst, _figure(f"errors-{output}", title, rows, changed, "")))
    return [figure for _, figure in sorted(out, key=lambda item: -item[0])]


def _named(one: Comparison | Diagnosis) -> bool:
    return isinstance(one, Diagnosis) and bool(one.steps)


def _row(name: str, output: OutputError | OutputFit, extended: bool = True) -> _ErrorRow | None:
    """Errors over the noise; None where the noise is unknown."""
    if not output.noise_rms:
        return None
    if isinstance(output, OutputFit):
        before, after = output.heldout_rms_before, output.heldout_rms_after
        return _ErrorRow(
            name, before / output.noise_rms, after / output.noise_rms if extended else nan
        )
    return _ErrorRow(name, output.rms / output.noise_rms, nan)


def _figure(name: str, title: str, rows: Sequence[_ErrorRow], changed: str, source: str) -> Figure:
    places = np.arange(float(len(rows)), 0.0, -1.0)
    today = np.array([row.before for row in rows])
    series = [FigureSeries("today", "today", today, places, "points")]
    if changed:
        then = np.array([row.after for row in rows])
        ends = np.column_stack([today, then, np.full(len(rows), np.nan)]).ravel()
        joined = FigureSeries("", "with", ends, np.repeat(places, 3), "line")
        series = [joined, *series, FigureSeries(changed, "with", then, places, "points")]
    every = [v for one in series for v in one.x.tolist() if isfinite(v)]
    least = min(_LEAST, *every) if every else _LEAST
    limits = (0.9 * least if least < _LEAST else _LEAST, max(2.0, _MOST * max(every, default=1.0)))
    named = tuple((float(at), row.name) for at, row in zip(places, rows, strict=True))
    return Figure(
        name,
        title,
        "Rms of the error over that of the noise; left of the line at 1 is noise.",
        FigureAxis("error ÷ noise", logarithmic=True, limits=limits),
        (
            Panel(
                FigureAxis("", limits=(0.4, len(rows) + 0.6), categories=named),
                tuple(series),
                floor=1.0,
            ),
        ),
        source=source,
        height=_ROW * len(rows) + 8,
    )


def present(figure: Figure | None) -> list[Figure]:
    """A figure as a list, empty for None."""
    return [] if figure is None else [figure]
