"""The command ``winchkit commission`` as a function."""

from __future__ import annotations

import sys
from pathlib import Path

from winchkit.arguments import path_of
from winchkit.bench.commissioning.dialogue import AnswerFile, Dialogue, TypedAnswers
from winchkit.bench.commissioning.procedure import commission_bench
from winchkit.bench.commissioning.record import Record
from winchkit.drivers.clock import MonotonicClock
from winchkit.schema.read import read_bench


def commission(bench: str | Path, answers: str | Path | None = None) -> Record:
    """Commission a bench: try directions, units, brake, limits and the loss of the host.

    Parameters
    ----------
    bench : str or Path
        Bench file; the record is written beside it.
    answers : str or Path, optional
        TOML file of answers; by default questions go to stderr and answers are read from stdin.

    Returns
    -------
    Record
        Tests, confirmations, and the person who confirmed them.

    Raises
    ------
    FileError
        For an invalid bench file or file of answers.
    NotPermitted
        For an item that was not confirmed or did not stop.
    ConnectionLost
        Where a bus or device does not answer.
    """

    def say(text: str) -> None:
        print(text, file=sys.stderr)  # noqa: T201 - questions to a person

    dialogue: Dialogue = (
        TypedAnswers(say, sys.stdin.readline)
        if answers is None
        else AnswerFile(path_of(answers, "answers"), say)
    )
    return commission_bench(read_bench(path_of(bench, "bench")), dialogue, MonotonicClock())
