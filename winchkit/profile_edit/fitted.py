"""Writing of fitted effects into a copy of a profile file, with the origin of their values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from math import isinf, isnan
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.items import InlineTable

from winchkit.effects.placement import HOME, base_of, line_of_effect
from winchkit.effects.term import Term
from winchkit.errors import Fault, FileError
from winchkit.profile_edit.document import (
    effect_tables,
    read_document,
    refuse_other,
    shorthands,
    write_document,
    written,
)
from winchkit.profile_edit.ledger import Judged, note
from winchkit.schema.profiles.winch import SHORTHANDS

_HOME_LENGTH = "home-length"


@dataclass(frozen=True)
class FittedTerm:
    """A term with the standard deviations of its values, and their origin."""

    term: Term
    std: Mapping[str, float]
    runs: Sequence[str]
    date: date


def write_fitted(
    source: Path, fitted: Sequence[FittedTerm], out: Path, judged: Judged, *, replace: bool
) -> None:
    """Copy a profile with fitted effects, the last one new; raises FileError."""
    refuse_other(source, out, replace)
    document = read_document(source)
    note(document, "add", fitted[-1].term.effect.id, judged)
    _put(document, fitted)
    write_document(document, out)


def write_without(
    source: Path,
    effect_id: str,
    fitted: Sequence[FittedTerm],
    out: Path,
    judged: Judged,
    *,
    replace: bool,
) -> None:
    """Copy a profile without an effect (on one line ``EFFECT/LINE``); raises FileError."""
    refuse_other(source, out, replace)
    document = read_document(source)
    short = {SHORTHANDS[key]: key for key in shorthands(document)}
    there = [label for table in effect_tables(document) for label in _labels(table)]
    if effect_id not in there and effect_id not in short:
        has = ", ".join([*there, *short]) or "none"
        raise FileError(Fault(f"has no effect '{effect_id}'; it has {has}", str(source)))
    note(document, "remove", effect_id, judged)
    if effect_id in short:
        part, _, name = short[effect_id].partition(".")
        del document[part][name]
    else:
        _take_out(document, effect_id)
    _put(document, fitted)
    write_document(document, out)


def _labels(table: Any) -> list[str]:
    """Labels of an effect's table: with its line, or each of its lines."""
    name = str(table["id"])
    if _of_lines(table):
        return [name, *(f"{name}/{line}" for line in table["length"])]
    return [f"{name}/{table['line']}"] if "line" in table else [name]


def _take_out(document: Any, label: str) -> None:
    """Delete the last table of this label, or the value of one line in it."""
    tables = effect_tables(document)
    last = max(index for index, table in enumerate(tables) if label in _labels(table))
    _, _, line = label.partition("/")
    if line and _of_lines(tables[last]) and len(tables[last]["length"]) > 1:
        del tables[last]["length"][line]
    else:
        del tables[last]


def _put(document: Any, fitted: Sequence[FittedTerm]) -> None:
    """Update the present effects and append the others."""
    unused = list(effect_tables(document))
    for item in fitted:
        if _update_shorthand(document, item):
            continue
        name, line = base_of(item.term.effect), line_of_effect(item.term.effect)
        if name == _HOME_LENGTH and line in (lengths := _home_lengths(document)):
            lengths[line] = written(item.term.values["length"], "m")
            continue
        table = next((t for t in unused if (t["id"], t.get("line", "")) == (name, line)), None)
        if table is None:
            table = tomlkit.table()
            table["id"] = name
            if line:
                table["line"] = line
            effect_tables(document).append(table)
            table = effect_tables(document)[-1]
        else:
            unused.remove(table)
        _fill(table, item)
        _put_home_lengths(document, item)


def _put_home_lengths(document: Any, item: FittedTerm) -> None:
    """Write home lengths that were fitted with a cable's law on a robot, as an effect."""
    values = item.term.values
    homes = {n.removeprefix(HOME): values[n] for n in values if n.startswith(HOME)}
    if not homes:
        return
    if not _home_lengths(document):
        lengths = tomlkit.inline_table()
        effect_tables(document).append(tomlkit.item({"id": _HOME_LENGTH}))
        effect_tables(document)[-1]["length"] = lengths
    table = next(t for t in effect_tables(document) if _of_lines(t))
    table["length"].update({line: written(value, "m") for line, value in homes.items()})
    table["fitted"] = {"runs": list(item.runs), "date": item.date}


def _home_lengths(document: Any) -> Any:
    """Home lengths of several lines in one table, by line; empty where there is none."""
    return next((t["length"] for t in effect_tables(document) if _of_lines(t)), {})


def _of_lines(table: Any) -> bool:
    return table["id"] == _HOME_LENGTH and isinstance(table.get("length"), Mapping)


def _update_shorthand(document: Any, item: FittedTerm) -> bool:
    """Write a refitted value to its shorthand key, remove it if infinite; False without the key."""
    effect = item.term.effect
    key = next((key for key in shorthands(document) if SHORTHANDS[key] == effect.id), None)
    if key is None:
        return False
    part, _, name = key.partition(".")
    if isinf(item.term.values[name]):
        del document[part][name]
    else:
        document[part][name] = written(item.term.values[name], effect.parameter(name).unit)
    return True


def _fill(table: Any, item: FittedTerm) -> None:
    effect = item.term.effect
    for parameter in effect.parameters:
        if parameter.name.startswith(HOME):
            continue
        value = item.term.values[parameter.name]
        if isinf(value):
            table.pop(parameter.name, None)
        elif parameter.name in item.std or value != parameter.null:
            table[parameter.name] = written(value, parameter.unit)
    table["fitted"] = _provenance(item)


def _provenance(item: FittedTerm) -> InlineTable:
    std = tomlkit.inline_table()
    for name, value in item.std.items():
        if isnan(value) or name.startswith(HOME):
            continue
        std[name] = written(value, item.term.effect.parameter(name).unit)
    fitted = tomlkit.inline_table()
    fitted["runs"] = list(item.runs)
    fitted["date"] = item.date
    fitted["std"] = std
    return fitted
