"""Runs cases through the diagnosis, one after the other or in a few processes."""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from campaign.answers import keep, kept
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


def _one(job: tuple[int, Plan, str | None]) -> Score | None:
    seed, plan, keep = job
    if keep is not None:
        return run_case(seed, plan, Path(keep) / f"case-{seed}")
    with tempfile.TemporaryDirectory() as folder:
        return run_case(seed, plan, Path(folder))


def run_cases(
    seed: int, plans: Sequence[Plan], jobs: int, folder: Path | None, log: Path | None = None
) -> list[Score]:
    """Scores in the order of the plans; progress on stderr.

    Each score is a line of ``log``; cases whose score is there already are not run again.
    """
    known = kept(log, Score.read)
    work = [(seed * 100_000 + i, p, str(folder) if folder else None) for i, p in enumerate(plans)]
    left = [job for job in work if job[0] not in known]
    for job, got in zip(left, _answers(left, jobs), strict=True):
        if got is None:
            print(f"none {job[0]} cannot be made: {job[1]}", file=sys.stderr)
            continue
        known[got.seed] = got
        keep(got, log)
        told = "ok  " if got.ok else "FAIL"
        print(
            f"{told} {got.seed} {got.kind} {got.snr:g} {','.join(got.truth)} -> {got.verdict} "
            f"{[list(s) for s in got.steps]} share {got.share:.3f} p {got.p_value:.2g} "
            f"{got.seconds:.1f} s | {got.scene}",
            file=sys.stderr,
            flush=True,
        )
    return [known[job[0]] for job in work if job[0] in known]


def _answers(
    jobs: Sequence[tuple[int, Plan, str | None]], processes: int
) -> Iterator[Score | None]:
    if processes == 1:
        yield from map(_one, jobs)
        return
    with ProcessPoolExecutor(processes) as pool:
        yield from pool.map(_one, jobs)
