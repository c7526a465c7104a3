"""Comparison of 6064h with the integral of 606Ch: false trips, and the smallest jump that it sees.

``python benchmarks/counter_agreement.py --hours 10 --seed 1 --json``: random motion (ramps, quick
stops, brakes that close, creeping) in the units of every shipped drive, with each way in which
drives make 606Ch: rounded, rounded down, in whole rpm, filtered, averaged, late, in a slower TPDO;
with cycles that come late and TPDOs that are lost. Nothing of it may be a disagreement. Then the
smallest jump of 6064h that is one, at rest and at the speed limit, and the slowest motion with a
counter that stands still. One JSON object on stdout; exit 1 for a false one.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.signal import lfilter

from winchkit.catalog import find, names
from winchkit.drivers.can.cia402.position_agreement import PositionAgreement
from winchkit.drivers.can.cia402.units import CountScale, UnitObjects, scale_of
from winchkit.schema.read import read_device

Array = npt.NDArray[np.float64]

CYCLE, RESPONSE, ACCELERATION, SPEED, RADIUS = 0.004, 0.06, 1.0, 0.3, 0.03
"""s, s, m/s², m/s, m: the defaults of a bench, and a usual drum without a gear."""
_LATE = ACCELERATION * RESPONSE * RESPONSE / 2 / RADIUS
_TURN = 2 * math.pi
_SEGMENT = 120.0
"""s of motion that are made at once."""


@dataclass(frozen=True)
class Motion:
    """A motor in one segment."""

    time: Array
    """As the host notes it, s."""
    angle: Array
    """rad, at the true times."""
    velocity: Array
    """rad/s."""


def _first_order(lag: float) -> Callable[[Array, CountScale], Array]:
    keep = math.exp(-CYCLE / lag)
    return lambda v, _: np.asarray(lfilter([1 - keep], [1, -keep], v))


def _average(span: float) -> Callable[[Array, CountScale], Array]:
    count = round(span / CYCLE)
    return lambda v, _: np.asarray(lfilter(np.full(count, 1 / count), [1.0], v))


def _late(span: float) -> Callable[[Array, CountScale], Array]:
    count = round(span / CYCLE)
    return lambda v, _: np.concatenate((np.full(count, v[0]), v[:-count]))


def _slow(v: Array, _scale: CountScale) -> Array:
    held = np.arange(len(v)) // 5 * 5
    return np.asarray(v[held])


FILTERS: dict[str, Callable[[Array, CountScale], Array]] = {
    "as it is": lambda v, _: v,
    "rounded down": lambda v, s: np.floor(v / s.velocity) * s.velocity,
    "whole rpm": lambda v, _: np.round(v / (_TURN / 60)) * _TURN / 60,
    "steps of 0.1 rad/s": lambda v, _: np.trunc(v / 0.1) * 0.1,
    "filter 30 ms": _first_order(0.03),
    "filter 60 ms": _first_order(0.06),
    "average of 50 ms": _average(0.05),
    "40 ms late": _late(0.04),
    "a TPDO every 20 ms": _slow,
}


def drives() -> dict[str, CountScale]:
    """Units of every shipped drive, by its device file."""
    found = {}
    for name in names("devices"):
        device = read_device(find("devices", name))
        if device.servo is not None:
            found[name] = scale_of(UnitObjects(), device.servo)
    return found


def motion(random: np.random.Generator, duration: float) -> Motion:
    """Ramps between random speeds; some are quick stops, some brakes."""
    count = round(duration / CYCLE)
    wanted, ramps = np.empty(count), np.empty(count)
    at = 0
    while at < count:
        hold = int(random.exponential(1.5) / CYCLE) + 25
        fast = random.choice([0.0, 0.002, 0.01, 0.05, 0.15, SPEED])
        wanted[at : at + hold] = fast * random.uniform(-1, 1)
        ramps[at : at + hold] = ACCELERATION * random.choice([0.2, 1.0, 1.0, 4.0])
        if random.random() < 0.2:
            wanted[at : at + hold], ramps[at : at + hold] = 0.0, random.choice([5.0, 50.0])
        at += hold
    speed, speeds = 0.0, []
    for goal, ramp in zip(wanted.tolist(), (ramps * CYCLE).tolist(), strict=True):
        speed += max(-ramp, min(ramp, goal - speed))
        speeds.append(speed)
    lag = random.uniform(0.002, RESPONSE / 2)
    keep = math.exp(-CYCLE / lag)
    true = np.asarray(lfilter([1 - keep], [1, -keep], np.array(speeds))) / RADIUS
    # Cycles that begin late are late for both measurements; what the host notes differs by less.
    late = np.where(random.random(count) < 5e-3, random.uniform(0.0, 0.02, count), 0.0)
    true_time = np.maximum.accumulate(np.arange(count) * CYCLE + late)
    fine = np.arange(count) * CYCLE
    angle = np.concatenate(([0.0], np.cumsum((true[1:] + true[:-1]) / 2 * CYCLE)))
    noted = true_time + random.normal(0.0, 2e-4, count)
    wrong = random.random(count) < 1e-3  # the thread lost the processor between note and SYNC
    noted = noted - np.where(wrong, random.uniform(0.0, 0.01, count), 0.0)
    return Motion(
        np.maximum.accumulate(noted),
        np.interp(true_time, fine, angle),
        np.interp(true_time, fine, true),
    )


def agreement_of(scale: CountScale) -> PositionAgreement:
    """The comparison as a bench with the defaults makes it."""
    return PositionAgreement(scale.angle, scale.velocity, RESPONSE, _LATE, 1.5 * SPEED / RADIUS)


def false_ones(
    scale: CountScale, shown: Callable[[Array, CountScale], Array], seconds: float, seed: int
) -> int:
    """Disagreements of measurements that are right."""
    random, found = np.random.default_rng(seed), 0
    for _ in range(max(1, round(seconds / _SEGMENT))):
        made = motion(random, min(seconds, _SEGMENT))
        velocity = np.round(shown(made.velocity, scale) / scale.velocity) * scale.velocity
        angle = np.round(made.angle / scale.angle) * scale.angle
        heard = random.random(len(angle)) > 2e-3
        compare = agreement_of(scale)
        rows = zip(
            made.time[heard].tolist(), angle[heard].tolist(), velocity[heard].tolist(), strict=True
        )
        found += any(compare.take(*row) for row in rows)
    return found


def _seen(scale: CountScale, speed: float, jump: float, *, stands: bool) -> bool:
    """Whether a jump (m of cable), or a counter that stands still, at a speed (m/s) is seen."""
    compare = agreement_of(scale)
    count = round((30.0 if stands else 6.0) / CYCLE)
    angle = velocity = 0.0
    for number in range(count):
        now = number * CYCLE
        before = velocity
        velocity += (min(speed, ACCELERATION * now) / RADIUS - velocity) * 0.5  # a lag of 6 ms
        angle += (before + velocity) / 2 * CYCLE
        shown = 0.0 if stands else angle + (jump / RADIUS if now > 5.0 else 0.0)
        counted = round(shown / scale.angle) * scale.angle
        if compare.take(now, counted, round(velocity / scale.velocity) * scale.velocity):
            return True
    return False


def _least(seen: Callable[[float], bool], low: float, high: float) -> float:
    """The least value that is seen."""
    while high - low > 0.02 * high:
        middle = (low + high) / 2
        low, high = (low, middle) if seen(middle) else (middle, high)
    return high


def smallest_jump(scale: CountScale, speed: float) -> float:
    """Of 6064h that is seen at a steady speed (m/s), m of cable."""
    return _least(lambda jump: _seen(scale, speed, jump, stands=False), 0.0, 0.1)


def slowest(scale: CountScale) -> float:
    """Speed at which a counter that stands still is seen, m/s."""
    return _least(lambda speed: _seen(scale, speed, 0.0, stands=True), 0.0, SPEED)


def main() -> int:
    """Exit 1 for a false disagreement."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, default=10.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    begin, every = time.perf_counter(), drives()
    each = arguments.hours * 3600 / (len(every) * len(FILTERS))
    false = {
        f"{name}: {way}": count
        for number, (name, scale) in enumerate(every.items())
        for other, (way, shown) in enumerate(FILTERS.items())
        if (count := false_ones(scale, shown, each, arguments.seed + 100 * number + other))
    }
    found: dict[str, Any] = {
        "schema": 1,
        "hours": arguments.hours,
        "drives": len(every),
        "false": false,
        "jump_at_rest_mm": {n: round(1e3 * smallest_jump(s, 0.0), 2) for n, s in every.items()},
        "jump_in_motion_mm": {n: round(1e3 * smallest_jump(s, SPEED), 2) for n, s in every.items()},
        "slowest_mm_s": {n: round(1e3 * slowest(s), 2) for n, s in every.items()},
        "seconds": round(time.perf_counter() - begin, 1),
    }
    print(json.dumps(found) if arguments.json else found)
    return 1 if false else 0


if __name__ == "__main__":
    raise SystemExit(main())
