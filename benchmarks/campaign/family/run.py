"""Makes, writes and diagnoses a family's cases, one line of JSON each."""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from campaign.family.answers import answer
from campaign.family.base import draw_base
from campaign.family.case import Case, draw_friction_case, write_case
from campaign.family.garbage import draw_garbage
from campaign.family.profiles import draw_wrong_profile
from campaign.family.relations import RELATIONS, write_files

CASES: Mapping[str, Callable[[np.random.Generator, int], Case]] = {
    "friction": draw_friction_case,
    "garbage": draw_garbage,
    "profiles": draw_wrong_profile,
}


@dataclass(frozen=True)
class Job:
    """One case to make and to diagnose."""

    kind: str
    seed: int
    """Of the campaign."""
    index: int
    limit: float
    """Of processor time, s."""
    keep: str = ""
    """Folder in which the case's files stay."""

    @property
    def number(self) -> int:
        """The case's own seed."""
        return self.seed * 100_000 + self.index

    def case(self) -> Case:
        """The same for the same seed and index."""
        return CASES[self.kind](np.random.default_rng([self.seed, self.index]), self.index)


def run_job(job: Job) -> dict[str, Any]:
    """Make one case, diagnose its files; the line of its result."""
    case = job.case()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(job.keep) / f"case-{job.number}" if job.keep else Path(temporary)
        runs, profile = write_case(case, folder)
        told = answer(runs, profile, job.limit)
    return line_of(job, case, told)


def line_of(job: Job, case: Case, told: Mapping[str, Any]) -> dict[str, Any]:
    """Truth and answer of a case as JSON."""
    truth = asdict(case.truth)
    truth |= {key: sorted(truth[key]) for key in ("right", "also")}
    return {
        "kind": job.kind,
        "seed": job.number,
        "truth": truth,
        "scene": case.scene,
        "samples": sum(len(run.channels["time"]) for run in case.runs),
        **told,
    }


def run_jobs(
    jobs: Sequence[Job],
    processes: int,
    out: Path | None,
    run: Callable[[Job], dict[str, Any]] = run_job,
) -> list[dict[str, Any]]:
    """Lines in the order of the jobs; progress on stderr.

    Each line is appended to ``out``; cases whose line is there already are not run again.
    """
    known = {line["seed"]: line for line in read_lines(out)}
    left = [job for job in jobs if job.number not in known]
    for line in _lines(left, processes, run):
        # As a reader of the file sees it.
        text = json.dumps(line, default=float)
        known[line["seed"]] = json.loads(text)
        if out is not None:
            with out.open("a", encoding="utf-8") as log:
                log.write(text + "\n")
        names = ["|".join(step["effects"]) for step in line["steps"]]
        why = line["text"].partition("\n")[0][:200]
        said = f"{line['verdict']} {names} {line['seconds']} s {why}"
        print(line["seed"], line["truth"]["words"], "->", said, file=sys.stderr, flush=True)
    return [known[job.number] for job in jobs]


def _lines(
    jobs: Sequence[Job], processes: int, run: Callable[[Job], dict[str, Any]]
) -> Iterator[dict[str, Any]]:
    if processes == 1:
        yield from map(run, jobs)
        return
    with ProcessPoolExecutor(processes) as pool:
        yield from pool.map(run, jobs)


def read_lines(path: Path | None) -> list[dict[str, Any]]:
    """Lines of a file of results; none of a file that is not there."""
    if path is None or not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def run_relations(job: Job) -> dict[str, Any]:
    """The line of a base case: the answer to it, and to each of its forms."""
    base = draw_base((job.seed, job.index), job.index)
    answers: dict[str, dict[str, Any]] = {}
    for number, (name, relation) in enumerate(RELATIONS.items()):
        random = np.random.default_rng([job.seed, job.index, number])
        with tempfile.TemporaryDirectory() as temporary:
            place = Path(temporary)
            if job.keep:
                place = Path(job.keep) / f"case-{job.number}" / name.replace(" ", "-")
            runs, profile = write_files(relation.files(base, random), place)
            answers[name] = answer(runs, profile, job.limit)
    first, *others = answers
    return {
        "kind": job.kind,
        "seed": job.number,
        "truth": {"words": base.words},
        "scene": base.machine.words,
        **answers[first],
        "relations": {name: answers[name] for name in others},
        "seconds_in_all": round(sum(a["seconds"] for a in answers.values()), 1),
    }
