"""Questions of ``winchkit import`` on a terminal, and the guess with the answers."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from winchkit.errors import UsageError, one_line

if TYPE_CHECKING:
    from winchkit.runs.importing.answers import Answers
    from winchkit.runs.importing.assignment import Guess, Question


def asked(guess: Guess, answers: Answers) -> tuple[Guess, Answers]:
    """Ask the open questions on the terminal, and guess again with the answers."""
    from winchkit.cli.files.import_table import tables_text
    from winchkit.runs.importing.guess import guess_columns

    if guess.questions:
        click.echo(tables_text([replace(guess, questions=())]), err=True)
    while guess.questions:
        answers = _answered(guess, answers)
        guess = guess_columns(guess.file, answers)
    return guess, answers


def _answered(guess: Guess, answers: Answers) -> Answers:
    question = guess.questions[0]
    click.echo(f"? {question.text}", err=True)
    if question.key:
        return _with_value(question, answers)
    if question.options[0].startswith("--body"):
        return replace(answers, body=_picked([o[8:-1] for o in question.options]))
    own = [option[len('--column "') : -1] for option in question.options]
    if len(own) == 1 and "[UNIT]" in own[0]:
        unit = _until("  unit", lambda text: _column(own[0].replace("[UNIT]", f"[{text}]")))
        return replace(answers, columns=(*answers.columns, unit))
    if len(own) == 1 and "FACTOR" in own[0]:
        factor = _until("  factor", lambda text: _column(own[0].replace("FACTOR", text)))
        return replace(answers, columns=(*answers.columns, factor))
    if any("COLUMN" in text for text in own):
        text = _until(f"  CHANNEL=COLUMN [UNIT] (e.g. {own[0]})", _column)
        return replace(answers, columns=(*answers.columns, text))
    return replace(answers, columns=(*answers.columns, _column(_picked(own))))


def _with_value(question: Question, answers: Answers) -> Answers:
    """Answer to a question on a field of the answers: a constant, columns, or the axis."""
    from winchkit.runs.importing.answers import STORAGE, with_options

    if question.key in STORAGE:
        return with_options(answers, [_picked(question.options)])
    example = re.sub(r'^--\S+ |"', "", question.options[0])
    value = _until(f"  {question.key.replace('_', ' ')} (e.g. {example})", question.key)
    return replace(answers, **{question.key: value})


def _column(text: str) -> Any:
    from winchkit.runs.importing.answers import read_column

    return read_column(text)


def _picked(texts: Sequence[str]) -> str:
    for number, text in enumerate(texts, start=1):
        click.echo(f"  {number}  {one_line(text)}", err=True)
    choice = click.prompt("  number", type=click.IntRange(1, len(texts)), err=True)
    return texts[int(choice) - 1]


def _until(words: str, read: str | Callable[[str], Any]) -> Any:
    """Prompt until the answer can be read."""
    from winchkit.runs.importing.answers import read_constant

    while True:
        text = click.prompt(words, err=True)
        try:
            return read_constant(read, text) if isinstance(read, str) else read(text)
        except UsageError as error:
            click.echo(f"  {error}", err=True)
