"""Fenced blocks of Markdown pages, executed as a reader would type them.

| language | block |
|---|---|
| ``console`` | ``$ commands`` with their output; numbers, ``next:`` may differ |
| ``python`` | a programme |
| ``toml`` | a declaration, read by its schema, or a part of one, parsed |
| ``csv`` | a run, read by ``winchkit check``, or points of a load cell, fitted |
| ``json`` | output with ``…`` for values, parsed |
| ``usage`` | a command line with its options, compared with those of the command |
| ``text`` | a drawing or a formula |

A block with ``title="NAME"`` is a file that the reader saves under this name. A ``console`` block
with ``title="first terminal"`` continues while the blocks after it run. An HTML
comment ``<!-- not run: reason -->`` before a block keeps it from being run. A session that fails
beside a stall of this computer is skipped, with the stall (tests/conftest.py). A line of a command
of winchkit that has run in a process of its own on another page is run in this process.
"""

from __future__ import annotations

import csv
import json
import os
import re
import shlex
import signal
import subprocess
import sys
import tomllib
from collections.abc import Container, Iterable, Iterator
from contextlib import chdir
from dataclasses import dataclass
from glob import glob
from pathlib import Path

import pytest
from click.testing import CliRunner

ROOT = Path(__file__).parents[2]
_FENCE = re.compile(
    r"^(?:<!-- not run: (?P<reason>[^\n]+) -->\n)?```(?P<info>\w[^\n]*)\n(?P<text>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)
_NEXT = re.compile(r"^next: winchkit .*\n?", re.MULTILINE)
_NUMBER = re.compile(r"[-−]?\d+(?:\.\d+)?(?:e[-+−]?\d+)?")
_PLAIN = re.compile(r"winchkit ([\w-]+)[^|<>;&`$\\]*")
"""A line of winchkit without a shell's redirections; its command."""
_PATIENCE = 120
FIRST_TERMINAL = 'title="first terminal"'
LANGUAGES = ("console", "python", "toml", "csv", "json", "usage", "text")


@dataclass(frozen=True)
class Snippet:
    """One fenced block and the line on which it begins."""

    line: int
    language: str
    mark: str
    text: str
    reason: str
    """Why it is not run; empty where it is."""

    @property
    def file(self) -> str:
        """Name of the file that the block is; empty where it is none."""
        if self.mark == FIRST_TERMINAL or not self.mark.startswith('title="'):
            return ""
        return self.mark.removeprefix('title="').removesuffix('"')

    @property
    def commands(self) -> Iterator[tuple[str, str]]:
        """Each command of a session with what it prints."""
        for part in re.split(r"^\$ ", self.text, flags=re.MULTILINE)[1:]:
            command, _, output = part.partition("\n")
            yield command, output


def snippets_of(page: Path) -> list[Snippet]:
    """Fenced blocks of a page, in order."""
    text = page.read_text(encoding="utf-8")
    found = []
    for match in _FENCE.finditer(text):
        language, _, mark = match["info"].partition(" ")
        line = text.count("\n", 0, match.start()) + 1
        found.append(Snippet(line, language, mark.strip(), match["text"], match["reason"] or ""))
    return found


def said(expected: str, printed: str) -> bool:
    """Whether a page's output is what was printed, numbers, line breaks, suggestions apart."""
    if not _NEXT.search(expected):
        printed = _NEXT.sub("", printed)
    pieces = [re.escape(_plain(piece)) for piece in expected.split("...")]
    return re.fullmatch(" ?.*? ?".join(pieces), _plain(printed)) is not None


def _plain(text: str) -> str:
    return " ".join(_NUMBER.sub("#", text).split())


def options_of(command: str) -> set[str]:
    """All options of a command of winchkit."""
    import click

    from winchkit.cli import main

    found = main.get_command(click.Context(main), command)
    assert found is not None, f"winchkit has no command {command!r}"
    return {name for item in found.params for name in (*item.opts, *item.secondary_opts)}


def first_pages(pages: Iterable[Path]) -> dict[str, Path]:
    """Commands of winchkit, and the first of these pages that runs each."""
    first: dict[str, Path] = {}
    for page in pages:
        for snippet in snippets_of(page):
            for line, _ in snippet.commands if not snippet.reason else ():
                if found := _PLAIN.fullmatch(line):
                    first.setdefault(found[1], page)
    return first


class Session:
    """A reader's folder and terminals; a context manager.

    ``here``: commands of winchkit that are run in this process.
    """

    def __init__(self, folder: Path, here: Container[str] = ()) -> None:
        self._folder, self._in_this_process = folder, here
        programs = str(Path(sys.executable).parent)
        self._environment = {**os.environ, "PATH": programs + os.pathsep + os.environ["PATH"]}
        self._beside: list[subprocess.Popen[str]] = []

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *_: object) -> None:
        for process in self._beside:
            process.send_signal(signal.SIGINT)
            try:
                process.communicate(timeout=_PATIENCE)
            finally:
                process.kill()

    def run(self, snippet: Snippet) -> None:
        """Run one block and compare what it prints."""
        if snippet.reason:
            return
        if snippet.file:
            (self._folder / snippet.file).write_text(snippet.text, encoding="utf-8")
        if snippet.language == "python":
            self._checked([sys.executable, "-W", "error", "-c", snippet.text], "...")
        elif snippet.mark == FIRST_TERMINAL:
            ((command, output),) = snippet.commands
            self._begin(command, output)
        elif snippet.language == "console":
            for command, output in snippet.commands:
                self._line(command, output)
        elif snippet.language == "toml":
            self._declared(snippet)
        elif snippet.language == "csv":
            self._table(snippet)
        elif snippet.language == "json":
            json.loads(re.sub(r"\[…\]|\{…\}|…", "null", snippet.text))
        elif snippet.language == "usage":
            self._usage(snippet)

    def _declared(self, snippet: Snippet) -> None:
        """Parse a part of a TOML file; check a whole one with the files that it names."""
        table = tomllib.loads(snippet.text)
        if "kind" in table and "schema" in table:
            self._checked_file(f"block-{snippet.line}.toml", snippet.text)

    def _table(self, snippet: Snippet) -> None:
        """Check a run; fit the points of a load cell."""
        name = f"block-{snippet.line}.csv"
        if "motor_angle" in snippet.text:
            self._checked_file(name, snippet.text)
            return
        rows = list(csv.reader(snippet.text.splitlines()))
        assert {len(row) for row in rows} == {len(rows[0])}
        (self._folder / name).write_text(snippet.text, encoding="utf-8")
        self._line(f"winchkit cell calibrate --points {name} --yes", "...")

    def _checked_file(self, name: str, text: str) -> None:
        (self._folder / name).write_text(text, encoding="utf-8")
        self._line(f"winchkit check {name}", "...")

    def _usage(self, snippet: Snippet) -> None:
        """Compare the options of a usage line with those of the commands that it names."""
        for line in re.split(r"^(?=winchkit)", snippet.text, flags=re.MULTILINE):
            if not line.strip():
                continue
            commands = line.split()[1].split("|")
            known = {name for command in commands for name in options_of(command)}
            named = set(re.findall(r"(?<![\w-])--?[a-z][a-z-]*", line))
            assert named <= known, f"{line}\nnames options that {commands} lack: {named - known}"

    def _line(self, line: str, output: str) -> None:
        found = _PLAIN.fullmatch(line)
        if found is None or found[1] not in self._in_this_process:
            self._checked(["bash", "-c", line], output)
            return
        from winchkit.cli import main

        with chdir(self._folder):
            words = [w for word in shlex.split(line)[1:] for w in sorted(glob(word)) or [word]]
            result = CliRunner().invoke(main, words)
        _compare(line, result.exit_code, result.output, output)

    def _checked(self, command: list[str], output: str) -> None:
        done = self._done(command)
        _compare(command[-1], done.returncode, done.stdout, output)

    def _done(self, command: list[str]) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            command,
            cwd=self._folder,
            env=self._environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=_PATIENCE,
            check=False,
        )

    def _begin(self, command: str, output: str) -> None:
        """Start a command and read on until it has said what the page shows."""
        process = subprocess.Popen(
            ["bash", "-c", f"exec {command}"],
            cwd=self._folder,
            env=self._environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._beside.append(process)
        assert process.stdout is not None
        printed = ""
        while not (printed and said(output, printed)):
            line = process.stdout.readline()
            if not line and "ip route add" in printed:
                pytest.skip(f"no route for multicast here: {printed}")
            assert line, f"{command}\nended, having printed\n{printed}"
            printed += line


def _compare(command: str, code: int, printed: str, output: str) -> None:
    assert code == 0, f"{command}\nends with {code}:\n{printed}"
    assert said(output, printed), f"{command}\nprints\n{printed}\nand not\n{output}"
