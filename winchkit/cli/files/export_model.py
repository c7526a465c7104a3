"""``winchkit export-model``: a profile with its effects for controllers and simulators."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import click

from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.messages import note
from winchkit.cli.core.options import (
    PROFILE,
    effects_option,
    output_option,
    quantity_option,
    replace_option,
)


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit export-model better.toml --to c -o better.h",
        "winchkit export-model joint-axis --to python -o joint.py",
        "winchkit export-model joint-axis --to mjcf -o joint.xml",
        "winchkit export-model cabtive --to c -o cabtive.h",
    ),
)
@click.argument("profile", type=PROFILE)
@click.option(
    "--to",
    "form",
    required=True,
    type=click.Choice(["c", "python", "mjcf", "json"]),
    help="A header in C99, a Python module, a model of MuJoCo, or the formulas as JSON.",
)
@quantity_option(
    "--load-mass",
    of="mass",
    example="10 kg",
    help="Mass on the cable or payload of an axis, for MuJoCo.",
)
@effects_option
@output_option("File to write; by default standard output.")
@replace_option
def command(
    *,
    profile: str,
    form: Literal["c", "python", "mjcf", "json"],
    load_mass: str | None,
    effects: Sequence[str],
    output: str | None,
    replace: bool,
) -> None:
    """Write PROFILE for other programs, with its effects as they stand in it.

    The header has a step and a batch of cable length, tension and motor torque, with the memory of
    the effects, and the motor angle at a cable length. Of an axis it has the motor torque, with the
    torque of your own model as an input. Of a robot it has the cable lengths at a pose, the
    structure matrix, the closed-form force distribution, and each line's winch. It needs math.h
    only, the Python module math only. The MuJoCo model moves like 'winchkit forward'; effects
    without a counterpart are listed.
    """
    from winchkit.catalog import find
    from winchkit.cli.core.quantities import quantity
    from winchkit.cli.model.options import declared_profile
    from winchkit.dynamics.export import export_model
    from winchkit.effects import load_catalogue
    from winchkit.regular_file import file_errors, refuse_existing

    if output is not None:
        refuse_existing(Path(output), replace)
    mass = None if load_mass is None else quantity(load_mass, "mass")
    declared = declared_profile(Path(find("profiles", profile)))
    exported = export_model(declared, form, load_catalogue(effects), mass)
    for one in exported.missing:
        note(f"not written: {one}")
    if output is None:
        click.echo(exported.text, nl=False)
        return
    with file_errors(output):
        Path(output).write_text(exported.text, encoding="utf-8")
    note(f"written: {output}")
