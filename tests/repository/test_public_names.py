"""The public names of winchkit: importable, documented, typed, and used by docs and examples."""

from __future__ import annotations

import ast
import dataclasses
import importlib
import inspect
import re
import runpy
import sys
import textwrap
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import winchkit
import winchkit.fleet
import winchkit.fleet.types
import winchkit.robot
import winchkit.robot.types
import winchkit.types
from command_line import own_process
from snippets import ROOT
from winchkit.bench.recording.recorder import Recorder
from winchkit.bench.remote.client import RemoteStation
from winchkit.bench.winch import Winch

FACES = (winchkit, winchkit.robot, winchkit.fleet)
TYPES = (winchkit.types, winchkit.robot.types, winchkit.fleet.types)
NAMES = sorted(set(winchkit.__all__) - {"__version__"})
PAGE = runpy.run_path(str(ROOT / "docs/make_api.py"))
LISTED = [
    (PAGE["face_of"](title).__name__, name)
    for title, names in PAGE["SECTIONS"].items()
    for name in names
]
PAGES = sorted(
    path
    for pattern in ("*.md", "docs/**/*.md", "docs/*.py", "examples/**/*.py")
    for path in ROOT.glob(pattern)
)
HEAVY = {"numpy", "scipy", "can", "canopen", "pymodbus", "pydantic", "rich", "click", "serial"}
_IMPORT = re.compile(r"^ *from (winchkit[\w.]*) import (?:\(([^)]*)\)|(.+))$", re.MULTILINE)


@pytest.mark.parametrize("face", [*FACES, *TYPES], ids=lambda face: face.__name__)
def test_importing_a_face_stays_light_and_knows_its_names(face: ModuleType) -> None:
    name = face.__name__
    code = f"import sys, {name}; print(*dir({name})); print(*sys.modules)"
    done = own_process(sys.executable, "-c", code)
    names, modules = (set(line.split()) for line in done.stdout.splitlines())
    assert set(face.__all__) <= names
    assert not HEAVY & modules
    parts = {m for m in modules if m.startswith(("winchkit.robot.", "winchkit.fleet."))}
    assert parts <= {name}


@pytest.mark.parametrize("face", [*FACES, *TYPES], ids=lambda face: face.__name__)
def test_type_checkers_see_the_names_that_there_are(face: ModuleType) -> None:
    tree = ast.parse(Path(str(face.__file__)).read_text(encoding="utf-8"))
    (typed,) = (node for node in tree.body if isinstance(node, ast.If))
    seen = {
        alias.name: node.module
        for node in typed.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert sorted(seen) == sorted(set(face.__all__) - {"__version__"})
    for name, module in seen.items():
        assert getattr(importlib.import_module(str(module)), name) is getattr(face, name)


def test_a_wrong_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'open_becnh'"):
        _ = winchkit.open_becnh


@pytest.mark.parametrize(("face", "name"), LISTED)
def test_a_public_name_is_described_with_the_sections_that_apply(face: str, name: str) -> None:
    assert not lacking(getattr(importlib.import_module(face), name))


def lacking(public: object) -> list[str]:
    """Sections, and fields of a dataclass, that the description of a public object lacks."""
    text = inspect.getdoc(public) or ""
    if dataclasses.is_dataclass(public) and isinstance(public, type):
        return [field for field in undescribed_fields(public) if field not in text]
    if isinstance(public, type):
        has_own = "__init__" in vars(public)
        text += textwrap.dedent(public.__init__.__doc__ or "") if has_own else ""
        needed = ["Parameters"] if has_own and len(parameters(public)) > 0 else []
    else:
        assert callable(public)
        signature = inspect.signature(public)
        result = signature.return_annotation
        gives = "Yields" if str(result).startswith("Iterator") else "Returns"
        needed = ["Parameters"] * bool(signature.parameters) + [gives] * (result != "None")
    return [each for each in needed if not re.search(rf"^ *{each}\n *-+$", text, re.MULTILINE)] + (
        [] if text else ["summary"]
    )


def parameters(public: type) -> list[str]:
    return [name for name in inspect.signature(public.__init__).parameters if name != "self"]


def undescribed_fields(public: type) -> Iterator[str]:
    """Fields of a dataclass that no docstring follows."""
    (node,) = ast.parse(textwrap.dedent(inspect.getsource(public))).body
    assert isinstance(node, ast.ClassDef)
    for field, after in zip(node.body, [*node.body[1:], None], strict=True):
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name):
            described = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
            if not described:
                yield field.target.id


def test_only_public_faces_list_their_names() -> None:
    """``__all__`` is that of a package that re-exports, or of a module that is promised."""
    promised = runpy.run_path(str(ROOT / "docs/make_signatures.py"))["PACKAGES"]
    root = Path(winchkit.__file__).parent
    listed = {
        ".".join(("winchkit", *file.relative_to(root).with_suffix("").parts))
        for file in root.rglob("*.py")
        if file.name != "__init__.py" and "\n__all__" in file.read_text(encoding="utf-8")
    }
    assert listed <= {*promised, *(face.__name__ for face in TYPES)}


def test_every_package_describes_itself_and_names_its_folders() -> None:
    lacking = []
    for file in sorted(Path(winchkit.__file__).parent.rglob("__init__.py")):
        text = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""
        folders = [init.parent.name for init in file.parent.glob("*/__init__.py")]
        if file.parent != Path(winchkit.__file__).parent:
            lacking += [f"{file.parent}: {name}" for name in folders if f"``{name}``" not in text]
        if "\n\n" not in text:
            lacking.append(f"{file.parent}: one line only")
    assert not lacking


def test_functions_without_a_section_are_recognised() -> None:
    def bare(x: float) -> float:
        """One line."""
        return x

    assert lacking(bare) == ["Parameters", "Returns"]


def deep_imports(text: str) -> Iterator[tuple[str, str]]:
    """Modules below winchkit, each with a name that a text imports from there."""
    for module, grouped, listed in _IMPORT.findall(text):
        for name in (grouped or listed).split(","):
            if module != "winchkit" and name.strip():
                yield module, name.split()[0]


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_pages_and_examples_import_public_names_from_winchkit(path: Path) -> None:
    home = {
        id(getattr(face, name)): face.__name__
        for face in FACES
        for name in face.__all__
        if callable(getattr(face, name))
    }
    for module, name in deep_imports(path.read_text(encoding="utf-8")):
        found = getattr(importlib.import_module(module), name, None)
        assert home.get(id(found), module) == module, f"from {home[id(found)]} import {name}"


def test_deep_imports_are_found_in_groups_and_lists() -> None:
    text = "from winchkit.a import (\n    b,\n    c as d,\n)\n    from winchkit.e import f, g\n"
    found = [("winchkit.a", "b"), ("winchkit.a", "c"), ("winchkit.e", "f"), ("winchkit.e", "g")]
    assert list(deep_imports(text + "from winchkit import h\n")) == found


def test_the_page_of_public_names_is_up_to_date() -> None:
    assert sorted(name for face, name in LISTED if face == "winchkit") == NAMES
    fleets = [name for face, name in LISTED if face == "winchkit.fleet"]
    assert sorted(fleets) == sorted(winchkit.fleet.__all__)
    there = (ROOT / "docs/api.md").read_text(encoding="utf-8")
    assert there == PAGE["page"](), "run: python docs/make_api.py"


def test_a_name_of_a_class_stands_for_one_class() -> None:
    """``sim`` included, though it is a second implementation: a reader meets both."""
    places: dict[str, list[str]] = {}
    for path in sorted((ROOT / "winchkit").rglob("*.py")):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef):
                places.setdefault(node.name, []).append(path.relative_to(ROOT).as_posix())
    assert not {name: found for name, found in places.items() if len(found) > 1}


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


@pytest.mark.parametrize("face", FACES, ids=lambda face: face.__name__)
def test_a_file_is_written_to_path_and_an_existing_one_replaced_on_request(
    face: ModuleType,
) -> None:
    functions = [getattr(face, name) for name in face.__all__ if name != "__version__"]
    for function in filter(inspect.isfunction, functions):
        parameters = inspect.signature(function).parameters
        assert not {"out", "output", "filename"} & set(parameters), function.__name__
        writes = function.__name__.startswith("write_") or "replace" in parameters
        if writes and "folder" not in parameters:
            assert "str | Path" in str(parameters["path"].annotation), function.__name__
            assert parameters["replace"].default is False, function.__name__
        assert "Callable" not in str(parameters.get("progress", "")), function.__name__
        files = parameters.get("effect_files")
        assert files is None or "str | Path" in str(files.annotation), function.__name__
        effects = parameters.get("effects")
        assert effects is None or "Path" not in str(effects.annotation), function.__name__
