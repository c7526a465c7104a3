"""Workspaces against volumes in closed form, a linear programme, and the surface's own volume."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from small_robots import planar, small_robot
from winchkit.catalog import find
from winchkit.cli import main
from winchkit.errors import UsageError
from winchkit.robot import ForceLimits, Pose, Robot, read_robot, robot_of, wrench_feasibility
from winchkit.robot.workspace.circuits import Wrenches, margins
from winchkit.robot.workspace.mesh import mesh_of, write_mesh
from winchkit.robot.workspace.workspace import CableDemand, grid_of, workspace_of

CORNERS = np.array([[0.0, 0.0, 0.0], [3.0, 0.2, 0.1], [0.4, 2.8, 0.2], [0.9, 0.8, 2.5]])


def tetrahedron() -> Robot:
    exits = [tuple(corner) for corner in CORNERS.tolist()]
    centre = tuple(CORNERS.mean(axis=0).tolist())
    return small_robot(exits, [(0.0, 0.0, 0.0)] * 4, ("x", "y", "z"), centre)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10_000), rows=st.integers(2, 6), spare=st.integers(0, 3))
def test_margins_are_those_of_the_linear_programme(seed: int, rows: int, spare: int) -> None:
    rng = np.random.default_rng(seed)
    structure = rng.normal(size=(1, rows, rows + spare))
    wrench = rng.normal(size=(1, rows)) * 20
    low, high = rng.uniform(0, 10, rows + spare), rng.uniform(30, 90, rows + spare)
    whole = np.zeros((6, rows + spare))
    whole[:rows] = structure[0]
    right = np.zeros(6)
    right[:rows] = wrench[0]
    expected = wrench_feasibility(whole, right, ForceLimits(low, high)).margin
    found = margins(Wrenches(structure, wrench, low, high))[0][0]
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-6)


def test_wrenches_of_any_direction_are_those_of_the_worst_sampled_one() -> None:
    robot = robot_of(read_robot("cabtive"))
    pose = robot.home
    structure, weight = robot.structure(pose), robot.weight(pose)
    low, high = np.full(8, 5.0), np.full(8, 80.0)
    found = margins(Wrenches(structure, weight, low, high, (6.0, 0.3)))[0][0]
    rng = np.random.default_rng(2)
    push = rng.normal(size=(400, 6))
    push[:, :3] *= 6.0 / np.linalg.norm(push[:, :3], axis=1, keepdims=True)
    push[:, 3:] *= 0.3 / np.linalg.norm(push[:, 3:], axis=1, keepdims=True)
    sampled = margins(Wrenches(np.repeat(structure, 400, 0), weight + push, low, high))[0]
    assert found <= sampled.min() + 1e-9
    assert sampled.min() - found < 0.1 * (sampled.max() - sampled.min())


def test_wrench_closure_of_a_point_mass_is_the_tetrahedron_of_its_exit_points() -> None:
    robot = tetrahedron()
    volume = abs(np.linalg.det(CORNERS[1:] - CORNERS[0])) / 6
    found = workspace_of(robot, grid_of(robot, 0.05), CableDemand())
    counted, uncertainty = found.volume("wrench-closure")
    assert abs(counted - volume) < 0.1 * uncertainty
    assert mesh_of(found, "wrench-closure").volume == pytest.approx(volume, rel=0.1)


def test_three_hanging_cables_hold_a_point_mass_below_their_triangle() -> None:
    exits = ((0.0, 0.0, 3.0), (4.0, 0.0, 3.0), (1.0, 3.0, 3.0))
    robot = small_robot(exits, [(0.0, 0.0, 0.0)] * 3, ("x", "y", "z"), home=(1.5, 1.0, 1.5))
    found = workspace_of(robot, grid_of(robot, 0.05), CableDemand(ForceLimits(0.0, 1e6)))
    area = 0.5 * 4.0 * 3.0
    for index in (0, len(found.grid.axes[2]) // 2):
        assert found.area("wrench-feasible", index) == pytest.approx(area, rel=0.02)
    assert not found.inside("wrench-closure").any(), "nothing pulls downwards"


def test_twists_of_a_planar_platform_against_the_fastest_cable() -> None:
    robot = planar()
    grid = grid_of(robot, 0.2)
    demand = CableDemand(cable_speed=np.full(4, 0.5), speed=0.3, rotation_speed=1.0)
    found = workspace_of(robot, grid, demand).levels["twist-feasible"].ravel()
    pose = Pose(grid.positions, np.tile(np.eye(3), (len(grid.positions), 1, 1)))
    fastest = np.zeros(len(found))
    for direction in np.linspace(0, 2 * np.pi, 721):
        for turn in (-1.0, 1.0):
            twist = [0.3 * np.cos(direction), 0, 0.3 * np.sin(direction), 0, turn, 0]
            rate = np.abs(np.swapaxes(robot.structure(pose), 1, 2) @ twist)
            fastest = np.maximum(fastest, rate.max(axis=1))
    np.testing.assert_allclose(found, 0.5 - fastest, atol=1e-5)


def test_rotations_only_take_from_a_workspace() -> None:
    robot = robot_of(read_robot("cabtive"))
    demand = CableDemand(ForceLimits(5.0, 80.0))
    upright, turned = (
        workspace_of(robot, grid_of(robot, 0.1, turn=turn), demand) for turn in (0.0, 0.2)
    )
    assert len(turned.grid.rotation) == 7
    less = turned.levels["wrench-feasible"] <= upright.levels["wrench-feasible"]
    assert less.all()
    assert 0 < turned.volume("wrench-feasible")[0] < upright.volume("wrench-feasible")[0]


@pytest.mark.parametrize("suffix", [".ply", ".obj"])
def test_a_surface_is_closed_and_can_be_read_back(tmp_path: Path, suffix: str) -> None:
    robot = tetrahedron()
    mesh = mesh_of(workspace_of(robot, grid_of(robot, 0.1), CableDemand()), "wrench-closure")
    edges = Counter((int(face[k]), int(face[(k + 1) % 4])) for face in mesh.face for k in range(4))
    assert all(edges[b, a] == count for (a, b), count in edges.items())
    path = tmp_path / f"shape{suffix}"
    write_mesh(mesh, path)
    with pytest.raises(UsageError, match="exists already"):
        write_mesh(mesh, path)
    lines = path.read_text(encoding="ascii").splitlines()
    if suffix == ".ply":
        lines = lines[lines.index("end_header") + 1 :]
        vertex = [line.split() for line in lines[: len(mesh.vertex)]]
        first = lines[len(mesh.vertex)].split()[1:]
    else:
        vertex = [line.split()[1:] for line in lines if line.startswith("v ")]
        first = [str(int(n) - 1) for n in next(s for s in lines if s[:2] == "f ").split()[1:]]
    np.testing.assert_allclose(np.array(vertex, dtype=float), mesh.vertex, atol=1e-5)
    assert [int(number) for number in first] == mesh.face[0].tolist()


def test_a_hanging_platform_is_judged_in_its_poses_of_rest() -> None:
    robot = robot_of(read_robot("hanging-4"))
    found = workspace_of(robot, grid_of(robot, 0.5), CableDemand(ForceLimits(5.0, 400.0)))
    assert list(found.levels) == ["wrench-feasible"]
    volume, _ = found.volume("wrench-feasible")
    assert 10 < volume < 4 * 4 * 4.4, "below the four exit points, and not beside them"


@pytest.mark.parametrize(
    ("step", "box", "words"),
    [
        (5.0, None, "no cell of 5 m fits along x"),
        (0.1, (np.zeros(3), np.zeros(3)), "edges of 0, 0, 0 m"),
        (1e-4, None, "more than 20000000"),
        (1e-6, None, "more than 20000000"),
        (-1.0, None, "step"),
    ],
)
def test_a_grid_of_nothing_is_refused(step: float, box: object, words: str) -> None:
    with pytest.raises(UsageError, match=words):
        grid_of(robot_of(read_robot("cabtive")), step, box)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["cabtive"], "no limits of its cable forces; give --tension"),
        ([], "give a ROBOT, or --bench FILE"),
        (["cabtve", "--tension", "5N", "80N"], "there is no profile 'cabtve'"),
        (["cabtive", "--tension", "80N", "5N"], "low 80.0 N is not below high 5.0 N"),
        (["cabtive", "--tension", "5N", "80N", "--of", "clear"], "the conditions here are"),
        (["cabtive", "--tension", "5N", "80N", "-o", "a.txt"], "'.txt' is no format for it"),
        (["hanging-4", "--tension", "5N", "200N", "--force", "9N"], "leave --force and --moment"),
        (["cabtive", "--tension", "5N", "80N", "--from", "yaw=3deg"], "the box has x, y and z"),
    ],
)
def test_wrong_input_of_the_command_is_one_sentence(arguments: list[str], words: str) -> None:
    found = CliRunner().invoke(main, ["workspace", *arguments, "--step", "200mm"])
    assert found.exit_code != 0
    assert words in str(found.exception) + found.output


def test_a_bench_has_all_conditions(tmp_path: Path) -> None:
    text = find("sim", "cabtive-robot").read_text(encoding="utf-8")
    text = text.replace("sim-bench", "bench").replace("[robot]", '[robot]\nclearance = "20 mm"')
    tables = re.split(r"(?m)^(?=\[)", text)
    bench = tmp_path / "bench.toml"
    of_simulation = re.compile(r"\[(platform|noise|winch\.\d\.truth|\[)")
    bench.write_text("".join(t for t in tables if not of_simulation.match(t)), encoding="utf-8")
    csv = tmp_path / "cells.csv"
    found = CliRunner().invoke(
        main, ["workspace", "-b", str(bench), "--step", "200mm", "-o", str(csv)]
    )
    assert found.exit_code == 0, found.output
    head = csv.read_text(encoding="utf-8").splitlines()[0]
    assert head == (
        "x [m],y [m],z [m],wrench-feasible [N],wrench-closure [1],twist-feasible [m/s],clear [m]"
    )
