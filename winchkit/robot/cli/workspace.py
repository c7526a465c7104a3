"""``winchkit workspace``: where a robot's cables hold and move its platform."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.options import PROFILE, bench_file_option, output_option, quantity_option
from winchkit.cli.core.output import json_flag, tell
from winchkit.cli.core.quantity_type import QuantityType
from winchkit.errors import UsageError
from winchkit.quantity_text import with_std

if TYPE_CHECKING:
    from winchkit.robot.geometry.robot import Robot
    from winchkit.robot.workspace.workspace import CableDemand, Grid, Workspace

_FORCE = QuantityType("force", example="20 N")
_SPEED = QuantityType("speed", example="0.3 m/s")
_PLACE = "x=-1m,y=-1m,z=0m"
_SLICES = 12
"""Rows of the table of areas: a screen; the file has every cell."""


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit workspace cabtive --tension '5 N' '80 N'",
        "winchkit workspace cabtive --tension '5 N' '80 N' --turn '10 deg' -o cabtive.ply",
    ),
)
@click.argument("robot", required=False, type=PROFILE)
@bench_file_option("Take robot, limits and bodies of a bench file.")
@click.option(
    "--tension", nargs=2, type=_FORCE, metavar="LOW HIGH", help="Limits of the cable forces."
)
@click.option("--force", type=_FORCE, help="Further force on the platform, in any direction.")
@quantity_option(
    "--moment",
    of="torque",
    example="2 N m",
    help="Further moment about its origin, in any direction.",
)
@click.option("--cable-speed", type=_SPEED, help="Limit of the speed of every cable.")
@click.option("--speed", type=_SPEED, help="Speed of the platform, in any direction.")
@quantity_option(
    "--rotation-speed",
    of="angular speed",
    example="20 deg/s",
    help="Speed of its rotation, about any axis.",
)
@quantity_option(
    "--turn",
    of="angle",
    example="10 deg",
    help="Ask also for rotations by this about each axis, both ways.",
)
@quantity_option(
    "--step", of="length", example="50 mm", help="Edge of a cell.  [default: a fortieth of the box]"
)
@click.option("--from", "start", metavar="PLACE", help=f"Lowest corner of the box, {_PLACE}.")
@click.option("--to", "end", metavar="PLACE", help="Highest corner.")
@click.option("--of", "condition", metavar="CONDITION", help="Condition of the mesh.")
@output_option("Write the surface (.ply, .obj) or every cell (.csv).")
@click.option("--replace", is_flag=True, help="Write over a file of that name.")
@json_flag("Print the answer as JSON, in SI units.")
def command(
    robot: str | None,
    bench: str | None,
    tension: tuple[str, str] | None,
    force: str | None,
    moment: str | None,
    cable_speed: str | None,
    speed: str | None,
    rotation_speed: str | None,
    turn: str | None,
    step: str | None,
    start: str | None,
    end: str | None,
    condition: str | None,
    output: str | None,
    replace: bool,
) -> None:
    """Compute the workspace of ROBOT, a profile, on a grid of positions.

    wrench-feasible: forces within the limits hold the platform's weight, and --force and --moment.
    wrench-closure: pulling cables can balance any wrench. twist-feasible: no cable is too fast for
    --speed and --rotation-speed. clear: cables keep the clearance of the bench file. A position
    counts where all rotations of --turn do; without it the rotation is that of home.
    """
    from winchkit.cli.core.early_checks import check_output
    from winchkit.cli.core.quantities import optional, quantity
    from winchkit.regular_file import refuse_existing
    from winchkit.robot.workspace.workspace import grid_of, workspace_of

    if output:
        check_output(output, (".ply", ".obj", ".csv"))
        refuse_existing(Path(output), replace)
    given: dict[str, Any] = {
        "force": optional(force, "force"),
        "moment": optional(moment, "torque"),
        "cable_speed": optional(cable_speed, "speed"),
        "speed": optional(speed, "speed"),
        "rotation_speed": optional(rotation_speed, "angular speed"),
        "tension": None if not tension else [quantity(one, "force") for one in tension],
    }
    model, demand = _demanded(robot, bench, {k: v for k, v in given.items() if v is not None})
    if model.hangs and (force or moment):
        raise UsageError(
            f"robot '{model.profile.name}' hangs on {len(model.names)} cables, which hold its "
            "weight at rest only: leave --force and --moment out"
        )
    grid = grid_of(
        model, optional(step, "length"), _box(model, start, end), optional(turn, "angle") or 0.0
    )
    found = workspace_of(model, grid, demand)
    chosen = condition or next(iter(found.levels))
    if chosen not in found.levels:
        raise UsageError(f"--of '{chosen}': the conditions here are {', '.join(found.levels)}")
    tell({"robot": model.profile.name, **_figures(found)}, [_text(model, found, demand)])
    if output:
        _write(found, chosen, Path(output))


def _demanded(
    robot: str | None, bench: str | None, given: dict[str, Any]
) -> tuple[Robot, CableDemand]:
    """The robot and what is asked of it: options before the bench file's numbers."""
    import numpy as np

    from winchkit.catalog import find
    from winchkit.effects.catalogue import load_catalogue
    from winchkit.robot.effects.bind import robot_with_effects
    from winchkit.robot.forces.force_distribution import ForceLimits
    from winchkit.robot.workspace.workspace import CableDemand
    from winchkit.schema.read import read_bench, read_robot

    if (robot is None) == (bench is None):
        raise UsageError("give a ROBOT, or --bench FILE with one")
    if bench is not None:
        from winchkit.robot.bench.planner import Planner

        planner = Planner.of(read_bench(bench))
        model, wiring = planner.robot, planner.wiring
        own: dict[str, Any] = {
            "tension": wiring.tension,
            "cable_speed": [planner.limits[name].speed for name in model.names],
            "speed": wiring.speed,
            "rotation_speed": wiring.rotation_speed,
            "clearance": wiring.clearance,
            "bodies": wiring.body,
        }
        given = {**own, **given}
    else:
        model = robot_with_effects(read_robot(find("profiles", str(robot))), load_catalogue())
        if "tension" not in given:
            raise UsageError(
                f"robot '{model.profile.name}' has no limits of its cable forces; give "
                "--tension LOW HIGH, such as --tension '5 N' '100 N', or --bench FILE"
            )
    given["tension"] = ForceLimits(*given["tension"])
    if "cable_speed" in given:
        given["cable_speed"] = np.broadcast_to(given["cable_speed"], (len(model.names),))
    return model, CableDemand(**given)


def _box(robot: Robot, start: str | None, end: str | None) -> Any:
    """Corners of the box, m; the default where neither is given."""
    from winchkit.cli.bench.pose_option import read_pose
    from winchkit.robot.workspace.workspace import usual_box

    corners = [corner.copy() for corner in usual_box(robot)]
    for corner, text in zip(corners, (start, end), strict=True):
        for name, value in (read_pose(text) if text else {}).items():
            if name not in {"x", "y", "z"}:
                raise UsageError(f"'{text}': the box has x, y and z; rotations are --turn")
            corner["xyz".index(name)] = value
    return tuple(corners)


def _unit(grid: Grid, *, sliced: bool = False) -> str:
    count = sum(map(bool, grid.free)) - sliced
    return {3: "m^3", 2: "m^2", 1: "m", 0: ""}[count]


def _figures(found: Workspace) -> dict[str, Any]:
    grid = found.grid
    conditions = {}
    for name in found.levels:
        volume, uncertainty = found.volume(name)
        conditions[name] = {
            "volume": volume,
            "uncertainty": uncertainty,
            "largest_level": float(found.levels[name].max()),
        }
    return {
        "step": grid.step,
        "shape": list(grid.shape),
        "rotations": len(grid.rotation),
        "unit": _unit(grid),
        "conditions": conditions,
        "slices": [
            {"z": float(z), **{name: found.area(name, k) for name in found.levels}}
            for k, z in enumerate(grid.axes[2])
        ],
    }


def _text(robot: Robot, found: Workspace, demand: CableDemand) -> str:
    """Volumes of all conditions, and areas at some heights."""
    grid = found.grid
    poses = len(grid.positions) * len(grid.rotation)
    about = (
        "in the rotation of home"
        if len(grid.rotation) == 1
        else (f"in {len(grid.rotation)} rotations each")
    )
    size = f"{poses} poses, cells of {grid.step * 1e3:.4g} mm"
    lines = [f"{robot.profile.name}: where each condition holds, {about} ({size})"]
    for name in found.levels:
        volume, uncertainty = found.volume(name)
        size = f"{with_std(volume, uncertainty, '1')} {_unit(grid)}" if volume else "nowhere"
        lines.append(f"{name:16} {size:24} {_asked(name, demand)}".rstrip())
    if grid.free[2] and len(grid.axes[2]) > 1:
        unit = _unit(grid, sliced=True)
        lines.append("\nz [m]   " + "  ".join(f"{f'{n} [{unit}]':>22}" for n in found.levels))
        count = len(grid.axes[2])
        rows = sorted({round(k * (count - 1) / (_SLICES - 1)) for k in range(_SLICES)})
        for k in rows:
            areas = "  ".join(f"{found.area(name, k):22.4g}" for name in found.levels)
            lines.append(f"{grid.axes[2][k]:<8.3f}{areas}")
    return "\n".join(lines)


def _asked(name: str, demand: CableDemand) -> str:
    from math import degrees

    if name == "wrench-feasible" and demand.tension is not None:
        extra = (
            f", {demand.force:g} N, {demand.moment:g} N m" if demand.force + demand.moment else ""
        )
        return f"{demand.tension.low:g} N to {demand.tension.high:g} N, weight{extra}"
    if name == "twist-feasible":
        return f"{demand.speed:g} m/s, {degrees(demand.rotation_speed):.3g} deg/s"
    if name == "clear":
        return f"clearance {(demand.clearance or 0.0) * 1e3:g} mm"
    return ""


def _write(found: Workspace, condition: str, path: Path) -> None:
    import numpy as np

    from winchkit.cli.core.messages import note
    from winchkit.robot.workspace.mesh import mesh_of, write_mesh

    if path.suffix == ".csv":
        head = ",".join(
            ["x [m]", "y [m]", "z [m]", *(f"{name} [{_LEVELS[name]}]" for name in found.levels)]
        )
        rows = np.column_stack([found.grid.positions, *(v.ravel() for v in found.levels.values())])
        np.savetxt(path, rows, "%.6g", delimiter=",", header=head, comments="")
    else:
        write_mesh(mesh_of(found, condition), path, replace=True)
    note(f"written: {path}")


_LEVELS = {"wrench-feasible": "N", "wrench-closure": "1", "twist-feasible": "m/s", "clear": "m"}
"""Units of the levels."""
