"""What ``winchkit check`` says about robots: whether the cables can hold the platform at home."""

from __future__ import annotations

from typing import TYPE_CHECKING

from winchkit.errors import Fault

if TYPE_CHECKING:
    from winchkit.robot.geometry.robot import Robot
    from winchkit.schema.bench import BenchSpec
    from winchkit.schema.profiles.robot import RobotProfile
    from winchkit.schema.reading.lines import Key

Said = list[tuple["Key", str]]
_NEAR = 1e-3
"""m and rad: far above the tolerance of the solution, below what a profile can mean by another
pose."""


def faults_and_warnings(
    file: str, value: RobotProfile
) -> tuple[tuple[Fault, ...], tuple[Fault, ...]]:
    """Faults and warnings of a robot's geometry at home."""
    from winchkit.robot.geometry.robot import robot_of
    from winchkit.schema.reading.source import open_source

    source, robot = open_source(file), robot_of(value)
    faults = _lengths(robot)
    warnings: Said = []
    if not faults and robot.hangs:
        faults, warnings = _hanging(robot)
    elif not faults:
        faults, warnings = _held(robot)
    return (
        tuple(source.fault(key, message) for key, message in faults),
        tuple(source.fault(key, message) for key, message in warnings),
    )


def clearance_at_home(file: str, spec: BenchSpec) -> tuple[tuple[Fault, ...], tuple[Fault, ...]]:
    """Warnings of a bench whose cables are too near to each other or to a body at home."""
    from winchkit.robot.bench.wiring import robot_of_bench
    from winchkit.robot.workspace.distances import distances
    from winchkit.schema.reading.source import open_source

    wiring, robot = spec.robot, robot_of_bench(spec)
    if wiring is None or robot is None or wiring.clearance is None:
        return (), ()
    source = open_source(file)
    found = distances(robot, wiring.body, robot.home, wiring.clearance)
    near = (found.distance[0] < wiring.clearance).nonzero()[0].tolist()
    return (), tuple(
        source.fault(("robot", "clearance"), f"at home {found.text(0, column)}") for column in near
    )


def _lengths(robot: Robot) -> Said:
    """Lines whose cable has no way from the pulley to the platform."""
    from math import isfinite

    return [
        (
            ("line", n, "anchor_point"),
            f"at home the anchor of line {name} lies inside its swivel pulley "
            f"(swivel_radius {radius * 1e3:g} mm); move home, or mend the points",
        )
        for n, (name, length, radius) in enumerate(
            zip(robot.names, robot.home_length, robot.geometry.swivel_radius, strict=True)
        )
        if not (isfinite(length) and length > 0)
    ]


def _held(robot: Robot) -> tuple[Said, Said]:
    """As many lines as degrees of freedom: do pulling cables balance the weight?"""
    from winchkit.robot.forces.force_distribution import ForceLimits, wrench_feasibility

    limits = ForceLimits(0.0, float("inf"))
    weight = robot.weight(robot.home)[0]
    found = wrench_feasibility(robot.structure(robot.home)[0], weight, limits)
    mass = robot.profile.platform.mass
    if not found.feasible:
        return [
            (
                ("home",),
                f"no pulling cables hold the platform of {mass:g} kg there: some cable would "
                "have to push; move home, or mend exit_point, anchor_point or center_of_mass",
            )
        ], []
    if mass == 0 and not found.margin > 0:
        return [], [(("platform",), "without mass nothing keeps the cables taut; give mass")]
    return [], []


def _hanging(robot: Robot) -> tuple[Said, Said]:
    """Fewer lines: the platform hangs, and home should be where it comes to rest."""
    import numpy as np

    from winchkit.model.rotation import angles_of
    from winchkit.robot.geometry.forward import forward

    platform = robot.profile.platform
    if platform.mass == 0:
        few = f"{len(robot.names)} lines leave the platform free, only its weight settles its pose"
        return [(("platform",), f"{few}; give mass")], []
    warnings: Said = []
    if names := robot.planar:
        listed = ", ".join(f'"{name}"' for name in names)
        words = f"all cables lie in one plane; is it planar, with degrees_of_freedom = [{listed}]?"
        warnings.append((("platform",), words))
    found = forward(robot.geometry, robot.home_length[None], robot.home, platform)
    if not found.converged[0]:
        return [(("home",), "with the cables' lengths at home the platform hangs nowhere")], []
    there, turned = found.pose.position[0], angles_of(found.pose.rotation[0])
    moved = float(np.linalg.norm(there - robot.home.position[0]))
    if moved <= _NEAR and np.allclose(found.pose.rotation, robot.home.rotation, atol=_NEAR):
        return [], warnings
    place = ", ".join(f'"{x * 1e3:.4g} mm"' for x in there)
    angles = ", ".join(f'"{np.degrees(angle):.4g} deg"' for angle in turned)
    return [], [
        *warnings,
        (
            ("home",),
            f"the platform does not rest there; with these cables it hangs at "
            f"position = [{place}], rotation = [{angles}]",
        ),
    ]
