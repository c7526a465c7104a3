"""A model specification: effects with values, nuisance parameters and initial states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from winchkit.effects.effect import Effect
from winchkit.effects.term import Term

START = "start"
"""Parameter of an effect with memory: its state at the start of a run."""


@dataclass(frozen=True)
class Hypothesis:
    """A model specification: effects with their values, nuisance parameters and initial states."""

    terms: tuple[Term, ...] = ()
    nuisances: tuple[float, ...] = ()
    """One per nuisance column of the regression; empty means zero."""
    starts: tuple[tuple[float, ...], ...] = ()
    """Per effect its initial state in every run; empty for an effect without memory."""

    def with_term(self, term: Term, runs: int) -> Hypothesis:
        """Hypothesis with one effect more, its initial states at zero."""
        remembers = term.effect.memory and START in term.values
        start = (0.0,) * runs if remembers else ()
        return replace(self, terms=(*self.terms, term), starts=(*self.starts, start))

    def with_law(self, effect: Effect) -> Hypothesis:
        """Hypothesis with another effect at the values of the last one."""
        return replace(self, terms=(*self.terms[:-1], Term(effect, self.terms[-1].values)))

    def with_term_at(self, index: int, term: Term) -> Hypothesis:
        """Hypothesis with another term without memory in the place of one."""
        return replace(self, terms=(*self.terms[:index], term, *self.terms[index + 1 :]))

    def exchanged(self, index: int, term: Term, runs: int) -> Hypothesis:
        """Hypothesis with another term in the place of one, its initial states at zero."""
        starts = list(self.starts)
        starts[index] = Hypothesis().with_term(term, runs).starts[0]
        return replace(self.with_term_at(index, term), starts=tuple(starts))

    def without(self, index: int) -> Hypothesis:
        """Hypothesis with one effect less."""
        keep = [i for i in range(len(self.terms)) if i != index]
        return replace(
            self,
            terms=tuple(self.terms[i] for i in keep),
            starts=tuple(self.starts[i] for i in keep),
        )


def held(term: Term) -> Term:
    """A term whose values are not fitted."""
    fixed = tuple(replace(p, role="fixed") for p in term.effect.parameters)
    return Term(replace(term.effect, parameters=fixed, polar=None), term.values)


def started(hypothesis: Hypothesis, run: int) -> Sequence[Term]:
    """Effects with the initial states of one run."""
    out = []
    for term, start in zip(hypothesis.terms, hypothesis.starts, strict=True):
        values: Mapping[str, float] = term.values
        out.append(Term(term.effect, {**values, START: start[run]}) if start else term)
    return out
