"""winchkit's diagnosis beside usual ways to select terms, on the same cases of the campaign.

``python benchmarks/diagnosis_rivals.py --cases 30 --seed 1 --json``: one JSON object on stdout, a
table on stderr. Needs requirements-rivals.txt. See benchmarks/README.md.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from campaign.case import Case, Plan, make_case
from campaign.rivals import RIVALS, regression_of
from campaign.sizes import CATALOGUE, OUTSIDE
from winchkit.diagnosis.diagnose import diagnose
from winchkit.runs.read import read_run
from winchkit.schema.read import read_profile

OURS = "winchkit"


@dataclass(frozen=True)
class Named:
    """What one method named in one case."""

    seed: int
    kind: str
    snr: float
    truth: tuple[str, ...]
    method: str
    sets: tuple[tuple[str, ...], ...]
    """In the order of its choice; a set is what it holds for alike."""

    @property
    def right(self) -> bool:
        """Whether what it named first is hidden there."""
        return bool(self.sets) and any(t in self.sets[0] for t in self.truth)

    @property
    def exact(self) -> bool:
        """Whether it named what is hidden and nothing besides."""
        return bool(self.sets) and self.wrong == 0 and len(self.sets) == len(self.truth)

    @property
    def wrong(self) -> int:
        """Names that nothing hidden bears."""
        return sum(not any(t in s for t in self.truth) for s in self.sets)


def all_named(case: Case) -> list[Named]:
    """Every method on one case."""
    answer = diagnose([read_run(path) for path in case.runs], read_profile(case.profile))
    sets = {OURS: tuple(step.effects for step in answer.diagnosis.steps)}
    data = regression_of(answer.engine)
    sets |= {name: tuple((e,) for e in method(data)) for name, method in RIVALS.items()}
    truth = tuple(case.hidden)
    return [Named(case.seed, case.kind, case.snr, truth, m, s) for m, s in sets.items()]


def plans(cases: int) -> list[Plan]:
    """A third without any effect, a third with one, a third outside the catalogue; short runs."""
    out = []
    for index in range(cases):
        kind = ("none", "single", "outside")[index % 3]
        turn = {"single": CATALOGUE, "outside": OUTSIDE}.get(kind, ())
        # Through the whole catalogue, in steps that share no factor with its length.
        effects = (turn[(index // 3) * 5 % len(turn)],) if kind == "single" else ()
        if kind == "outside":
            effects = (turn[(index // 3) % len(turn)],)
        out.append(Plan(kind, (1.0, 3.0)[(index // 3) % 2], effects, small=True))
    return out


def figures(found: list[Named]) -> dict[str, dict[str, float]]:
    """Per method what the table shows."""
    out = {}
    for method in dict.fromkeys(n.method for n in found):
        own = [n for n in found if n.method == method]
        none, single, outside = (
            [n for n in own if n.kind == k] for k in ("none", "single", "outside")
        )
        out[method] = {
            "none_named": float(np.mean([bool(n.sets) for n in none])),
            "none_names": float(np.mean([len(n.sets) for n in none])),
            "single_first_right": float(np.mean([n.right for n in single])),
            "single_exact": float(np.mean([n.exact for n in single])),
            "single_wrong_names": float(np.mean([n.wrong for n in single])),
            "outside_named": float(np.mean([bool(n.sets) for n in outside])),
            "outside_names": float(np.mean([len(n.sets) for n in outside])),
        }
    return out


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--log", type=Path, help="file that gets every answer as a line of JSON")
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    found: list[Named] = []
    for index, plan in enumerate(plans(args.cases)):
        with tempfile.TemporaryDirectory() as folder:
            case = make_case(args.seed * 100_000 + index, plan, Path(folder))
            if case is None:
                continue
            named = all_named(case)
        found += named
        if args.log is not None:
            with args.log.open("a", encoding="utf-8") as lines:
                lines.writelines(json.dumps(asdict(n)) + "\n" for n in named)
        told = "  ".join(f"{n.method}: {len(n.sets)}" for n in named)
        print(f"{case.seed} {case.kind} {case.snr:g} {told}", file=sys.stderr, flush=True)
    result = figures(found)
    names = list(next(iter(result.values())))
    print(f"{'':24}" + "".join(f"{n:>20}" for n in names), file=sys.stderr)
    for method, row in result.items():
        cells = "".join(f"{row[n]:>20.2f}" for n in names)
        print(f"{method:24}" + cells, file=sys.stderr)
    if args.json:
        print(json.dumps({"cases": len(found) // len(result), "methods": result}, indent=1))


if __name__ == "__main__":
    main()
