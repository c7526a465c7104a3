"""What an import made of a recording, against the truth that is known of it."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from click.testing import CliRunner

from fuzzing.recordings import Array, Recording
from winchkit.cli import main
from winchkit.runs import read_run
from winchkit.runs.run import Run

_TOLD_BY_THE_WAY = {"quantised"}
"""Findings on the resolution alone, which excuse no wrong number."""
_ERROR = 70
"""Exit code of an error of the program itself."""


@dataclass(frozen=True)
class Outcome:
    """``right``, ``told``, ``refused``, ``asked``, ``wrong`` or ``traceback``."""

    kind: str
    text: str = ""

    @property
    def is_fault(self) -> bool:
        """Whether a user has a wrong number without a word, or a traceback."""
        return self.kind in {"wrong", "traceback"}


def outcome_of(made: Recording, folder: Path) -> Outcome:
    """Import a file as a user does, and compare the runs with the truth."""
    arguments = [
        "import",
        *map(str, made.paths),
        "-o",
        str(folder),
        "--yes",
        "--json",
        *made.options,
    ]
    result = CliRunner().invoke(main, arguments)
    if result.exit_code == _ERROR or not isinstance(result.exception, SystemExit | None):
        return Outcome("traceback", f"{result.exception!r} {result.output[-400:]}")
    if result.exit_code:
        return Outcome("asked" if result.exit_code == 2 else "refused", result.stderr[-300:])
    report = json.loads(result.stdout)
    told = [*_told(report), *result.stderr.splitlines()]
    wrong = {
        channel: text
        for entry in report["runs"]
        for channel, text in _differences(made, read_run(entry["path"])).items()
    }
    # A word on another column excuses nothing.
    silent = [
        text
        for channel, text in wrong.items()
        if not any(_concerns(note, channel, made.names[channel]) for note in told)
    ]
    if silent:
        return Outcome("wrong", "; ".join(silent))
    return Outcome("told" if wrong else "right", "; ".join([*wrong.values(), *told])[:600])


def _concerns(note: str, channel: str, column: str) -> bool:
    """Whether a note names a channel, its column, or the end of a file that is cut off there."""
    plain = note.casefold().replace("_", " ")
    words = (channel.replace("_", " "), column.casefold(), "may lack digits")
    return any(word in plain for word in words)


def _told(report: dict[str, Any]) -> Iterable[str]:
    """Notes and findings of the report that say that something is not as it seems."""
    for entry in report["files"]:
        yield from entry.get("notes", [])
    for entry in report["runs"]:
        yield from entry.get("notes", [])
    for finding in report["sanity"]:
        if finding["code"] not in _TOLD_BY_THE_WAY:
            yield f"{finding['channel']}: {finding['text']}"


def _differences(made: Recording, run: Run) -> dict[str, str]:
    """Channels of a run that differ from the truth by more than their resolution."""
    best: dict[str, str] | None = None
    # A run begins at its first row, which may be another one than that of the file.
    is_elsewhere = "piece" in run.metadata or "latest row first" in made.changes
    for first in made.time[: len(made.time) if is_elsewhere else 8]:
        found = {
            channel: text
            for channel in made.truth
            if channel in run and (text := _difference(made, run, channel, run.time + first))
        }
        if best is None or len(found) < len(best):
            best = found
        if not best:
            break
    return best or {}


def _difference(made: Recording, run: Run, channel: str, time: Array) -> str:
    truth_of = made.truth[channel]
    truth = truth_of(time)
    slope = float(np.max(np.abs(np.gradient(truth_of(made.time), made.time))))
    allowed = 1.01 * made.resolution[channel] + 4 * made.clock * slope + 1e-9
    if len(made.paths) > 1:
        # Between samples of the other file: h²/8 times the curvature, over up to 2.5 intervals.
        step = 2.5 * float(np.median(np.diff(made.time)))
        rates = np.gradient(np.gradient(truth_of(made.time), made.time), made.time)
        allowed += step**2 / 8 * float(np.max(np.abs(rates)))
    error = run[channel] - truth
    error = error[np.isfinite(error)]
    if not len(error):
        return ""
    if modulus := made.moduli.get(channel):
        error = error - modulus * np.round(np.median(error) / modulus)
    largest = float(np.max(np.abs(error)))
    if largest <= allowed:
        return ""
    at = int(np.argmax(np.abs(error)))
    return f"{channel} is off by {largest:.4g} (allowed {allowed:.3g}) at row {at} of {len(run)}"
