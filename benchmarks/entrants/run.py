"""All entrants on some cases of missing_physics, then their table.

``python -m entrants.run DIR --cases 30``, in benchmarks/: writes the cases where DIR has none, lets
every entrant answer those that it has not answered, and scores. Needs requirements-rivals.txt.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from importlib import import_module
from pathlib import Path
from time import process_time

os.environ.setdefault("OMP_NUM_THREADS", "1")

from entrants.case import Case
from missing_physics.enter import main as enter

MODULES = ("diagnosis", "selections", "boosting")


def main() -> int:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", default="1")
    parser.add_argument("--cases", default="200", help="only the first of them")
    parser.add_argument("--only", choices=MODULES, action="append", help="one kind of entrants")
    args = parser.parse_args()
    if not (args.folder / "cases").exists():
        enter(["write", str(args.folder), "--seed", args.seed, "--cases", args.cases])
    for folder in sorted((args.folder / "cases").iterdir())[: int(args.cases)]:
        for module in args.only or MODULES:
            done = args.folder / "answers" / f"{folder.name}-{module}.done"
            if done.exists():
                continue
            start = process_time()
            for name, answer in import_module(f"entrants.{module}").answers(Case(folder)):
                path = args.folder / "answers" / name / f"{folder.name}.json"
                path.parent.mkdir(parents=True, exist_ok=True)
                seconds = {"seconds": process_time() - start}
                path.write_text(json.dumps(seconds | answer), encoding="utf-8")
                print(folder.name, name, answer["verdict"], file=sys.stderr, flush=True)
            done.touch()
    return enter(["score", str(args.folder), "--cases", args.cases])


if __name__ == "__main__":
    sys.exit(main())
