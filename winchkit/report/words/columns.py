"""Plain-text columns for a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from textwrap import wrap

from winchkit.quantity_text import unbroken

_WIDTH = 80
"""Characters of a terminal."""


def aligned(rows: Sequence[Sequence[str]], words: int = 1) -> list[str]:
    """Rows indented by two, the first ``words`` columns flush left and the others flush right."""
    if not rows:
        return []
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    lines = []
    for row in rows:
        cells = [
            cell.ljust(width) if at < words else cell.rjust(width)
            for at, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  " + "  ".join(cells).rstrip())
    return lines


def hanging(rows: Sequence[Sequence[str]], words: int = 1) -> list[str]:
    """Rows as by :func:`aligned`, with the last cell of each wrapped in its column."""
    heads = aligned([row[:-1] for row in rows], words)
    width = max((len(head) for head in heads), default=0) + 2
    return [
        line
        for head, row in zip(heads, rows, strict=True)
        for line in paragraph(row[-1], head.ljust(width), " " * width)
    ]


def entries(texts: Iterable[str]) -> list[str]:
    """Texts in lines of at most 80 characters, indented by two, and by four from the second on."""
    return [line for text in texts for line in paragraph(text, "  ", "    ")]


def joined(blocks: Iterable[Sequence[str]]) -> str:
    """Blocks of lines with an empty line between them; empty blocks are left out."""
    return "\n".join(line for block in blocks if block for line in (*block, "")).rstrip("\n")


def paragraph(text: str, first: str = "", then: str = "") -> list[str]:
    """Text in lines of at most 80 characters."""
    lines = wrap(
        unbroken(text),
        _WIDTH,
        initial_indent=first,
        subsequent_indent=then,
        break_on_hyphens=False,
        break_long_words=False,
    )
    return [line.replace("\u00a0", " ") for line in lines]
