"""The diagnosis of a robot: first with the numbers of its file, then with its geometry let go.

The geometry that was fitted to these very runs is fitted again beside whatever is sought, as are
the values of all effects that a profile has. A geometry that was not is taken as it stands, within
the uncertainty of its calibration; only where no few effects explain the runs with it is all of it
let go, and then it is the first thing that the model lacks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import f as f_distribution

from winchkit.diagnosis.diagnose import Told, silent
from winchkit.diagnosis.fit import fit
from winchkit.diagnosis.hypothesis import Hypothesis
from winchkit.diagnosis.robot.answer import RobotAnswer, Seen, answer_of
from winchkit.diagnosis.robot.believed import Believed
from winchkit.diagnosis.robot.inquiry import RobotInquiry
from winchkit.diagnosis.robot.problem import RobotProblem
from winchkit.diagnosis.robot.study import Study, fitted_to, study_of
from winchkit.diagnosis.search import Found, search
from winchkit.diagnosis.verdict import judge
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.runs.run import Run
from winchkit.schema.robot import RobotProfile

__all__ = ["diagnose_robot"]

_GEOMETRY_LEVEL = 1e-3
_ONE_OF_FEW = 0.4


def diagnose_robot(
    runs: Sequence[Run],
    profile: RobotProfile,
    catalogue: Catalogue | None = None,
    told: Told = silent,
) -> RobotAnswer:
    """Find which effect of the catalogue a robot's model lacks on these poses.

    ``told`` hears what is begun and which share (0 to 1) of the work is about done. Raises RunError
    with every fault of every run, FileError for effects that do not bind.
    """
    told("judging the noise", 0.0)
    study = study_of(runs, profile, catalogue or load_catalogue())
    told("searching", 0.4)
    if fitted_to(profile, runs):
        inquiry = study.let_go()
        return _concluded(study, inquiry, inquiry)
    filed = study.as_filed()
    if _beyond_few(study, filed):
        return _concluded(study, study.let_go(), filed)
    found = search(filed)
    if added := found.final.hypothesis.terms[filed.given :]:
        # Poses placed by ropes that contradict each other turn, and tensions there look unbalanced.
        filed = study.as_filed(added[:1])
        found = search(filed)
    judgement = judge(filed, found)
    if judgement.verdict in ("adequate", "explained") and not _geometry_is_off(study, filed, found):
        return answer_of(Seen(study, filed, filed, found, judgement), "file")
    return _concluded(study, study.let_go(), filed)


def _beyond_few(study: Study, filed: RobotInquiry) -> bool:
    """Whether the whole geometry explains far more than any single effect does."""
    gain = _gain_of_geometry(study, filed, filed.begin)
    if not _is_real(study, gain):
        return False
    present, noise = filed.settle(filed.begin)
    best = max((s.gain for s in filed.scores(present, noise)), default=0.0)
    return best < _ONE_OF_FEW * gain


def _gain_of_geometry(study: Study, filed: RobotInquiry, model: Hypothesis) -> float:
    """Whitened squares that the geometry takes, beyond what its uncertainty allows it."""
    standing = filed.robot_problem.standing
    wide = RobotProblem(replace(standing, believed=_from(study.prior, standing.believed)))
    hypothesis = replace(model, nuisances=())
    before = filed.problem
    cost = fit(before, hypothesis, np.ones(before.rows)).cost
    return cost - fit(wide, hypothesis, np.ones(wide.rows)).cost


def _concluded(study: Study, inquiry: RobotInquiry, filed: RobotInquiry) -> RobotAnswer:
    """With the geometry let go."""
    found = search(inquiry)
    return answer_of(Seen(study, inquiry, filed, found, judge(inquiry, found)), "refitted")


def _geometry_is_off(study: Study, filed: RobotInquiry, found: Found) -> bool:
    """Whether the geometry as a whole would explain more of what is left than chance does."""
    return _is_real(study, _gain_of_geometry(study, filed, found.final.hypothesis))


def _is_real(study: Study, gain: float) -> bool:
    """F test of the whitened squares that the geometry takes."""
    count = len(study.prior)
    freedom = study.noise.freedom.get("cable_length", 1.0)
    level = float(f_distribution.isf(_GEOMETRY_LEVEL, count, max(freedom, 1.0)))
    return gain / count > level


def _from(prior: Sequence[Believed], now: Sequence[Believed]) -> tuple[Believed, ...]:
    """Priors from where the numbers are now."""
    there = {(b.term.effect.id, b.parameter): b.value for b in now}
    out = []
    for belief in prior:
        value = there.get((belief.term.effect.id, belief.parameter), 0.0)
        out.append(replace(belief.moved(value / belief.std), at=value))
    return tuple(out)
