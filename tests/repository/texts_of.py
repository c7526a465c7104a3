"""Docstrings, comments and texts of Python files: everything that a person reads, no names."""

from __future__ import annotations

import io
import tokenize
from collections.abc import Iterator
from pathlib import Path

__all__ = ["texts_of"]

_TEXTS = {tokenize.COMMENT, tokenize.STRING}
if hasattr(tokenize, "FSTRING_MIDDLE"):  # Since Python 3.12 f-strings come in parts.
    _TEXTS.add(tokenize.FSTRING_MIDDLE)


def texts_of(path: Path) -> Iterator[tuple[int, str]]:
    """Line number and text of every comment and of every string of more than one word.

    A string without a space is a key, a name or a unit. Line breaks count as spaces, so that a
    phrase is found across them.
    """
    source = path.read_text(encoding="utf-8")
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type in _TEXTS:
            text = " ".join(token.string.split())
            if token.type == tokenize.COMMENT or " " in text:
                yield token.start[0], text
