"""docs/methods.md and the code: every numeric constant of the diagnosis has a reason beside it."""

import ast
import re
from pathlib import Path

import pytest

from snippets import ROOT

PAGE = ROOT / "docs" / "methods.md"
_MODULE = re.compile(r"`(\w+/\w+(?:/\w+)?\.py)`")
_PARTS = ("diagnosis", "robot/diagnosis", "fleet/diagnosis")
_CITED = re.compile(
    r"([A-ZŠ][\w']+)(?:(?:, | & | and )(?:[A-Z]\. )?[A-Z][\w']+)*(?: et al\.)?,? ((?:19|20)\d\d)\b"
)


@pytest.fixture(scope="module")
def page() -> str:
    return PAGE.read_text(encoding="utf-8")


def test_every_constant_has_its_reason_in_the_line_after_it() -> None:
    """What it does, and why it has this value."""
    assert not [found for part in _PARTS for found in without_reason(ROOT / "winchkit" / part)]


def test_modules_that_the_page_names_exist(page: str) -> None:
    roots = (ROOT, ROOT / "winchkit", ROOT / "winchkit" / "diagnosis")
    named = _MODULE.findall(page)
    assert not [name for name in named if not any((root / name).is_file() for root in roots)]


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


def test_a_constant_without_a_reason_is_found_in_every_form(tmp_path: Path) -> None:
    source = tmp_path / "room" / "file.py"
    source.parent.mkdir()
    source.write_text(
        'A = 1\nB, C = 2.0, -3\nD: float = 1 / 3\n"""A third."""\nE = (1, 2)\nG = True\n'
        "H = 'x'\nI = (K(1.0), K(2))\n",
        encoding="utf-8",
    )
    found = [name for _, name in without_reason(tmp_path)]
    assert found == ["A", "B", "E", "I"]


def without_reason(package: Path) -> list[tuple[str, str]]:
    """File and first name of every module-level assignment of a number without a docstring."""
    out = []
    for path in sorted(package.rglob("*.py")):
        body = ast.parse(path.read_text(encoding="utf-8")).body
        for node, after in zip(body, [*body[1:], None], strict=True):
            name = _name_of(node)
            if name and not (isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)):
                out.append((path.relative_to(package).as_posix(), name))
    return out


def _name_of(node: ast.stmt) -> str:
    """First name of an assignment of numbers; empty for any other statement."""
    if isinstance(node, ast.Assign):
        target, value = node.targets[0], node.value
    elif isinstance(node, ast.AnnAssign) and node.value is not None:
        target, value = node.target, node.value
    else:
        return ""
    first = target.elts[0] if isinstance(target, ast.Tuple) else target
    return first.id if isinstance(first, ast.Name) and _numbers(value) else ""


def _numbers(value: ast.expr) -> bool:
    return any(
        isinstance(part, ast.Constant)
        and isinstance(part.value, int | float)
        and not isinstance(part.value, bool)
        for part in ast.walk(value)
    )
