"""Readings against the weight of a platform: closed forms, plane statics, which faults are seen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import date
from functools import cache
from math import cos, hypot, sin, sqrt
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import root

from small_robots import small_robot
from winchkit.arrays import Array
from winchkit.catalog import find
from winchkit.robot import Pose, Robot, robot_of
from winchkit.robot.bench.balance_check import MOST, Sources, check_of, sources_of
from winchkit.robot.dynamics.rest import rest_poses
from winchkit.robot.forces.force_distribution import ForceLimits, null_space, quadratic
from winchkit.schema.profiles.robot import FittedSpec, Point
from winchkit.schema.read import read_robot
from winchkit.schema.robot_bench import RobotWiring
from winchkit.units import GRAVITY

WIRING = RobotWiring("winding-device-8", 0.2, (60.0, 2000.0))
MASS = 4.0
EXITS: tuple[Point, ...] = ((-1.5, 0.0, 2.5), (1.4, 0.0, 2.2))
ANCHORS: tuple[Point, ...] = ((-0.2, 0.0, 0.1), (0.25, 0.0, 0.12))
CENTRE: Point = (0.02, 0.0, -0.05)


def exact(count: int) -> Sources:
    """Everything is known, but for a zero of the cells that keeps the covariance regular."""
    none, points = np.zeros(count), np.zeros((count, 3))
    return Sources(none, points, points, none, none, none, np.zeros(4), np.zeros(6), 1e-7)


def test_a_point_mass_on_three_cables_is_judged_as_the_closed_form() -> None:
    """Cells and the mass are unknown: the covariance of the forces is one matrix plus a dyad."""
    turns, height = np.arange(3) * 2 * np.pi / 3, 1.5
    exits = [(2.0 * cos(turn), 2.0 * sin(turn), 1.0 + height) for turn in turns.tolist()]
    robot = small_robot(exits, [(0.0, 0.0, 0.0)] * 3, ("x", "y", "z"), mass=MASS)
    upward = height / hypot(2.0, height)
    force = np.full((1, 3), MASS * GRAVITY / (3 * upward))
    std, heavier = 0.8, 0.3
    payload = np.array([heavier, 0.0, 0.0, 0.0])
    sources = replace(exact(3), payload=payload, zero=std)
    check = check_of(robot, sources, robot.home, force)
    along, spread = 1 / (3 * upward), (heavier * GRAVITY / std) ** 2
    for deviation in (np.array([1.0, 0.0, 0.0]), np.array([0.3, -0.7, 0.1]), np.ones(3)):
        sum_along = along * float(deviation.sum())
        taken = sum_along**2 * spread / (1 + 3 * along**2 * spread)
        wanted = sqrt(float(deviation @ deviation) - taken) / std
        assert check.size(0, deviation) == pytest.approx(wanted, rel=1e-6)
    _, words = check.words(0, force[0] * 5.0)
    assert f"a load that is {5.0 * MASS:+.1f} kg heavier would explain it" in words


class Plate:
    """A plate on two cables in the plane of x and z, whose rest is that of plane statics."""

    def __init__(self) -> None:
        self.exits, self.anchors = np.array(EXITS), np.array(ANCHORS)
        self.centre, self.mass = np.array(CENTRE), MASS
        self.robot = small_robot(
            EXITS,
            ANCHORS,
            ("x", "z", "pitch"),
            mass=MASS,
            center_of_mass=CENTRE,
            inertia=(0.02, 0.04, 0.03),
        )
        rest = rest_poses(self.robot, self.robot.home)
        self.pose, self.force = rest.pose, rest.force[0]
        self.length = self.robot.lengths(rest.pose)[0]
        turned = rest.pose.rotation[0]
        x, _, z = rest.pose.position[0].tolist()
        self.start = np.array([x, z, float(np.arctan2(turned[0, 2], turned[0, 0])), *self.force])

    def forces(self) -> Array:
        """Forces at the rest of the present numbers, (2,), N."""

        def left(unknown: Array) -> Array:
            x, z, pitch, *force = unknown.tolist()
            turn = np.array([[cos(pitch), sin(pitch)], [-sin(pitch), cos(pitch)]])
            weight = -self.mass * GRAVITY
            lever = turn @ self.centre[::2]
            balance = np.array([0.0, weight, -lever[0] * weight])
            out = []
            for e, b, length, pull in zip(
                self.exits, self.anchors, self.length, force, strict=True
            ):
                arm = turn @ b[::2]
                way = e[::2] - [x, z] - arm
                there = float(np.linalg.norm(way))
                ux, uz = (way / there).tolist()
                balance += pull * np.array([ux, uz, arm[1] * ux - arm[0] * uz])
                out.append(there - length)
            return np.array([*balance, *out])

        found = root(left, self.start, tol=1e-14)
        assert np.abs(left(found.x)).max() < 1e-9
        return np.asarray(found.x[3:])


def _moved(name: str, line: int, axis: int) -> Callable[[Plate, float], Sources]:
    def apply(plate: Plate, size: float) -> Sources:
        array = {"exit_point": plate.exits, "anchor_point": plate.anchors}[name]
        array[line, axis] += size
        std = np.zeros((2, 3))
        std[line, axis] = size
        changed: dict[str, Any] = {name: std}
        return replace(exact(2), **changed)

    return apply


def _longer(line: int) -> Callable[[Plate, float], Sources]:
    def apply(plate: Plate, size: float) -> Sources:
        plate.length[line] += size
        return replace(exact(2), home=size * np.eye(2)[line])

    return apply


def _heavier(index: int) -> Callable[[Plate, float], Sources]:
    def apply(plate: Plate, size: float) -> Sources:
        if index == 0:
            plate.mass += size
        else:
            plate.centre[index - 1] += size
        return replace(exact(2), payload=size * np.eye(4)[index])

    return apply


@pytest.mark.parametrize(
    "error",
    [
        *(
            _moved(name, line, axis)
            for name in ("exit_point", "anchor_point")
            for line in (0, 1)
            for axis in (0, 2)
        ),
        *(_longer(line) for line in (0, 1)),
        *(_heavier(index) for index in (0, 1, 3)),
    ],
)
def test_an_error_of_one_standard_deviation_of_a_hanging_plate_is_found_as_one(
    error: Callable[[Plate, float], Sources],
) -> None:
    """The plate hangs in another pose with other forces, which no wrong derivative explains."""
    plate = Plate()
    assert plate.forces() == pytest.approx(plate.force, abs=1e-7)
    sources = error(plate, 1e-5)
    check = check_of(plate.robot, sources, plate.pose, plate.force[None])
    assert check.size(0, plate.forces() - plate.force) == pytest.approx(1.0, rel=0.02)


@cache
def platform(*, calibrated: bool = False) -> tuple[Robot, Array, Array]:
    """The winding device's robot at home with forces that balance."""
    profile = read_robot(find("profiles", "winding-device-8"))
    points = [
        f"{line}.{name}.{axis}"
        for line in "12345678"
        for name in ("exit_point", "anchor_point")
        for axis in "xyz"
    ]
    fitted = FittedSpec(date(2026, 11, 29), std=dict.fromkeys(points, "0.2 mm"))
    robot = robot_of(replace(profile, fitted=fitted if calibrated else None))
    structure = robot.structure(robot.home)[0]
    limits = ForceLimits(*WIRING.tension)
    return robot, structure, quadratic(structure, robot.weight(robot.home)[0], limits).value


@given(signs=st.lists(st.floats(-1.0, 1.0), min_size=8, max_size=8), preload=st.floats(-9e3, 9e3))
@settings(max_examples=50, deadline=None)
def test_usual_friction_in_all_cables_and_any_preload_trip_nothing(
    signs: list[float], preload: float
) -> None:
    robot, structure, force = platform()
    sources = sources_of(robot, WIRING, np.full(8, 1e-5), described=False)
    check = check_of(robot, sources, robot.home, force[None])
    # Three pulleys with wraps of 90, 180 and 90 degrees and a friction of 0.02.
    friction = 0.02 * (2 * sqrt(2) + 2) * force
    readings = np.array(signs) * friction + preload * null_space(structure)[:, 0]
    assert check.size(0, readings) < MOST


def test_a_yaw_of_a_degree_is_explained_and_its_least_norm_forces_are_not() -> None:
    """Forces that balance at the true pose, seen from one that is turned by 0.6 degrees."""
    robot, _, _ = platform()
    turn = np.radians(0.6)
    turned = np.array([[cos(turn), -sin(turn), 0], [sin(turn), cos(turn), 0], [0, 0, 1.0]])
    there = Pose(robot.home.position, turned[None])
    true, weight = robot.structure(there)[0], robot.weight(there)[0]
    shown = quadratic(true, weight, ForceLimits(*WIRING.tension)).value
    _, structure, force = platform()
    sources = sources_of(robot, WIRING, np.full(8, 1e-5), described=False)
    check = check_of(robot, sources, robot.home, force[None])
    null = null_space(structure)
    least = shown - force - null @ (null.T @ (shown - force))
    assert np.abs(least).max() > 0.1 * force.mean()
    assert check.size(0, shown - force) < 1.0


def test_words_name_what_explains_and_nothing_where_two_cells_are_wrong() -> None:
    robot, structure, force = platform()
    sources = sources_of(robot, WIRING, np.full(8, 1e-5), described=False)
    check = check_of(robot, sources, robot.home, force[None])
    two = 1500.0 * (np.eye(8)[0] - np.eye(8)[4])
    assert "explain" not in check.words(0, two)[1]
    heavier = -np.linalg.pinv(structure) @ robot.weight(robot.home)[0] * 0.5
    assert "a load that is +51.0 kg heavier" in check.words(0, heavier)[1]


def test_a_calibrated_robot_with_known_friction_sees_smaller_errors() -> None:
    """The sizes that docs/safety.md states, as shares of the mean force and of the weight."""
    seen = []
    for calibrated in (False, True):
        robot, structure, force = platform(calibrated=calibrated)
        sources = sources_of(robot, WIRING, np.full(8, 1e-5), described=calibrated)
        if calibrated:  # with `pulley-dahl` of 0.0128 and a standard deviation of a fifth
            sources = replace(sources, reading=np.full(8, hypot(0.01, 0.0124)))
        check = check_of(robot, sources, robot.home, force[None])
        cell = max(MOST / check.size(0, one) for one in np.eye(8))
        lifted = -np.linalg.pinv(structure) @ robot.weight(robot.home)[0]
        seen.append([cell / force.mean(), MOST / check.size(0, lifted)])
    assert np.array(seen) == pytest.approx(np.array([[0.61, 0.22], [0.195, 0.177]]), abs=5e-3)
