"""Maintenance report of a fleet as a page: changes over time, their dates, costs and measures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from winchkit.arrays import Array
from winchkit.fleet.diagnosis.history import FleetHistory, FleetParameter, WinchHistory
from winchkit.fleet.diagnosis.swapped_profiles import Swap
from winchkit.fleet.report.text import (
    beyond_text,
    change_text,
    day_text,
    nothing_text,
    odd_texts,
    swap_text,
)
from winchkit.quantity_text import unbroken
from winchkit.report.figures.figure import Figure, FigureAxis, FigureSeries, Panel
from winchkit.report.html.markup import Markup, element, section, table
from winchkit.report.html.page import figure_block, page
from winchkit.report.pages.parts import bullets, lead

_MOST_FIGURES = 24
"""Parameters that are drawn, most significant first; a longer page is not read."""
_SIDE = 340
"""px: width of a figure, of which a row has three."""
_HEIGHT = 120.0
"""px of its axes."""
_DAY = 86400.0
"""s."""


def fleet_history_html(
    history: FleetHistory,
    title: str,
    swapped: Sequence[Swap] = (),
    left_out: Sequence[str] = (),
) -> str:
    """The page, self-contained: a row and for the most significant a figure per change, limits, odd
    winches, exchanged profiles, and a sentence for each session or run ``left_out`` or cut
    short."""
    changed = history.changed
    drawn = sorted(changed[:_MOST_FIGURES], key=lambda pair: (pair[1].winch, pair[0].effect))
    figures = [_figure(*pair) for pair in drawn]
    winches = {winch.winch for _, winch in changed}
    tested = sum(len(parameter.winches) for parameter in history.parameters)
    rows = [
        ("Tested", f"{tested} series of estimates; false discovery rate 1 %, {history.procedure}."),
        ("Left out", _left_out(history)),
        ("Figures", _figures_text(len(changed), len(drawn))),
    ]
    headline = (
        f"{len(changed)} change{'s' * (len(changed) > 1)} in {len(winches)} "
        f"winch{'es' * (len(winches) > 1)}"
        if changed
        else "No change over time"
        if history.odd
        else nothing_text(history)
    )
    beyond = [beyond_text(*pair) for pair in history.beyond_limit if not pair[1].changed]
    differs = bool(history.odd or beyond or swapped)
    tone = "partly" if changed or differs or left_out else "adequate"
    chip = "Changes" if changed else "Differences" if differs else "No change"
    if chip == "No change" and left_out:
        chip = "Incomplete"
    blocks = [figure_block(figure, _SIDE) for figure in figures]
    over_time = element("div", *blocks, class_="pair maps output") if blocks else Markup("")
    odd = [" ".join(" ".join(odd_texts(*pair)).split()) for pair in history.odd]
    return page(
        title,
        figures,
        lead(title, chip, tone, headline, rows),
        section("changes", "Changes", _table(history)) if changed else Markup(""),
        section("time", "Estimates over time", over_time),
        section("limits", "Beyond a limit", bullets(beyond)),
        section("odd", "Winches that differ from the others", bullets(odd)),
        section("swapped", "Exchanged profiles", bullets([swap_text(swap) for swap in swapped])),
        section("left-out", "Left out or cut short", bullets(left_out)),
        headed=False,
    )


def _left_out(history: FleetHistory) -> str:
    count = history.undetermined
    return f"{count} estimates, which their runs leave open." if count else ""


def _figures_text(changes: int, drawn: int) -> str:
    return "" if changes == drawn else f"The {drawn} most significant of {changes} changes."


def _table(history: FleetHistory) -> Markup:
    head = ["winch", "cause", "parameter", "since", "costs (rms)", "do", "change", "now"]
    rows = []
    for parameter, winch in history.changed:
        text = change_text(parameter, winch)
        advice = f"{text.advice}; {text.limit}" if text.limit else text.advice
        name = element("code", f"{parameter.effect} {parameter.parameter}")
        words = [text.since, text.cost or "–", advice, text.size, text.now]
        rows.append([winch.winch, text.cause, name, *map(unbroken, words)])
    caption = "The most significant change first; ± is one standard deviation."
    return table(caption, head, rows, words=6)


def _figure(parameter: FleetParameter, winch: WinchHistory) -> Figure:
    """Estimates of the sessions, and the step or trend."""
    share = parameter.unit == "1"
    factor, unit = (100.0, "%") if share else (1.0, parameter.unit)
    series = winch.series
    start = float(series.times[0])
    fit = FigureSeries("fitted", "with", *_fitted(winch, start, factor), "line")
    points = FigureSeries(
        "sessions", "today", (series.times - start) / _DAY, factor * series.values, "points"
    )
    std = factor * float(np.median(series.stds))
    return Figure(
        f"{winch.winch}-{parameter.effect}-{parameter.parameter}".replace(" ", "-"),
        f"{winch.winch}: {parameter.effect}",
        f"{parameter.parameter}, a point per session (standard deviation {std:.2g} {unit}).",
        FigureAxis(f"days since {day_text(start)}"),
        (Panel(FigureAxis(parameter.parameter, unit), (fit, points)),),
        height=_HEIGHT,
    )


def _fitted(winch: WinchHistory, start: float, factor: float) -> tuple[Array, Array]:
    """Days and values of the fitted change."""
    change, times = winch.change, winch.series.times
    assert change is not None, "a change that was tested is there"
    ends = change.level_before, change.level
    if change.date is None:
        days, values = [times[0], times[-1]], list(ends)
    else:
        date = change.date.date
        days, values = [times[0], date, date, times[-1]], [ends[0], ends[0], ends[1], ends[1]]
    return (np.array(days) - start) / _DAY, factor * np.array(values)
