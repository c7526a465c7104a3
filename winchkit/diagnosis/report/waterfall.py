"""What every step buys out of sample: in the order of growth, added first, and dropped last."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from winchkit.diagnosis.diagnose import Answer
from winchkit.diagnosis.gate import held_out_rms
from winchkit.diagnosis.problem import Hypothesis

__all__ = ["Waterfall", "waterfall_of"]


@dataclass(frozen=True)
class Waterfall:
    """Held-out rms per output, SI, at every rung."""

    rungs: tuple[tuple[str, Mapping[str, float]], ...]
    """The profile as it is, then with each addition in the order of growth."""
    first: Mapping[str, Mapping[str, float]]
    """By effect: with it alone beside the profile."""
    last: Mapping[str, Mapping[str, float]]
    """By effect: with everything else that was found, but without it."""


def waterfall_of(answer: Answer) -> Waterfall | None:
    """The ladder of a diagnosis; None where it names nothing."""
    diagnosis, inquiry, found = answer.diagnosis, answer.inquiry, answer.found
    if not diagnosis.steps:
        return None
    whole = found.final.hypothesis
    given = tuple(range(inquiry.given))
    added = tuple(range(inquiry.given, len(whole.terms)))
    names = [whole.terms[index].label for index in added]
    folds = inquiry.folds(found.final, found.noise)
    known: dict[tuple[int, ...], Mapping[str, float]] = {
        given: {o: fit.heldout_rms_before for o, fit in diagnosis.outputs.items()},
        (*given, *added): {o: fit.heldout_rms_after for o, fit in diagnosis.outputs.items()},
    }

    def error(*terms: int) -> Mapping[str, float]:
        kept = (*given, *terms)
        if kept not in known:
            fitted = inquiry.refit(_only(whole, kept), found.noise)
            known[kept] = held_out_rms(inquiry.problem, fitted, found.noise, folds)
        return known[kept]

    rungs = [("profile as it is", error())]
    rungs += [(f"+ {name}", error(*added[: n + 1])) for n, name in enumerate(names)]
    return Waterfall(
        rungs=tuple(rungs),
        first={name: error(index) for name, index in zip(names, added, strict=True)},
        last={
            name: error(*(other for other in added if other != index))
            for name, index in zip(names, added, strict=True)
        },
    )


def _only(whole: Hypothesis, kept: tuple[int, ...]) -> Hypothesis:
    return Hypothesis(
        tuple(whole.terms[index] for index in kept),
        whole.nuisances,
        tuple(whole.starts[index] for index in kept),
    )
