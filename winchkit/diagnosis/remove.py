"""Taking an effect out of a profile: what the others then are, and what that costs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from winchkit.diagnosis.add import fitted_json
from winchkit.diagnosis.dataset import prepare
from winchkit.diagnosis.diagnose import inquire
from winchkit.diagnosis.result import Estimate, OutputFit
from winchkit.diagnosis.uncertainty import estimates, spread_of
from winchkit.diagnosis.verdict import output_fits
from winchkit.diagnosis.weighing import weighed
from winchkit.effects.bind import Term
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.errors import UsageError
from winchkit.runs.run import Run
from winchkit.schema.winch import WinchProfile

__all__ = ["Removal", "remove"]


@dataclass(frozen=True)
class Removal:
    """What is left of a profile's effects, refitted together, and what the loss did."""

    effect: str
    outputs: Mapping[str, OutputFit]
    terms: tuple[tuple[Term, Mapping[str, Estimate]], ...]
    notes: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """As ``winchkit remove --json`` prints it."""
        return fitted_json(self.effect, self.outputs, self.terms, self.notes)


def remove(
    effect_id: str,
    runs: Sequence[Run],
    profile: WinchProfile,
    catalogue: Catalogue | None = None,
    band: float | None = None,
) -> Removal:
    """Refit a profile's effects without the last one of this name.

    Raises UsageError for an effect that the profile does not have, RunError with every fault of
    every run.
    """
    inquiry = inquire(prepare(runs, profile, band, thin=True), catalogue or load_catalogue())
    begin, noise = inquiry.settle(inquiry.begin)
    terms = begin.hypothesis.terms
    there = [index for index, term in enumerate(terms) if term.effect.id == effect_id]
    if not there:
        has = ", ".join(term.label for term in terms) or "none"
        raise UsageError(f"profile '{profile.name}' has no effect '{effect_id}'; it has {has}")
    best = weighed(inquiry, *inquiry.settle(begin.hypothesis.without(there[-1])))
    # Judged by the noise of the better model: without the effect its trace would pass for noise.
    outputs = output_fits(inquiry, (begin, noise), (best.fit, noise))
    spread = spread_of(inquiry.problem, best.fit, best.noise, inquiry.blocks)
    left = tuple(estimates(inquiry.problem, best.fit, spread))
    notes = (*inquiry.problem.dataset.notes, *best.notes)
    return Removal(effect_id, outputs, left, notes)
