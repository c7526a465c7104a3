"""Random faults of a moving bench, in simulated time through the real loop, frames and replies.

``python benchmarks/fault_campaign.py --cases 1000 --seed 1 --json``: single, double and repeated
faults at random moments of jogs, moves and programmes, on one winch and on eight. Each case is
judged from the truth: the speed, tension and drive state of the simulation, never from what
winchkit says. With ``--realtime-share`` that share of the cases runs in real time. ``--case 1/17``
plays one case again and tells it. One JSON object on stdout, failures on stderr; exit 1 where a
case failed. See benchmarks/README.md.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections import Counter
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

from fault_cases.case import Case, cases
from fault_cases.judge import Verdict, judge
from fault_cases.play import play

_GOOD = ("stopped", "moved_after_trip", "over_tension", "cause", "log", "error")


def summary(played: list[tuple[Case, Verdict]], seconds: float) -> dict[str, Any]:
    """Counts, the worst reaction by fault, and every failure by the seed that brings it back."""
    worst: dict[str, float] = {}
    for case, verdict in played:
        single = len(case.faults) == 1 and not math.isnan(verdict.reaction)
        if single:
            kind = case.faults[0].kind
            worst[kind] = max(worst.get(kind, 0.0), verdict.reaction)
    verdicts = [verdict for _, verdict in played]
    return {
        "schema": 1,
        "cases": len(played),
        "passed": sum(verdict.good for verdict in verdicts),
        "stopped": sum(not (v.stopped or v.error) for v in verdicts),
        "moved_after_trip": sum(bool(v.moved_after_trip) for v in verdicts),
        "over_tension": sum(bool(v.over_tension) for v in verdicts),
        "cause_right": sum(not (v.cause or v.error) for v in verdicts),
        "log_whole": sum(not (v.log or v.error) for v in verdicts),
        "errors": sum(bool(v.error) for v in verdicts),
        "recovered": sum(v.recovered for v in verdicts),
        "not_recovered": {
            case.seed: f"{case.faults[0].kind}: {verdict.refusal[:200]}"
            for case, verdict in played
            if not verdict.recovered
        },
        "real_time": sum(case.real_time for case, _ in played),
        "independent_drives": sum(case.independent for case, _ in played),
        "eight_winches": sum(case.winches == 8 for case, _ in played),
        "faults": dict(Counter(fault.kind for case, _ in played for fault in case.faults)),
        "worst_s": {kind: round(value, 3) for kind, value in sorted(worst.items())},
        "failed": [
            {
                "seed": case.seed,
                "faults": [f"{f.kind} ({f.winch})" for f in case.faults],
                "motion": f"{case.motion} of {case.winches}",
                "real_time": case.real_time,
                "independent": case.independent,
                **{name: text for name in _GOOD if (text := getattr(verdict, name))},
            }
            for case, verdict in played
            if not verdict.good
        ],
        "seconds": round(seconds, 1),
    }


def chosen(arguments: argparse.Namespace) -> list[Case]:
    """The cases that are asked for."""
    share = arguments.realtime_share
    if arguments.case is None:
        found = cases(arguments.first + arguments.cases, arguments.seed, real_time_share=share)
        return found[arguments.first :]
    seed, _, number = arguments.case.partition("/")
    return [cases(int(number) + 1, int(seed), real_time_share=share)[-1]]


def main() -> int:
    """Exit 1 where a case failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--case", help="play one case, SEED/NUMBER, and tell it")
    parser.add_argument("--realtime-share", type=float, default=0.0)
    parser.add_argument("--limit", type=float, default=math.inf, help="end after so long, s")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    begin = time.perf_counter()
    played: list[tuple[Case, Verdict]] = []
    for case in chosen(arguments):
        if time.perf_counter() - begin > arguments.limit:
            break
        record = play(case)
        verdict = judge(record)
        played.append((case, verdict))
        if arguments.case is not None:
            print(case, record.trips, record.early_reset, record.late_reset, file=sys.stderr)
        if not verdict.good or arguments.case is not None:
            print(f"{case.seed} {[f.kind for f in case.faults]}: {verdict}", file=sys.stderr)
    found = summary(played, time.perf_counter() - begin)
    if arguments.json:
        print(json.dumps(found))
    else:
        print({key: value for key, value in found.items() if key not in ("failed", "faults")})
    return 0 if found["passed"] == found["cases"] else 1


if __name__ == "__main__":
    raise SystemExit(main())
