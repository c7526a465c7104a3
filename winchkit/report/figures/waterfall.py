"""Contributions of effects to the held-out error: in sequence, added first, and removed last."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from winchkit.diagnosis.diagnose import Answer
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.selection.engine import SelectionEngine
from winchkit.diagnosis.selection.stepwise import SelectionResult

__all__ = ["GEOMETRY_NAME", "Waterfall", "waterfall_of"]

GEOMETRY_NAME = "the whole geometry"
"""Name of the change of a robot's model in which all of its geometry is fitted."""


@dataclass(frozen=True)
class Waterfall:
    """Held-out rms per output, SI, at every step."""

    rungs: tuple[tuple[str, Mapping[str, float]], ...]
    """The unchanged profile, then with each effect in the order of selection."""
    first: Mapping[str, Mapping[str, float]]
    """By effect: the profile with it alone."""
    last: Mapping[str, Mapping[str, float]]
    """By effect: the profile with all other named effects."""


def waterfall_of(answer: Answer) -> Waterfall | None:
    """Contributions of the effects of a diagnosis; None where it names none."""
    diagnosis, engine, file_engine = answer.diagnosis, answer.engine, answer.file_engine
    if not diagnosis.steps:
        return None
    whole = answer.result.final.hypothesis
    added = tuple(range(engine.n_initial_terms, len(whole.terms)))
    names = [whole.terms[index].label for index in added]
    before = {o: fit.heldout_rms_before for o, fit in diagnosis.outputs.items()}
    after = {o: fit.heldout_rms_after for o, fit in diagnosis.outputs.items()}
    ladder = _Ladder(engine, answer.result, {added: after})
    rungs: list[tuple[str, Mapping[str, float]]] = [("unchanged profile", before)]
    first: dict[str, Mapping[str, float]] = {}
    last: dict[str, Mapping[str, float]] = {}
    if file_engine is engine:
        ladder.known[()] = before
        plain = ladder
    else:
        plain = _Ladder(file_engine, answer.result, {(): before})
        rungs.append((f"+ {GEOMETRY_NAME}", ladder.error()))
        first[GEOMETRY_NAME], last[GEOMETRY_NAME] = ladder.error(), plain.error(*added)
    rungs += [(f"+ {name}", ladder.error(*added[: n + 1])) for n, name in enumerate(names)]
    for name, index in zip(names, added, strict=True):
        first[name] = plain.error(index)
        last[name] = ladder.error(*(other for other in added if other != index))
    return Waterfall(tuple(rungs), first, last)


@dataclass(frozen=True)
class _Ladder:
    """Held-out errors of a model with some of its named effects."""

    engine: SelectionEngine
    result: SelectionResult
    known: dict[tuple[int, ...], Mapping[str, float]]

    def error(self, *terms: int) -> Mapping[str, float]:
        """Held-out error of the profile with these effects, refitted."""
        if terms not in self.known:
            engine, noise = self.engine, self.result.noise
            kept = _only(self.result.final.hypothesis, (*range(engine.n_initial_terms), *terms))
            fitted = engine.refit(kept, noise)
            folds = engine.folds(self.result.final, noise)
            self.known[terms] = engine.held_out_errors(fitted, noise, folds)
        return self.known[terms]


def _only(whole: Hypothesis, kept: tuple[int, ...]) -> Hypothesis:
    """Some terms of a hypothesis; its nuisance parameters are linear and restart at zero."""
    return Hypothesis(
        tuple(whole.terms[index] for index in kept),
        (),
        tuple(whole.starts[index] for index in kept),
    )
