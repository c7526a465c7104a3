"""docs/methods.md lists every numeric constant of the diagnosis with its value and reason."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from constants_of import Constants, numbers_of, table_of
from snippets import ROOT

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
