"""The ledger of a profile file: steps, their held-out errors, and the data to undo them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import Any, Literal

import tomlkit

from winchkit.arguments import path_of
from winchkit.errors import Fault, FileError
from winchkit.profile_edit.document import (
    effect_tables,
    read_document,
    refuse_other,
    shorthands,
    tables,
    write_document,
    written,
)


@dataclass(frozen=True)
class Judged:
    """Runs of a step, and its held-out errors by output, SI."""

    date: date
    runs: Sequence[str] = ()
    unit: Mapping[str, str] = field(default_factory=dict)
    before: Mapping[str, float] = field(default_factory=dict)
    after: Mapping[str, float] = field(default_factory=dict)
    noise: Mapping[str, float] = field(default_factory=dict)


def note(document: Any, did: Literal["add", "remove"], effect_id: str, judged: Judged) -> None:
    """Append a step to the ledger of a document before the step changes it."""
    entry = tomlkit.table()
    entry["did"], entry["effect"], entry["date"] = did, effect_id, judged.date
    if judged.runs:
        entry["runs"] = list(judged.runs)
    for name in ("before", "after", "noise"):
        values = getattr(judged, name)
        if values:
            row = tomlkit.inline_table()
            row.update({o: str(written(v, judged.unit[o])) for o, v in values.items()})
            entry[name] = row
    was = tomlkit.array()
    for table in effect_tables(document):
        was.append(_inline(table))
    entry["was"] = was
    if short := shorthands(document):
        entry["shorthand"] = _inline(short)
    tables(document, "ledger").append(entry)


def undo(source: str | Path, path: str | Path, *, replace: bool = False) -> str:
    """Copy a profile without its last step.

    Parameters
    ----------
    source, path : str or Path
        The profile, and its copy.
    replace : bool
        Write over another profile that exists; over ``source`` always.

    Returns
    -------
    str
        Description of the undone step.

    Raises
    ------
    FileError
        Where the ledger is empty or a file cannot be read or written.
    UsageError
        For a file that is not to be replaced.
    """
    source, path = path_of(source, "source"), path_of(path)
    refuse_other(source, path, replace)
    document = read_document(source)
    steps = tables(document, "ledger")
    if not len(steps):
        raise FileError(Fault("has no ledger: there is nothing to undo", str(source)))
    last = steps[-1].unwrap()
    effects = tomlkit.aot()
    for values in last.get("was", ()):
        effects.append(_table(values))
    for key, value in last.get("shorthand", {}).items():
        part, _, name = key.partition(".")
        document[part][name] = value
    del steps[len(steps) - 1]
    _replace(document, effects)
    write_document(document, path)
    return f"{last['did']} {last['effect']}"


def _replace(document: Any, effects: Any) -> None:
    there = effect_tables(document)
    while len(there):
        del there[len(there) - 1]
    for table in effects:
        there.append(table)


def _inline(values: Any) -> Any:
    """A table in one line."""
    out = tomlkit.inline_table()
    plain = values.unwrap() if hasattr(values, "unwrap") else values
    for key, value in plain.items():
        out[key] = _inline(value) if isinstance(value, dict) else value
    return out


def _table(values: Mapping[str, Any]) -> Any:
    out = tomlkit.table()
    for key, value in values.items():
        out[key] = _inline(value) if isinstance(value, dict) else value
    return out
