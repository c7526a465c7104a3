"""Docstrings of the public interface have NumPy's sections."""

from __future__ import annotations

import ast
import dataclasses
import inspect
from collections.abc import Callable, Iterator
from typing import Any

import pytest

import winchkit
from winchkit.bench.recording.recorder import Recorder
from winchkit.bench.remote.client import RemoteStation
from winchkit.bench.winch import Winch

PUBLIC = [getattr(winchkit, name) for name in winchkit.__all__ if name != "__version__"]
CLASSES = [
    *(item for item in PUBLIC if inspect.isclass(item) and not issubclass(item, Exception)),
    *(Winch, RemoteStation, Recorder),
]
"""Public classes, and those of what a public function returns."""


def callables() -> Iterator[tuple[str, Callable[..., Any]]]:
    """Public functions and the public methods of public classes, by name."""
    yield from ((item.__name__, item) for item in PUBLIC if inspect.isfunction(item))
    for owner in CLASSES:
        bases = [base for base in owner.__mro__ if base.__module__.startswith("winchkit")]
        members = {name: item for base in reversed(bases) for name, item in vars(base).items()}
        for name, member in members.items():
            function = getattr(member, "__func__", member)
            if inspect.isfunction(function) and not name.startswith("_"):
                yield f"{owner.__name__}.{name}", function


@pytest.mark.parametrize(("name", "function"), [*callables()], ids=[n for n, _ in callables()])
def test_a_public_function_describes_its_parameters_and_its_result(
    name: str, function: Callable[..., Any]
) -> None:
    text = inspect.getdoc(function) or ""
    signature = inspect.signature(function)
    parameters = [p for p in signature.parameters if p not in ("self", "cls")]
    assert text, f"{name} has no docstring"
    if not parameters:
        return
    assert "Parameters\n----------" in text, name
    if signature.return_annotation != "None":
        assert "Returns\n-------" in text or "Yields\n------" in text, name


@pytest.mark.parametrize("owner", CLASSES, ids=lambda owner: owner.__name__)
def test_every_field_of_a_public_dataclass_is_described(owner: type) -> None:
    if not dataclasses.is_dataclass(owner):
        return
    tree = ast.parse(inspect.getsource(owner)).body[0]
    assert isinstance(tree, ast.ClassDef)
    described = set()
    for before, after in zip(tree.body, tree.body[1:], strict=False):
        if isinstance(before, ast.AnnAssign) and isinstance(before.target, ast.Name):
            is_text = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
            if is_text:
                described.add(before.target.id)
    text = inspect.getdoc(owner) or ""
    missing = [
        field.name
        for field in dataclasses.fields(owner)
        if not field.name.startswith("_") and field.name not in described | set(text.split())
    ]
    assert not missing, f"{owner.__name__}: {missing}"
