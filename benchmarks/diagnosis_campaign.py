"""Tries to break the diagnosis: cases made by another physics, answers scored against the truth.

``python benchmarks/diagnosis_campaign.py --cases 40 --seed 1 --json``: one JSON object on stdout,
a table on stderr. ``--winches 8``: recordings of eight winches, of which none, one or all hide
an effect. See benchmarks/README.md.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parent))

from campaign.case import Plan
from campaign.run import run_cases
from campaign.score import summary, table
from campaign.several import EXTENTS
from campaign.several_score import run_several, several_summary
from campaign.sizes import CATALOGUE, OUTSIDE

KINDS = ("none", "single", "pair", "triple", "outside", "norepeat")
_POOLS = dict.fromkeys(("single", "norepeat", "one", "all"), CATALOGUE) | {"outside": OUTSIDE}
SNRS = (0.3, 1.0, 3.0, 10.0)


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


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kind", choices=dict.fromkeys((*KINDS, *EXTENTS)), action="append")
    parser.add_argument("--winches", type=int, default=1, help="in one recording")
    parser.add_argument("--snr", type=float, action="append")
    parser.add_argument("--effect", action="append", help="hide this one instead of a drawn one")
    parser.add_argument("--small", action="store_true", help="shorter runs")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--keep", type=Path, help="folder in which the cases' files stay")
    parser.add_argument("--log", type=Path, help="file that gets every score as a line of JSON")
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
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
        several = run_several(args.seed, extents, args.winches, args.keep, args.log)
        result = several_summary(several)
    else:
        result = summary(run_cases(args.seed, todo, args.jobs, args.keep, args.log))
    print(table(result), file=sys.stderr)
    if args.json:
        print(json.dumps(result, indent=1, default=float))


if __name__ == "__main__":
    main()
