"""Every page's commands and programmes do what the page says, and its links lead somewhere."""

from __future__ import annotations

import os
import re
import shutil
import tomllib
from pathlib import Path

import pytest

from recordings_of_others import lay_out
from snippets import (
    FIRST_TERMINAL,
    LANGUAGES,
    ROOT,
    Session,
    Snippet,
    first_pages,
    said,
    snippets_of,
)

PAGES = sorted(
    path
    for path in [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
    if "site" not in path.relative_to(ROOT).parts
)
_LINK = re.compile(r"\]\((?!\w+://)([^)\s]+)\)")
_PATH = re.compile(
    r"`((?:winchkit|devices|profiles|sim|tests|docs|examples|\.ci|benchmarks)/[\w./-]*)`"
)
_HEADING = re.compile(r"^#+ (.+)$", re.MULTILINE)


def name(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def sessions() -> list[object]:
    """Pages with something to run; those that serve or open a bench do so in real time."""
    found = []
    for page in PAGES:
        run = [s for s in snippets_of(page) if not s.reason and s.language != "text"]
        live = any(s.mark == FIRST_TERMINAL or "LiveBench(" in s.text for s in run)
        if run:
            marks = [pytest.mark.realtime] if live else []
            found.append(pytest.param(page, id=name(page), marks=marks))
    return found


FIRST = first_pages(PAGES)
"""The first page that runs each command of winchkit, there in a process of its own."""
RECORDINGS = {
    "docs/tutorial/emps.md": "emps",
    "docs/tutorial/known-effect.md": "emps",
    "docs/tutorial/cogging.md": "odrive-cogging",
    "docs/tutorial/lifting.md": "odrive-lifting",
}
"""Pages that use recordings of others, and which."""


@pytest.mark.skipif(os.name != "posix", reason="sessions are written for a POSIX shell")
@pytest.mark.parametrize("page", sessions())
def test_what_a_page_shows_is_what_happens(page: Path, tmp_path: Path) -> None:
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    if name(page) in RECORDINGS:
        lay_out(RECORDINGS[name(page)], tmp_path)
    here = {command for command, first in FIRST.items() if first != page}
    with Session(tmp_path, here) as session:
        for snippet in snippets_of(page):
            session.run(snippet)


NOT_RUN = {
    "needs a CAN adapter": "docs/commands.md",
    "needs Pinocchio": "docs/howto/own-model.md",
    "asks a person beside the winch": "docs/commands.md",
    "the answer depends on the computer": "docs/realtime.md",
    "needs the drive": "docs/howto/drive.md",
    "tests/devices/test_makers_drives.py runs it with the maker's file": "docs/howto/drive.md",
    "needs a bench with a robot": "docs/howto/robot-motion.md",
    "simulates minutes of motion, and needs a bench": "docs/howto/tracker.md",
    "simulates minutes of a robot's motion": "docs/howto/robot-motion.md",
    "needs a folder of runs over months": "docs/howto/fleet.md",
    "the checks of .ci/run": "CONTRIBUTING.md",
    "needs a CAN adapter of this computer": "docs/tutorial/bench.md",
    "tests/repository/test_wheel.py installs the wheel": "docs/howto/install.md",
}
"""Reasons for blocks that are not run, and the page of each."""


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_every_block_has_a_language_and_is_run_or_has_a_reason(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    snippets = snippets_of(page)
    assert len(re.findall(r"^```", text, re.MULTILINE)) == 2 * len(snippets)
    assert {snippet.language for snippet in snippets} <= set(LANGUAGES)
    reasons = {snippet.reason for snippet in snippets if snippet.reason}
    assert {NOT_RUN.get(reason) for reason in reasons} <= {name(page)}
    # No command or programme is an indented block, which no test would run.
    fenced = re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
    assert re.findall(r"^ {4}(?:\$|import |from \w+ import ).*", fenced, re.MULTILINE) == []


def test_no_reason_is_left_over() -> None:
    used = {snippet.reason for page in PAGES for snippet in snippets_of(page) if snippet.reason}
    assert used == set(NOT_RUN)


def test_the_readme_begins_with_the_two_commands() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    first = [line.strip() for line in text.splitlines() if line.startswith("    ")][:2]
    assert first == [
        "python3 -m venv .venv && .venv/bin/pip install -e '.[dev]' && .venv/bin/winchkit demo",
        ".venv/bin/pytest",
    ]


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_links_lead_somewhere(page: Path) -> None:
    lost = []
    for link in _LINK.findall(page.read_text(encoding="utf-8")):
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        if not target.exists() or (anchor and anchor not in anchors(target)):
            lost.append(link)
    assert not lost


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_paths_that_are_named_exist(page: Path) -> None:
    named = _PATH.findall(page.read_text(encoding="utf-8"))
    assert [path for path in named if not (ROOT / path).exists()] == []


def test_the_layers_are_those_that_are_enforced() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    layers = settings["tool"]["importlinter"]["contracts"][0]["layers"]
    drawn = "\n".join(f"    {layer.replace('winchkit.', '')}" for layer in layers)
    assert drawn in (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")


def anchors(page: Path) -> set[str]:
    headings = _HEADING.findall(page.read_text(encoding="utf-8"))
    return {re.sub(r"[^\w\- ]", "", h.lower()).replace(" ", "-") for h in headings}


def test_blocks_are_distinguished(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "# x\n```console\n$ echo a\na\n$ echo b\n```\n"
        "<!-- not run: needs a terminal -->\n```console\n$ jog\n```\n```python\n1\n```\n"
    )
    first, second, third = snippets_of(page)
    assert (first.line, list(first.commands)) == (2, [("echo a", "a\n"), ("echo b", "")])
    assert second.reason == "needs a terminal"
    assert (third.language, third.text) == ("python", "1\n")


@pytest.mark.parametrize(
    ("expected", "printed", "same"),
    [
        ("EA = 298 ± 13 kN", "EA = 301.5 ±\n  9 kN", True),
        ("a\n...\nz", "a\nb c\nz", True),
        ("a\n...", "a", True),
        ("...", "", True),
        ("a ... z", "a b", False),
        ("EXPLAINED", "UNKNOWN", False),
        ("a", "a\nb", False),
        ("", "a", False),
    ],
)
def test_outputs_are_compared_apart_from_numbers(expected: str, printed: str, same: bool) -> None:
    assert said(expected, printed) is same


@pytest.mark.parametrize("here", [(), ("effects",)], ids=["in a process", "in this process"])
def test_a_wrong_answer_of_winchkit_is_noticed(here: tuple[str, ...], tmp_path: Path) -> None:
    line = "$ winchkit effects --help\n"
    with Session(tmp_path, here) as session:
        session.run(Snippet(1, "console", "", f"{line}Usage...\n", ""))
        with pytest.raises(AssertionError, match="and not"):
            session.run(Snippet(1, "console", "", f"{line}Verdict\n", ""))
        with pytest.raises(AssertionError, match="ends with 2"):
            session.run(Snippet(1, "console", "", "$ winchkit effects --nothing\n", ""))


def test_a_wrong_page_is_noticed(tmp_path: Path) -> None:
    with Session(tmp_path) as session:
        session.run(Snippet(1, "console", "", "$ echo a\na\n", ""))
        with pytest.raises(AssertionError, match="and not"):
            session.run(Snippet(1, "console", "", "$ echo a\nb\n", ""))
        with pytest.raises(AssertionError, match="ends with 3"):
            session.run(Snippet(1, "console", "", "$ exit 3\n", ""))
        with pytest.raises(AssertionError, match="ends with 1"):
            session.run(Snippet(1, "python", "", "assert False\n", ""))
