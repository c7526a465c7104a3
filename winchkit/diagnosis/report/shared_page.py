"""All winches of a recording as one page: a line for each, what they share, their own pages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from winchkit.diagnosis.report.embed import compact
from winchkit.diagnosis.report.markup import Markup, details, element, section, table
from winchkit.diagnosis.report.parts import bullets
from winchkit.diagnosis.report.shared_text import effect_text, error_rows, error_texts, winch_rows
from winchkit.diagnosis.report.shell import page
from winchkit.diagnosis.report.wording import unbroken
from winchkit.diagnosis.result import Comparison, Diagnosis
from winchkit.diagnosis.shared_effects import SharedEffect
from winchkit.diagnosis.shared_errors import SharedError

__all__ = ["shared_effects_html", "shared_errors_html"]


def shared_effects_html(
    found: Mapping[str, Diagnosis],
    shared: Sequence[SharedEffect],
    chances: Mapping[str, float],
    title: str,
    pages: Mapping[str, str],
) -> str:
    """The page over the diagnoses of all winches; ``pages`` are the names of each one's own."""
    told_of = winch_rows(found, chances)
    rows = [[_link(name, pages), verdict, unbroken(text)] for name, verdict, text in told_of]
    told = [unbroken(effect_text(one)) for one in shared]
    return page(
        title,
        (),
        section("winches", "Every winch", _table(["winch", "verdict", "what was found"], rows, 3)),
        section("shared", "What they have in common, and what not", bullets(told)),
        _as_json({"effects": [one.to_json() for one in shared], "alarms": dict(chances)}),
    )


def shared_errors_html(
    found: Mapping[str, Comparison],
    shared: Mapping[str, SharedError],
    title: str,
    pages: Mapping[str, str],
) -> str:
    """The page over the comparisons of all winches, as :func:`shared_effects_html`."""
    head, *rows = error_rows(found)
    linked = [[_link(name, pages), *cells] for name, *cells in rows]
    told = [unbroken(text) for text in error_texts(shared)]
    return page(
        title,
        (),
        section("winches", "Every winch", _table(head, linked, 1)),
        section("shared", "What the errors of all follow", bullets(told)),
        _as_json({"outputs": {name: error.to_json() for name, error in shared.items()}}),
    )


def _table(head: Sequence[str], rows: Sequence[Sequence[str]], words: int) -> Markup:
    return table("Each by itself, against the same profile.", head, rows, words=words)


def _link(name: str, pages: Mapping[str, str]) -> Markup:
    return element("a", name or "the winch", href=pages[name])


def _as_json(shared: Mapping[str, object]) -> Markup:
    return details("What is shared as JSON", element("pre", compact(shared, indent=1)))
