"""Docstrings, comments and texts of Python files: everything that a person reads, no names."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

_QUOTED = re.compile(r"``[^`]*``|:\w+:`[^`]*`")
_PARAMETER = re.compile(r"^\s*\w+(, \w+)*( : .*)?$", re.MULTILINE)


@dataclass(frozen=True)
class Text:
    """One comment, docstring or string."""

    line: int
    words: str
    """With single spaces, names of parameters and in double backquotes left out."""
    about_code: bool
    """A comment or docstring; else a text of the program itself."""


def without_quotes(text: str) -> str:
    """A text with single spaces, without its parts in double backquotes."""
    return " ".join(_QUOTED.sub(" ", text).split())


def texts_of(path: Path) -> Iterator[Text]:
    """Every comment, docstring, and string of more than one word of a file.

    A string without a space is a key, a name or a unit. Line breaks count as spaces, so that a
    phrase is found across them.
    """
    source = path.read_text(encoding="utf-8")
    tree = ast.parse(source)
    alone = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            documents = id(node) in alone
            plain = _QUOTED.sub(" ", node.value)
            words = " ".join((_PARAMETER.sub(" ", plain) if documents else plain).split())
            if documents or " " in words:
                yield Text(node.lineno, words, documents)
    for token in tokenize.generate_tokens(io.StringIO(source).readline) if "#" in source else ():
        if token.type == tokenize.COMMENT:
            yield Text(token.start[0], without_quotes(token.string), True)
