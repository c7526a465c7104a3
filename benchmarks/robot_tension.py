"""Control of a simulated robot's cable forces by its cells, and of its pose by its tracker.

    python benchmarks/robot_tension.py step --seed 1 --friction 0.8
    python benchmarks/robot_tension.py pose --seed 1
    python benchmarks/robot_tension.py rectangle --seed 1 --friction 0.8 --scale 0.25

The shipped ``winding-device-robot`` in simulated time, with eight cells on CAN at 100 Hz. The
friction of its pulleys follows Maxwell-slip elements with a Stribeck curve; the profile has the
Dahl law that fits it best, its friction times ``--friction``, with a declared standard deviation of
20 %.

``step``: after a move and 10 s of rest the preload of cable 1 is held, then raised by 100 N. True
share of the step after 0.3 s and later, overshoot, and distance from the pose before the step.
``pose``: exit and anchor points 2 mm off (one standard deviation per coordinate), the pose held by
the tracker; true distance from the goal over 2 s after 6 s; time until all winches stop without the
tracker. ``rectangle``: true cable forces less the force distribution at the true pose, round the
paper's rectangle at 0.05 m/s, by kind of control.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

import numpy as np

from winchkit import find, open_bench, read_simbench
from winchkit.arrays import Array
from winchkit.bench.bench import Bench
from winchkit.bench.control.snapshot import BenchSnapshot
from winchkit.errors import MotionError
from winchkit.robot.bench import force_loop
from winchkit.robot.forces.force_distribution import quadratic
from winchkit.robot.geometry.kinematics import Pose
from winchkit.schema.bench import DeviceRef
from winchkit.schema.simbench import SimBench
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.live.bench import LiveBench

FRICTION, STIFFNESS = 0.01281, 11842.0
"""Dahl law (shape 1) that fits the simulated pulleys, by ``identify_dahl`` on another motion."""
DOUBT = 0.2
"""Declared standard deviation of the friction, as a share."""
CORNERS = ((-0.2, -0.215), (0.2, -0.215), (0.2, 0.215), (-0.2, 0.215), (-0.2, -0.215))
KINDS = ("none", "feed-forward", "cells", "cells, Dahl")


def simulated(folder: Path, geometry: float, seed: int) -> SimBench:
    """The robot with cells on CAN at 100 Hz, a filter of 10 ms and points that are off (m)."""
    home, cell = find("devices", "generic-cia404").parent, folder / "cell"
    cell.mkdir()
    text = (home / "device.toml").read_text()
    for old, new in (("20 ms", "10 ms"), ("rate = 50.0", "rate = 100.0")):
        text = text.replace(old, new)
    (cell / "device.toml").write_text(text)
    (cell / "generic-cia404.eds").write_bytes((home / "generic-cia404.eds").read_bytes())
    sim = read_simbench(find("sim", "winding-device-robot"))
    assert sim.platform is not None
    winches = {
        name: replace(one, cell=DeviceRef(str(cell), "can", node=40 + int(name)))
        for name, one in sim.bench.winch.items()
    }
    bench = replace(sim.bench, winch=winches, bus={"can": sim.bench.bus["can"]})
    return replace(
        sim, bench=bench, platform=replace(sim.platform, geometry=geometry, geometry_seed=seed)
    )


def profile(folder: Path, friction: float | None) -> str:
    """The robot's profile, its winches with a friction of their pulleys."""
    winch = find("profiles", "winding-device-winch").read_text()
    if friction is not None:
        winch += (
            f'\n[[effect]]\nid = "pulley-dahl"\nfriction = {friction}\nstiffness = '
            f'"{STIFFNESS} N/m"\nfitted = {{ runs = [], date = 2026-11-29, std = {{ friction = '
            f'{DOUBT * FRICTION}, stiffness = "{0.3 * STIFFNESS} N/m" }} }}\n'
        )
    (folder / "winch.toml").write_text(winch)
    robot = find("profiles", "winding-device-8").read_text()
    (folder / "robot.toml").write_text(robot.replace('"winding-device-winch"', '"winch"'))
    return str(folder / "robot.toml")


@contextmanager
def opened(
    seed: int, *, friction: float | None, geometry: float = 0.0, trim: Any = "none"
) -> Iterator[tuple[LiveBench, Bench]]:
    """The open bench; EA of the cables is declared."""
    clock = SimulatedClock()
    with TemporaryDirectory() as name:
        folder = Path(name)
        sim = simulated(folder, geometry, seed)
        with LiveBench(sim, seed=seed, simulated_time=clock, compiled=True) as live:
            assert live.robot is not None
            wiring = live.bench_spec.robot
            assert wiring is not None
            wiring = replace(
                wiring,
                profile=profile(folder, friction),
                axial_stiffness=200e3,
                tension_trim=trim,
            )
            with open_bench(replace(live.bench_spec, robot=wiring), clock) as bench:
                assert bench.tracker is not None, "it receives from now on"
                clock.sleep(0.5)
                yield live, bench


def refreshed(bench: Bench, duration: float) -> None:
    """Hold what is held for a time (s)."""
    for _ in range(round(duration / 0.25)):
        bench.clock.sleep(0.25)
        bench.robot.refresh(1.0)


def away(bench: Bench, random: np.random.Generator) -> Pose:
    """Go to a pose near home, and let the platform come to rest."""
    x, y, z = (random.uniform(-0.1, 0.1, 3) * [1, 1, 0.5]).tolist()
    goal = bench.robot.moved({"x": x, "y": y, "z": z}, relative=True)
    bench.robot.move(goal, 0.1)
    bench.clock.sleep(10.0)
    return goal


def step(seed: int, friction: float) -> dict[str, Any]:
    """A step of 100 N in the preload of cable 1."""
    with opened(seed, friction=friction * FRICTION) as (live, bench):
        assert live.robot is not None
        body, platform = live.robot.platform, bench.robot
        away(bench, np.random.default_rng(seed))
        rows = []

        def record(snapshot: BenchSnapshot) -> None:
            rows.append([snapshot.time, *body.tension, *body.position])

        first = platform._forces(platform.pose)[0]
        platform.hold(preload={"1": first[0], "2": first[1]}, hold=1.0)
        refreshed(bench, 3.0)
        bench.on_cycle(record)
        refreshed(bench, 1.0)
        begun, before = bench.clock.now(), platform._held[0]
        assert isinstance(before, force_loop.ForceLoop)
        set_before = before.force
        platform.set_preload({"1": first[0] + 100.0, "2": first[1]})
        change = before.force - set_before
        refreshed(bench, 2.0)
        tripped = [str(trip) for trip in bench.snapshot.tripped]
    values = np.array(rows)
    time, force, place = values[:, 0] - begun, values[:, 1:9], values[:, 9:]
    rest = force[time <= 0].mean(axis=0)
    share = (force - rest) @ change / (change @ change)
    moved = 1e3 * np.linalg.norm(place - place[time <= 0].mean(axis=0), axis=1)
    later = share[time >= 0.3]
    return {
        "at_0.3_s": float(later[0]),
        "least_later": float(later.min()),
        "largest": float(share.max()),
        "settled_s": float(time[np.flatnonzero(np.abs(share - 1) > 0.05)[-1]]),
        "moved_mm": float(moved[time > 0].max()),
        "moved_before_mm": float(moved[time <= 0].max()),
        "deviation_before_N": float(np.abs(rest - set_before).max()),
        "tripped": tripped,
    }


def pose(seed: int, friction: float) -> dict[str, Any]:
    """A pose held by the tracker, which is then lost."""
    with opened(seed, friction=friction * FRICTION, geometry=2e-3) as (live, bench):
        assert live.robot is not None
        goal = away(bench, np.random.default_rng(seed))

        def off() -> Array:
            assert live.robot is not None
            with live.up_to_date():
                return 1e3 * np.asarray(live.robot.platform.position - goal.position[0])

        before = off()
        bench.robot.hold(pose=goal, hold=1.0)
        refreshed(bench, 6.0)
        errors = []
        for _ in range(40):
            bench.clock.sleep(0.05)
            bench.robot.refresh(1.0)
            errors.append(off())
        live.robot.on_pose = None
        lost = bench.clock.now()
        stopped, words = float("nan"), ""
        try:
            while bench.clock.now() - lost < 2.0:
                bench.clock.sleep(0.01)
                bench.robot.refresh(1.0)
        except MotionError as error:
            stopped, words = bench.clock.now() - lost, str(error)
    size = np.linalg.norm(errors, axis=1)
    return {
        "before_mm": float(np.linalg.norm(before)),
        "mean_mm": float(np.linalg.norm(np.mean(errors, axis=0))),
        "rms_mm": float(np.sqrt(np.mean(size**2))),
        "largest_mm": float(size.max()),
        "stopped_after_s": stopped,
        "words": words,
    }


def rectangle(seed: int, friction: float, scale: float, kind: str) -> dict[str, Any]:
    """Deviation of the true forces from the distribution round the rectangle."""
    trim = "none" if kind == "none" else "along"
    fits = friction * FRICTION if kind == "cells, Dahl" else None
    gain, force_loop.LOOP = force_loop.LOOP, 0.0 if kind == "feed-forward" else force_loop.LOOP
    rows: list[list[Array]] = []
    try:
        with opened(seed, friction=fits, trim=trim) as (live, bench):
            assert live.robot is not None
            body, home = live.robot.platform, bench.robot.robot.home
            for number, (x, y) in enumerate(CORNERS):
                place = home.position + np.array([[scale * x, scale * y, 0.0]])
                bench.robot.move(Pose(place, home.rotation), 0.05, 0.2, hold=True)
                if number == 0:
                    bench.on_cycle(
                        lambda _snapshot: rows.append([body.position, body.rotation, body.tension])
                    )
            robot, limits = bench.robot.robot, bench.robot.planner.tension
    finally:
        force_loop.LOOP = gain
    errors = []
    for position, rotation, force in rows[::10]:
        there = Pose(position[None], rotation[None])
        wanted = quadratic(robot.structure(there)[0], robot.weight(there)[0], limits).value
        errors.append(force - wanted)
    size = np.abs(errors)
    return {"mean_N": float(size.mean()), "std_N": float(size.std()), "samples": len(errors)}


def main() -> None:
    """Measure and print one JSON object."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    parser.add_argument("what", choices=("step", "pose", "rectangle"))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--friction", type=float, default=0.8)
    parser.add_argument("--scale", type=float, default=1.0)
    parser.add_argument("--kind", choices=KINDS, action="append")
    asked = parser.parse_args()
    started = process_time()
    found: dict[str, Any]
    if asked.what == "rectangle":
        kinds = asked.kind or KINDS
        found = {one: rectangle(asked.seed, asked.friction, asked.scale, one) for one in kinds}
    else:
        found = {"step": step, "pose": pose}[asked.what](asked.seed, asked.friction)
    result = {"schema": 1, "seed": asked.seed, "friction": asked.friction, **found}
    sys.stdout.write(json.dumps({**result, "cpu_s": process_time() - started}) + "\n")


if __name__ == "__main__":
    main()
