"""Numeric constants of modules, read from their source, and those of the table of a page."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

__all__ = ["Constants", "numbers_of", "table_of"]

Constants = dict[tuple[str, str], str]
"""File (relative to the package) and name of a constant, to its value as Python writes it."""
_FILE = re.compile(r"### `([\w/]+\.py)`")
_ROW = re.compile(r"\| `(\w+)` \| `([^`]+)` \| ([^|]+) \| ([^|]+) \|")


def numbers_of(package: Path) -> Constants:
    """Module-level assignments of a package whose value holds a number."""
    out: Constants = {}
    for path in sorted(package.rglob("*.py")):
        place = path.relative_to(package).as_posix()
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            out |= {(place, name): value for name, value in _assigned(node)}
    return out


def table_of(page: str) -> Constants:
    """Rows ``| `NAME` | `VALUE` | what it does | reason |`` under headings ``### `FILE` ``."""
    out: Constants = {}
    place = ""
    for line in page.splitlines():
        if heading := _FILE.fullmatch(line):
            place = heading[1]
        elif line.startswith("#"):
            place = ""
        elif place and (row := _ROW.fullmatch(line)):
            assert (place, row[1]) not in out, f"{place} {row[1]} stands in the table twice"
            out[place, row[1]] = row[2]
    return out


def _assigned(node: ast.stmt) -> Iterator[tuple[str, str]]:
    """Names and values of one assignment, those of a tuple one by one."""
    if isinstance(node, ast.Assign):
        targets, value = node.targets, node.value
    elif isinstance(node, ast.AnnAssign) and node.value is not None:
        targets, value = [node.target], node.value
    else:
        return
    for target in targets:
        pairs = [(target, value)]
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
            pairs = list(zip(target.elts, value.elts, strict=True))
        for name, own in pairs:
            if isinstance(name, ast.Name) and _numbers(own):
                yield name.id, _written(own)


def _numbers(value: ast.expr) -> bool:
    return any(
        isinstance(part, ast.Constant)
        and isinstance(part.value, int | float)
        and not isinstance(part.value, bool)
        for part in ast.walk(value)
    )


def _written(value: ast.expr) -> str:
    """The value as source; of a tuple of objects, the numbers that they are made with."""
    made = isinstance(value, ast.Tuple) and any(isinstance(e, ast.Call) for e in value.elts)
    if not made:
        return ast.unparse(value)
    numbers = [n.value for n in ast.walk(value) if isinstance(n, ast.Constant)]
    return " ".join(f"{n:g}" for n in numbers if isinstance(n, int | float))
