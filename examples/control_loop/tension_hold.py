"""A user's control loop: hold the tension of a cable by jogging its winch.

The load is a chain, whose weight increases with the cable length. The loop pays out at a tension
below the target and winds in above it, with a speed in proportion to the error.

    python tension_hold.py bench.toml 250 --for 10

``hold`` takes an open bench, so that the tests beside this file run it on simulated winches.
"""

import argparse
import math
from collections.abc import Callable

from winchkit import Bench, BenchSnapshot, open_bench

GAIN = 0.01
"""Cable speed per error, m/s per N."""
FASTEST = 0.3
"""m/s."""
DEAD_BAND = 2.0
"""An error below this moves nothing, N."""
SMOOTHING = 0.4
"""Of the reading, s. An accelerating load reads heavier, 10 N per m/s^2 at 10 kg: a loop whose
gain times mass is not well below this time would answer its own movements."""


def speed_for(tension: float, wanted: float) -> float:
    """Winding speed (m/s, positive winds in) at a tension; zero where there is none to go by."""
    error = tension - wanted
    if math.isnan(error) or abs(error) < DEAD_BAND:
        return 0.0
    return max(-FASTEST, min(FASTEST, GAIN * error))


class TensionHold:
    """Called in every cycle with the bench's snapshot; returns the speed for its winch."""

    def __init__(self, winch: str, wanted: float) -> None:
        self._winch, self._wanted = winch, wanted
        self._time = self._smooth = math.nan

    def __call__(self, snapshot: BenchSnapshot) -> dict[str, float]:
        """Smooth the newest reading; a bad one (NaN) is forgotten with the next good one."""
        tension = snapshot.winch[self._winch].tension
        share = (snapshot.time - self._time) / SMOOTHING
        self._time = snapshot.time
        fresh = math.isnan(self._smooth) or math.isnan(tension)
        self._smooth = tension if fresh else self._smooth + (tension - self._smooth) * share
        return {self._winch: speed_for(self._smooth, self._wanted)}


def hold(bench: Bench, winch: str, wanted: float) -> Callable[[], None]:
    """Hold a winch's tension (N) from the next cycle on; returns a function that ends it."""
    return bench.on_cycle(TensionHold(winch, wanted))


def main() -> None:
    """Hold a tension for a while."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bench", help="bench file")
    parser.add_argument("tension", type=float, help="N")
    parser.add_argument("--winch", default="A")
    parser.add_argument("--for", dest="duration", type=float, default=10.0, help="s")
    asked = parser.parse_args()
    with open_bench(asked.bench) as bench:
        end = hold(bench, asked.winch, asked.tension)
        bench.clock.sleep(asked.duration)
        end()
        bench.raise_trouble()
        winch = bench.winch[asked.winch]
        print(f"{winch.tension:.0f} N at {winch.cable_length:.2f} m")


if __name__ == "__main__":
    main()
