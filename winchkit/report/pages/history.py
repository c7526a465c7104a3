"""A profile's ledger as a page: the held-out error after every step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from winchkit.profile_edit.history import LADDER_UNITS, HistoryStep
from winchkit.quantity_text import scale_for
from winchkit.report.html.markup import Markup, element, join, section, table
from winchkit.report.html.page import page
from winchkit.report.tables import bar
from winchkit.report.words.columns import aligned
from winchkit.report.words.vocabulary import OUTPUT_NAMES, meaning

_SIGN = {"add": "+", "remove": "−"}
_ROOM = 1.05
"""Of the largest error: no bar ends at the frame."""


def ladder_html(name: str, rungs: Sequence[HistoryStep]) -> str:
    """The page; a step on other runs than the one before starts a new series."""
    title = f"{name}: history of its effects"
    if not rungs:
        return page(title, (), element("p", "No effect was added or removed."))
    caption = (
        "Held-out error, rms, after each step: measured on runs that the fit had not seen. The "
        "vertical mark is the noise at that step; bars of a column have one scale."
    )
    shown = [o for o in LADDER_UNITS if any(o in rung.after for rung in rungs)]
    head = ["step", "meaning", *(OUTPUT_NAMES[o] for o in shown)]
    steps = table(caption, head, _rows(rungs, shown), words=2)
    return page(
        title,
        (),
        section("waterfall", "Held-out error per step", element("div", steps, class_="bars")),
    )


def _rows(rungs: Sequence[HistoryStep], shown: Sequence[str]) -> list[list[str]]:
    longest = {o: _longest(rungs, o) for o in shown}
    rows: list[list[str]] = []
    runs: tuple[str, ...] = ()
    for rung in rungs:
        if rung.runs and rung.runs != runs:
            runs = rung.runs
            bars = _bars(rung.before, rung.noise, shown, longest)
            rows.append(["before", f"on {len(runs)} runs", *bars])
        step = element("code", f"{_SIGN[rung.did]} {rung.effect}")
        bars = _bars(rung.after, rung.noise, shown, longest)
        day = element("small", rung.date.isoformat())
        rows.append([step, join([meaning(rung.effect), day]), *bars])
    return rows


def _bars(
    errors: Mapping[str, float],
    noise: Mapping[str, float],
    shown: Sequence[str],
    longest: Mapping[str, float],
) -> list[Markup]:
    """A bar per output; a dash where a step has no held-out error."""
    return [
        bar(errors[o], longest[o], noise.get(o), scale_for(errors[o], LADDER_UNITS[o]))
        if o in errors
        else Markup("–")
        for o in shown
    ]


def _longest(rungs: Sequence[HistoryStep], output: str) -> float:
    sizes = [m[output] for rung in rungs for m in (rung.before, rung.after) if output in m]
    return _ROOM * max(sizes)


def ladder_text(name: str, rungs: Sequence[HistoryStep]) -> str:
    """Held-out error per step; a step on other runs than the one before starts a new series."""
    if not rungs:
        return f"{name}: no effect was added or removed"
    shown = [o for o in LADDER_UNITS if any(o in rung.after for rung in rungs)]
    rows = [["held-out error, rms", "", *(OUTPUT_NAMES[o] for o in shown)]]
    runs: tuple[str, ...] = ()
    for rung in rungs:
        if rung.runs and rung.runs != runs:
            rows.append([f"before, on {len(rung.runs)} runs", "", *_cells(rung.before, shown)])
            runs = rung.runs
        step = f"{_SIGN[rung.did]} {rung.effect}"
        rows.append([step, rung.date.isoformat(), *_cells(rung.after, shown)])
    rows.append(["noise", "", *_cells(rungs[-1].noise, shown)])
    return "\n".join([name, *aligned(rows, words=2)])


def _cells(values: Mapping[str, float], shown: Sequence[str]) -> list[str]:
    """Values of the shown outputs, a dash where a step has no held-out error."""
    return [
        scale_for(values[o], LADDER_UNITS[o]).text(values[o]) if o in values else "—" for o in shown
    ]
