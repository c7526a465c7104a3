"""Reader of one table of a declaration into its dataclass by pydantic, with messages of its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from types import NoneType
from typing import Annotated, Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from pydantic import TypeAdapter, ValidationError
from pydantic_core import ErrorDetails

from winchkit.errors import Fault, suggest
from winchkit.schema.quantity import Marker
from winchkit.schema.reading.lines import Key
from winchkit.schema.reading.source import TomlSource
from winchkit.schema.table import BrokenRules

T = TypeVar("T")


def read_table(source: TomlSource, kind: type[T], raw: object, at: Key = ()) -> T | list[Fault]:
    """Read ``raw``, the table at the key ``at`` of the source, or list all its faults."""
    try:
        table: T = _adapter(kind).validate_python(raw)  # type: ignore[arg-type] # classes hash
    except ValidationError as error:
        errors = error.errors(include_url=False)
    else:
        return table
    unknown = [details for details in errors if details["type"] == "unexpected_keyword_argument"]
    faults = [
        source.fault((*at, *key), message)
        for details in unknown or errors
        for key, message in _faults(kind, details)
    ]
    if unknown:
        # pydantic checks no rule of a table with an unknown key: read it again without the key.
        known = raw
        for details in unknown:
            known = _without(known, details["loc"])
        rest = read_table(source, kind, known, at)
        faults += rest if isinstance(rest, list) else []
    return faults


@cache
def _adapter(kind: type[Any]) -> TypeAdapter[Any]:
    """Validator of a table, cached: it takes a tenth of a second to build."""
    return TypeAdapter(kind)


def _without(raw: Any, place: Key) -> Any:
    """A copy of a tree that lacks the key at a place."""
    head, *rest = place
    rebuilt = raw.copy()
    if rest:
        rebuilt[head] = _without(raw[head], tuple(rest))
    else:
        del rebuilt[head]
    return rebuilt


def _faults(kind: type, details: ErrorDetails) -> list[tuple[Key, str]]:
    """One error of pydantic as places and messages."""
    place: Key = tuple(details["loc"])
    if place and str(place[-1]).startswith("function-plain["):  # of a quantity of two dimensions
        place = place[:-1]
    error = details.get("ctx", {}).get("error")
    if isinstance(error, BrokenRules):
        return [((*place, *_parts(key)), message) for key, message in error.rules]
    if details["type"] == "value_error":
        return [(place, str(error))]
    if place and place[-1] == "[key]":
        names = list(get_args(get_args(type_at(kind, place[:-2]))[0]))
        return [(place[:-1], _unknown_key(str(place[-2]), names))]
    if place and _is_branch(kind, place):
        place = place[:-1]
    return [(place, _message(kind, details["type"], place, details))]


def _parts(key: str) -> Key:
    """The parts of a rule's dotted key; a number is a position within an array."""
    parts = key.split(".") if key else []
    return tuple(int(part) if part.isdigit() else part for part in parts)


def _is_branch(kind: type, place: Key) -> bool:
    """Whether a place ends in the name that pydantic gives to one branch of a union."""
    return place[-1] in {"str", "int"} and type_at(kind, place) is None


def _unknown_key(name: str, known: list[str]) -> str:
    return f"unknown key{suggest(name, known) or '; use one of ' + ', '.join(known)}"


def _message(kind: type, error: str, place: Key, details: ErrorDetails) -> str:
    name = place[-1] if place else ""
    if error == "unexpected_keyword_argument":
        table = type_at(kind, place[:-1])
        return _unknown_key(str(name), _keys(table))
    wanted = _wanted(type_at(kind, place))
    if error == "missing" and isinstance(name, int):
        owner = _wanted(type_at(kind, place[:-1]))
        return f"missing; expected {owner}"
    if error == "missing":
        return f"missing; expected {wanted}"
    if error == "literal_error":
        choices = [str(choice) for choice in get_args(type_at(kind, place))]
        return f"unknown value {details['input']!r}; expected {wanted}" + suggest(
            str(details["input"]), choices
        )
    return f"expected {wanted}, not {_shown(details['input'])}"


def _keys(table: Any) -> list[str]:
    """Keys that a file may give; fields that are not part of the value are excluded."""
    if not is_dataclass(table):
        return []
    return sorted(field.name for field in fields(table) if field.compare)


def _shown(value: object) -> str:
    if isinstance(value, Mapping):
        return "a table"
    return f"a list of {len(value)}" if isinstance(value, list | tuple) else repr(value)


def type_at(kind: object, place: Key) -> Any:
    """The type that a dataclass declares at a place, without ``Optional``; None where unknown."""
    for part in place:
        kind = _bare(kind)
        if is_dataclass(kind):
            kind = get_type_hints(kind, include_extras=True).get(str(part))
        elif get_origin(kind) is tuple:
            members = [member for member in get_args(kind) if member is not Ellipsis]
            kind = members[min(part, len(members) - 1)] if isinstance(part, int) else None
        else:
            kind = (get_args(kind) or (None,))[-1]
    return _bare(kind)


def marker_at(kind: object, place: Key) -> Marker | None:
    """The marker of the field at a place of a dataclass; None where there is no such field."""
    return _marker(type_at(kind, place))


def _marker(kind: object) -> Marker | None:
    return next((part for part in get_args(kind) if isinstance(part, Marker)), None)


def _bare(kind: object) -> object:
    """``X`` of ``X | None``, and of ``str | X`` the table."""
    members = [member for member in get_args(kind) if member is not NoneType]
    if get_origin(kind) in {Annotated, Literal, tuple} or not members or _is_mapping(kind):
        return kind
    return members[-1]


def _is_mapping(kind: object) -> bool:
    origin = get_origin(kind)
    return isinstance(origin, type) and issubclass(origin, Mapping)


def _wanted(kind: object) -> str:
    """Description of the value that a type expects in a file."""
    marker = _marker(kind)
    if marker is not None:
        return marker.wanted
    if get_origin(kind) is Literal:
        return f"one of {', '.join(str(choice) for choice in get_args(kind))}"
    if get_origin(kind) is tuple:
        members = get_args(kind)
        if Ellipsis in members:
            return "a list"
        return f"a list of {len(members)}, each {_wanted(members[0])}"
    if is_dataclass(kind) or _is_mapping(kind):
        return "a table"
    return _PLAIN.get(kind, "another value")


_PLAIN: dict[object, str] = {str: "text in quotes", int: "a whole number", float: "a number"}
