"""A new profile of a winch from the values of its drawing; what is unknown is left out."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from winchkit.arguments import path_of, require_mapping, require_types
from winchkit.errors import UsageError, suggest
from winchkit.profile_edit.drawing import (
    DRUMS,
    FIELDS,
    NO_PULLEY,
    PULLEY,
    PULLEY_EXAMPLE,
    Field,
    asked,
)
from winchkit.regular_file import refuse_existing
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.reading.source import TomlSource
from winchkit.schema.reading.tables import marker_at, read_table, type_at
from winchkit.units import number_and_unit


def choices(field: Field) -> tuple[str, ...]:
    """Permitted values of a field, where these are few."""
    kind = type_at(WinchProfile, field.place)
    return tuple(map(str, get_args(kind))) if get_origin(kind) is Literal else ()


def drawing() -> dict[str, Any]:
    """What is asked for a new profile, as JSON."""
    fields = [{**asdict(field), "choices": choices(field)} for field in FIELDS]
    own = {"words": PULLEY, "example": PULLEY_EXAMPLE, "without": NO_PULLEY}
    return {"drums": DRUMS, "fields": fields, "pulley": own}


def read_field(field: Field, text: str) -> str | float:
    """Value of a field for the file; raises UsageError where it is no such quantity."""
    text = text.strip().replace("−", "-")
    if (marker := marker_at(WinchProfile, field.place)) is not None:
        marker.read(text)
    elif text not in choices(field):
        known = list(choices(field))
        raise UsageError(f"'{text}' is none of {', '.join(known)}{suggest(text, known)}")
    found = number_and_unit(text)
    if found is None or found[1]:
        return text
    return int(found[0]) if found[0].is_integer() else found[0]


def read_pulley(text: str) -> dict[str, str]:
    """A pulley of ``"40 mm, 90 deg"``; raises UsageError."""
    parts = [part.strip() for part in text.split(",")]
    if len(parts) > 2:
        raise UsageError(
            f"'{text}' has {len(parts)} values, not a radius and a wrap; with decimal points, "
            f"write such as '{PULLEY_EXAMPLE}'"
        )
    table = dict(zip(("radius", "wrap"), parts, strict=False))
    for name, value in table.items():
        marker = marker_at(WinchProfile, ("pulley", 0, name))
        assert marker is not None
        marker.read(value)
    return table


def new_profile(
    path: str | Path,
    values: Mapping[str, str],
    pulleys: Sequence[str] = (),
    *,
    replace: bool = False,
) -> dict[str, str]:
    """Write the profile of a winch from the values of its drawing.

    Parameters
    ----------
    path : str or Path
        File to write.
    values : mapping of str to str
        Text of a value with its unit by its key in the profile, such as
        ``{"drum.winding_radius": "60 mm"}``; an empty text is unknown.
    pulleys : sequence of str
        Radius and wrap angle of each, from the drum to the load: ``"40 mm, 90 deg"``.
    replace : bool
        Whether an earlier file may be replaced.

    Returns
    -------
    dict of str to str
        What is unknown, by key, and what the model does without it.

    Raises
    ------
    UsageError
        For a file that exists or cannot be written, an unknown key, a value that is none of its
        quantity, a needed one that is missing, or values that contradict each other.
    """
    file = path_of(path, "path")
    require_mapping(values, "values", "texts by key")
    require_types(pulleys, str, "pulleys")
    refuse_existing(file, replace)
    given = {key: str(text).strip() for key, text in values.items() if str(text).strip()}
    fields = asked(given)
    tree = _tree(given, fields)
    tree["pulley"] = [read_pulley(text) for text in pulleys]
    unknown = {field.key: field.without for field in fields if field.key not in given}
    if not pulleys:
        unknown["pulley"] = NO_PULLEY
    name = file.stem
    found = read_table(
        TomlSource(str(file), "winch", tree, {}), WinchProfile, {"name": name, **tree}
    )
    if isinstance(found, list):
        raise UsageError("\n".join(f"{fault.key}: {fault.message}" for fault in found))
    try:
        file.write_text(_text(name, tree, fields, unknown), encoding="utf-8")
    except OSError as error:
        raise UsageError(f"{path}: cannot be written: {error.strerror}") from None
    return unknown


def profile_command(file: str, values: Mapping[str, str], pulleys: Sequence[str]) -> str:
    """Command that writes the profile, also over an earlier one."""
    words = ["winchkit", "profile", "new", file, "--replace"]
    for field in FIELDS:
        if text := values.get(field.key, "").strip():
            words += [field.option, text]
    return shlex.join([*words, *(word for text in pulleys for word in ("--pulley", text))])


def _tree(given: Mapping[str, str], fields: Sequence[Field]) -> dict[str, Any]:
    """Tables of the profile; raises UsageError with every fault of the values."""
    every, faults = {field.key: field for field in FIELDS}, []
    for key in given.keys() - {field.key for field in fields}:
        if key not in every:
            faults.append(f"{key}: unknown key{suggest(key, list(every))}")
        elif every[key].after:
            faults.append(f"{key}: give {every[key].after} too")
        elif given.get("drum.kind") in DRUMS:
            faults.append(f"{key}: a {given['drum.kind']} drum has none")
    tree: dict[str, Any] = {"drum": {}, "reference": {}}
    for field in fields:
        if field.key not in given:
            if not field.without:
                faults.append(f"{field.key}: missing: {field.words}, such as {field.example}")
            continue
        table, name = field.place
        try:
            tree.setdefault(table, {})[name] = read_field(field, given[field.key])
        except UsageError as error:
            faults.append(f"{field.key}: {error}")
    if faults:
        raise UsageError("\n".join(sorted(faults)))
    return tree


def _text(
    name: str, tree: Mapping[str, Any], fields: Sequence[Field], unknown: Mapping[str, str]
) -> str:
    """The file: every value with its meaning, and what is unknown as a comment."""
    lines = ["schema = 1", 'kind = "winch"', f'name = "{name}"']
    for table in dict.fromkeys(field.place[0] for field in fields):
        lines += ["", f"[{table}]" if table in tree else f"# [{table}]"]
        for field in fields:
            own, key = field.place
            if own == table and field.key in unknown:
                lines.append(f"# {key}: unknown; {unknown[field.key]}")
            elif own == table:
                lines.append(f"{f'{key} = {_toml(tree[table][key])}':<31}# {field.words}")
    for item in tree["pulley"]:
        lines += ["", "[[pulley]]", *(f"{key} = {_toml(value)}" for key, value in item.items())]
    return "\n".join(lines) + "\n"


def _toml(value: str | float) -> str:
    return f'"{value}"' if isinstance(value, str) else str(value)
