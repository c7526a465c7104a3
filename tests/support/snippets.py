"""Fenced blocks of Markdown pages, executed as a reader would type them.

``console`` blocks hold ``$ commands`` with what they print; ``...`` stands for anything, numbers
may differ, and so may line breaks. ``python`` blocks are programmes. A block whose language is
followed by ``first-terminal`` goes on while the blocks after it run. An HTML comment
``<!-- not run: reason -->`` before a block keeps it from being run.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

__all__ = ["ROOT", "Session", "Snippet", "said", "snippets_of"]

ROOT = Path(__file__).parents[2]
_FENCE = re.compile(
    r"^(?:<!-- not run: (?P<reason>[^\n]+) -->\n)?```(?P<info>\w[^\n]*)\n(?P<text>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)
_NUMBER = re.compile(r"[-−]?\d+(?:\.\d+)?(?:e[-+−]?\d+)?")
_PATIENCE = 120
_STALLED = ("no complete feedback", "no load cell reading", "heartbeat is gone")
"""What a bench says when this machine stood still for a moment; rightly, it stops."""
_AGAIN = 3
"""How often a command that was stopped so is given anew."""


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
    """Whether a page's output is what was printed, numbers and line breaks apart."""
    pieces = [re.escape(_plain(piece)) for piece in expected.split("...")]
    return re.fullmatch(" ?.*? ?".join(pieces), _plain(printed)) is not None


def _plain(text: str) -> str:
    return " ".join(_NUMBER.sub("#", text).split())


class Session:
    """A reader's folder and terminals; a context manager."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
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
        if snippet.language == "python":
            self._checked([sys.executable, "-W", "error", "-c", snippet.text], "...")
        elif snippet.mark == "first-terminal":
            ((command, output),) = snippet.commands
            self._begin(command, output)
        elif snippet.language == "console":
            for command, output in snippet.commands:
                self._checked(["bash", "-c", command], output)

    def _checked(self, command: list[str], output: str) -> None:
        done = self._done(command)
        for _ in range(_AGAIN):
            if done.returncode == 0 or not any(word in done.stdout for word in _STALLED):
                break
            done = self._done(command)
        assert done.returncode == 0, f"{command[-1]}\nends with {done.returncode}:\n{done.stdout}"
        assert said(output, done.stdout), f"{command[-1]}\nprints\n{done.stdout}\nand not\n{output}"

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
