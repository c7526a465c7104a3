"""Plan of the next run of a winch: motion programmes by what they separate and detect."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from winchkit.arguments import require_type
from winchkit.diagnosis.data.dataset import Dataset
from winchkit.diagnosis.design.plan import Offer, inseparable, offers, programme_of
from winchkit.diagnosis.design.programmes import OperatingRange, range_of_limits, range_of_runs
from winchkit.diagnosis.diagnose import WinchAnswer
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.effects.term import Term
from winchkit.rendering import Shown
from winchkit.schema.bench import LimitSpec
from winchkit.schema.programme import Programme


@dataclass(frozen=True, repr=False)
class Plan(Shown):
    """Candidate motion programmes for the next run, the best first."""

    dataset: Dataset
    """Runs so far."""
    operating_range: OperatingRange
    """Operating range of the programmes."""
    pairs: tuple[tuple[Term, Term], ...]
    """Effects that the runs so far cannot distinguish."""
    offers: tuple[Offer, ...]
    """Programmes with their time and power, the best first."""

    @property
    def inseparable(self) -> list[tuple[Term, Term]]:
        """Pairs that none of these programmes separates."""
        return inseparable(self.offers, self.pairs)

    def programme(self, name: str) -> Programme:
        """The best motion programme, for ``winchkit run``."""
        return programme_of(self.dataset, self.offers[0].kind, name, self.operating_range)

    def to_json(self) -> dict[str, Any]:
        """JSON of ``winchkit plan --json``, without the file written."""
        return {"schema": 1, "offers": [offer.to_json(self.pairs) for offer in self.offers]}


def plan(
    answer: WinchAnswer, catalogue: Catalogue | None = None, limits: LimitSpec | None = None
) -> Plan:
    """Propose the next motion programme after a diagnosis.

    Programmes are simulated on the nominal model with the noise of the runs; those that separate
    effects that the runs cannot distinguish come first, then those that make effects detectable.

    Parameters
    ----------
    answer
        What :func:`winchkit.diagnose` returned.
    catalogue
        Effects whose detection is of interest; by default all that are installed.
    limits
        Limits of the bench on which the programme is to run; by default the programme keeps to the
        stroke, speed and load of the runs so far.

    Returns
    -------
    Plan
        Candidate programmes, the best first.

    Notes
    -----
    The power is that of a noncentral χ² test (:mod:`winchkit.diagnosis.design.discrimination`).
    """
    require_type(answer, WinchAnswer, "answer")
    regression, noise = answer.engine.regression, answer.result.noise.rms
    dataset = regression.dataset
    allowed = range_of_runs(dataset) if limits is None else range_of_limits(dataset, limits)
    effects = list(load_catalogue() if catalogue is None else catalogue)
    found = offers(
        regression,
        answer.pairs,
        noise,
        effects,
        threshold=answer.threshold,
        operating_range=allowed,
    )
    return Plan(dataset, allowed, answer.pairs, tuple(found))
