"""Command: write cases, score answers.

``python -m missing_physics.enter write DIR``, ``python -m missing_physics.enter score DIR``.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path

from missing_physics.cases import draw_case, kinds, write_case, write_truth
from missing_physics.score import AnswerError, score, summary, table

PUBLIC = 200
"""Cases whose truths are written beside them, by the default seed."""


def write(folder: Path, truths: Path, seed: int, cases: int, of: int) -> None:
    """Write the first ``cases`` of the ``of`` cases of a seed, and their truths."""
    for index, kind in enumerate(kinds(seed, of)[:cases]):
        case, name = draw_case(seed, index, kind), f"case-{index + 1:03d}"
        write_case(case, folder / "cases" / name)
        write_truth(case, truths / f"{name}.json")


def main(arguments: list[str] | None = None) -> int:
    """Run; exit code 3 where an answer or a folder does not have the format."""
    parser = argparse.ArgumentParser(prog="python -m missing_physics.enter", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    writing = commands.add_parser("write", help="write cases and their truths")
    writing.add_argument("folder", type=Path)
    writing.add_argument("--seed", type=int, default=1, help="the maintainer's is secret")
    writing.add_argument("--cases", type=int, default=PUBLIC, help="only the first of them")
    writing.add_argument("--of", type=int, default=PUBLIC, help="the maintainer keeps 100")
    writing.add_argument("--truths", type=Path, help="another folder for the truths")
    scoring = commands.add_parser("score", help="score answers, one table")
    scoring.add_argument("folder", type=Path)
    scoring.add_argument("--truths", type=Path)
    scoring.add_argument("--cases", type=int, help="only the first of them")
    scoring.add_argument("--json", action="store_true", help="every case, as JSON")
    args = parser.parse_args(arguments)
    truths = args.truths or args.folder / "truths"
    if args.command == "write":
        if (args.folder / "cases").exists():
            parser.error(f"{args.folder / 'cases'} exists; name another folder")
        write(args.folder, truths, args.seed, args.cases, args.of)
        return 0
    entrants = sorted(path for path in args.folder.glob("answers/*") if path.is_dir())
    if not entrants:
        parser.error(f"{args.folder / 'answers'}: no folder of an entrant there; README.md")
    try:
        judged = {path.name: score(truths, path, args.cases) for path in entrants}
    except AnswerError as error:
        print(error, file=sys.stderr)
        return 3
    found = {name: summary(some) for name, some in judged.items()}
    if args.json:
        cases = {name: [asdict(one) for one in some] for name, some in judged.items()}
        print(json.dumps({"entrants": found, "cases": cases}, indent=1))
    else:
        print(table(found))
    return 0


if __name__ == "__main__":
    sys.exit(main())
