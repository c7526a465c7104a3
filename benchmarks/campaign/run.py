"""A case through the diagnosis."""

from __future__ import annotations

import time
from pathlib import Path

from campaign.case import Case, Plan, make_case
from campaign.score import Score, refused, score


def run_case(seed: int, plan: Plan, folder: Path) -> Score | None:
    """Make one case, diagnose its files and score the answer; None where no case can be made."""
    case = make_case(seed, plan, folder)
    return None if case is None else answer(case)


def answer(case: Case) -> Score:
    """Diagnose a case from its files."""
    from winchkit.diagnosis.diagnose import diagnose
    from winchkit.errors import WinchkitError
    from winchkit.runs.read import read_run
    from winchkit.schema.read import read_profile

    runs = [read_run(path) for path in case.runs]
    begun = time.perf_counter()
    try:
        answer = diagnose(runs, read_profile(case.profile))
    except WinchkitError as error:
        # A refusal of good files is an answer too, a wrong one.
        return refused(case, str(error), time.perf_counter() - begun)
    seconds = time.perf_counter() - begun
    p_value = answer.result.lack_of_fit_test.p_value
    return score(case, answer.diagnosis.to_json(), p_value, seconds)
