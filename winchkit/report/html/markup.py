"""HTML from data: every text is escaped unless it is markup already."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Sequence
from html import escape
from typing import Any

from winchkit.plain_json import without_nan

_SUBSCRIPT = re.compile(r"(?<=\w)_(\w+)")


class Markup(str):
    """Text that is HTML; any other text is escaped when it is inserted into a page."""

    __slots__ = ()


def element(name: str, *children: str, **attributes: str) -> Markup:
    """An element; ``class_`` and ``aria_label`` become ``class`` and ``aria-label``."""
    written = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{escape(value)}"'
        for key, value in attributes.items()
    )
    return Markup(f"<{name}{written}>{join(children)}</{name}>")


def join(children: Iterable[str]) -> Markup:
    """Children concatenated."""
    return Markup("".join(c if isinstance(c, Markup) else escape(c) for c in children))


def formula(text: str) -> Markup:
    """A formula of an effect with its subscripts: ``F_c`` is an F with the index c."""
    letters = _SUBSCRIPT.split(text)
    parts = [element("sub", part) if k % 2 else part for k, part in enumerate(letters)]
    return element("span", *parts, class_="formula")


def section(id_: str, heading: str, *children: str) -> Markup:
    """A section with its heading as accessible name; empty without content."""
    if not any(children):
        return Markup("")
    title = element("h2", heading, id=f"{id_}-heading")
    return element("section", title, *children, id=id_, aria_labelledby=f"{id_}-heading")


def folded(id_: str, heading: str, *children: str) -> Markup:
    """A section to be opened; empty without content."""
    if not any(children):
        return Markup("")
    head = element("summary", element("h2", heading, id=f"{id_}-heading"))
    return element("details", head, *children, id=id_, class_="section")


def facts(pairs: Iterable[tuple[str, str]], class_: str = "facts") -> Markup:
    """A list of names and their texts; names without a text are left out."""
    parts = [p for name, text in pairs if text for p in (element("dt", name), element("dd", text))]
    return element("dl", *parts, class_=class_)


def details(summary: str, *children: str) -> Markup:
    """A block to be opened."""
    return element("details", element("summary", summary), *children)


def table(
    caption: str, head: Sequence[str], rows: Iterable[Sequence[str]], words: int = 1
) -> Markup:
    """A table whose first ``words`` columns are text and whose others are numbers."""

    def row(cells: Sequence[str]) -> Markup:
        first = element("th", cells[0], scope="row")
        rest = [
            element("td", cell, class_="words")
            if at < words
            else element("td", cell, class_="number")
            for at, cell in enumerate(cells[1:], start=1)
        ]
        return element("tr", first, *rest)

    top = [
        element("th", name, scope="col", **({} if at < words else {"class_": "number"}))
        for at, name in enumerate(head)
    ]
    inside = element(
        "table",
        element("caption", caption),
        element("thead", element("tr", *top)),
        element("tbody", *(row(cells) for cells in rows)),
    )
    return element("div", inside, class_="wide", tabindex="0", role="group", aria_label=caption)


def compact(value: Any, indent: int | None = None) -> str:
    """JSON with null in place of numbers that are not finite."""
    separators = (",", ":") if indent is None else (",", ": ")
    plain = without_nan(value)
    return json.dumps(
        plain, ensure_ascii=False, allow_nan=False, indent=indent, separators=separators
    )


def inline(value: Any) -> str:
    """JSON for a script element, escaped so that no text in it can end the element."""
    text = compact(value)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
