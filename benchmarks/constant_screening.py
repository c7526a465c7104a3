"""Group screening of the constants whose reason in the code is a rule of thumb.

``python benchmarks/constant_screening.py --draws 8 --cases 16 --seed 1 --json``: in each draw every
such constant of the time-series diagnosis is made larger or smaller by a factor, at random and all
at once, and the same cases are diagnosed again. A two-level screening design with random columns
(Satterthwaite, Technometrics 1 (1959) 111-137): where no answer changes, none of the constants
decides at that size, alone or beside others; where one does, the association of its changes with
the levels of each constant says where to look. Cases as in diagnosis_campaign.py, small; with
``--robots`` half of them as in robot_diagnosis.py and half as in robot_metrology.py, for the
constants of robots. See benchmarks/README.md.
"""

from __future__ import annotations

import argparse
import ast
import importlib
import os
import pkgutil
import re
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import pairwise
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from campaign.case import Plan
from campaign.run import run_case
from diagnosis_campaign import SNRS, plans
from robot_diagnosis import answer, named
from robot_metrology import Hidden, diagnosed, drawn
from robot_poses.cases import CASES
from robot_poses.hidden import Case
from summaries import print_summary

Name = tuple[str, str]
"""File below winchkit/diagnosis, and constant."""
PACKAGE = Path(__file__).parents[1] / "winchkit" / "diagnosis"
KINDS = ("none", "single", "pair", "outside")
ROOMS = ("data", "regression", "selection", "verdict")
"""Folders whose constants can change the answer for a winch."""
ROBOT_ROOMS = ("robot",)
"""Folders whose constants change the answer for a robot only."""
SETS = {"_DEGREES", "_POWERS"}
"""Sets of laws, which have no size."""


def rules_of_thumb(rooms: Sequence[str] = ROOMS) -> list[Name]:
    """Constants of folders that were chosen by judgement, and not by the computing cost."""
    found = []
    for room in rooms:
        for path in sorted((PACKAGE / room).rglob("*.py")):
            body = ast.parse(path.read_text(encoding="utf-8")).body
            for node, after in pairwise(body):
                names = _names(node)
                if names and _is_judgement(after) and not SETS & set(names):
                    place = path.relative_to(PACKAGE).as_posix()
                    found += [(place, name) for name in names]
    return found


def _names(node: ast.stmt) -> list[str]:
    if not isinstance(node, ast.Assign):
        return []
    target = node.targets[0]
    parts = target.elts if isinstance(target, ast.Tuple) else [target]
    return [part.id for part in parts if isinstance(part, ast.Name)]


def _is_judgement(node: ast.stmt) -> bool:
    """Whether the docstring after a constant says so."""
    if not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)):
        return False
    text = " ".join(str(node.value.value).lower().split())
    return "computing cost" not in text and ("rule of thumb" in text or "screened" in text)


def value_of(name: Name) -> Any:
    """Value of a constant."""
    return getattr(_module(name[0]), name[1])


def scaled(value: Any, factor: float) -> Any:
    """A constant at another level.

    Counts stay whole and at least 1; of a share or a ratio between 0.5 and 2 the distance from 1
    is scaled, so that it stays on its side of 1.
    """
    if isinstance(value, tuple):
        return tuple(scaled(one, factor) for one in value)
    if isinstance(value, int):
        moved = round(value * factor)
        return max(1, moved if moved != value else value + (1 if factor > 1 else -1))
    if 0.5 < value < 2 and value != 1:
        return 1 + (value - 1) * factor
    return value * factor


def set_constants(values: Mapping[Name, Any]) -> None:
    """Set constants where they are defined, and where another module has imported them."""
    for (place, name), value in values.items():
        home = _module(place)
        before = getattr(home, name)
        for module in [home, *_importers(name, before)]:
            setattr(module, name, value)


def _importers(name: str, before: Any) -> list[Any]:
    if name.startswith("_"):
        return []
    loaded = [m for key, m in sys.modules.items() if key.startswith("winchkit.") and m is not None]
    return [module for module in loaded if getattr(module, name, None) is before]


def _module(place: str) -> Any:
    return importlib.import_module("winchkit.diagnosis." + place[:-3].replace("/", "."))


def _answer(job: tuple[int, Plan, Mapping[Name, Any]]) -> tuple[Any, ...] | None:
    """Verdict and sets of names of a case."""
    seed, plan, values = job
    set_constants(values)
    with tempfile.TemporaryDirectory() as folder:
        found = run_case(seed, plan, Path(folder))
    return None if found is None else (found.verdict, *(tuple(sorted(s)) for s in found.steps))


def _robot_answer(job: tuple[int, Case | Hidden, Mapping[Name, Any]]) -> tuple[Any, ...]:
    """Verdict and sets of names of a case of a robot, or of a tracker that was set up anew."""
    seed, case, values = job
    set_constants(values)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        found = diagnosed(case, folder) if isinstance(case, Hidden) else answer(case, seed, folder)
    return (found["verdict"], *(tuple(own.split("|")) for own in named(found)))


def associations(
    names: Sequence[Name], levels: Sequence[Sequence[bool]], changed: Sequence[float]
) -> list[dict[str, Any]]:
    """Share of changed answers at the upper less that at the lower level, the largest first."""
    upper = np.asarray(levels, dtype=bool)
    share = np.asarray(changed)
    out = []
    for column, (place, name) in enumerate(names):
        high, low = share[upper[:, column]], share[~upper[:, column]]
        if len(high) and len(low):
            difference = float(high.mean() - low.mean())
            out.append({"constant": f"{place} {name}", "difference": round(difference, 3)})
    return sorted(out, key=lambda row: -abs(row["difference"]))


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=8)
    parser.add_argument("--cases", type=int, default=16)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--factor", type=float, default=1.5, help="between a value and its levels")
    parser.add_argument("--robots", action="store_true", help="constants and cases of robots")
    parser.add_argument("--only", default="", help="constants whose file and name match")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    import winchkit.diagnosis

    for module in pkgutil.walk_packages(winchkit.diagnosis.__path__, "winchkit.diagnosis."):
        importlib.import_module(module.name)
    names = [
        name
        for name in rules_of_thumb(ROBOT_ROOMS if args.robots else ROOMS)
        if re.search(args.only, " ".join(name))
    ]
    usual = {name: value_of(name) for name in names}
    chance = np.random.default_rng(args.seed)
    levels = [chance.random(len(names)) < 0.5 for _ in range(args.draws)]
    draws = [usual] + [
        {
            name: scaled(usual[name], args.factor if up else 1 / args.factor)
            for name, up in zip(names, upper, strict=True)
        }
        for upper in levels
    ]
    run: Callable[[Any], tuple[Any, ...] | None]
    cases: Sequence[Plan | Case | Hidden]
    if args.robots:
        trackers = drawn(args.cases // 2, args.seed * 100_000)
        run, cases = _robot_answer, [*CASES[: args.cases - args.cases // 2], *trackers]
    else:
        run, cases = _answer, plans(args.cases, list(KINDS), list(SNRS), (), small=True)
    jobs = [
        (args.seed * 100_000 + index, case, values)
        for values in draws
        for index, case in enumerate(cases)
    ]
    answers: list[tuple[Any, ...] | None] = []
    with ProcessPoolExecutor(args.jobs) as pool:
        for job, found in zip(jobs, pool.map(run, jobs), strict=True):
            answers.append(found)
            print(job[0], len(answers) // len(cases), found, file=sys.stderr, flush=True)
    table = [answers[n * len(cases) : (n + 1) * len(cases)] for n in range(len(draws))]
    known = [n for n, found in enumerate(table[0]) if found is not None]
    changed = [[own[n] != table[0][n] for n in known] for own in table[1:]]
    summary = {
        "schema": 1,
        "constants": len(names),
        "factor": args.factor,
        "answers": sum(len(own) for own in changed),
        "changed": sum(sum(own) for own in changed),
        "changes": [
            {
                "draw": draw + 1,
                "case": args.seed * 100_000 + n,
                "before": table[0][n],
                "after": table[draw + 1][n],
            }
            for draw, own in enumerate(changed)
            for n, is_changed in zip(known, own, strict=True)
            if is_changed
        ],
        "associations": associations(names, levels, [float(np.mean(own)) for own in changed])[:12],
    }
    print_summary(summary, as_json=args.json)


if __name__ == "__main__":
    main()
