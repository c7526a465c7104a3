"""Who answers the questions of a commissioning: a person at a terminal, or a file for tests."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from winchkit.bench.commissioning.record import hash_of
from winchkit.errors import Fault, FileError, NotPermitted, UsageError
from winchkit.regular_file import read_text

_YES = ("yes", "y")
YES_OR_NO = (*_YES, "no", "n")


class Dialogue(Protocol):
    """Where questions go to and answers come from."""

    source: str
    """For the record: ``typed``, or the file of answers."""

    def show(self, text: str) -> None:
        """Show a text that needs no answer."""

    def ask(self, key: str, question: str, choices: tuple[str, ...] = ()) -> str:
        """The answer to a question, one of ``choices``; ``key`` names it in a file of answers."""


class StoppedDialogue:
    """Ends another one where a stop has come: nothing is enabled but after an answer."""

    def __init__(self, dialogue: Dialogue, check: Callable[[], None]) -> None:
        """``check`` raises MotionError after a stop."""
        self.source, self.show = dialogue.source, dialogue.show
        self._ask, self._check = dialogue.ask, check

    def ask(self, key: str, question: str, choices: tuple[str, ...] = ()) -> str:
        """The other one's answer."""
        answer = self._ask(key, question, choices)
        self._check()
        return answer


class TypedAnswers:
    """Questions on a stream, answers from another."""

    source = "typed"

    def __init__(self, say: Callable[[str], None], read: Callable[[], str]) -> None:
        """``read`` returns a line with its end, and nothing when the input has ended."""
        self.show, self._read = say, read

    def ask(self, key: str, question: str, choices: tuple[str, ...] = ()) -> str:
        """Ask until one of the choices is typed; raises NotPermitted when the input ends."""
        while True:
            self.show(question)
            line = self._read()
            if not line:
                raise NotPermitted(
                    f"the input ended without an answer to: {question} Nothing was recorded."
                )
            answer = _as_offered(line.strip(), choices)
            if answer and (not choices or answer in choices):
                return answer
            if answer:
                self.show(f"'{answer}' is no answer here: type {_offered(choices)}")


class AnswerFile:
    """Answers by key from a TOML file, for tests and benches without an operator."""

    def __init__(self, path: str | Path, say: Callable[[str], None]) -> None:
        """Raise FileError for a file that cannot be used."""
        self.show = say
        found = hash_of(path)
        self.source = f"{found.path} sha256 {found.sha256}"
        self._path = str(path)
        try:
            self._tree = tomllib.loads(read_text(path))
        except (OSError, ValueError) as error:
            raise FileError(Fault(f"cannot be read as TOML: {error}", str(path))) from error

    def ask(self, key: str, question: str, choices: tuple[str, ...] = ()) -> str:
        """The answer under a dotted key; raises UsageError where there is none, or another."""
        found: object = self._tree
        for part in key.split("."):
            found = found.get(part) if isinstance(found, dict) else None
        if found is None or isinstance(found, dict):
            raise UsageError(f"{self._path}: no answer '{key}' to: {question}")
        answer = _as_offered(str(found).strip(), choices)
        if choices and answer not in choices:
            raise UsageError(
                f"{self._path}: {key} is '{answer}': write {_offered(choices)}; nothing was "
                "recorded"
            )
        self.show(f"{question} {answer}")
        return answer


def _as_offered(answer: str, choices: tuple[str, ...]) -> str:
    """An answer in the case of the choices; names are free and keep theirs."""
    return answer.casefold() if choices else answer


def _offered(choices: tuple[str, ...]) -> str:
    """The choices in words, without the short ones for yes and no."""
    return " or ".join(("yes", "no") if choices == YES_OR_NO else choices)


def agreed(answer: str) -> bool:
    """Whether an answer is yes; everything else is not."""
    return answer.casefold() in _YES


def confirm(dialogue: Dialogue, key: str, question: str) -> str:
    """An answer that is yes; raises NotPermitted for no, with the ``key`` that a file uses."""
    answer = dialogue.ask(key, f"{question} [yes/no]", YES_OR_NO)
    if agreed(answer):
        return answer
    raise NotPermitted(
        f"the answer was no: {question} Nothing was recorded. Put this right, then begin "
        f"again ({key})."
    )
