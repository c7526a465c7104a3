"""A diagnosis as one self-contained page: no network, nothing beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import date
from importlib.resources import files

from winchkit.diagnosis.diagnose import Answer
from winchkit.diagnosis.report.embed import inline
from winchkit.diagnosis.report.markup import Markup, element
from winchkit.diagnosis.report.plots import OutputPlots, plots_of
from winchkit.diagnosis.report.sections import sections

__all__ = ["report_html"]

_POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'"


def report_html(
    answer: Answer,
    title: str,
    story: Sequence[str] = (),
    truth: Mapping[str, object] | None = None,
    profile: str = "",
) -> str:
    """The page of a diagnosis.

    ``story`` tells in sentences what was done; ``truth`` is what a simulated bench hid, revealed
    last; ``profile`` is the profile as the user named it, for the commands that repeat all this.
    """
    plots = plots_of(answer)
    head = element(
        "header", element("h1", title), element("p", f"winchkit, {date.today()}", class_="quiet")
    )
    noscript = element("noscript", element("p", "The plots need JavaScript; all else is here."))
    body = element(
        "body",
        element("main", head, noscript, sections(answer, plots, story, truth, profile)),
        Markup(f'<script type="application/json" id="plots">{inline(_data(plots))}</script>'),
        _script("uPlot.iife.min.js"),
        _script("report.js"),
    )
    return f'<!DOCTYPE html>\n<html lang="en">{_head(title)}{body}</html>\n'


def _head(title: str) -> Markup:
    policy = f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">'
    return element(
        "head",
        Markup('<meta charset="utf-8">'),
        Markup(policy),
        Markup('<meta name="viewport" content="width=device-width, initial-scale=1">'),
        Markup('<meta name="color-scheme" content="light dark">'),
        element("title", title),
        Markup(f"<!-- The plots are drawn by uPlot:\n{_asset('uPlot.LICENSE')}-->"),
        Markup(f"<style>{_asset('uPlot.min.css')}{_asset('report.css')}</style>"),
    )


def _script(name: str) -> Markup:
    return Markup(f"<script>{_asset(name)}</script>")


def _asset(name: str) -> str:
    """A file of the folder ``assets`` beside this module."""
    return (files("winchkit.diagnosis.report") / "assets" / name).read_text(encoding="utf-8")


def _data(plots: Sequence[OutputPlots]) -> dict[str, object]:
    both = [plot for own in plots for plot in (own.over_time, own.over_variable) if plot]
    return {plot.id: plot.data for plot in both}
