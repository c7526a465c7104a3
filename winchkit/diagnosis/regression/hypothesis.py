"""What is held against the runs: terms with their values, nuisances, and initial states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from winchkit.effects.effect import Effect
from winchkit.effects.term import Term

__all__ = ["START", "Hypothesis", "started"]

START = "start"
"""Parameter of an effect with memory that says in which state a run begins."""


@dataclass(frozen=True)
class Hypothesis:
    """Terms with their values, nuisances, and initial states."""

    terms: tuple[Term, ...] = ()
    nuisances: tuple[float, ...] = ()
    """One per column of the problem's ``nuisance_columns``; none is all zero."""
    starts: tuple[tuple[float, ...], ...] = ()
    """Per term: one initial state per run where it has memory, else nothing."""

    def with_term(self, term: Term, runs: int) -> Hypothesis:
        """With one term more."""
        remembers = term.effect.memory and START in term.values
        start = (0.0,) * runs if remembers else ()
        return replace(self, terms=(*self.terms, term), starts=(*self.starts, start))

    def with_law(self, effect: Effect) -> Hypothesis:
        """With another effect at the values of the last term."""
        return replace(self, terms=(*self.terms[:-1], Term(effect, self.terms[-1].values)))

    def without(self, index: int) -> Hypothesis:
        """With one term less."""
        keep = [i for i in range(len(self.terms)) if i != index]
        return replace(
            self,
            terms=tuple(self.terms[i] for i in keep),
            starts=tuple(self.starts[i] for i in keep),
        )


def started(hypothesis: Hypothesis, run: int) -> Sequence[Term]:
    """Terms with the initial states of one run."""
    out = []
    for term, start in zip(hypothesis.terms, hypothesis.starts, strict=True):
        values: Mapping[str, float] = term.values
        out.append(Term(term.effect, {**values, START: start[run]}) if start else term)
    return out
