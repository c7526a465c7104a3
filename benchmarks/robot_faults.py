"""Single faults of a robot during random moves of its platform, judged from the simulation's truth.

    python benchmarks/robot_faults.py --cases 20 --seed 1 --json

The shipped ``winding-device-robot`` in simulated time with a cycle of 20 ms. One fault comes during
a random Cartesian move: a drive, a cell, a cable, the host, a second master. Afterwards a new move
without a reset must be refused. Judged are: all winches at rest within the time bound of the fault,
no motion without a reset, deviation of the platform from its path and cable forces within bounds,
and the reported cause. The deviation contains that of a move without a fault, up to 22 mm: the
profile has no elasticity of the cables. One JSON object on stdout; exit 1 where a case failed.
"""

from __future__ import annotations

import argparse
import json
import logging
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from fault_cases.kinds import KINDS
from fault_cases.world import World
from winchkit import find, open_bench, read_simbench
from winchkit.arrays import Array
from winchkit.errors import MotionError, NotPermitted, WinchkitError
from winchkit.robot.bench.path import Waypoint
from winchkit.robot.bench.trajectory import PlatformTrajectory
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.live.bench import LiveBench

BROKEN = "broken cable"
FAULTS = {
    "drive silent": KINDS["drive silent"],
    "enable input open": KINDS["enable input open"],
    "cell silent": KINDS["cell silent"],
    "cell frozen": KINDS["cell frozen"],
    "drive fault: over-current": KINDS["drive fault: over-current"],
    "host frames lost": KINDS["host frames lost"],
    "exception in the loop": KINDS["exception in the loop"],
    "computer stalls 0.5 s": KINDS["computer stalls 0.5 s"],
    "second master: 6040h = 06h": KINDS["second master: 6040h = 06h"],
    "stranger: NMT stopped": KINDS["stranger: NMT stopped"],
}
"""Faults of other campaigns by name; a broken cable is added to them."""
CYCLE, HEARTBEAT = 0.02, 0.1
BOX = np.array([0.15, 0.15, 0.1, 0.05, 0.05, 0.05])
"""Half the edges of the box of goals about home, m and rad."""
NAMES = ("x", "y", "z", "roll", "pitch", "yaw")
DETECTED = {"cell silent": 0.5, BROKEN: 0.35}
"""Time in which a fault is detected, s: longest age of a reading with a poll, and the time for
which slack must hold with filter, conversion and two cycles."""
COMMUNICATION = 0.3
"""The same of every other fault, s: 2.5 heartbeats and two cycles."""
DISPLACED = {BROKEN: 60e-3}
"""Bound of the deviation from the path, m: of a broken cable, elastic equilibrium of the rest."""
DISPLACED_OTHERWISE = 40e-3
"""The same where one cable stops at once and the others at 0.2 m/s after 0.15 s, m."""
MOVES = 4e-3
"""Cable speed by the motor above which a winch moves, m/s."""
_AFTER, _REFUSED = 1.5, 0.6
_SAMPLED = 4e-3


@dataclass(frozen=True)
class RobotCase:
    """A move and a fault."""

    seed: str
    kind: str
    winch: str
    share: float
    """Of the duration of the move, at which the fault begins."""
    speed: float
    """Of the platform, m/s."""


@dataclass(frozen=True)
class Outcome:
    """What was true; empty strings are good."""

    stopped: str = ""
    moved_after_trip: str = ""
    cause: str = ""
    error: str = ""
    displaced: float = 0.0
    """Largest distance of the platform from its path since the fault, m."""
    highest: float = 0.0
    """Largest cable force since the fault, N."""
    over_tension: str = ""
    beyond: str = ""
    """Where the displacement exceeds its bound."""
    rest: float = 0.0
    """From the fault until the last winch stood still, s."""

    @property
    def good(self) -> bool:
        """Whether nothing is wrong."""
        wrong = (self.stopped, self.moved_after_trip, self.cause, self.error, self.over_tension)
        return not any(wrong) and not self.beyond


def drawn(number: int, seed: int) -> list[RobotCase]:
    """Each fault in turn; all else by the seed."""
    kinds = [*FAULTS, BROKEN]
    out = []
    for k in range(number):
        random = Random(f"robot fault {seed}/{k}")
        out.append(
            RobotCase(
                f"{seed}/{k}",
                kinds[k % len(kinds)],
                random.choice("12345678"),
                random.uniform(0.2, 0.8),
                random.choice((0.1, 0.2)),
            )
        )
    return out


@dataclass(frozen=True)
class _Seen:
    """Truth at one moment."""

    time: float
    position: Array
    speed: Array
    """Of the cables by the motors, m/s, without sign."""
    force: Array
    """At the platform, N."""


@dataclass(frozen=True)
class _Words:
    """What was reported, and when."""

    onset: float
    """Of the fault, s."""
    first: list[str]
    """Kind of the first trip, if there was one."""
    told: list[tuple[str, str]]
    """Kind and winch of every trip."""
    commanded: float
    """When a new move was commanded without a reset, s."""
    refused: str
    """The words that refused it."""


def played(case: RobotCase) -> Outcome:
    """Play a case and judge it."""
    sim = read_simbench(find("sim", "winding-device-robot"))
    bus = {**sim.bench.bus, "can": replace(sim.bench.bus["can"], heartbeat=HEARTBEAT)}
    clock = SimulatedClock()
    with tempfile.TemporaryDirectory() as folder:
        spec = replace(sim.bench, bus=bus, cycle=CYCLE, path=str(Path(folder) / "bench.toml"))
        sim = replace(sim, bench=spec)
        number = int.from_bytes(case.seed.encode()[-6:], "little")
        try:
            with LiveBench(sim, seed=number, simulated_time=clock) as live:
                world = World(clock, live, Path(folder), open_bench(live.bench_spec, clock))
                try:
                    return _played(world, case)
                finally:
                    world.close()
                    _close(world)
        except WinchkitError as error:
            return Outcome(error=f"{type(error).__name__}: {error}")


def _close(world: World) -> None:
    try:
        world.bench.close()
    except (WinchkitError, ValueError):
        if world.bench.loop.failure is None:
            raise


def _played(world: World, case: RobotCase) -> Outcome:
    clock, bench = world.clock, world.bench
    clock.sleep(0.3)
    planned = _planned(world, case)
    seen: list[_Seen] = []
    onset: list[float] = []
    first: list[str] = []
    bench.loop.samplers.append(lambda snapshot: first.extend(t.kind for t in snapshot.tripped))
    bench.robot.begin(planned)
    clock.sleep(0.1)  # until the drives are enabled
    at = world.now + case.share * planned.duration
    world.call_at(at, partial(_begin_fault, world, case, onset))
    _sample(world, seen)
    clock.sleep(at - world.now + _AFTER)
    told, commanded = _told(world), world.now
    words = _Words(
        onset[0],
        (first or [kind for kind, _ in told])[:1],
        told,
        commanded,
        _moves_without_reset(world),
    )
    clock.sleep(_REFUSED)
    world.close()
    return _judged(world, case, planned, seen, words)


def _planned(world: World, case: RobotCase) -> PlatformTrajectory:
    platform, random = (
        world.bench.robot,
        np.random.default_rng([ord(letter) for letter in case.seed]),
    )
    while True:
        change = random.uniform(-BOX, BOX)
        goal = platform.moved(dict(zip(NAMES, change.tolist(), strict=True)), relative=True)
        try:
            (planned,) = platform.planner.plan(
                [Waypoint(goal.position[0], goal.rotation[0])], platform.pose, case.speed
            )
        except NotPermitted:
            continue
        return planned


def _begin_fault(world: World, case: RobotCase, onset: list[float]) -> None:
    onset.append(world.now)
    if case.kind == BROKEN:
        robot = world.live.robot
        assert robot is not None
        robot.ends[case.winch]._axial_stiffness = 1e-3
        return
    FAULTS[case.kind].begin(world, case.winch)


def _sample(world: World, seen: list[_Seen]) -> None:
    robot = world.live.robot
    assert robot is not None
    if world._stopping.is_set():
        return
    with world.live.up_to_date():
        plants = [one.plant for one in world.live.winches.values()]
        speed = np.array([abs(p.motor_velocity * p._state.arm) for p in plants])
        platform = robot.platform
        seen.append(_Seen(world.now, platform.position, speed, np.array(platform.tension)))
    world.call_at(world.now + _SAMPLED, partial(_sample, world, seen))


def _told(world: World) -> list[tuple[str, str]]:
    return [(trip.kind, trip.winch) for trip in world.bench.snapshot.tripped]


def _moves_without_reset(world: World) -> str:
    """The words that refuse a new move; empty where it is accepted."""
    try:
        platform = world.bench.robot
        goal = platform.moved({"z": 0.02}, relative=True)
        platform.move(goal, 0.05, wait=False)
    except (MotionError, WinchkitError, ValueError) as error:
        return str(error) or type(error).__name__
    return ""


def _judged(
    world: World,
    case: RobotCase,
    planned: PlatformTrajectory,
    seen: list[_Seen],
    words: _Words,
) -> Outcome:
    told, onset = words.told, words.onset
    later = [one for one in seen if one.time >= onset]
    before = [one for one in later if one.time <= words.commanded]
    moving = [one.time - onset for one in before if one.speed.max() > MOVES]
    rest = moving[-1] if moving else 0.0
    frozen = case.kind == "cell frozen"
    detected = DETECTED.get(case.kind, COMMUNICATION)
    fastest = max(float(one.speed.max()) for one in seen)
    slowest = min(one.limits.acceleration for one in world.bench.spec.winch.values())
    bound = detected + fastest / slowest + 0.05
    if frozen:
        # A cell that is found only where its noise or a changing force shows it.
        bound = max(bound, (1 - case.share) * planned.duration + 0.5)
    displaced = max(_off_path(planned, one.position) for one in later)
    highest = max(float(one.force.max()) for one in later)
    high = min(one.limits.tension_high or np.inf for one in world.bench.spec.winch.values())
    allowed = DISPLACED.get(case.kind, DISPLACED_OTHERWISE)
    ended = frozen and not told
    return Outcome(
        stopped=f"moved for {rest:.3f} s (bound {bound:.3f} s)" if rest > bound else "",
        moved_after_trip="" if ended else _moved_again(later, words.commanded, words.refused),
        cause="" if ended else _cause(world, case, words.first, told),
        displaced=displaced,
        highest=highest,
        over_tension=f"{highest:.0f} N (limit {high:.0f} N)" if highest > high else "",
        beyond=f"{displaced * 1e3:.1f} mm (bound {allowed * 1e3:.0f} mm)"
        if displaced > allowed
        else "",
        rest=rest,
    )


def _moved_again(later: list[_Seen], commanded: float, refused: str) -> str:
    fastest = max((float(s.speed.max()) for s in later if s.time > commanded), default=0.0)
    if fastest > MOVES:
        return f"a cable moved at {fastest:.3f} m/s without a reset"
    return "" if refused else "a move was accepted without a reset"


def _off_path(planned: PlatformTrajectory, position: Array) -> float:
    """Distance of the platform from the line of its motion, m."""
    start, end = planned.pose.position[0], planned.pose.position[-1]
    along = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
    share = float(np.clip((position - start) @ along, 0.0, np.linalg.norm(end - start)))
    return float(np.linalg.norm(position - start - share * along))


def _cause(world: World, case: RobotCase, first: list[str], told: list[tuple[str, str]]) -> str:
    if case.kind == BROKEN:
        named = {kind for kind, winch in told if winch == case.winch}
        return "" if named & {"slack", "tension rate"} else f"{told} for a broken {case.winch}"
    named_first = first or (["failure"] if world.bench.loop.failure is not None else [])
    if named_first and named_first[0] in FAULTS[case.kind].causes:
        return ""
    return f"{named_first} for {case.kind}"


def summary(found: list[tuple[RobotCase, Outcome]]) -> dict[str, Any]:
    """Counts and worst values; every failure with its seed."""
    worst: dict[str, list[float]] = {}
    for case, one in found:
        values = worst.setdefault(case.kind, [0.0, 0.0, 0.0])
        for k, value in enumerate((one.displaced * 1e3, one.highest, one.rest)):
            values[k] = round(max(values[k], value), 3)
    return {
        "schema": 1,
        "cases": len(found),
        "passed": sum(one.good for _, one in found),
        "stopped": sum(not (one.stopped or one.error) for _, one in found),
        "moved_after_trip": sum(bool(one.moved_after_trip) for _, one in found),
        "displaced_mm": round(max(one.displaced for _, one in found) * 1e3, 2),
        "displaced_beyond": sum(bool(one.beyond) for _, one in found),
        "over_tension": sum(bool(one.over_tension) for _, one in found),
        "highest_N": round(max(one.highest for _, one in found), 1),
        "cause_right": sum(not (one.cause or one.error) for _, one in found),
        "worst_mm_N_s": worst,
        "failed": [
            {
                "seed": case.seed,
                "fault": f"{case.kind} ({case.winch}) at {case.speed:g} m/s",
                **{
                    name: text
                    for name in (
                        "stopped",
                        "moved_after_trip",
                        "cause",
                        "error",
                        "over_tension",
                        "beyond",
                    )
                    if (text := getattr(one, name))
                },
            }
            for case, one in found
            if not one.good
        ],
    }


def main() -> int:
    """Exit 1 where a case failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    begin, found = time.perf_counter(), []
    logging.disable(logging.CRITICAL)  # faults cause thousands of messages
    for case in drawn(asked.first + asked.cases, asked.seed)[asked.first :]:
        found.append((case, played(case)))
        if not asked.json:
            print(case, found[-1][1], file=sys.stderr)
    result = {**summary(found), "seconds": round(time.perf_counter() - begin, 1)}
    print(json.dumps(result) if asked.json else json.dumps(result, indent=1))
    return 0 if result["passed"] == result["cases"] else 1


if __name__ == "__main__":
    raise SystemExit(main())
