"""Random sequences of faults against every Modbus device file, in simulated time.

``python benchmarks/cell_faults.py --cases 10000 --seed 1 --json``: wrong numbers must be 0. One
JSON object on stdout, a table on stderr. See benchmarks/README.md.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter

from cell_campaign.case import Outcome, Plan, modbus_devices, play
from summaries import print_summary


def plans(cases: int, seed: int) -> list[Plan]:
    """Devices and lines in turn."""
    kinds = [(name, rtu) for name in modbus_devices() for rtu in (True, False)]
    return [Plan(*kinds[k % len(kinds)], seed=f"{seed}/{k}") for k in range(cases)]


def summary(outcomes: list[Outcome], seconds: float) -> dict[str, object]:
    """Totals, and every wrong number by the plan that brings it back."""
    faults: Counter[str] = Counter()
    for outcome in outcomes:
        faults.update(outcome.faults)
    return {
        "schema": 1,
        "sequences": len(outcomes),
        "faults": dict(sorted(faults.items())),
        "readings": sum(outcome.readings for outcome in outcomes),
        "numbers": sum(outcome.numbers for outcome in outcomes),
        "wrong_numbers": sum(len(outcome.wrong) for outcome in outcomes),
        "wrong": [
            {"device": o.plan.device, "rtu": o.plan.rtu, "seed": o.plan.seed, "what": o.wrong[0]}
            for o in outcomes
            if o.wrong
        ][:20],
        "least_bystander": min(outcome.bystander for outcome in outcomes),
        "seconds": round(seconds, 1),
    }


def main() -> int:
    """Exit 1 where a single wrong number was published."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    begin = time.perf_counter()
    outcomes = [play(plan) for plan in plans(arguments.cases, arguments.seed)]
    found = summary(outcomes, time.perf_counter() - begin)
    print_summary(found, as_json=arguments.json)
    return 1 if found["wrong_numbers"] else 0


if __name__ == "__main__":
    sys.exit(main())
