"""``winchkit forward``: the motion of a profile under a torque, a reference or a programme."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.messages import note
from winchkit.cli.core.options import (
    PROFILE,
    PROGRAMME,
    RUN,
    effects_option,
    output_option,
    quantity_option,
)
from winchkit.cli.core.output import json_flag, tell
from winchkit.cli.core.terminal import progress_bar


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit forward better.toml --torque demo-10kg-1.csv -o forward.csv",
        "winchkit forward better.toml --torque demo-20kg-1.csv -o forward-20kg.csv",
    ),
)
@click.argument("profile", type=PROFILE)
@click.option("--programme", type=PROGRAMME, help="Motion programme that [control] follows.")
@click.option("--torque", type=RUN, metavar="RUN", help="Run whose motor torque drives it.")
@click.option(
    "--reference", type=RUN, metavar="RUN", help="Run whose motor angle [control] follows."
)
@quantity_option(
    "--load-mass",
    of="mass",
    example="10 kg",
    help="Mass on the cable; by default that of the run or the programme.",
)
@click.option(
    "--initial-speed", metavar="VALUE", help="Speed at the start; by default that of the run."
)
@quantity_option("--rate", of="frequency", default="100 Hz", help="Sampling rate of a programme.")
@effects_option
@output_option("The simulated run: a .csv or .mcap file.", required=True)
@click.option("--replace", is_flag=True, help="Write over a file of that name.")
@json_flag("Print the summary as JSON.")
def command(
    *,
    profile: str,
    programme: str | None,
    torque: str | None,
    reference: str | None,
    load_mass: str | None,
    initial_speed: str | None,
    rate: str,
    effects: Sequence[str],
    output: str,
    replace: bool,
) -> None:
    """Simulate the motion of PROFILE with its effects and write it as a run, without noise.

    The motor is driven by a recorded torque, or by the position and velocity loop of the profile's
    table [control]. Friction sticks and slips, and backlash opens and closes, at exact times.
    """
    from winchkit.catalog import find
    from winchkit.cli.core.quantities import check_typed, quantity
    from winchkit.dynamics.forward import forward
    from winchkit.effects import load_catalogue
    from winchkit.regular_file import refuse_existing
    from winchkit.runs import read_run, write_run
    from winchkit.runs.info import summary_of
    from winchkit.schema.read import read_profile, read_programme
    from winchkit.sim.bench import programme_path

    refuse_existing(Path(output), replace)
    declared = read_profile(find("profiles", profile))
    speed = None
    if initial_speed is not None:
        dimension = "speed" if declared.is_linear else "angular speed"
        check_typed("--initial-speed", initial_speed, dimension)
        speed = quantity(initial_speed, dimension)
    with progress_bar() as progress:
        progress("integrating", None)
        run = forward(
            declared,
            programme=None if programme is None else read_programme(programme_path(programme)),
            torque=None if torque is None else read_run(torque),
            reference=None if reference is None else read_run(reference),
            catalogue=load_catalogue(effects),
            load_mass=None if load_mass is None else quantity(load_mass, "mass"),
            initial_speed=speed,
            rate=quantity(rate, "frequency"),
        )
    write_run(run, output, replace=replace)
    summary = summary_of(run)
    note(f"{output}: {summary.text}")
    tell({"profile": profile, "output": output, "summary": summary}, [])
