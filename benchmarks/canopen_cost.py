"""What CANopen costs: a frame taken in, a cycle of eight axes, and how steady the cycles are.

``python benchmarks/canopen_cost.py [--seconds 60] [--json]``: our receive path beside canopen's
PdoMap and BaseNode402 in one run; processor time of ``ControlLoop.step`` and of the receive thread
with eight axes in motion, in held time; the jitter of the same cycles in real time. All of it on
python-can's `virtual` interface, whose own cost is included. Exits 1 when a frame is lost, or when
the machine is so busy that the supervisor stops the winches.
"""

from __future__ import annotations

import argparse
import json
import sys

from can_cost.cycle import cost_of_cycle, jitter_of_cycle
from can_cost.decoding import cost_of_decoding

AIMS = {
    "pdo_map_over_feedback": "at least 10",
    "cycle_us": "at most 400",
    "lost": "0",
}


def main() -> int:
    """Measure, print, judge."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0, help="of real-time cycles")
    parser.add_argument("--axes", type=int, default=8)
    parser.add_argument("--cycles", type=int, default=2000, help="in held time")
    parser.add_argument("--rounds", type=int, default=15, help="of decoding")
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    figures = {
        "decoding": cost_of_decoding(rounds=given.rounds),
        "cycle": cost_of_cycle(given.axes, given.cycles),
        "jitter": jitter_of_cycle(given.seconds, given.axes),
    }
    if given.json:
        print(json.dumps({"schema": 1, **figures, "aims": AIMS}, indent=2))
    else:
        for name, values in figures.items():
            print(name)
            for key, value in values.items():
                aim = f"   (aim: {AIMS[key]})" if key in AIMS else ""
                print(f"  {key:30} {value:10.3f}{aim}")
    jitter = figures["jitter"]
    return 0 if jitter["kept_moving"] and not jitter["lost"] else 1


if __name__ == "__main__":
    sys.exit(main())
