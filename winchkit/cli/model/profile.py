"""``winchkit profile new``: the profile of a winch from the values of its drawing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import click

from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.early_checks import check_new_profile
from winchkit.cli.core.lazy import CommandPlace, LazyGroup
from winchkit.cli.core.messages import note, suggest_next
from winchkit.cli.core.options import Decorator, all_of
from winchkit.cli.core.output import is_json, json_flag
from winchkit.cli.core.standard_input import may_ask
from winchkit.errors import UsageError
from winchkit.profile_edit.drawing import DRUMS, FIELDS, PULLEY, PULLEY_EXAMPLE, Field, asked

_SECTIONS = """\
  spiral, archimedean        grooved           squared
      |  o  |             o   o   o   o      | o o o o |
      |  o  |            (_) (_) (_) (_)     | o o o o |
      |__o__|                                |_o_o_o_o_|
   - - - - - - axis - - - - - - - - - - - - - - - - - - - -
"""
"""Cable and drum in a section through the drum's axis, by kind."""


@click.group(
    "profile",
    cls=LazyGroup,
    table={
        "new": CommandPlace("winchkit.cli.model.profile", "Write a profile from a drawing.", "new")
    },
    examples=(
        "winchkit profile new --help",
        "winchkit profile new my-drum.toml --drum-kind grooved --drum-winding-radius 60mm"
        " --drum-groove-pitch 5mm --gearbox-ratio 20.4",
    ),
)
def command() -> None:
    """Profiles of your own: drum, gearbox, cable, pulleys and reference of a winch in a file."""


def _option(field: Field) -> Decorator:
    drums = "" if len(field.drums) == len(DRUMS) else f" ({', '.join(field.drums)})"
    words = f"{field.words[0].upper()}{field.words[1:]}{drums}, such as '{field.example}'."
    return click.option(field.option, "_".join(field.place), metavar="VALUE", help=words)


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit profile new my-winch.toml --drum-kind spiral --drum-winding-radius 60mm"
        " --cable-diameter 4mm --gearbox-ratio 20.4 --pulley 40mm,90deg",
        "winchkit profile new direct.toml --drum-kind grooved --drum-winding-radius 60mm"
        " --drum-groove-pitch 5mm --gearbox-ratio 1 --reference-cable-length 4m --json",
    ),
)
@click.argument("file", metavar="FILE.toml")
@all_of(*map(_option, FIELDS))
@click.option(
    "--pulley",
    "pulleys",
    multiple=True,
    metavar="RADIUS,WRAP",
    help=f"{PULLEY[0].upper()}{PULLEY[1:]}, such as '{PULLEY_EXAMPLE}'.",
)
@click.option("--replace", is_flag=True, help="Write over an earlier file.")
@json_flag("Print the answer as JSON.")
def new(*, file: str, pulleys: Sequence[str], replace: bool, **given: str | None) -> None:
    """Write FILE.toml, the profile of a winch from the values of its drawing.

    What is unknown is left out: the file and the command list it, with what the model does without
    it. In a terminal the command asks for all of it where a needed value is missing.
    """
    from winchkit.cli.core.output import echo_json
    from winchkit.profile_edit.new_profile import new_profile

    check_new_profile(file, "FILE.toml")
    values = {field.key: given["_".join(field.place)] or "" for field in FIELDS}
    lacking = any(not field.without and not values[field.key] for field in asked(values))
    if lacking and may_ask():
        pulleys = _ask(values, pulleys)
    unknown = new_profile(file, values, pulleys, replace=replace)
    note(f"written: {file}")
    if is_json():
        echo_json({"schema": 1, "profile": file, "unknown": unknown})
    elif unknown:
        from winchkit.report.words.columns import hanging

        click.echo("unknown, and what the model does without it")
        click.echo("\n".join(hanging([[key, words] for key, words in unknown.items()])))
    suggest_next("diagnose", "RUN...", "-p", file)


def _ask(values: dict[str, str], pulleys: Sequence[str]) -> Sequence[str]:
    """Ask for every value that is not given, which is written into ``values``; returns pulleys."""
    from winchkit.profile_edit.new_profile import read_field, read_pulley

    click.echo(f"Enter leaves a value unknown.\n\n{_SECTIONS}", err=True)
    for kind, words in DRUMS.items():
        click.echo(f"  {kind}: {words}", err=True)
    for field in FIELDS:
        if field in asked(values) and not values[field.key]:
            values[field.key] = _until(field, partial(read_field, field))
    found = list(pulleys)
    while not pulleys and (text := _until(None, read_pulley)):
        found.append(text)
    return found


def _until(field: Field | None, read: Callable[[str], Any]) -> str:
    """Prompt for a value, or a pulley, until it can be read or may stay unknown."""
    name, words, example = (
        ("pulley", PULLEY, PULLEY_EXAMPLE)
        if field is None
        else (field.key, field.words, field.example)
    )
    while text := click.prompt(
        f"{name}: {words} (such as {example})", default="", show_default=False, err=True
    ):
        try:
            read(text)
        except UsageError as error:
            click.echo(f"  {error}", err=True)
        else:
            return str(text)
    if field is None or field.without:
        return ""
    click.echo("  needed", err=True)
    return _until(field, read)
