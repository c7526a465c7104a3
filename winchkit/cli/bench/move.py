"""``winchkit move``: moves a winch, or all as one, to a cable length, or a robot to a pose."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from winchkit.cli.bench.direction_option import direction_options, read_direction
from winchkit.cli.bench.holding import until_rest
from winchkit.cli.bench.pose_option import pose_line, read_pose
from winchkit.cli.core.command import Example, ToolCommand
from winchkit.cli.core.options import (
    bench_option,
    dry_run_option,
    effects_option,
    quantity_option,
    take_over_option,
    winch_argument,
)
from winchkit.cli.core.output import json_flag, tell
from winchkit.cli.core.terminal import status_line
from winchkit.errors import UsageError
from winchkit.schema.programme import ALL

if TYPE_CHECKING:
    from winchkit.bench.direction import DirectionKeyword


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit move A --to '3.9 m' --speed '0.2 m/s'",
        "winchkit move all --pay-out 50mm -b bench.toml",
        Example("winchkit move --pose x=0.1m,yaw=2deg -b robot.toml", "needs a bench with a robot"),
    ),
)
@winch_argument
@bench_option
@quantity_option("--to", of="length", example="2 m", help="Cable length to go to.")
@direction_options("LENGTH")
@click.option("--pose", metavar="POSE", help="Pose of the robot's platform, x=0.1m,yaw=2deg.")
@click.option("--pose-by", metavar="POSE", help="Change of that pose.")
@quantity_option(
    "--speed",
    of="speed",
    example="0.1 m/s",
    help="Speed, without a direction.  [default: limit of winch or robot]",
)
@quantity_option(
    "--acceleration",
    of="acceleration",
    example="0.5 m/s^2",
    help="[default: limit of winch or robot]",
)
@take_over_option
@effects_option
@dry_run_option
@json_flag("Print where it stands as JSON.")
def command(
    winch: str | None,
    *,
    bench: str,
    to: str | None,
    pay_out: str | None,
    wind_in: str | None,
    pose: str | None,
    pose_by: str | None,
    speed: str | None,
    acceleration: str | None,
    take_over: bool,
    effects: Sequence[str],
    dry_run: bool,
) -> None:
    """Move WINCH to a cable length, or by one, on an S-curve; then disable it.

    With --pose or --pose-by the platform of the bench's robot moves on a line: before it begins,
    cable lengths, speeds and forces along the whole path are compared with their limits. A
    coordinate (x, y, z, roll, pitch, yaw) that is not named stays as it is.

    WINCH may be left out where there is one, and be "all": then all winches start in one control
    cycle and arrive together. Ctrl-C stops. Attaches to the process that owns the bench where
    there is one; then the motion ends with this command too.
    """
    from winchkit.cli.core.dry_run import station_for
    from winchkit.cli.core.quantities import optional

    direction = read_direction(pay_out, wind_in)
    limit, gentle = optional(speed, "speed"), optional(acceleration, "acceleration")
    if pose is not None or pose_by is not None:
        if winch is not None or to is not None or direction is not None:
            raise UsageError("a pose is of the platform: give neither WINCH nor a LENGTH with it")
        if pose is not None and pose_by is not None:
            raise UsageError("give one of --pose and --pose-by")
        goal = read_pose(pose or pose_by or "")
        with station_for(bench, client="move", dry_run=dry_run, effects=effects) as station:
            if take_over:
                station.take_over(ALL)
            station.move_pose(goal, pose is None, limit, gentle)
            until_rest(station, ALL)
            status, there = station.status(), station.pose()
        if not dry_run:
            tell({**status, "pose": there}, [pose_line(there)])
        return
    if (to is None) == (direction is None):
        raise UsageError(
            "no destination is given: give one of --to, --pay-out and --wind-in, each a "
            "LENGTH; or --pose"
        )
    target = optional(to, "length")
    change: DirectionKeyword = {} if direction is None else direction.length
    with station_for(
        bench, client="move", dry_run=dry_run, effects=effects, winch=winch
    ) as station:
        if take_over:
            station.take_over(winch)
        station.move(winch, to=target, **change, speed=limit, acceleration=gentle)
        until_rest(station, winch)
        status = station.status()
    if not dry_run:
        tell(status, [status_line(status)])
