"""``winchkit effects``: the catalogue of effects, and the card of one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from winchkit.cli.output import echo_json

if TYPE_CHECKING:
    from winchkit.effects.catalogue import Catalogue

__all__ = ["command"]

_OUTPUTS = ("cable_length", "tension", "motor_torque")


@click.command("effects")
@click.argument("effect_id", metavar="[ID]", required=False)
@click.option(
    "--effects",
    "files",
    multiple=True,
    metavar="FILE",
    help="Python file with effects of your own; may be given several times.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON, complete, in SI units.")
def command(effect_id: str | None, files: Sequence[str], as_json: bool) -> None:
    """List the effects that a model may lack, or show the card of one."""
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


def _listing(catalogue: Catalogue) -> str:
    """Effects by the first output that they change."""
    width = max(len(effect.id) for effect in catalogue)
    lines: list[str] = []
    for output in _OUTPUTS:
        lines.append(f"On the way to {output}")
        lines += [
            f"  {effect.id:<{width}}  {effect.what}"
            for effect in catalogue
            if effect.outputs[0] == output
        ]
        lines.append("")
    return "\n".join([*lines, f"{len(catalogue)} effects; 'winchkit effects ID' shows one."])
