"""Results for machines: JSON with null where there is no number."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields, is_dataclass
from datetime import date
from enum import Enum
from functools import singledispatch
from os import PathLike, fspath
from typing import Any

import click

from winchkit.errors import CONTROL_CHARACTERS
from winchkit.plain_json import finite_or_none

_JSON = "winchkit.json"


def keep_json(ctx: click.Context, _param: click.Parameter, value: bool) -> bool:
    """Keep ``--json`` for :func:`is_json`."""
    if value:
        ctx.meta[_JSON] = True
    return value


def json_flag(help: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """The option ``--json``, which :func:`tell` and :func:`is_json` read."""
    return click.option("--json", is_flag=True, expose_value=False, callback=keep_json, help=help)


def is_json() -> bool:
    """Whether the present command prints JSON."""
    context = click.get_current_context(silent=True)
    return context is not None and _JSON in context.meta


def tell(data: Mapping[str, Any], lines: Iterable[str]) -> None:
    """Print a result: with ``--json`` its data, else its lines."""
    if is_json():
        echo_json({"schema": 1, **data})
        return
    for line in lines:
        click.echo(line)


def to_json(value: object) -> str:
    """One line of JSON, null for what is not finite; what steers a terminal is escaped."""
    text = json.dumps(plain(value), ensure_ascii=False, allow_nan=False)
    return CONTROL_CHARACTERS.sub(lambda found: json.dumps(found[0])[1:-1], text)


def echo_json(value: object) -> None:
    """Print a result as one line of JSON to stdout."""
    click.echo(to_json(value))


def echo_each(texts: Mapping[str, str], overview: str, kind: str) -> None:
    """Print a text for every winch or axis (``kind``) under its name, and last, where one looks,
    all at a glance."""
    for name, text in texts.items():
        click.echo(f"{kind} {name}\n{text}\n" if name else text)
    if len(texts) > 1:
        click.echo(overview)


@singledispatch
def plain(value: Any) -> Any:
    """A value as dicts, lists, numbers, texts and None only; TypeError for anything else."""
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    raise TypeError(f"{type(value).__name__} has no form in JSON")


@plain.register(type(None))
@plain.register(bool)
@plain.register(str)
@plain.register(int)
def _(value: Any) -> Any:
    return plain(value.value) if isinstance(value, Enum) else value


@plain.register
def _(value: float) -> float | None:
    return finite_or_none(value)


@plain.register
def _(value: Enum) -> Any:
    return plain(value.value)


@plain.register(Mapping)
def _(value: Mapping[Any, Any]) -> dict[str, Any]:
    return {str(key): plain(item) for key, item in value.items()}


@plain.register(list)
@plain.register(tuple)
def _(value: Any) -> list[Any]:
    return [plain(item) for item in value]


@plain.register(set)
@plain.register(frozenset)
def _(value: Any) -> list[Any]:
    return [plain(item) for item in sorted(value)]


@plain.register(PathLike)
def _(value: PathLike[str]) -> str:
    return fspath(value)


@plain.register
def _(value: date) -> str:
    return value.isoformat()
