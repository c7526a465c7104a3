"""What to run next, as a programme: what it separates and what it would show for the first time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from winchkit.diagnosis.dataset import Dataset
from winchkit.diagnosis.kinds import KINDS, Kind, imagined, seen
from winchkit.diagnosis.next_run import power_of, separation
from winchkit.diagnosis.problem import Problem
from winchkit.diagnosis.signature import missing_needs
from winchkit.effects.bind import Term
from winchkit.effects.coordinates import Coordinates
from winchkit.effects.effect import Effect
from winchkit.schema.programme import Programme, Step

__all__ = ["Offer", "offers", "programme_of"]

_SURE = 0.9
_REPEATS = 2
_HANGS = 0.5


@dataclass(frozen=True)
class Offer:
    """One kind of programme and what it would bring."""

    kind: Kind
    minutes: float
    """Of motion, both repeats."""
    powers: tuple[float, ...]
    """Chance of telling each pair apart."""
    shows: tuple[str, ...]
    """Effects of a usual size that it shows and the runs so far do not."""

    @property
    def per_minute(self) -> tuple[float, float]:
        """What it separates, then what it shows, a minute: more is better."""
        worst = min(self.powers, default=0.0)
        return round(worst, 2) / self.minutes ** (worst >= _SURE), len(self.shows) / self.minutes

    def to_json(self, pairs: Sequence[tuple[Term, Term]]) -> dict[str, Any]:
        """As ``winchkit plan --json`` prints it."""
        separates = [
            {"effects": [a.effect.id, b.effect.id], "power": power}
            for (a, b), power in zip(pairs, self.powers, strict=True)
        ]
        return {
            "kind": self.kind.name,
            "minutes": self.minutes,
            "separates": separates,
            "shows": list(self.shows),
        }


def offers(
    problem: Problem,
    pairs: Sequence[tuple[Term, Term]],
    noise: Mapping[str, float],
    effects: Sequence[Effect],
) -> list[Offer]:
    """Every kind of programme, the most telling per minute first."""
    dataset = problem.dataset
    hidden = [
        term
        for term in _usual(effects, problem)
        if power_of(separation(problem, term, None, noise)) < _SURE
    ]
    out = []
    for kind in KINDS:
        tried = imagined(dataset, kind)
        minutes = sum(r.signals.time[-1] for r in tried.dataset.recordings) / 60 * _REPEATS
        powers = tuple(power_of(_twice(separation(tried, a, b, noise))) for a, b in pairs)
        shows = tuple(
            term.effect.id
            for term in hidden
            if power_of(_twice(separation(tried, term, None, noise))) >= _SURE
        )
        out.append(Offer(kind, minutes, powers, shows))
    return sorted(out, key=lambda offer: offer.per_minute, reverse=True)


def programme_of(dataset: Dataset, kind: Kind, name: str) -> Programme:
    """A kind as a programme for ``winchkit run``: within the stroke and speed seen so far, twice.

    It begins and ends at the shortest length, so that its repeats are equal.
    """
    stroke = seen(dataset)
    steps: list[Step] = []
    for warmed in kind.warmed if _warm(dataset) else (0.0,):
        if warmed:
            steps.append(Step(ask=f"warm rope and machine up by {warmed:g} K"))
        for load in kind.loads:
            steps += _hang(stroke.mass, load)
            steps.append(_move(stroke.low, stroke.fastest))
            for share, speed in kind.moves:
                steps += [_move(stroke.at(share), speed * stroke.fastest), Step(hold=kind.hold)]
    about = f"{kind.name}; proposed from {len(dataset.recordings)} runs of {dataset.profile.name}"
    return Programme(name, tuple(steps), repeat=_REPEATS, description=about)


def _hang(mass: float | None, share: float) -> list[Step]:
    """Ask for a load, rounded to what a bench has at hand."""
    if mass is None:
        return []
    wanted = max(_HANGS, round(mass * share / _HANGS) * _HANGS)
    return [Step(ask=f"hang the {wanted:g} kg load", load_mass=wanted)]


def _move(length: float, speed: float) -> Step:
    return Step(to=round(length, 3), speed=float(f"{max(speed, 1e-3):.2g}"))


def _twice(strength: float) -> float:
    """Every programme runs twice: twice the evidence of one run."""
    return _REPEATS * strength


def _warm(dataset: Dataset) -> bool:
    return all(r.signals.temperature is not None for r in dataset.recordings)


def _usual(effects: Sequence[Effect], problem: Problem) -> list[Term]:
    """Every effect that could be seen here, in a usual size."""
    out = []
    for effect in effects:
        if missing_needs(effect, problem):
            continue
        shape = next(iter(Coordinates(effect).grid()))
        secant = next(iter(Coordinates(effect).secants()))
        out.append(Term(effect, {**effect.null, **shape, **secant}))
    return out
