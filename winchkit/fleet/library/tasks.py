"""One diagnosis of a session: from paths to the rows of the tables.

A task is known by a key of all that its diagnosis depends on; its rows are the same in every
process of a computer.
"""

from __future__ import annotations

import hashlib
import json
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from winchkit.fleet.library.index import profile_of_runs, profile_path
from winchkit.fleet.library.partitions import Partitions, Row
from winchkit.fleet.library.sessions import WinchSession
from winchkit.plain_json import without_nan
from winchkit.version import __version__

if TYPE_CHECKING:
    from winchkit.diagnosis.diagnose import WinchAnswer
    from winchkit.diagnosis.results import Estimate

_CANDIDATES = 10
"""Candidates that a stored result keeps."""
_STORED = (
    "verdict",
    "outputs",
    "steps",
    "candidates",
    "unexplained",
    "caveats",
    "notes",
)
"""Parts of a diagnosis that a stored result keeps."""
_LARGEST = 20_000
"""Length of a stored result, bytes."""
_DISPENSABLE = ("candidates", "unexplained", "notes", "outputs", "steps", "caveats")
"""Parts that a result above this length loses, in this order; the estimates have their table."""


@dataclass(frozen=True)
class Task:
    """All that one diagnosis needs: paths, no data."""

    key: str
    library: str
    """Absolute path of the folder of the runs, which a worker can read."""
    session: WinchSession
    profile: str
    """Text of the profile's file."""
    profile_hash: str
    profile_name: str
    effects: tuple[tuple[str, str], ...]
    """Names and texts of files of user effects."""
    band: float | None


@dataclass(frozen=True)
class Outcome:
    """Rows of one diagnosis."""

    diagnosis: Row
    estimates: tuple[Row, ...]


def task_of(
    tables: Partitions,
    session: WinchSession,
    profile: str | Path,
    effects: tuple[tuple[str, str], ...] = (),
    band: float | None = None,
) -> Task:
    """Task of a session, with its profile, or that of a folder (:func:`.profile_path`), and the
    ``band`` of the torque's low-pass, Hz; raises FileError where its winch has no profile."""
    path = profile_path(profile, session.winch)
    known = profile_of_runs(path)
    basis = [session.winch, session.session, [[r.path, r.hash, r.prefix] for r in session.runs]]
    parts = [basis, known.hash, effects, band, __version__]
    key = hashlib.sha256(json.dumps(parts).encode()).hexdigest()
    text = path.read_text(encoding="utf-8")
    library = str(tables.runs.resolve())
    return Task(key, library, session, text, known.hash, known.name, effects, band)


def outcome_of(task: Task) -> Outcome:
    """Diagnose the runs of a task; a failure becomes a row with its reason."""
    from winchkit.diagnosis.diagnose import diagnose
    from winchkit.effects.catalogue import load_catalogue
    from winchkit.schema.read import read_profile

    library = Path(task.library)
    try:
        with tempfile.TemporaryDirectory() as place:
            source = Path(place) / f"{task.profile_name}.toml"
            source.write_text(task.profile, encoding="utf-8")
            profile = read_profile(source)
            files = [Path(place) / name for name, _ in task.effects]
            for file, (_, text) in zip(files, task.effects, strict=True):
                file.write_text(text, encoding="utf-8")
            catalogue = load_catalogue(files)
        runs = [run.read(library) for run in task.session.runs]
        answer = diagnose(runs, profile, catalogue, task.band)
    except Exception as error:  # noqa: BLE001 - kept with its reason: other sessions go on
        return failed(task, f"{type(error).__name__}: {error}")
    return _rows(task, answer)


def failed(task: Task, reason: str) -> Outcome:
    """Outcome of a task without a diagnosis."""
    return Outcome(_shared(task) | {"failure": reason}, ())


def stored_result(found: Mapping[str, Any]) -> str:
    """What ``winchkit diagnose --json`` prints as a table keeps it, at most 20 kB; ``dropped``
    names omitted parts."""
    stored = {name: found[name] for name in _STORED}
    stored["candidates"] = stored["candidates"][:_CANDIDATES]
    dropped: list[str] = []
    text = json.dumps(without_nan(stored))
    for name in _DISPENSABLE:
        if len(text) <= _LARGEST:
            break
        del stored[name]
        dropped.append(name)
        text = json.dumps(without_nan({**stored, "dropped": dropped}))
    return text


def _shared(task: Task) -> Row:
    session = task.session
    return {
        "key": task.key,
        "winch": session.winch,
        "session": session.session,
        "time": session.time,
        "runs": [run.path for run in session.runs],
        "profile": task.profile_hash,
        "profile_name": task.profile_name,
        "version": __version__,
        "failure": None,
    }


def _rows(task: Task, answer: WinchAnswer) -> Outcome:
    from winchkit.diagnosis.steps import place_text

    diagnosis = answer.diagnosis
    row = _shared(task) | {
        "verdict": diagnosis.verdict,
        "effects": [step.effects[0] for step in diagnosis.steps if step.certain],
        "places": [place_text(step) for step in diagnosis.steps if not step.certain],
        "result": stored_result(diagnosis.to_json()),
    }
    about = {
        name: value
        for name, value in _shared(task).items()
        if name not in {"version", "profile_name", "failure"}
    }
    about["verdict"] = diagnosis.verdict
    return Outcome(row, tuple(about | values for values in _estimates(answer)))


def _estimates(answer: WinchAnswer) -> list[Row]:
    """Rows of the effects of all steps, of the other members of their sets, of combinations."""
    from winchkit.diagnosis.steps import place_text

    model: list[Row] = []
    others: list[Row] = []
    combinations: list[Row] = []
    for step in answer.diagnosis.steps:
        shared = {
            "set": list(step.effects),
            "certain": step.certain,
            "place": place_text(step) if step.place else None,
        }
        for number, effect in enumerate(step.effects):
            kind, rows = ("alternative", others) if number else ("model", model)
            for name, estimate in step.parameters.get(effect, {}).items():
                rows.append(shared | {"kind": kind, "effect": effect} | _values(name, estimate))
        if step.combination is not None:
            known = step.combination
            values = {"parameter": known.name, "value": known.value, "unit": known.unit}
            values["std"] = known.std if isfinite(known.std) else None
            combinations.append(
                shared | {"kind": "combination", "effect": step.effects[0]} | values
            )
    _correlate(model, answer)
    for rows in (model, others, combinations):
        for index, row in enumerate(rows):
            row["index"] = index
    return [*model, *others, *combinations]


def _values(name: str, estimate: Estimate) -> Row:
    low, high = estimate.interval or (None, None)
    std = estimate.std if isfinite(estimate.std) else None
    named: dict[str, Any] = {"parameter": name, "value": estimate.value, "std": std}
    return named | {"low": low, "high": high, "unit": estimate.unit}


def _correlate(model: list[Row], answer: WinchAnswer) -> None:
    """Covariances: correlations of the linearised fit times the standard deviations, which are
    wider than those of the linearised fit (intervals.py)."""
    from winchkit.diagnosis.regression.conditioning import value_covariance

    result = answer.result
    known = value_covariance(answer.engine.regression, result.final, result.noise)
    names = [f"{row['effect']}.{row['parameter']}" for row in model]
    if any(name not in known.names for name in names):
        return  # The named effect is not the fitted one: no joint covariance is known.
    places = [known.names.index(name) for name in names]
    matrix, scale = known.matrix, [float(known.matrix[i, i]) ** 0.5 for i in places]
    for a, (row, i) in enumerate(zip(model, places, strict=True)):
        row["covariance"] = [
            None
            if row["std"] is None or other["std"] is None or not scale[a] * scale[b] > 0
            else row["std"] * other["std"] * float(matrix[i, j]) / (scale[a] * scale[b])
            for b, (other, j) in enumerate(zip(model, places, strict=True))
        ]
