"""``winchkit effects``: the catalogue of effects, the card of one, a file for one of your own."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.completion import complete_effect
from winchkit.cli.core.lazy import CommandPlace, LazyGroup
from winchkit.cli.core.messages import note
from winchkit.cli.core.options import own_effects_option
from winchkit.cli.core.output import echo_json, is_json, json_flag, tell
from winchkit.cli.core.terminal import progress_bar
from winchkit.cli.model.options import (
    Asked,
    ManyValues,
    declared_profile,
    fit_option,
    html_option,
    model_options,
    refuse_curves,
    suggest_with,
    write_page,
)

if TYPE_CHECKING:
    from winchkit.effects.catalogue import Catalogue
    from winchkit.effects.effect import Effect

_OUTPUTS = ("cable_length", "tension", "motor_torque")


class _Effects(LazyGroup):
    """``effects new …`` is a command; anything else is an effect to show, or all of them."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Send whatever is no command to ``show``."""
        if not args or (args[0] not in self.table and args[0] not in ctx.help_option_names):
            args = ["show", *args]
        return super().parse_args(ctx, args)


@click.group(
    "effects",
    cls=_Effects,
    table={
        "show": CommandPlace(
            "winchkit.cli.model.effects", "List the effects, or show the card of one.", "show"
        ),
        "new": CommandPlace(
            "winchkit.cli.model.effects", "Write a file for an effect of your own.", "new"
        ),
    },
    examples=(
        "winchkit effects",
        "winchkit effects cable-creep",
        "winchkit effects friction speed",
    ),
)
def command() -> None:
    """List the effects that a model may lack, describe one, or write a new one.

    'winchkit effects ID' and 'winchkit effects WORD...' are short for 'winchkit effects show …'.
    """


@click.command(
    "show",
    cls=ToolCommand,
    examples=(
        "winchkit effects show cable-creep",
        "winchkit effects show runout",
        "winchkit effects show --html effects.html",
    ),
)
@click.argument("words", metavar="[ID|WORD]...", nargs=-1, shell_complete=complete_effect)
@own_effects_option("Python file with effects of your own; may be given several times.", "files")
@json_flag("Print JSON, complete, in SI units.")
@html_option
def show(words: Sequence[str], files: Sequence[str], html: str | None) -> None:
    """List the effects that a model may lack, describe one, or find those with all WORDs.

    The page of --html holds the cards, with the signatures drawn.
    """
    from winchkit.effects.card import card, card_data
    from winchkit.effects.catalogue import load_catalogue

    catalogue = load_catalogue(files)
    shown, title = list(catalogue), " ".join(words)
    if words:
        shown = [catalogue[title]] if title in catalogue else _found(catalogue, words)
        shown = shown or [catalogue[title]]  # which refuses it with the effects of similar names
    if words and len(shown) == 1:
        (effect,) = shown
        tell(card_data(effect), [card(effect)])
    elif is_json():
        echo_json({"schema": 1, "effects": [card_data(effect) for effect in shown]})
    else:
        click.echo(_listing(shown))
    if html:
        from winchkit.report.pages.effects import effects_html

        write_page(html, effects_html(shown, title or "The catalogue of effects"))


def _found(catalogue: Catalogue, words: Sequence[str]) -> list[Effect]:
    """Effects with all words in id, name, description or the pattern that they leave."""
    from winchkit.report.words.vocabulary import clause, effect_name

    texts = {
        e.id: f"{e.id} {effect_name(e.id)} {clause(e.id)} {e.what} {e.looks_like}".lower()
        for e in catalogue
    }
    asked = " ".join(words).lower().split()
    return [e for e in catalogue if all(word in texts[e.id] for word in asked)]


def _listing(effects: Sequence[Effect]) -> str:
    """Effects by the first output that they change; those that only a robot has by themselves."""
    from winchkit.report.words.columns import hanging
    from winchkit.report.words.vocabulary import output_name

    lines: list[str] = []
    for place in (*_OUTPUTS, ""):
        own = [
            [effect.id, effect.what]
            for effect in effects
            if ("" if effect.of_robots else effect.outputs[0]) == place
        ]
        if own:
            lines += [
                f"Effects on the {output_name(place)}" if place else "On a robot",
                *hanging(own),
                "",
            ]
    return "\n".join([*lines, f"{len(effects)} effects; 'winchkit effects ID' shows one."])


@click.command(
    cls=ManyValues,
    examples=(
        "winchkit effects new own.py --curve empirical-motor-torque-speed"
        " --fit demo-*.csv -p bench-spiral",
        "winchkit effects new drum.py --id drum-shape --curve empirical-tension-drum-angle"
        " --fit demo-*.csv -p bench-spiral",
    ),
)
@click.argument("file", metavar="FILE.py")
@fit_option("Runs whose residual gives the initial values.", required=True)
@click.option("--curve", metavar="ID", help="Empirical effect to begin from; else the strongest.")
@click.option("--id", "effect_id", metavar="ID", help="Of the new effect; else the file's name.")
@model_options
def new(
    file: str, runs: Sequence[str], curve: str | None, effect_id: str | None, asked: Asked
) -> None:
    """Write FILE.py with the variable and the curve that the runs show and no effect explains.

    It is ready for --effects: diagnose with it, then put in the physics that you recognise.
    """
    from winchkit.diagnosis.new_effect import new_effect
    from winchkit.effects.effect_template import check_own

    refuse_curves(declared_profile(asked.source))
    name = effect_id or Path(file).stem.replace("_", "-")
    check_own(name, Path(file), asked.catalogue)
    with progress_bar() as progress:
        start = new_effect(
            file,
            asked.runs(runs),
            asked.declared,
            asked.catalogue,
            asked.band,
            curve=curve,
            effect_id=name,
            progress=progress,
        )
    note(f"written: {file}; it holds the effect '{name}', with its initial values from {start}")
    suggest_with("diagnose", asked, runs, "--effects", file)
