"""The diagnosis on friction of many forms, on garbage, on wrong profiles, and on changed data.

``python benchmarks/diagnosis_family.py --kind friction --cases 100 --seed 1 --out FILE.jsonl``:
one line of JSON a case, the figures on stdout, progress on stderr. ``--compare OLD.jsonl`` lists
the cases whose verdict or names differ. See benchmarks/README.md.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

from campaign.family.relation_score import relation_table
from campaign.family.run import CASES, Job, read_lines, run_job, run_jobs, run_relations
from campaign.family.score import changes, failures, table

METAMORPHIC = "metamorphic"


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kind", choices=(*CASES, METAMORPHIC), required=True)
    parser.add_argument("--cases", type=int, default=40)
    parser.add_argument("--first", type=int, default=0, help="index of the first case")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--limit", type=float, default=60.0, help="of processor time a case, s")
    parser.add_argument("--out", type=Path, help="file that gets a line of JSON a case")
    parser.add_argument("--keep", type=Path, help="folder in which the cases' files stay")
    parser.add_argument("--compare", type=Path, help="file of an earlier run")
    args = parser.parse_args()
    keep = str(args.keep) if args.keep else ""
    jobs = [
        Job(args.kind, args.seed, index, args.limit, keep)
        for index in range(args.first, args.first + args.cases)
    ]
    run = run_relations if args.kind == METAMORPHIC else run_job
    lines = run_jobs(jobs, args.jobs, args.out, run)
    if args.kind == METAMORPHIC:
        print(relation_table(lines))
    else:
        print(table(lines), "", "failures", *failures(lines), sep="\n")
    if args.compare:
        changed = changes(read_lines(args.compare), lines)
        print(f"changed: {len(changed)}", *changed, sep="\n")


if __name__ == "__main__":
    main()
