"""The repository's own rules: data without code, folders of one topic, nothing private."""

from __future__ import annotations

import ast
import re
import subprocess
from collections import Counter
from collections.abc import Iterator, Mapping
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import winchkit
from snippets import ROOT
from winchkit.cli import main

_FULLEST_FOLDER = 20
_DATA = ("devices", "profiles", "sim")
_SOURCES = sorted((ROOT / "winchkit").rglob("*.py"))
# Spelt in pieces, so that this file does not hold what it looks for.
_PRIVATE = re.compile(
    "|".join(
        [
            r"pypi\." + r"(?:org|python)",
            r"python" + r"hosted\.org",
            r"npm" + r"js\.(?:org|com)",
            r"conda\." + r"anaconda",
            r"(?<![\w./])/" + r"(?:work|root|home|Users|opt)/\w",
            r"(?<![\w./])/" + r"tmp/\w",
            r"index-" + r"url",
        ]
    )
)


def tracked() -> list[Path]:
    """Files under version control and new ones that are not ignored."""
    try:
        done = subprocess.run(
            ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"],
            cwd=ROOT,
            capture_output=True,
            text=True,
            check=True,
        )
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("not a git checkout")
    paths = [ROOT / name for name in done.stdout.split("\0") if name]
    return [path for path in paths if path.is_file()]


@pytest.mark.parametrize("folder", _DATA)
def test_data_folders_hold_no_code(folder: str) -> None:
    files = [path for path in (ROOT / folder).rglob("*") if path.is_file()]
    assert files
    assert [path for path in files if path.suffix not in {".toml", ".eds"}] == []


def test_no_folder_is_too_full() -> None:
    files = [*_SOURCES, *(ROOT / "tests").rglob("*.py")]
    counts = Counter(path.parent for path in files if path.name != "__init__.py")
    full = {str(p.relative_to(ROOT)): n for p, n in counts.items() if n > _FULLEST_FOLDER}
    assert not full, f"folders with more than {_FULLEST_FOLDER} files: {full}"


def test_every_package_says_what_it_holds() -> None:
    packages = [path for path in _SOURCES if path.name == "__init__.py"]
    texts = {
        path: ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) for path in packages
    }
    silent = [
        str(path.relative_to(ROOT)) for path, text in texts.items() if not text or "TODO" in text
    ]
    assert not silent


def test_no_file_names_registries_or_machines() -> None:
    found = []
    for path in tracked():
        try:
            text = path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue
        for number, line in enumerate(text.splitlines(), start=1):
            found += [f"{path.relative_to(ROOT)}:{number}: {m[0]}" for m in _PRIVATE.finditer(line)]
    assert not found


@pytest.mark.parametrize(
    ("text", "private"),
    [
        ("see /" + "home/me/x.toml", True),
        ('"/' + 'tmp/run.csv"', True),
        ("https://py" + "pi.org/simple", True),
        ("a share of the work/load", False),
        ("./tmp_path/x", False),
    ],
)
def test_private_things_are_recognised(text: str, private: bool) -> None:
    assert bool(_PRIVATE.search(text)) is private


def test_the_changelog_mentions_every_command() -> None:
    pages = [ROOT / "CHANGELOG.md", *(ROOT / "docs" / "changes").glob("*.md")]
    text = " ".join(page.read_text(encoding="utf-8") for page in pages)
    quoted = set(re.findall(r"[\w-]+", " ".join(re.findall(r"`([^`]+)`", text))))
    assert set(main.table) <= quoted


def test_the_top_folder_holds_what_it_needs_only() -> None:
    top = {path.relative_to(ROOT).parts[0] for path in tracked()}
    assert top <= {
        *(".ci", ".github", ".gitignore", ".pre-commit-config.yaml"),
        *("CHANGELOG.md", "CITATION.cff", "CONTRIBUTING.md", "LICENSE", "README.md"),
        *("benchmarks", "devices", "docs", "examples", "profiles", "pyproject.toml", "sim"),
        *("tests", "winchkit"),
    }


def test_the_citation_has_what_the_format_requires() -> None:
    yaml = pytest.importorskip("yaml", reason="PyYAML comes with the extra 'docs'")
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    citation = yaml.safe_load(text)
    assert {"cff-version", "message", "title", "authors"} <= set(citation)
    assert all("name" in author or "family-names" in author for author in citation["authors"])
    # The version of a citation is that of its release.
    assert "version" not in citation


def test_workflows_run_the_checks_with_pinned_actions() -> None:
    yaml = pytest.importorskip("yaml", reason="PyYAML comes with the extra 'docs'")
    steps, text = [], ""
    for path in sorted((ROOT / ".github/workflows").glob("*.yml")):
        text += path.read_text(encoding="utf-8")
        for job in yaml.safe_load(path.read_text(encoding="utf-8"))["jobs"].values():
            steps += job["steps"]
    ran = " ".join(step.get("run", "") for step in steps)
    for program in (".ci/run", "docs/make_site.py", "benchmarks/compatibility.py"):
        assert program in ran
        assert (ROOT / program).is_file()
    used = [step["uses"] for step in steps if "uses" in step]
    assert all(re.fullmatch(r"[\w-]+/[\w-]+@[0-9a-f]{40}", name) for name in used)
    assert "secrets." not in text


def test_the_ci_script_is_a_valid_program() -> None:
    done = subprocess.run(
        ["bash", "-n", str(ROOT / ".ci" / "run")], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")


PACKAGE = Path(winchkit.__file__).parent


def module_of(file: Path) -> str:
    """The dotted name of a file of the package."""
    parts = ("winchkit", *file.relative_to(PACKAGE).with_suffix("").parts)
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
    files = {module_of(file): file for file in sorted(PACKAGE.rglob("*.py"))}
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
