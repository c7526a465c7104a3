"""Frame of every page: one file with its styles, scripts and licences, without network access."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date
from importlib.resources import files

from winchkit.report.figures.plots import OutputPlots
from winchkit.report.html.markup import Markup, element, inline

__all__ = ["page"]

_POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'"


def page(title: str, plots: Sequence[OutputPlots], *content: Markup) -> str:
    """A whole page: title, content, and the data of its plots."""
    head = element(
        "header", element("h1", title), element("p", f"winchkit, {date.today()}", class_="quiet")
    )
    drawing = _drawing(plots) if plots else []
    noscript = element("noscript", element("p", "The plots need JavaScript; the rest does not."))
    within = [head, noscript, *content] if plots else [head, *content]
    body = element("body", element("main", *within), *drawing)
    return f'<!DOCTYPE html>\n<html lang="en">{_head(title, drawn=bool(plots))}{body}</html>\n'


def _drawing(plots: Sequence[OutputPlots]) -> list[Markup]:
    """Script elements of the plots; none for a page without plots."""
    return [
        Markup(f'<script type="application/json" id="plots">{inline(_data(plots))}</script>'),
        _script("uPlot.iife.min.js"),
        _script("report.js"),
    ]


def _head(title: str, *, drawn: bool) -> Markup:
    policy = f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">'
    return element(
        "head",
        Markup('<meta charset="utf-8">'),
        Markup(policy),
        Markup('<meta name="viewport" content="width=device-width, initial-scale=1">'),
        Markup('<meta name="color-scheme" content="light dark">'),
        element("title", title),
        Markup(
            f"<!-- The plots are drawn by uPlot:\n{_asset('uPlot.LICENSE')}-->" if drawn else ""
        ),
        Markup(f"<style>{_asset('uPlot.min.css') if drawn else ''}{_asset('report.css')}</style>"),
    )


def _plot_styles() -> list[Markup]:
    return [
        Markup(f"<!-- The plots are drawn by uPlot:\n{_asset('uPlot.LICENSE')}-->"),
        Markup(f"<style>{_asset('uPlot.min.css')}</style>"),
    ]


def _script(name: str) -> Markup:
    return Markup(f"<script>{_asset(name)}</script>")


def _asset(name: str) -> str:
    """A file of the folder ``assets`` beside this module."""
    return (files("winchkit.report.html") / "assets" / name).read_text(encoding="utf-8")


def _data(plots: Sequence[OutputPlots]) -> dict[str, object]:
    both = [plot for own in plots for plot in (own.over_time, own.over_variable) if plot]
    return {plot.id: plot.data for plot in both}
