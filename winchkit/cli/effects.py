"""``winchkit effects``: the catalogue of effects, the card of one, a file for one of your own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from winchkit.cli.html_option import html_option, write_page
from winchkit.cli.lazy import At, LazyGroup
from winchkit.cli.output import echo_json

if TYPE_CHECKING:
    from winchkit.effects.catalogue import Catalogue

__all__ = ["command", "show"]

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
        "show": At("winchkit.cli.effects", "List the effects, or show the card of one.", "show"),
        "new": At("winchkit.cli.effects_new", "Write a file for an effect of your own."),
    },
)
def command() -> None:
    """List the effects that a model may lack, show the card of one, or begin one of your own.

    'winchkit effects' and 'winchkit effects ID' are short for 'winchkit effects show [ID]'.
    """


@click.command("show")
@click.argument("effect_id", metavar="[ID]", required=False)
@click.option(
    "--effects",
    "files",
    multiple=True,
    metavar="FILE",
    help="Python file with effects of your own; may be given several times.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON, complete, in SI units.")
@html_option
def show(effect_id: str | None, files: Sequence[str], as_json: bool, html: str | None) -> None:
    """List the effects that a model may lack, or show the card of one.

    The page of --html holds the card, or all cards, with the signatures drawn.
    """
    from winchkit.effects.card import card, card_data
    from winchkit.effects.catalogue import load_catalogue

    catalogue = load_catalogue(files)
    if effect_id is not None and as_json:
        echo_json({"schema": 1, **card_data(catalogue[effect_id])})
    elif effect_id is not None:
        click.echo(card(catalogue[effect_id]))
    elif as_json:
        echo_json({"schema": 1, "effects": [card_data(effect) for effect in catalogue]})
    else:
        click.echo(_listing(catalogue))
    if html:
        from winchkit.diagnosis.report.effect_page import effects_html

        shown = list(catalogue) if effect_id is None else [catalogue[effect_id]]
        write_page(html, effects_html(shown, effect_id or "The catalogue of effects"))


def _listing(catalogue: Catalogue) -> str:
    """Effects by the first output that they change; those that only a robot has by themselves."""
    from winchkit.diagnosis.report.columns import hanging

    lines: list[str] = []
    for place in (*_OUTPUTS, ""):
        own = [
            [effect.id, effect.what]
            for effect in catalogue
            if ("" if effect.of_robots else effect.outputs[0]) == place
        ]
        lines += [f"On the way to {place}" if place else "On a robot", *hanging(own), ""]
    return "\n".join([*lines, f"{len(catalogue)} effects; 'winchkit effects ID' shows one."])
