"""Tries to break the diagnosis: cases made by another physics, answers scored against the truth.

``python benchmarks/diagnosis_campaign.py --cases 40 --seed 1 --json``: one JSON object on stdout,
a table on stderr. ``--winches 8``: recordings of eight winches, of which none, one or all hide
an effect. ``--loggers``: one effect or none, recorded by loggers with faults. See
benchmarks/README.md.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

from campaign.answers import scores_of
from campaign.case import Plan
from campaign.logger_case import LoggerPlan, run_logger_case
from campaign.logger_score import LoggerScore, logger_summary, logger_table
from campaign.loggers import FAULTS
from campaign.run import run_case
from campaign.score import Score, summary, table
from campaign.several_score import EXTENTS, SeveralScore, run_several, several_summary
from campaign.sizes import CATALOGUE, OUTSIDE

KINDS = ("none", "single", "pair", "triple", "outside", "norepeat")
_POOLS = dict.fromkeys(("single", "norepeat", "one", "all"), CATALOGUE) | {"outside": OUTSIDE}
SNRS = (0.3, 1.0, 3.0, 10.0)
LOGGER_SNRS = (1.0, 3.0, 10.0)


def plans(
    cases: int, kinds: list[str], snrs: list[float], effects: tuple[str, ...], small: bool
) -> list[Plan]:
    """One plan a case: kinds and sizes in turn, every effect as often as any other."""
    mix = [(kind, snr) for kind in kinds for snr in (snrs if kind != "none" else snrs[:1])]
    out = []
    for index in range(cases):
        kind, snr = mix[index % len(mix)]
        pool = _POOLS.get(kind)
        turn = (pool[(index // len(mix)) % len(pool)],) if pool else ()
        out.append(Plan(kind, snr, effects or turn, small))
    return out


def logger_plans(args: argparse.Namespace) -> list[LoggerPlan]:
    """One plan a case: every fourth hides nothing, the others an effect, sizes and faults in turn.

    What is not given is drawn at random.
    """
    snrs = [0.0, *(args.snr or LOGGER_SNRS)]
    effects, faults = args.effect or [""], args.fault or [""]
    return [
        LoggerPlan(
            snrs[index % len(snrs)],
            effects[index // len(snrs) % len(effects)],
            faults[index % len(faults)],
            args.small,
        )
        for index in range(args.cases)
    ]


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kind", choices=dict.fromkeys((*KINDS, *EXTENTS)), action="append")
    parser.add_argument("--winches", type=int, default=1, help="in one recording")
    parser.add_argument("--loggers", action="store_true", help="that have faults")
    parser.add_argument("--fault", choices=FAULTS, action="append", help="not a drawn one")
    parser.add_argument("--snr", type=float, action="append")
    parser.add_argument("--effect", action="append", help="hide this one instead of a drawn one")
    parser.add_argument("--small", action="store_true", help="shorter runs")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="folder in which the cases' files stay")
    parser.add_argument("--log", type=Path, help="file that gets every score as a line of JSON")
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    how = {"jobs": args.jobs, "folder": args.keep, "log": args.log}
    if args.loggers:
        scores = scores_of(run_logger_case, args.seed, logger_plans(args), LoggerScore.read, **how)
        show(logger_summary(scores), logger_table, args.json)
        return
    kinds = EXTENTS if args.winches > 1 else KINDS
    if wrong := set(args.kind or ()) - set(kinds):
        parser.error(f"{', '.join(wrong)}: of {args.winches} winches there are {', '.join(kinds)}")
    todo = plans(
        args.cases,
        args.kind or list(kinds),
        args.snr or list(SNRS),
        tuple(args.effect or ()),
        args.small,
    )
    if args.winches > 1:
        extents = [(plan.kind, plan) for plan in todo]
        run = partial(run_several, args.winches)
        several = scores_of(run, args.seed, extents, SeveralScore.read, **how)
        result = several_summary(several)
    else:
        result = summary(scores_of(run_case, args.seed, todo, Score.read, **how))
    show(result, table, args.json)


def show(result: dict[str, Any], words: Callable[[dict[str, Any]], str], as_json: bool) -> None:
    """A table on stderr, JSON on stdout."""
    print(words(result), file=sys.stderr)
    if as_json:
        print(json.dumps(result, indent=1, default=float))


if __name__ == "__main__":
    main()
