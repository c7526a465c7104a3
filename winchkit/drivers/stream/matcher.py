"""Templates of a device file as matchers of whole lines, in time linear in the line."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import NamedTuple

from winchkit.schema.template import Part

_ANY = r"[\x20-\x7e]"


class Match(NamedTuple):
    """Text of the fields by name, and how many characters stood before the frame."""

    fields: dict[str, str]
    before: int
    text: str


class Matcher:
    """One template. A field without width never holds the character that ends it."""

    def __init__(self, parts: tuple[Part, ...]) -> None:
        """``parts`` as the schema has checked them."""
        pieces = []
        for part, after in zip(parts, (*parts[1:], None), strict=True):
            pieces.append(_piece(part, after))
        self._pattern = re.compile("".join(pieces))
        self._first = parts[0].literal[:1] if parts else ""

    def match(self, line: str) -> Match | None:
        """Fit the whole line or, where the template begins with a literal, its last frame."""
        found = self._pattern.fullmatch(line)
        start = 0
        if found is None and self._first:
            start = line.rfind(self._first)
            found = self._pattern.fullmatch(line, start) if start > 0 else None
        if found is None:
            return None
        return Match(found.groupdict(), start, line[start:])


def fits(text: str, patterns: Iterable[str]) -> str | None:
    """The first pattern that a text fits; ``*`` stands for anything."""
    for pattern in patterns:
        if _fits(text, pattern.split("*")):
            return pattern
    return None


def _fits(text: str, pieces: list[str]) -> bool:
    """Greedy from the left, which is enough for stars only; linear in the text."""
    if len(pieces) == 1:
        return text == pieces[0]
    first, *middle, last = pieces
    if not text.startswith(first) or not text.endswith(last):
        return False
    at, end = len(first), len(text) - len(last)
    for piece in middle:
        at = text.find(piece, at, max(at, end))
        if at < 0:
            return False
        at += len(piece)
    return at <= end


def _piece(part: Part, after: Part | None) -> str:
    if part.literal:
        return re.escape(part.literal)
    if part.width is not None:
        inner = f"{_ANY}{{{part.width}}}"
    elif after is None:
        inner = f"{_ANY}+"
    else:
        ends = after.literal[0]
        inner = f" *[^{re.escape(ends)}\\x00-\\x1f\\x7f-\\xff]+"
    return inner if part.field == "skip" else f"(?P<{part.field}>{inner})"
