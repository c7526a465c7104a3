"""docs/methods.md lists every numeric constant of the diagnosis with its value and reason."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from snippets import ROOT

Constants = dict[tuple[str, str], str]
"""File (relative to the package) and name of a constant, to its value as Python writes it."""
_FILE = re.compile(r"### `([\w/]+\.py)`")
_ROW = re.compile(r"\| `(\w+)` \| `([^`]+)` \| ([^|]+) \| ([^|]+) \|")

PAGE = ROOT / "docs" / "methods.md"
_MODULE = re.compile(r"`(\w+/\w+\.py)`")
_CITED = re.compile(
    r"([A-ZŠ][\w']+)(?:(?:, | & | and )(?:[A-Z]\. )?[A-Z][\w']+)*(?: et al\.)?,? ((?:19|20)\d\d)\b"
)


@pytest.fixture(scope="module")
def page() -> str:
    return PAGE.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def constants() -> Constants:
    return numbers_of(ROOT / "winchkit" / "diagnosis")


def test_every_constant_is_in_the_table(page: str, constants: Constants) -> None:
    missing = sorted(constants.keys() - table_of(page).keys())
    assert not missing, "constants without a row, with what they do and their reason"


def test_no_row_is_of_a_constant_that_is_gone(page: str, constants: Constants) -> None:
    assert not sorted(table_of(page).keys() - constants.keys())


def test_values_are_those_of_the_code(page: str, constants: Constants) -> None:
    table = table_of(page)
    wrong = {key: (table[key], constants[key]) for key in table.keys() & constants.keys()}
    assert not {key: pair for key, pair in wrong.items() if pair[0] != pair[1]}


def test_modules_that_the_page_names_exist(page: str) -> None:
    package = ROOT / "winchkit" / "diagnosis"
    assert not [name for name in _MODULE.findall(page) if not (package / name).is_file()]


def test_every_citation_is_in_the_list_of_references(page: str) -> None:
    text, references = page.split("## References")
    cited = set(_CITED.findall(text))
    assert len(cited) > 40
    missing = [
        f"{name} {year}"
        for name, year in sorted(cited)
        if not re.search(rf"^- (?:von )?{re.escape(name)}, .*\({year}\)", references, re.MULTILINE)
    ]
    assert not missing


def test_numbers_of_a_module_are_found_in_every_form(tmp_path: Path) -> None:
    source = tmp_path / "room" / "file.py"
    source.parent.mkdir()
    source.write_text(
        "A = 1\nB, C = 2.0, -3\nD: float = 1 / 3\nE = (1, 2)\nF = {'a': 1.5}\nG = True\nH = 'x'\n"
        "I = (K(1.0), K(2))\n",
        encoding="utf-8",
    )
    found = numbers_of(tmp_path)
    assert {name: value for (_, name), value in found.items()} == {
        "A": "1",
        "B": "2.0",
        "C": "-3",
        "D": "1 / 3",
        "E": "(1, 2)",
        "F": "{'a': 1.5}",
        "I": "1 2",
    }


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
