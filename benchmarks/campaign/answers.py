"""Runs of a campaign, in one process or a few, and its log: scores as lines of JSON."""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any, Protocol, TypeVar


class _Score(Protocol):
    """A dataclass."""

    @property
    def seed(self) -> int: ...

    @property
    def line(self) -> str:
        """The case in a line."""


P = TypeVar("P")
S = TypeVar("S", bound=_Score)


def scores_of(
    answer: Callable[[int, P, Path], S | None],
    seed: int,
    plans: Sequence[P],
    read: Callable[[Mapping[str, Any]], S],
    *,
    jobs: int = 1,
    folder: Path | None = None,
    log: Path | None = None,
) -> list[S]:
    """Scores in the order of the plans; progress on stderr.

    ``answer`` makes and scores the case of a number in a folder; None where none can be made. Each
    score is a line of ``log``; cases whose score is there already, made of a line by ``read``, are
    not run again.
    """
    known = kept(log, read)
    numbers = [seed * 100_000 + index for index in range(len(plans))]
    left = [(n, plan) for n, plan in zip(numbers, plans, strict=True) if n not in known]
    for (number, plan), got in zip(left, _answers(answer, left, jobs, folder), strict=True):
        if got is None:
            print(f"none {number} cannot be made: {plan}", file=sys.stderr)
            continue
        known[got.seed] = got
        keep(got, log)
        print(got.line, file=sys.stderr, flush=True)
    return [known[number] for number in numbers if number in known]


def _answers(
    answer: Callable[[int, P, Path], S | None],
    work: Sequence[tuple[int, P]],
    processes: int,
    folder: Path | None,
) -> Iterator[S | None]:
    one = partial(_one, answer, folder)
    if processes == 1:
        yield from map(one, work)
        return
    with ProcessPoolExecutor(processes) as pool:
        yield from pool.map(one, work)


def _one(
    answer: Callable[[int, P, Path], S | None], folder: Path | None, job: tuple[int, P]
) -> S | None:
    number, plan = job
    with tempfile.TemporaryDirectory() as temporary:
        return answer(number, plan, folder / f"case-{number}" if folder else Path(temporary))


def keep(score: Any, log: Path | None) -> None:
    """Append a score (a dataclass) to a log, if there is one."""
    if log is not None:
        with log.open("a", encoding="utf-8") as lines:
            lines.write(json.dumps(asdict(score)) + "\n")


def kept(log: Path | None, read: Callable[[Mapping[str, Any]], S]) -> dict[int, S]:
    """Scores of a log by their seeds, each made of a line by ``read``."""
    if log is None or not log.exists():
        return {}
    lines = map(json.loads, log.read_text(encoding="utf-8").splitlines())
    return {int(line["seed"]): read(line) for line in lines}
