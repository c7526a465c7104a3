"""No file of winchkit imports itself by way of others, whatever the kind of import."""

import ast
from collections.abc import Iterator, Mapping
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import winchkit

ROOT = Path(winchkit.__file__).parent


def module_of(file: Path) -> str:
    """The dotted name of a file of the package."""
    parts = ("winchkit", *file.relative_to(ROOT).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imported(tree: ast.Module, modules: Mapping[str, object]) -> Iterator[str]:
    """Modules that a file imports: at its top, in functions, and under TYPE_CHECKING."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            assert node.module is not None, "imports are absolute"
            for alias in node.names:
                name = f"{node.module}.{alias.name}"
                yield name if name in modules else node.module
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


@cache
def graph() -> dict[str, set[str]]:
    """Imports between the files of winchkit, by module."""
    files = {module_of(file): file for file in sorted(ROOT.rglob("*.py"))}
    return {
        name: {
            found
            for found in imported(ast.parse(file.read_text(encoding="utf-8")), files)
            if found in files and found != name
        }
        for name, file in files.items()
    }


def first_cycle(edges: Mapping[str, set[str]]) -> list[str]:
    """One import cycle of a graph; empty where there is none."""
    try:
        TopologicalSorter(edges).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def longest_chain(edges: Mapping[str, set[str]], package: str) -> list[str]:
    """The longest chain of imports between files directly in a package's folder."""
    own = {name for name in edges if name.rpartition(".")[0] == package}
    best: dict[str, list[str]] = {}
    for name in TopologicalSorter({name: edges[name] & own for name in own}).static_order():
        best[name] = [name, *max((best[each] for each in edges[name] & own), key=len, default=[])]
    return max(best.values(), key=len, default=[])


def test_no_import_cycle_between_files() -> None:
    assert first_cycle(graph()) == []


def test_the_graph_contains_every_kind_of_import() -> None:
    edges = graph()
    assert "winchkit.bench.bench" in edges["winchkit.bench.remote.server"], "at the top of a file"
    assert "winchkit.bench.bench" in edges["winchkit.bench.remote.process"], "in a function"
    assert "winchkit.bench.bench" in edges["winchkit"], "under TYPE_CHECKING"
    assert "winchkit.catalog" in edges["winchkit.bench.hardware"], "a module from its package"


def test_a_cycle_is_found() -> None:
    assert set(first_cycle({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}})) == {"a", "b", "c"}


def test_import_chains_inside_a_folder_have_at_most_ten_files() -> None:
    packages = {name.rpartition(".")[0] for name in graph()} - {""}
    chains = [longest_chain(graph(), package) for package in sorted(packages)]
    assert not [" -> ".join(chain) for chain in chains if len(chain) > 10]
