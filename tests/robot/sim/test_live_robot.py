"""A simulated robot behind real CAN frames, in simulated time: moves, cells, and its tracker."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.spatial.transform import Rotation

from winchkit import open_bench
from winchkit.arrays import Array
from winchkit.bench.bench import Bench
from winchkit.catalog import find
from winchkit.cli import main
from winchkit.errors import FileError, NotPermitted, UsageError
from winchkit.robot.sim.build import build_robot
from winchkit.runs import read_run
from winchkit.schema.read import read_programme, read_simbench
from winchkit.sim.bench import profiles_of, programme_path
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.live.bench import LiveBench
from winchkit.sim.live.control import obey
from winchkit.sim.physics.parameters import overridden
from winchkit.sim.plant.kinematics import Kinematics
from winchkit.sim.record import simulate


@pytest.fixture(scope="module")
def clock() -> SimulatedClock:
    return SimulatedClock()


@pytest.fixture(scope="module")
def live(clock: SimulatedClock) -> Iterator[LiveBench]:
    sim = read_simbench(find("sim", "winding-device-robot"))
    sim = replace(sim, bench=replace(sim.bench, cycle=0.02))
    with LiveBench(sim, seed=1, simulated_time=clock) as running:
        yield running


@pytest.fixture(scope="module")
def poses(live: LiveBench) -> list[dict[str, Any]]:
    received: list[dict[str, Any]] = []
    assert live.robot is not None
    live.robot.on_pose = lambda datagram: received.append(json.loads(datagram))
    return received


@pytest.fixture(scope="module")
def bench(live: LiveBench, clock: SimulatedClock, poses: list[Any]) -> Iterator[Bench]:
    with open_bench(live.bench_spec, clock) as opened:
        clock.sleep(0.3)
        yield opened


def truth(live: LiveBench) -> Array:
    assert live.robot is not None
    return live.robot.platform.position


@pytest.mark.slow
def test_at_home_the_cells_show_the_equilibrium(bench: Bench, live: LiveBench) -> None:
    assert truth(live) == pytest.approx([0, 0, 0.2], abs=1e-6)
    assert live.robot is not None
    shown = [bench.snapshot.winch[name].tension for name in live.robot.profiles]
    assert shown == pytest.approx(live.robot.platform.tension.tolist(), abs=3.0)


@pytest.mark.slow
def test_a_move_moves_the_platform_and_the_friction_shows_at_the_cells(
    bench: Bench, live: LiveBench, poses: list[dict[str, Any]]
) -> None:
    goal = bench.robot.moved({"x": 0.04, "z": 0.03}, relative=True)
    seen: list[tuple[float, float, float]] = []

    def watch(snapshot: Any) -> None:
        one = snapshot.winch["1"]
        seen.append((one.cable_speed, one.tension, live.winches["1"].plant.load))

    remove = bench.on_cycle(watch)
    bench.robot.move(goal, 0.05)
    remove()
    assert truth(live) == pytest.approx(goal.position[0], abs=4e-3)
    speed, cell, there = np.array(seen).T
    moving = np.abs(speed) > 0.01
    share = np.median((cell[moving] - there[moving]) * -np.sign(speed[moving])) / there.mean()
    assert 0.02 < share < 0.15, "more where cable is wound in, by the friction of three pulleys"
    # The tracker's frame is the base frame here; its last datagram is 8 ms to 20 ms old.
    assert poses[-1]["position"] == pytest.approx(truth(live), abs=5e-4)
    times = np.array([pose["time"] for pose in poses])
    assert np.diff(times) == pytest.approx(0.01, abs=3e-3)


@pytest.mark.slow
def test_the_load_of_one_winch_of_a_robot_cannot_be_changed(bench: Bench, live: LiveBench) -> None:
    with pytest.raises(NotPermitted, match="platform of a robot"):
        live.hang("1", 20.0)
    assert "platform: x" in obey(live, "status")


def test_the_tracker_shows_poses_in_a_frame_of_its_own() -> None:
    sim = read_simbench(find("sim", "cabtive-robot"))
    received: list[dict[str, Any]] = []
    ages: list[float] = []
    clock = SimulatedClock()
    started = clock.now()

    def take(datagram: bytes) -> None:
        received.append(json.loads(datagram))
        ages.append(clock.now() - started - received[-1]["time"])

    bare = replace(sim.bench, winch={n: replace(w, cell=None) for n, w in sim.bench.winch.items()})
    with LiveBench(replace(sim, bench=bare), simulated_time=clock) as live:
        assert live.robot is not None
        live.robot.on_pose = take
        clock.sleep(0.1)
    assert sim.platform is not None
    frame = sim.platform.tracker
    assert ages == pytest.approx([frame.delay] * len(ages), abs=1e-5), "a multiple of the tick"
    roll, pitch, yaw = frame.rotation
    turn = Rotation.from_euler("ZYX", [yaw, pitch, roll])
    expected = turn.apply([0.36, 0.558, 0.56]) + frame.position
    assert received[-1]["position"] == pytest.approx(expected, abs=2e-4)
    w, x, y, z = received[-1]["quaternion"]
    assert (Rotation.from_quat([x, y, z, w]) * turn.inv()).magnitude() < 3e-3
    assert received[-1].keys() == {"schema", "body", "time", "position", "quaternion"}


def test_the_hidden_geometry_differs_from_the_profile() -> None:
    sim = read_simbench(find("sim", "cabtive-robot"))
    assert sim.platform is not None
    built = build_robot(sim, sim.platform)
    declared = build_robot(sim, replace(sim.platform, geometry=0.0))
    offset = built.platform.pulleys.exit_point - declared.platform.pulleys.exit_point
    assert np.std(offset) == pytest.approx(5e-3, rel=0.4)
    plain = Kinematics.of(built.profiles["1"])
    radii = [
        Kinematics.of(overridden(one, built.truth[name].overrides)).arm(0.0) / plain.arm(0.0)
        for name, one in built.profiles.items()
    ]
    assert 0.003 < np.std(radii) < 0.016, "0.5 mm of 60 mm"
    again = build_robot(sim, sim.platform)
    assert np.array_equal(again.platform.length, built.platform.length)


def test_a_platform_that_no_cable_forces_hold_is_refused() -> None:
    sim = read_simbench(find("sim", "hanging-robot"))
    assert sim.platform is not None
    with pytest.raises(FileError, match="hold the platform"):
        build_robot(sim, replace(sim.platform, center_of_mass=(0.5, 0.0, 0.0)))


@pytest.mark.slow
def test_a_robot_programme_is_recorded_in_simulated_time(tmp_path: Path) -> None:
    """By the command: the platform of the true geometry goes where the tracker shows it."""
    programme, sim = tmp_path / "side.toml", tmp_path / "robot.toml"
    sim.write_text(find("sim", "cabtive-robot").read_text().replace('"8 ms"', '"40 ms"'))
    steps = '[[step]]\nto = { x = "30 mm" }\n[[step]]\nhold = "0.5 s"\n'
    head = (
        'schema = 1\nkind = "robot-programme"\nname = "side"\nframe = "home"\nspeed = "0.1 m/s"\n'
    )
    programme.write_text(head + steps)
    call = ["sim", "record", str(sim), str(programme), "-o", str(tmp_path / "runs")]
    recorded = CliRunner().invoke(main, call)
    assert recorded.exit_code == 0, recorded.output
    assert recorded.stdout == f"{tmp_path}/runs/side-1.csv\n"
    run = read_run(tmp_path / "runs" / "side-1.csv")
    shown = np.stack([run[f"tracker_{axis}"] for axis in "xyz"], axis=1)
    shown = shown[np.isfinite(shown).all(axis=1)]
    assert np.linalg.norm(shown[-1] - shown[0]) == pytest.approx(0.03, abs=1e-3)
    assert all(f"{line}.tension" in run for line in "12345678")
    refused = CliRunner().invoke(main, [*call, "--rate", "10 Hz"])
    assert refused.exit_code == 2
    assert "--rate is of winches" in refused.stderr
    other = CliRunner().invoke(main, ["sim", "record", "demo-adequate", str(programme)])
    assert other.exit_code == 2
    assert "declares no robot" in other.stderr


def test_a_robot_is_not_recorded_winch_by_winch() -> None:
    sim = read_simbench(find("sim", "hanging-robot"))
    programme = read_programme(programme_path("programme-demo"))
    with pytest.raises(UsageError, match="give a robot programme"):
        next(iter(simulate(sim, profiles_of(sim), programme)))
