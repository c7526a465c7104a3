"""Docstrings in NumPy style name the arguments that a function has."""

from __future__ import annotations

import ast
import importlib
import re
from collections.abc import Iterator
from pathlib import Path

from snippets import ROOT

_SECTION = re.compile(r"Parameters\n-+\n(.*?)(?:\n\n\w+\n-+|\Z)", re.DOTALL)


def described(docstring: str) -> list[str]:
    """Names in the section on parameters."""
    section = _SECTION.search(docstring)
    heads = [line for line in section[1].splitlines() if line[:1].strip()] if section else []
    return [name.strip(" *") for head in heads for name in head.split(" : ")[0].split(",")]


def arguments(function: ast.FunctionDef | ast.AsyncFunctionDef) -> list[str]:
    own = function.args
    every = [*own.posonlyargs, *own.args, *own.kwonlyargs, own.vararg, own.kwarg]
    return [a.arg for a in every if a is not None and a.arg not in {"self", "cls"}]


def wrong(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            names = described(ast.get_docstring(node) or "")
            if names and set(names) != set(arguments(node)):
                place = path.relative_to(ROOT).as_posix()
                yield f"{place}: {node.name}({', '.join(arguments(node))}) describes {names}"


def test_described_parameters_are_the_arguments() -> None:
    paths = sorted((ROOT / "winchkit").rglob("*.py"))
    assert not [fault for path in paths for fault in wrong(path)]


def test_parameters_of_a_docstring_are_found() -> None:
    head = "One.\n\nParameters\n----------\na, b : (n,) arrays\n    Two.\nc\n    Three."
    text = head + "\n\nReturns\n-------\nx"
    assert described(text) == ["a", "b", "c"]
    assert described("One.") == []


_REFERENCE = re.compile(r":(?:class|func|mod|meth|attr|data):`~?(winchkit\.[^`]+)`")


def resolves(name: str) -> bool:
    """Whether a dotted name is a module, or a name in one."""
    parts = name.split(".")
    for count in range(len(parts), 0, -1):
        try:
            found: object = importlib.import_module(".".join(parts[:count]))
        except ModuleNotFoundError:
            continue
        for part in parts[count:]:
            if part in getattr(found, "__annotations__", {}):
                return True
            if not hasattr(found, part):
                return False
            found = getattr(found, part)
        return True
    return False


def test_references_of_docstrings_exist() -> None:
    texts = {path: path.read_text(encoding="utf-8") for path in (ROOT / "winchkit").rglob("*.py")}
    named = {(path, name) for path, text in texts.items() for name in _REFERENCE.findall(text)}
    assert named
    missing = [f"{path.relative_to(ROOT)}: {name}" for path, name in named if not resolves(name)]
    assert not missing


def test_a_reference_that_leads_nowhere_is_recognised() -> None:
    assert resolves("winchkit.drivers.can.cia402.axis.Cia402Axis")
    assert not resolves("winchkit.drivers.can.cia402.axis.Axis")
    assert not resolves("winchkit.nowhere")
