"""Random sequences of faults against every serial device file, in simulated time.

``python benchmarks/stream_faults.py --cases 10000 --seed 1``: wrong numbers must be 0; prints JSON,
exits 1 where one was published. Each case is a fault of up to a second and what comes after it; the
sequences go on without a break, a hundred cases long. The line, its faults and the simulated
instrument are those of tests/support/instruments.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from random import Random
from time import perf_counter

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "support" / "instruments"))

from stream_campaign import campaign
from stream_rig import DEVICES

LENGTH = 100


def main() -> int:
    """Exit 1 where a wrong number was published."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=1000, help="faults over all devices")
    parser.add_argument("--seed", default="1")
    options = parser.parse_args()
    start = perf_counter()
    each = max(1, options.cases // len(DEVICES))
    devices: dict[str, dict[str, object]] = {}
    for name in DEVICES:
        readings, wrong = 0, []
        for first in range(0, each, LENGTH):
            random = Random(f"{options.seed}/{name}/{first}")
            outcome = campaign(name, random, cases=min(LENGTH, each - first))
            readings += outcome.readings
            wrong += outcome.wrong
        devices[name] = {"cases": each, "readings": readings, "wrong": wrong[:5]}
        print(name, readings, len(wrong), file=sys.stderr)
    found = any(one["wrong"] for one in devices.values())
    seconds = round(perf_counter() - start, 1)
    print(json.dumps({"devices": devices, "seconds": seconds}, indent=1))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
