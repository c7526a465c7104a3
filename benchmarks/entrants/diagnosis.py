"""winchkit's diagnosis, with its defaults."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from entrants.case import Case
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.regression.hypothesis import Hypothesis

VERDICTS = {"adequate": "none", "explained": "effects"}
"""All others say that something may be missing that was not found."""


def answers(case: Case) -> Iterator[tuple[str, dict[str, Any]]]:
    """The effects of its final model, each with its set."""
    answer = diagnose(case.runs, case.profile)
    steps = answer.diagnosis.steps
    model = Hypothesis()
    for term in answer.result.final.hypothesis.terms:
        model = model.with_term(term, 1)  # memories begin at rest
    is_open = any(step.law == "open" for step in steps)
    yield (
        "winchkit",
        {
            "verdict": "unknown" if is_open else VERDICTS.get(answer.diagnosis.verdict, "unknown"),
            "effects": [{"names": list(s.effects), "certain": s.certain} for s in steps],
            "predicted": case.predicted(case.change(model)),
            "verdict of winchkit": answer.diagnosis.verdict,
        },
    )
