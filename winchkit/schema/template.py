"""Templates of lines of text in a device file: ``ST,{kind:2},{value:8}kg``.

``{name:8}`` is a field of eight characters, ``{name}`` one that ends where the next literal
character begins or with the line. ``{skip}`` is ignored text. ``{{`` is a brace.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from string import Formatter

from winchkit.errors import UsageError


@dataclass(frozen=True, slots=True)
class Part:
    """A piece of a template: literal text, or a field of a width (None: as long as it is)."""

    literal: str = ""
    field: str = ""
    width: int | None = None


def parts_of(template: str) -> tuple[Part, ...]:
    """Pieces of a template in order; raises UsageError with its fault."""
    try:
        pieces = list(Formatter().parse(template))
    except ValueError as error:
        raise UsageError(f"'{template}' is not a template: {error}") from error
    found: list[Part] = []
    for literal, field, width, conversion in pieces:
        if literal:
            found.append(Part(literal))
        if field is not None:
            found.append(_field(template, field, width or "", conversion))
    _refuse_doubtful(template, found)
    return tuple(found)


def length_of(parts: tuple[Part, ...]) -> int | None:
    """Characters of a line, None where a field has no width."""
    total = 0
    for part in parts:
        if part.field and part.width is None:
            return None
        total += part.width or len(part.literal)
    return total


def fields_of(parts: tuple[Part, ...], line: str) -> dict[str, str] | None:
    """Text of the fields in a line, piece by piece from the left; None where it does not fit."""
    fields: dict[str, str] = {}
    for part, after in zip(parts, (*parts[1:], None), strict=True):
        if part.literal:
            fits, length = line.startswith(part.literal), len(part.literal)
        elif part.width is not None:
            fits, length = len(line) >= part.width, part.width
        else:
            length = line.find(after.literal) if after is not None else len(line)
            fits = length > 0
        if not fits:
            return None
        if part.field:
            fields[part.field] = line[:length]
        line = line[length:]
    return None if line else fields


def _field(template: str, name: str, width: str, conversion: str | None) -> Part:
    if not name.isidentifier() or conversion:
        raise UsageError(f"'{template}': a field is written {{name}} or {{name:8}}")
    if not width:
        return Part(field=name)
    if not (width.isascii() and width.isdecimal() and int(width) > 0):
        raise UsageError(f"'{template}': the width of {{{name}}} is '{width}'; write such as 8")
    return Part(field=name, width=int(width))


def _refuse_doubtful(template: str, parts: list[Part]) -> None:
    names = [part.field for part in parts if part.field and part.field != "skip"]
    for name in names:
        if names.count(name) > 1:
            raise UsageError(f"'{template}': {{{name}}} stands twice")
    for part, after in pairwise(parts):
        if part.field and part.width is None and after.field:
            raise UsageError(
                f"'{template}': the end of {{{part.field}}} and the start of {{{after.field}}} are "
                "ambiguous; give the first a width"
            )
