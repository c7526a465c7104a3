"""Every type that a public function or class takes or returns can be imported from a face."""

from __future__ import annotations

import ast
import importlib
import inspect
import runpy
import sys
import typing
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

import pytest

from snippets import ROOT

PACKAGES = runpy.run_path(str(ROOT / "docs/make_signatures.py"))["PACKAGES"]
FACES = [importlib.import_module(name) for name in ("winchkit", *PACKAGES)]
TYPES = ("winchkit.types", "winchkit.robot.types", "winchkit.fleet.types")
PUBLIC = {
    id(getattr(face, name))
    for face in (*FACES, *map(importlib.import_module, TYPES))
    for name in face.__all__
}
WITHOUT = {"pa": ModuleType("pa")}
"""Names of packages that an extra brings."""
WITHOUT["pa"].Table = type("Table", (), {})  # type: ignore[attr-defined]


@cache
def names_of(module: ModuleType) -> dict[str, Any]:
    """What annotations of a module may name, imports for type checkers included."""
    names = {**WITHOUT, **vars(module)}
    for node in ast.walk(ast.parse(Path(str(module.__file__)).read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith("winchkit"):
            there = importlib.import_module(str(node.module))
            for alias in node.names:
                if hasattr(there, alias.name):
                    names.setdefault(alias.asname or alias.name, getattr(there, alias.name))
    return names


def types_in(annotation: Any, names: dict[str, Any]) -> Iterator[type]:
    """Classes of winchkit that an annotation names; those that are private are left out."""
    if isinstance(annotation, typing.ForwardRef):
        annotation = annotation.__forward_arg__
    if isinstance(annotation, str):
        annotation = eval(annotation, names)
    if isinstance(annotation, type) and annotation.__module__.startswith("winchkit"):
        if not annotation.__name__.startswith("_"):
            yield annotation
    elif isinstance(annotation, list | tuple) or typing.get_origin(annotation) is not None:
        of_literal = typing.get_origin(annotation) is typing.Literal
        for part in () if of_literal else getattr(annotation, "__args__", annotation):
            yield from types_in(part, names)


def functions(face: ModuleType) -> Iterator[tuple[str, FunctionType]]:
    """Public functions, and public methods, properties and constructors of public classes."""
    for name in face.__all__:
        public = getattr(face, name)
        members = {name: public}
        if isinstance(public, type):
            members = {f"{name}.{key}": value for key, value in vars(public).items()}
        for key, member in members.items():
            function = member.fget if isinstance(member, property) else member
            function = getattr(function, "__func__", function)
            is_public = "._" not in key or key.endswith("__init__")
            if isinstance(function, FunctionType) and is_public:
                yield key, function


@pytest.mark.parametrize("face", FACES, ids=lambda face: face.__name__)
def test_every_type_of_a_public_signature_can_be_imported(face: ModuleType) -> None:
    lacking = {
        f"{found.__module__}.{found.__name__} of {name}"
        for name, function in functions(face)
        if function.__module__.startswith("winchkit")
        for annotation in function.__annotations__.values()
        for found in types_in(annotation, names_of(sys.modules[function.__module__]))
        if id(found) not in PUBLIC
    }
    assert not lacking
    assert any(inspect.isfunction(function) for _, function in functions(face))
