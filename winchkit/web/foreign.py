"""Files of other programs: assignments of their columns, and the imported run."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from winchkit.errors import FileError, RunError, UsageError
from winchkit.plain_json import significant
from winchkit.report.figures.reduction import decimated
from winchkit.runs.importing.answers import CONSTANTS, STORAGE, read_answers
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.session import guesses_of, runs_of
from winchkit.runs.read import read_run
from winchkit.runs.run import Run
from winchkit.schema.mapping import CHANNELS
from winchkit.units import parse
from winchkit.web.words import page_text

_FIRST = 5
"""Rows of a column that the dialog shows."""
_POINTS = 120
"""Of a column's small plot."""


def is_run(path: Path) -> bool:
    """Whether a file is a run that needs no mapping."""
    try:
        read_run(path)
    except FileError:
        return False
    return True


def preview(path: Path, answers: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Columns of a file of another program with the channels that they may be.

    ``answers``: as :func:`~winchkit.runs.importing.answers.read_answers`. Raises FileError where no
    reader knows the file.
    """
    (guess,) = guesses_of([read_table(path)], read_answers(answers or {}))
    columns = {column.source: column for column in guess.table.columns}
    rows = []
    for item in guess.assignments:
        column = columns[item.source]
        texts = None if column.texts is None else list(column.texts[:_FIRST])
        values = [] if texts else significant(list(column.values[:_FIRST]), 6)
        drawn: list[float | None] = []
        if texts is None and len(column.values) > 1:
            line = column.values[decimated([column.values], _POINTS // 2)]
            drawn = significant(line.tolist(), 4)
        rows.append(
            {
                "source": item.source,
                "channel": item.channel,
                "unit": item.unit,
                "confidence": item.confidence if item.channel else "",
                "reason": page_text(item.reason),
                "first": texts or values,
                "plot": drawn,
            }
        )
    return {
        "layout": guess.table.layout,
        "rows": max((len(column) for column in guess.table.columns), default=0),
        "columns": rows,
        "channels": list(CHANNELS),
        "questions": [
            {
                "text": page_text(question.text),
                "key": question.key,
                "options": question.options if question.key in STORAGE else (),
            }
            for question in guess.questions
        ],
        "notes": [page_text(note) for note in (*guess.table.notes, *guess.notes)],
        "certain": guess.is_certain and not guess.questions,
    }


def imported(path: Path, answers: Mapping[str, Any]) -> Run:
    """The run of a file with the answers of the page, and ``load_mass``.

    Raises UsageError where something is still not known; RunError with every fault of the file.
    """
    (guess,) = guesses_of([read_table(path)], read_answers(answers))
    if guess.questions:
        raise UsageError("; ".join(question.text for question in guess.questions))
    mass = str(answers.get("load_mass", "")).strip()
    found = runs_of([guess], masses=[f"{parse(mass, 'mass'):.12g} kg" if mass else None])
    if found.jumps:
        by = "; they are written by winchkit import"
        raise RunError([replace(jump, message=jump.message + by) for jump in found.jumps])
    return replace(found.runs[0][1], name=path.stem)


def import_command(file: str, answers: Mapping[str, Any], folder: str) -> str:
    """Command that imports a file with the answers of the page to a folder."""
    words = ["winchkit", "import", file, "-y", "--replace", "-o", folder]
    for column in answers.get("columns", ()):
        words += ["--column", str(column)]
    for key in (*CONSTANTS, "load_mass"):
        if text := str(answers.get(key, "")).strip():
            words += [f"--{key.replace('_', '-')}", text]
    return " ".join([shlex.join(words), *map(str, answers.get("options", ()))])
