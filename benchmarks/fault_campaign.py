"""Random faults of a moving bench, in simulated time through the real loop, frames and replies.

``python benchmarks/fault_campaign.py --cases 1000 --seed 1 --json``: single, double and repeated
faults at random moments of jogs, moves and programmes, on one winch and on eight. Each case is
judged from the truth: the speed, tension and drive state of the simulation, never from what
winchkit says. With ``--realtime-share`` that share of the cases runs in real time. ``--case 1/17``
plays one case again and prints it. ``--jobs 2`` plays them in as many processes, with the same
result. One JSON object on stdout, failures on stderr; exit 1 where a case failed, 130 after Ctrl-C,
which keeps what was played. See benchmarks/README.md.
"""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
import re
import signal
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

from fault_cases.case import Case, cases
from fault_cases.judge import Verdict, judge
from fault_cases.play import play

_GOOD = ("stopped", "moved_after_trip", "over_tension", "cause", "log", "length", "error")
_LONGEST = 900.0
"""A process that has not played a case after so long is lost, s."""


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
        "length_right": sum(not (v.length or v.error) for v in verdicts),
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
    seed, number = arguments.case
    return [cases(number + 1, seed, real_time_share=share)[-1]]


def seed_and_number(text: str) -> tuple[int, int]:
    """Seed and number of a case, of an argument ``SEED/NUMBER``."""
    found = re.fullmatch(r"(\d+)/(\d+)", text, re.ASCII)
    if found is None:
        raise argparse.ArgumentTypeError(f"{text!r} is no SEED/NUMBER, such as 1/17")
    return int(found[1]), int(found[2])


def at_least_one(text: str) -> int:
    """A number of cases or processes."""
    if not re.fullmatch(r"0*[1-9]\d*", text, re.ASCII):
        raise argparse.ArgumentTypeError(f"{text!r} is no whole number of at least 1")
    return int(text)


def judged(case: Case) -> tuple[Case, Verdict, str]:
    """Play a case; also what ``--case`` prints."""
    record = play(case)
    told = f"{case} {record.trips} {record.early_reset} {record.late_reset}"
    return case, judge(record), told


def each(found: Sequence[Case], jobs: int) -> Iterator[tuple[Case, Verdict, str]]:
    """Play cases in ``jobs`` processes; they come in their order."""
    if jobs == 1:
        yield from map(judged, found)
        return
    # Ctrl-C is this process's affair: leaving the pool ends the others at once.
    alone = multiprocessing.get_context("spawn")
    with alone.Pool(jobs, signal.signal, (signal.SIGINT, signal.SIG_IGN)) as pool:
        coming = pool.imap(judged, found)
        for _ in found:
            yield coming.next(_LONGEST)


def main() -> int:
    """Exit 1 where a case failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=at_least_one, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--case", type=seed_and_number, help="SEED/NUMBER: play it and print it")
    parser.add_argument("--realtime-share", type=float, default=0.0)
    parser.add_argument("--limit", type=float, default=math.inf, help="end after so long, s")
    parser.add_argument("--jobs", type=at_least_one, default=1, help="processes")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    begin = time.perf_counter()
    played: list[tuple[Case, Verdict]] = []
    coming, ended = each(chosen(arguments), arguments.jobs), False
    try:
        for case, verdict, told in coming:
            played.append((case, verdict))
            if arguments.case is not None:
                print(told, file=sys.stderr)
            if not verdict.good or arguments.case is not None:
                kinds = [fault.kind for fault in case.faults]
                print(f"{case.seed} {kinds}: {verdict}", file=sys.stderr)
            if time.perf_counter() - begin > arguments.limit:
                break
    except KeyboardInterrupt:
        print(f"interrupted after {len(played)} cases", file=sys.stderr)
        ended = True
    finally:
        coming.close()
    if not played:
        return 130
    found = summary(played, time.perf_counter() - begin)
    if arguments.json:
        print(json.dumps(found))
    else:
        print({key: value for key, value in found.items() if key not in ("failed", "faults")})
    if ended:
        return 130
    return 0 if found["passed"] == found["cases"] else 1


if __name__ == "__main__":
    raise SystemExit(main())
