"""``winchkit hold-platform``: holds cable forces and pose of a robot while the command runs."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import click

from winchkit.cli.bench.holding import hold_on, until_rest
from winchkit.cli.bench.pose_option import read_pose
from winchkit.cli.core.command import Example, ToolCommand
from winchkit.cli.core.options import (
    bench_option,
    dry_run_option,
    duration_option,
    effects_option,
    quantity_option,
    take_over_option,
)
from winchkit.cli.core.output import json_flag, tell
from winchkit.errors import MotionError
from winchkit.schema.programme import ALL

_NEEDS_ROBOT = "needs a bench with a robot"
_REHEARSED = 1.0
"""Time of a dry run, s."""


@click.command(
    cls=ToolCommand,
    examples=(
        Example("winchkit hold-platform --preload 600N --for 5s -b robot.toml", _NEEDS_ROBOT),
        Example("winchkit hold-platform --pose x=0.1m -b robot.toml", _NEEDS_ROBOT),
    ),
)
@bench_option
@click.option(
    "--preload",
    metavar="FORCES",
    help="Forces nearest to it in all cables (600N), or those of cables by name (1=600N,2=500N).",
)
@click.option("--pose", metavar="POSE", help="Pose to hold by the tracker, x=0.1m,yaw=2deg.")
@duration_option("Stop after this time.  [default: until Ctrl-C]", "5 s")
@quantity_option(
    "--travel",
    of="length",
    default="10 mm",
    help="Of each cable either way from its place at the start; the bench trips where it is used "
    "up.",
)
@quantity_option("--speed", of="speed", default="50 mm/s", help="Largest speed of a cable.")
@quantity_option(
    "--axial-stiffness",
    of="force",
    example="200 kN",
    help="Of the cables, EA.  [default: by the profile]",
)
@take_over_option
@effects_option
@dry_run_option
@json_flag("Print what is held as JSON.")
def command(
    *,
    bench: str,
    preload: str | None,
    pose: str | None,
    duration: str | None,
    travel: str,
    speed: str,
    axial_stiffness: str | None,
    take_over: bool,
    effects: Sequence[str],
    dry_run: bool,
) -> None:
    """Hold the robot's platform: its cable forces by the load cells, its pose by the tracker.

    Forces that balance each other are changed until the cells show the set-point; the pose stays by
    the lengths of the cables. With --pose the tracker's pose is corrected to this one, within
    --travel of the cables; a coordinate that is not named is that of the present pose. All winches
    come to rest within 0.2 s of the end of this command. Exit code 5 where a force is more than 1 %
    of the mean force from the set-point at the end of --for.
    """
    from winchkit.bench.control.dead_man import DEAD_MAN
    from winchkit.cli.core.dry_run import station_for
    from winchkit.cli.core.quantities import optional, quantity, seconds

    limit = seconds(duration)
    forces = None if preload is None else _preload(preload)
    goal = None if pose is None else read_pose(pose)
    bounds = {"travel": quantity(travel, "length"), "speed": quantity(speed, "speed")}
    if (stiffness := optional(axial_stiffness, "force")) is not None:
        bounds["axial_stiffness"] = stiffness
    with station_for(
        bench, client="hold-platform", dry_run=dry_run, effects=effects, platform=True
    ) as station:
        if take_over:
            station.take_over(ALL)
        station.hold_platform(forces, goal, DEAD_MAN, bounds)
        hold_on(station, ALL, _REHEARSED if dry_run else math.inf if limit is None else limit)
        held = station.platform_held()
        station.release(ALL)
        until_rest(station, ALL)
    if dry_run:
        return
    tell(held, _lines(held, forces))
    _require_reached(held)


def _preload(text: str) -> float | dict[str, float]:
    """A force, or forces by cable; raises UsageError."""
    from winchkit.cli.core.quantities import check_typed, quantity

    pairs = [part.partition("=") for part in text.split(",")] if "=" in text else [("", "", text)]
    for _, _, value in pairs:
        check_typed("--preload", value.strip(), "force", example="600 N")
    forces = {name.strip(): quantity(value.strip(), "force") for name, _, value in pairs}
    return forces if "=" in text else forces[""]


def _lines(held: Mapping[str, Any], asked: float | Mapping[str, float] | None) -> Iterator[str]:
    """What is held, for a terminal."""
    force = held["force"] or {}
    if isinstance(asked, float) and any(abs(one - asked) > 0.5 for one in force.values()):
        yield (
            f"{asked:g} N in every cable would move the platform here; set are the forces "
            "nearest to that which balance its weight"
        )
    for name, one in force.items():
        measured, missing = held["measured"][name], held["missing"][name]
        shown = "no reading" if measured is None else f"{measured:.1f} N"
        yield f"{name}: {shown}, set {one:.1f} N, {missing:+.1f} N are missing that can be given"
    if held["position_error"] is not None:
        yield (
            f"platform: {held['position_error'] * 1e3:.3f} mm and "
            f"{math.degrees(held['rotation_error']):.4f} deg from its pose, by the tracker"
        )


def _require_reached(held: Mapping[str, Any]) -> None:
    """Raise MotionError where a force that could be given is missing."""
    from winchkit.bench.control.tension_control import HELD

    if held["force"] is None:
        return
    limit = HELD * sum(held["force"].values()) / len(held["force"])
    name, missing = max(held["missing"].items(), key=lambda item: abs(item[1]))
    if abs(missing) > limit:
        raise MotionError(
            f"cable {name}: {missing:+.1f} N are missing at the end (limit {limit:.1f} N); hold it "
            "longer, or give --axial-stiffness: by the bound of the profile a soft cable is slow"
        )
