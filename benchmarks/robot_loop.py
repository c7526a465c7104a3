"""A hidden error of a robot found on a run of its bench, added to the profile, and judged again.

    python benchmarks/robot_loop.py --seed 1 --cases 20 --json

The simulated robot ``cabtive-robot`` moves in simulated time, by CAN frames, on lines through
random poses; its bench logs drives, cells and tracker. The profile is that of a calibrated robot,
but for one error that the seed determines: the drum radius of one winch (0.5 %), the span of one
cell, one cable that is softer than the others, one exit point (3 mm), or none. ``winchkit
diagnose`` gets the log; the first effect that it names is added by ``winchkit add``, whose held-out
errors (stretches of the path that were not fitted) are compared.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

import numpy as np
from click.testing import CliRunner

from winchkit import open_bench
from winchkit.bench.bench import Bench
from winchkit.bench.tracker import Tracker
from winchkit.catalog import find
from winchkit.cli import main
from winchkit.errors import NotPermitted
from winchkit.robot import lengths, read_robot, robot_of
from winchkit.robot.bench.path import Waypoint
from winchkit.robot.bench.planner import coordinates_of, moved
from winchkit.robot.sim.build import build_robot
from winchkit.schema.read import read_simbench
from winchkit.schema.simbench import HiddenSpec, SimBench
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.live.bench import LiveBench

ROBOT = "cabtive-robot"
KINDS = ("drum radius", "cell gain", "soft cable", "exit point", "none")
OUTCOMES = ("right", "in a set", "wrong", "silent")
LINES = tuple(str(n) for n in range(1, 9))
BOX = np.array([0.075, 0.075, 0.075, 0.13, 0.13, 0.13])
"""Half the edges of the box of waypoints about home, m and rad."""
WAYPOINTS = 14
CYCLE = 0.02
"""Of the host, s."""
SPEED = 0.2
"""Of the platform, m/s."""
NAMES = ("x", "y", "z", "roll", "pitch", "yaw")


@dataclass(frozen=True)
class Case:
    """One hidden error."""

    kind: str
    line: str = ""
    answers: tuple[str, ...] = ()
    """Effects with their line that describe it."""
    hidden: HiddenSpec | None = None
    """Physics of the simulator on the line."""
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """True exit point less that of the profile, m."""


def case_of(random: np.random.Generator, kind: str) -> Case:
    """Draw line, size and sign of an error."""
    line = LINES[random.integers(len(LINES))]
    sign = float(random.choice([-1.0, 1.0]))
    if kind == "drum radius":
        spec = HiddenSpec("fat drum", {"radius_error": f"{sign * 0.3:.2f} mm"})
        return Case(kind, line, (f"drum-radius/{line}", f"gear-ratio/{line}"), spec)
    if kind == "cell gain":
        spec = HiddenSpec("stretched cell", {"gain_error": sign * random.uniform(0.05, 0.15)})
        return Case(kind, line, (f"cell-gain/{line}",), spec)
    if kind == "soft cable":
        spec = HiddenSpec("elastic rope", {"axial_stiffness": f"{random.uniform(40, 80):.0f} kN"})
        return Case(kind, line, (f"cable-elongation-linear/{line}",), spec)
    if kind == "exit point":
        way = random.standard_normal(3)
        x, y, z = (3e-3 * way / np.linalg.norm(way)).tolist()
        return Case(kind, line, (f"exit-point/{line}",), offset=(x, y, z))
    return Case(kind)


def robot_of_case(case: Case) -> SimBench:
    """The simulated robot with the error of a case in its winch; the profile has the geometry."""
    sim = read_simbench(find("sim", ROBOT))
    assert sim.platform is not None
    truth = dict(sim.truth)
    if case.hidden is not None:
        truth[case.line] = replace(truth[case.line], hidden=(case.hidden,))
    platform = replace(sim.platform, geometry=0.0, winding_radius=0.0)
    wiring = sim.bench.robot
    assert wiring is not None
    wiring = replace(wiring, speed=SPEED, acceleration=0.6, rotation_speed=np.radians(40.0))
    bench = replace(sim.bench, cycle=CYCLE, robot=wiring)
    return replace(sim, platform=platform, truth=truth, bench=bench)


def profile_text(case: Case, sim: SimBench) -> str:
    """Profile as a calibration leaves it: cables, tracker and home lengths known."""
    assert sim.platform is not None
    path = find("profiles", "cabtive")
    robot = robot_of(read_robot(path))
    built = build_robot(sim, sim.platform)
    home = robot.home
    free = lengths(robot.geometry, home.position, home.rotation)[0]
    slack = {
        name: built.ends[name].home_length - float(own)
        for name, own in zip(robot.names, free, strict=True)
    }
    frame = sim.platform.tracker
    text = path.read_text()
    line = next(one for one in robot.profile.line if one.name == case.line) if case.line else None
    if line is not None:
        true = np.array(line.exit_point)
        declared = (true - case.offset).tolist()
        text = text.replace(_point(line.exit_point), ", ".join(f'"{x!r} m"' for x in declared))
    known = ", ".join(f'{name} = "{value!r} m"' for name, value in slack.items())
    return (
        text
        + f"""
[instrument.tracker]
frame = {{ position = {_quoted(frame.position, "m")}, rotation = {_quoted(frame.rotation, "rad")} }}
delay = "unknown"

[[effect]]
id = "cable-elongation-linear"
axial_stiffness = "{sim.platform.axial_stiffness!r} N"

[[effect]]
id = "home-length"
length = {{ {known} }}
"""
    )


def _point(values: tuple[float, float, float]) -> str:
    return ", ".join(f'"{1e3 * x:.10g} mm"' for x in values)


def _quoted(values: tuple[float, ...], unit: str) -> str:
    return "[" + ", ".join(f'"{x!r} {unit}"' for x in values) + "]"


def recorded(sim: SimBench, profile: Path, seed: int, folder: Path) -> Path:
    """Log of a random path that the bench plans by the user's profile."""
    clock, random = SimulatedClock(), np.random.default_rng([seed, 2])
    with LiveBench(sim, seed=seed, simulated_time=clock) as live:
        spec = live.bench_spec
        assert spec.robot is not None
        assert live.robot is not None
        spec = replace(spec, robot=replace(spec.robot, profile=str(profile)))
        with open_bench(spec, clock) as bench:
            tracker = Tracker(clock.now)
            live.robot.on_pose = tracker.receive
            bench.take_tracker(tracker)
            clock.sleep(0.5)
            return _logged(bench, random, folder / "path.csv")


def _logged(bench: Bench, random: np.random.Generator, path: Path) -> Path:
    platform = bench.robot
    home = platform.planner.robot.home
    start = coordinates_of(home)
    while True:
        way = []
        for _ in range(WAYPOINTS):
            values = dict(zip(NAMES, random.uniform(-BOX, BOX).tolist(), strict=True))
            goal = moved(home, {n: v + start[n] for n, v in values.items()}, relative=False)
            way.append(Waypoint(goal.position[0], goal.rotation[0]))
        try:
            motions = platform.planner.plan(way, platform.pose)
        except NotPermitted:
            continue
        break
    with bench.log(path):
        preload = None
        for motion in motions:
            preload = platform.begin(motion, hold=True, preload=preload)
            platform.wait()
    bench.stop()
    return path


def called(*arguments: object) -> dict[str, Any]:
    """JSON of a command."""
    result = CliRunner().invoke(main, [*map(str, arguments), "--json"], catch_exceptions=False)
    if result.exit_code:
        raise SystemExit(f"winchkit {' '.join(map(str, arguments))}: {result.output}")
    return json.loads(result.stdout)  # type: ignore[no-any-return]


def named(found: Mapping[str, Any]) -> list[list[str]]:
    """Members of each set of effects that a diagnosis names, with their lines."""
    return [
        [
            effect + (f"/{line}" if line else "")
            for effect, lines in step["lines"].items()
            for line in lines
        ]
        for step in found["steps"]
    ]


def outcome(case: Case, found: Mapping[str, Any]) -> str:
    """Judge a diagnosis: ``right``, ``in a set`` with other effects, ``wrong``, ``silent``."""
    sets = named(found)
    if not sets:
        return "right" if not case.answers else "silent"
    if len(sets) > 1 or not set(sets[0]) & set(case.answers):
        return "wrong"
    return "right" if set(sets[0]) <= set(case.answers) else "in a set"


def looped(case: Case, seed: int, folder: Path) -> dict[str, Any]:
    """Record, diagnose, add the first effect that is named, and compare the errors."""
    sim, started = robot_of_case(case), process_time()
    profile = folder / "robot.toml"
    profile.write_text(profile_text(case, sim))
    run = recorded(sim, profile, seed, folder)
    recording = process_time() - started
    found = called("diagnose", run, "-p", profile)
    errors: dict[str, Any] = {}
    if found["steps"]:
        better = folder / "better.toml"
        member = next((m for m in named(found)[0] if m in case.answers), named(found)[0][0])
        outputs = called("add", member, "-p", profile, "--fit", run, "-o", better)["outputs"]
        errors = {
            name: [one["heldout_rms_before"], one["heldout_rms_after"]]
            for name, one in outputs.items()
        }
    return {
        "seed": seed,
        "kind": case.kind,
        "hidden": list(case.answers),
        "outcome": outcome(case, found),
        "verdict": found["verdict"],
        "named": ["|".join(members) for members in named(found)],
        "held_out_rms": errors,
        "recording_cpu_s": recording,
        "cpu_s": process_time() - started,
    }


def main_of() -> int:
    """Run the cases; exit code 1 where an effect that is not hidden is named."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cases", type=int, default=len(KINDS))
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    rows = []
    for number in range(asked.first, asked.first + asked.cases):
        case = case_of(np.random.default_rng([asked.seed, number]), KINDS[number % len(KINDS)])
        with TemporaryDirectory() as folder:
            rows.append(looped(case, 1000 * asked.seed + number, Path(folder)))
        if not asked.json:
            row = rows[-1]
            print(f"{row['kind']:12} {row['hidden']} {row['outcome']:8} {row['named']}", flush=True)
            print(f"    {row['held_out_rms']}", flush=True)
    counts = {name: sum(row["outcome"] == name for row in rows) for name in OUTCOMES}
    if asked.json:
        print(json.dumps({"schema": 1, "summary": counts, "cases": rows}, indent=1))
    else:
        print(", ".join(f"{name} {count}" for name, count in counts.items()))
    return int(counts["wrong"] > 0)


if __name__ == "__main__":
    sys.exit(main_of())
