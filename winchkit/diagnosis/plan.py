"""Plan of the next run of a winch: motion programmes by what they separate and detect."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, overload

from winchkit import wings
from winchkit.arguments import require_type
from winchkit.diagnosis.data.dataset import Dataset
from winchkit.diagnosis.design.discrimination import weights_of
from winchkit.diagnosis.design.plan import Offer, inseparable, offers, programme_of
from winchkit.diagnosis.design.programmes import (
    ISOLATING,
    OperatingRange,
    range_of_limits,
    range_of_runs,
)
from winchkit.diagnosis.diagnose import Answer, WinchAnswer
from winchkit.diagnosis.residuals.attribution import Attribution
from winchkit.diagnosis.results import Diagnosis
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.effects.term import Term
from winchkit.rendering import Shown
from winchkit.schema.bench import LimitSpec
from winchkit.schema.programme import Programme


@dataclass(frozen=True, repr=False)
class Plan(Shown):
    """What to record next, the best first."""

    pairs: tuple[tuple[Term, Term], ...]
    """Effects that the runs so far cannot distinguish; the first powers of an offer are theirs."""

    def to_json(self) -> dict[str, Any]:
        """JSON of ``winchkit plan --json``, without the file written."""
        raise NotImplementedError


@dataclass(frozen=True, repr=False)
class WinchPlan(Plan):
    """Candidate motion programmes for the next run of a winch."""

    dataset: Dataset
    """Runs so far."""
    operating_range: OperatingRange
    """Operating range of the programmes."""
    offers: tuple[Offer, ...]
    """Programmes with their time and power, the best first."""
    repeats: int
    """Runs of each: two where the runs so far have no repeat, which gives the noise."""
    isolates: Attribution | None = None
    """Unexplained residual whose cause the first programme isolates."""

    @property
    def inseparable(self) -> list[tuple[Term, Term]]:
        """Pairs that none of these programmes separates."""
        return inseparable(self.offers, self.pairs)

    def programme(self, name: str) -> Programme:
        """The best motion programme, for ``winchkit run``."""
        return programme_of(
            self.dataset, self.offers[0].kind, name, self.operating_range, self.repeats
        )

    def to_json(self) -> dict[str, Any]:
        """JSON of ``winchkit plan --json``, without the file written."""
        offers = [offer.to_json(self.pairs) for offer in self.offers]
        isolates = {} if self.isolates is None else {"isolates": self.isolates.to_json()}
        return {"schema": 1, "offers": offers, **isolates}


@overload
def plan(
    answer: WinchAnswer, catalogue: Catalogue | None = None, limits: LimitSpec | None = None
) -> WinchPlan: ...


@overload
def plan(
    answer: Answer, catalogue: Catalogue | None = None, limits: LimitSpec | None = None
) -> Plan: ...


def plan(
    answer: Answer, catalogue: Catalogue | None = None, limits: LimitSpec | None = None
) -> Plan:
    """Propose the next motion programme after a diagnosis, or the next poses of a robot.

    Programmes are simulated on the nominal model with the noise of the runs. The first one belongs
    to the shortest set of runs that separates all effects that the runs cannot distinguish; then
    come those that separate most of them, or make effects detectable. Where none
    is to be distinguished and a residual has no cause, the first one isolates its cause.

    Parameters
    ----------
    answer
        What :func:`winchkit.diagnose` returned.
    catalogue
        Effects whose detection is of interest; by default all that are installed.
    limits
        Limits of the bench on which the programme is to run; by default the programme keeps to the
        stroke, speed and load of the runs so far. Both are of winches only.

    Returns
    -------
    Plan
        Candidates, the best first: programmes in a WinchPlan, poses in a PosePlan.

    Notes
    -----
    The power is that of a noncentral χ² test (:mod:`winchkit.diagnosis.design.discrimination`).
    """
    if (by_wing := wings.call("plan", answer)) is not None:
        poses: Plan = by_wing(answer)
        return poses
    require_type(answer, WinchAnswer, "answer")
    assert isinstance(answer, WinchAnswer), "just required"
    regression, noise = answer.engine.regression, answer.result.noise
    dataset = regression.dataset
    allowed = range_of_runs(dataset) if limits is None else range_of_limits(dataset, limits)
    effects = list((catalogue or load_catalogue()).of_winches())
    repeats = 1 if noise.from_repeats else 2
    found = offers(
        regression,
        answer.pairs,
        weights_of(regression, noise),
        effects,
        threshold=answer.threshold,
        repeats=repeats,
        operating_range=allowed,
    )
    isolates = None if answer.pairs else _unexplained(answer.diagnosis)
    if isolates is not None:
        found.sort(key=lambda offer: offer.kind.name != ISOLATING[isolates.variable][0])
    return WinchPlan(answer.pairs, dataset, allowed, tuple(found), repeats, isolates)


def _unexplained(diagnosis: Diagnosis) -> Attribution | None:
    """Largest unexplained pattern that a programme isolates."""
    if diagnosis.verdict in {"adequate", "explained"}:
        return None
    return next((where for where in diagnosis.where if where.variable in ISOLATING), None)
