"""The frozen-cell test on simulated cells: false trips per 1000 h, and how soon a freeze is seen.

``python benchmarks/frozen_cell.py --hours 2 --seed 1 --json``. The cells are simulated here: noise
(white, filtered, hum, bursts, switched on and off), quantisation, amplifier lag, a load that is
moved up and down while the predicted tension is wrong by up to 20 %; the 1000 h are not simulated.
For each cell the largest sum of every run of repeats is kept: the share of runs that reach -ln a
is measured for a from 1e-2 to 1e-5 and must stay below a, which is what the test is built on; the
false trips at its own threshold follow from the slope of those shares, and are bounded by
a times the number of runs.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from math import exp, inf, log, nan, pi, sin
from random import Random

from winchkit.bench.control.frozen_cell import FrozenCell
from winchkit.drivers.reading import InstrumentReading, Quality

MASS, GRAVITY, COUNT = 20.0, 9.81, 0.01
"""kg, m/s², N."""
SPEED, ACCELERATION, PERIOD = 0.3, 0.5, 6.0
"""m/s, m/s²; s from one start to the next."""
UNSURE = 0.1
"""A cell that freezes so soon (s) before or after a change may show either tension."""
LEVELS = (1e-2, 1e-3, 1e-4, 1e-5)


@dataclass(frozen=True)
class Cell:
    """A simulated cell: noise in counts, conversions per second."""

    name: str
    noise: float
    rate: float = 100.0
    filtered: float = 0.0
    """Coefficient of a first-order low-pass filter of the noise."""
    hum: float = 0.0
    bursts: float = 0.0
    """Share of conversions with ten times the noise."""
    switched: float = 0.0
    """Period after which the noise falls to a tenth and comes back, s."""
    coarse: int = 1
    """Counts of one division of the display."""


CELLS = (
    Cell("quiet", 0.02),
    Cell("white 0.1", 0.1),
    Cell("white 0.2", 0.2),
    Cell("white 0.3", 0.3),
    Cell("white 0.5", 0.5),
    Cell("white 1", 1.0),
    Cell("white 3", 3.0),
    Cell("white 30, 300/s", 30.0, rate=300.0),
    Cell("filtered 3", 3.0, filtered=0.8),
    Cell("hum 2", 0.3, hum=2.0),
    Cell("bursts", 0.15, bursts=0.01),
    Cell("switched", 2.0, switched=7.0),
    Cell("divisions of 10", 3.0, coarse=10),
    Cell("slow", 1.0, rate=20.0),
)


def ramp(now: float, period: float = PERIOD) -> tuple[float, bool]:
    """Acceleration (m/s², positive winds in) and whether the winch moves: in, rest, out, rest."""
    phase, up = now % period, 1 if int(now / period) % 2 == 0 else -1
    rise, run = SPEED / ACCELERATION, 2.0
    if phase < rise:
        return up * ACCELERATION, True
    if phase < rise + run:
        return 0.0, True
    return (-up * ACCELERATION, True) if phase < 2 * rise + run else (0.0, False)


class Watched(FrozenCell):
    """Keeps the largest sum of every run of repeats, in nats, as a histogram."""

    def __init__(self, rate: float) -> None:
        super().__init__(rate)
        self.sums: list[int] = [0] * 60
        self.runs = 0

    def _begin(self, reading: InstrumentReading | None) -> None:
        self.runs += 1
        self.sums[min(59, int(self._sum))] += 1
        super()._begin(reading)

    def share(self, level: float) -> float:
        """Of the runs whose sum reached -ln level."""
        return sum(self.sums[round(-log(level)) :]) / max(1, self.runs)


def readings(
    cell: Cell, seconds: float, random: Random, *, frozen_at: float = inf, wrong: float = 0.0
) -> Iterator[tuple[InstrumentReading, float, bool, float]]:
    """Reading, predicted tension, whether the winch moves, acceleration, for each conversion.

    The true change of the tension is ``1 + wrong`` times the predicted one.
    """
    step, held, slow, counts = 1 / cell.rate, MASS * GRAVITY, 0.0, nan
    offset = random.uniform(-50, 50)
    for k in range(int(seconds * cell.rate)):
        now = k * step
        acceleration, moving = ramp(now)
        tension = MASS * (GRAVITY + (1 + wrong) * acceleration)
        held += (tension - held) * min(1.0, 100 * step)
        noise = cell.noise * (10 if random.random() < cell.bursts else 1)
        if cell.switched and int(now / cell.switched) % 2:
            noise /= 10
        slow = cell.filtered * slow + (1 - cell.filtered**2) ** 0.5 * random.gauss(0, noise)
        hum = cell.hum * sin(2 * pi * 50.3 * now)
        # The zero wanders by a few counts per minute.
        level = held / COUNT + offset + 5 * sin(now / 20) + slow + hum
        if now < frozen_at:
            counts = float(cell.coarse * round(level / cell.coarse))
        value = counts * COUNT
        when = (now, now + 0.002, now - 0.005, 0.005)
        yield (
            InstrumentReading(value, value, counts, Quality.GOOD, *when),
            MASS * (GRAVITY + acceleration),
            moving,
            acceleration,
        )


def false_trips(cell: Cell, hours: float, seed: int) -> dict[str, object]:
    """Shares of runs that reach each level, and the trips of 1000 h that follow."""
    test, trips = Watched(cell.rate), 0
    random = Random(f"{cell.name}/{seed}")
    was = False
    for part in range(10):
        # Each tenth has its own error of the profile; the winch pauses between them.
        wrong = random.uniform(-0.2, 0.2)
        start = part * 360.0 * hours
        for reading, predicted, moving, _ in readings(cell, 360.0 * hours, random, wrong=wrong):
            moved = InstrumentReading(
                reading.value, reading.gross, reading.raw, reading.quality,
                reading.t_request + start, reading.t_receive + start,
                reading.t_sample + start, reading.t_uncertainty,
            )  # fmt: skip
            found = test.update(moved, moved.t_receive, predicted, moving=moving)
            trips += found is not None and not was
            was = found is not None
    shares = {f"{level:g}": test.share(level) for level in LEVELS}
    runs = 1000 * test.runs / hours
    seen = [(level, test.share(level)) for level in LEVELS if test.share(level) > 0]
    slope = log(seen[0][1] / seen[-1][1]) / log(seen[0][0] / seen[-1][0]) if len(seen) > 1 else 1.0
    last = seen[-1] if seen else (LEVELS[0], 1 / max(1, test.runs))
    # A share that falls with a power of the level falls on with it.
    own = exp(-test._threshold)
    expected = runs * last[1] * (own / last[0]) ** max(slope, 1e-9)
    return {
        "cell": cell.name,
        "runs": test.runs,
        "trips": trips,
        "shares": shares,
        "power": round(slope, 2),
        "per_1000h": float(f"{expected:.2g}"),
        "bound_per_1000h": float(f"{runs * own:.2g}"),
    }


def delays(cell: Cell, seed: int, cases: int = 8) -> dict[str, object]:
    """How soon a freeze is seen after 30 s of history.

    At rest, counted from the freeze: what the noise shows alone. Beside motion, counted from the
    first change of the predicted tension after the freeze, which is far beyond 5 standard
    deviations at once: when the motion begins, or when the acceleration ends 0.6 s later.
    """
    rest, motion, begin = [], [], 5 * PERIOD
    for case in range(cases):
        random = Random(f"{cell.name}/{seed}/{case}")
        rest.append(_delay(cell, random, begin - 2.6, begin - 2.6))
        early, late = random.uniform(-0.6, -UNSURE), random.uniform(UNSURE, 0.5)
        frozen_at = begin + random.choice((early, late))
        change = begin if frozen_at < begin else begin + SPEED / ACCELERATION
        motion.append(_delay(cell, random, frozen_at, change))
    return {"cell": cell.name, "at_rest_s": _spread(rest), "motion_s": _spread(motion)}


def _delay(cell: Cell, random: Random, frozen_at: float, since: float) -> float:
    test, wrong = FrozenCell(cell.rate), random.uniform(-0.2, 0.2)
    for reading, predicted, moving, _ in readings(
        cell, since + 2.5, random, frozen_at=frozen_at, wrong=wrong
    ):
        found = test.update(reading, reading.t_receive, predicted, moving=moving)
        if found is not None and reading.t_receive >= frozen_at:
            return max(0.0, reading.t_receive - since)
    return inf


def _spread(values: list[float]) -> dict[str, float | int | None]:
    ordered = sorted(values)
    seen = [one for one in ordered if one < inf]
    middle = ordered[len(ordered) // 2]
    return {
        "seen": len(seen),
        "of": len(ordered),
        "median": round(middle, 3) if middle < inf else None,
        "worst_seen": round(seen[-1], 3) if seen else None,
    }


def main() -> int:
    """Exit 1 where a cell tripped falsely, or a share was above its level."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, default=1.0, help="simulated, per cell")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    rates, seen = [], []
    for cell in CELLS:
        rates.append(false_trips(cell, options.hours, options.seed))
        seen.append(delays(cell, options.seed))
        print(rates[-1], seen[-1], sep="\n", file=sys.stderr, flush=True)
    if options.json:
        print(json.dumps({"schema": 1, "false": rates, "delays": seen}))
    return 1 if any(line["trips"] for line in rates) else 0


if __name__ == "__main__":
    sys.exit(main())
