"""Diagnoses a base case and its changed forms; one line of JSON a base case."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from campaign.family.answers import answer
from campaign.family.base import draw_base
from campaign.family.relations import RELATIONS, write_files
from campaign.family.run import Job


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
