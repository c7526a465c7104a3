"""An import on a terminal: a table of the guess with a plot of text, and the questions."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from winchkit.errors import UsageError, one_line, some_of

if TYPE_CHECKING:
    from collections.abc import Iterable

    from winchkit.runs.importing.answers import Answers
    from winchkit.runs.importing.assignment import Assignment, Guess, Question
    from winchkit.runs.importing.table import FileColumn


def asked(guess: Guess, answers: Answers) -> tuple[Guess, Answers]:
    """Ask the open questions on the terminal, and guess again with the answers."""
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


_WIDEST = 24
"""Characters of a name or of values, so that a row fits on a usual terminal."""
_PLOT = 16
"""Characters of a plot: enough for the shape of a motion."""
_FIRST = 3
"""Values of a column that are shown: enough to see its unit and first step."""
_MOST = 4
"""Different texts of one kind from which those that differ in numbers alone are one line."""
_UNUSED = 8
"""Columns without a channel that have a line each; of more, those of one reason have one."""
_NUMBER = re.compile(r"\d[\d.e+-]*")
_HEAD = ("column", "channel", "unit", "SI of 1", "confidence", "first values", "plot", "reason")


def shortened(paths: Sequence[str]) -> str:
    """``a.csv``, ``a.csv and b.csv`` or ``5 files, a.csv to e.csv``."""
    if len(paths) < 3:
        return " and ".join(paths)
    return f"{len(paths)} files, {paths[0]} to {paths[-1]}"


def together(pairs: Iterable[tuple[str, str]]) -> list[str]:
    """A line for each different text, with its files; many that differ in numbers alone are one."""
    told = list(dict.fromkeys((one_line(path), text) for path, text in pairs))
    is_many = len({text for _, text in told}) > _MOST
    found: dict[str, list[tuple[str, str]]] = {}
    for path, text in told:
        found.setdefault(_NUMBER.sub("#", text) if is_many else text, []).append((path, text))
    lines = []
    for own in found.values():
        example = " (the numbers of the first)" if len({text for _, text in own}) > 1 else ""
        paths = shortened(list(dict.fromkeys(path for path, _ in own)))
        lines.append(f"{paths}: {own[0][1]}{example}")
    return lines


def alike(guesses: Sequence[Guess]) -> list[list[Guess]]:
    """Guesses in groups of equal columns, channels and units, in the order of the files."""
    found: dict[Any, list[Guess]] = {}
    for guess in guesses:
        columns = tuple(
            (item.source, item.channel, item.unit, item.factor, item.offset, item.confidence)
            for item in guess.assignments
        )
        key = guess.table.layout, columns, tuple(guess.table.constants.items())
        found.setdefault(key, []).append(guess)
    return list(found.values())


def tables_text(group: Sequence[Guess]) -> str:
    """The guess of files of one kind: a line per column, unused ones last, notes, and questions."""
    from winchkit.report.words.columns import aligned

    guess = group[0]
    table = guess.table
    counts = [max((len(c) for c in one.table.columns), default=0) for one in group]
    rows = str(counts[0]) if len(set(counts)) == 1 else f"{min(counts)} to {max(counts)}"
    names = shortened([one_line(one.table.path) for one in group])
    title = f"{names}: {table.layout}; {len(table.columns)} columns, {rows} rows"
    columns = {column.source: column for column in table.columns}
    ordered = sorted(guess.assignments, key=lambda item: not item.channel)
    # Without a reason nothing is decided yet: the values of a column help to answer the question.
    unused = [item for item in ordered if not item.channel and item.reason]
    few = len(unused) <= _UNUSED
    listed = [item for item in ordered if few or item.channel or not item.reason]
    lines = [_HEAD, *(_row(item, columns[item.source]) for item in listed)]
    body = aligned(lines, words=len(_HEAD))
    body += [] if few else _not_used(unused)
    constants = ", ".join(f"{one_line(k)} = {v:g}" for k, v in table.constants.items())
    notes = [f"  constants: {constants}"] if constants else []
    told = [(one.table.path, note) for one in group for note in (*one.table.notes, *one.notes)]
    asked = [
        (one.table.path, f"{question.text}: {' or '.join(question.options)}")
        for one in group
        for question in one.questions
    ]
    for mark, pairs in (("note:", told), ("?", asked)):
        notes += [f"  {mark} {line.removeprefix(f'{names}: ')}" for line in together(pairs)]
    return "\n".join([title, *body, *notes])


def _not_used(items: Sequence[Assignment]) -> list[str]:
    """A line for each reason, with the columns that it leaves out."""
    by_reason: dict[str, list[str]] = {}
    for item in items:
        by_reason.setdefault(item.reason, []).append(one_line(item.source))
    return [f"  not used, {why}: {some_of(names)}" for why, names in by_reason.items()]


def _row(item: Assignment, column: FileColumn) -> tuple[str, ...]:
    from winchkit.effects.card import sparkline

    name = one_line(item.source)
    name = name if len(name) <= _WIDEST else f"{name[: _WIDEST - 1]}…"
    first = column.texts[:_FIRST] if column.texts is not None else []
    numbers = [f"{value:.6g}" for value in column.values[:_FIRST]]
    shown = " ".join(one_line(str(text)) for text in first)[:_WIDEST] if len(first) else ""
    plot = "" if column.texts is not None else sparkline(column.values, _PLOT)
    if not item.channel:
        return name, "—", one_line(item.unit), "", "", shown or " ".join(numbers), plot, item.reason
    factor = "" if item.factor != item.factor else f"{item.factor:.6g}"
    factor += f" {item.offset:+.6g}" if item.offset else ""
    return (
        name,
        item.channel,
        one_line(item.unit) or "?",
        factor or "?",
        item.confidence if factor else "not known",
        shown or " ".join(numbers),
        plot,
        item.reason,
    )


def entry_of(guess: Guess) -> dict[str, Any]:
    """The guess of one file for JSON."""
    table = guess.table
    columns = {column.source: column for column in table.columns}
    return {
        "path": table.path,
        "layout": table.layout,
        "rows": max((len(column) for column in table.columns), default=0),
        "interval": table.interval,
        "sample_rate": guess.sample_rate,
        "axis": guess.axis or None,
        "metadata": table.metadata,
        "constants": table.constants,
        "columns": [
            {
                "source": item.source,
                "number": columns[item.source].number,
                "channel": item.channel or None,
                "unit": item.unit,
                "factor": item.factor if item.channel else None,
                "offset": item.offset if item.channel else None,
                "confidence": item.confidence,
                "reason": item.reason,
                "stored": item.stored,
                "first": list(columns[item.source].values[:_FIRST]),
            }
            for item in guess.assignments
        ],
        "questions": [
            {"text": question.text, "options": question.options} for question in guess.questions
        ],
        "notes": [*table.notes, *guess.notes],
    }
