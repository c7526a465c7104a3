"""A profile's ledger as a page: the held-out error after every step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from winchkit.profile_edit.history import ERROR_UNITS, HistoryStep
from winchkit.quantity_text import scale_for
from winchkit.report.html.markup import Markup, element, join, section, table
from winchkit.report.html.page import page
from winchkit.report.tables import bar
from winchkit.report.words.columns import aligned
from winchkit.report.words.vocabulary import OUTPUT_NAMES, meaning

_SIGN = {"add": "+", "remove": "−"}
_ROOM = 1.05
"""Of the largest error: no bar ends at the frame."""


def history_html(name: str, steps: Sequence[HistoryStep]) -> str:
    """The page; a step on other runs than the one before starts a new series."""
    title = f"{name}: history of its effects"
    if not steps:
        return page(title, (), element("p", "No effect was added or removed."))
    caption = (
        "Held-out error, rms, after each step: measured on runs that the fit had not seen. The "
        "vertical mark is the noise at that step; bars of a column have one scale."
    )
    shown = [o for o in ERROR_UNITS if any(o in step.after for step in steps)]
    head = ["step", "meaning", *(OUTPUT_NAMES[o] for o in shown)]
    drawn = table(caption, head, _rows(steps, shown), words=2)
    return page(
        title,
        (),
        section("waterfall", "Held-out error per step", element("div", drawn, class_="bars")),
    )


def _rows(steps: Sequence[HistoryStep], shown: Sequence[str]) -> list[list[str]]:
    longest = {o: _longest(steps, o) for o in shown}
    rows: list[list[str]] = []
    runs: tuple[str, ...] = ()
    for step in steps:
        if step.runs and step.runs != runs:
            runs = step.runs
            bars = _bars(step.before, step.noise, shown, longest)
            rows.append(["before", f"on {len(runs)} runs", *bars])
        change = element("code", f"{_SIGN[step.did]} {step.effect}")
        bars = _bars(step.after, step.noise, shown, longest)
        day = element("small", step.date.isoformat())
        rows.append([change, join([meaning(step.effect), day]), *bars])
    return rows


def _bars(
    errors: Mapping[str, float],
    noise: Mapping[str, float],
    shown: Sequence[str],
    longest: Mapping[str, float],
) -> list[Markup]:
    """A bar per output; a dash where a step has no held-out error."""
    return [
        bar(errors[o], longest[o], noise.get(o), scale_for(errors[o], ERROR_UNITS[o]))
        if o in errors
        else Markup("–")
        for o in shown
    ]


def _longest(steps: Sequence[HistoryStep], output: str) -> float:
    sizes = [m[output] for step in steps for m in (step.before, step.after) if output in m]
    return _ROOM * max(sizes)


def history_text(name: str, steps: Sequence[HistoryStep]) -> str:
    """Held-out error per step; a step on other runs than the one before starts a new series."""
    if not steps:
        return f"{name}: no effect was added or removed"
    shown = [o for o in ERROR_UNITS if any(o in step.after for step in steps)]
    rows = [["held-out error, rms", "", *(OUTPUT_NAMES[o] for o in shown)]]
    runs: tuple[str, ...] = ()
    for step in steps:
        if step.runs and step.runs != runs:
            rows.append([f"before, on {len(step.runs)} runs", "", *_cells(step.before, shown)])
            runs = step.runs
        change = f"{_SIGN[step.did]} {step.effect}"
        rows.append([change, step.date.isoformat(), *_cells(step.after, shown)])
    rows.append(["noise", "", *_cells(steps[-1].noise, shown)])
    return "\n".join([name, *aligned(rows, words=2)])


def _cells(values: Mapping[str, float], shown: Sequence[str]) -> list[str]:
    """Values of the shown outputs, a dash where a step has no held-out error."""
    return [
        scale_for(values[o], ERROR_UNITS[o]).text(values[o]) if o in values else "—" for o in shown
    ]
