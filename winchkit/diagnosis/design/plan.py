"""Choice of the next run: which pairs it separates, and which effects become detectable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from winchkit.diagnosis.data.dataset import Dataset
from winchkit.diagnosis.design.detectability import Bar
from winchkit.diagnosis.design.discrimination import power_of, separation, so_far
from winchkit.diagnosis.design.programmes import (
    KINDS,
    Kind,
    Room,
    imagined,
    seen,
    usual_temperature,
)
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.effects.effect import Effect
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term
from winchkit.schema.programme import Programme, Step

__all__ = ["Offer", "hopeless", "offers", "programme_of"]

_SURE = 0.9
_FAINT = 0.2
"""Power below which a programme is not worth a run."""
_HANGING, _WARMING = 1 / 3, 20.0
"""Time of an operator to change a load, and to warm the machine, minutes."""
_REPEATS = 2
_HANGS = 0.5


@dataclass(frozen=True)
class Offer:
    """A candidate programme with its time and power."""

    kind: Kind
    minutes: float
    """Motion and the operator's work, both repeats."""
    powers: tuple[float, ...]
    """Power to separate each pair."""
    shows: tuple[str, ...]
    """Effects of usual size that become detectable."""

    @property
    def worth(self) -> tuple[float, ...]:
        """Sort key, larger is better.

        Pairs separated with at least 90 % power, then the sum of powers, then per minute; where
        nothing is to be separated, effects that become detectable per minute.
        """
        sure = sum(power >= _SURE for power in self.powers)
        told = round(sum(power for power in self.powers if power >= _FAINT), 1)
        quick, shown = 1 / self.minutes, len(self.shows) / self.minutes
        return (sure, told, quick, shown) if told else (0.0, 0.0, shown, quick)

    def to_json(self, pairs: Sequence[tuple[Term, Term]]) -> dict[str, Any]:
        """Dictionary that ``winchkit plan --json`` prints."""
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
    regression: TimeSeriesRegression,
    pairs: Sequence[tuple[Term, Term]],
    noise: Mapping[str, float],
    effects: Sequence[Effect],
    *,
    bar: Bar,
    room: Room | None = None,
) -> list[Offer]:
    """Candidate programmes within an operating range, best first.

    Parameters
    ----------
    regression
        Regression problem of the runs so far.
    pairs
        Effects to be separated.
    noise
        Rms per output, SI.
    effects
        Effects whose detection is of interest.
    bar
        Detection threshold.
    room
        Operating range; None for that of the runs so far.
    """
    dataset = regression.dataset
    room = room or seen(dataset)
    usual = [(term, so_far(regression, term, None, noise)) for term in _usual(effects, regression)]
    hidden = [(t, known) for t, known in usual if known and not _sees(bar, t, known.left)]
    known_pairs = [(a, b, so_far(regression, a, b, noise)) for a, b in pairs]
    out = []
    for kind in KINDS:
        tried = imagined(dataset, kind, room)
        motion = sum(r.signals.time[-1] for r in tried.dataset.recordings) / 60
        minutes = _REPEATS * (motion + _work(kind, dataset))
        powers = tuple(
            power_of(separation(tried, a, b, noise, known=known, repeats=_REPEATS))
            for a, b, known in known_pairs
        )
        shows = tuple(
            term.effect.id
            for term, known in hidden
            if _sees(
                bar,
                term,
                known.left + separation(tried, term, None, noise, known=known, repeats=_REPEATS),
            )
        )
        out.append(Offer(kind, minutes, powers, shows))
    return sorted(out, key=lambda offer: offer.worth, reverse=True)


def _sees(bar: Bar, term: Term, strength: float) -> bool:
    """Whether an effect of noncentrality λ is detected with at least 90 % power."""
    return bar.power(strength, Coordinates(term.effect).n_parameters) >= _SURE


def hopeless(found: Sequence[Offer], pairs: Sequence[tuple[Term, Term]]) -> list[tuple[Term, Term]]:
    """Pairs that none of these programmes separates."""
    return [
        pair
        for index, pair in enumerate(pairs)
        if max(offer.powers[index] for offer in found) < _FAINT
    ]


def programme_of(dataset: Dataset, kind: Kind, name: str, room: Room | None = None) -> Programme:
    """Motion programme of a kind for ``winchkit run``, repeated twice.

    Parameters
    ----------
    dataset
        Runs so far.
    kind
        Candidate programme.
    name
        Of the motion programme.
    room
        Operating range; None for that of the runs so far.

    Returns
    -------
    Programme
        It begins and ends at the shortest length, so that its repeats are equal.
    """
    room = room or seen(dataset)
    steps: list[Step] = []
    for warmed in kind.warmed if _warm(dataset) else (0.0,):
        if len(kind.warmed) > 1:
            steps += _bring(dataset, warmed)
        for load in kind.loads:
            steps += _hang(room.load(load))
            steps.append(_move(room.low, room.fastest))
            for share, speed in kind.moves:
                steps += [_move(room.at(share), speed * room.fastest), Step(hold=kind.hold)]
    about = f"{kind.name}; proposed from {len(dataset.recordings)} runs of {dataset.profile.name}"
    return Programme(name, tuple(steps), repeat=_REPEATS, description=about)


def _bring(dataset: Dataset, warmed: float) -> list[Step]:
    """Step that asks for a temperature, in whole degrees Celsius."""
    usual = usual_temperature(dataset)
    if usual is None:
        return []
    wanted = float(round(usual + warmed))
    ask = f"bring rope and machine to {wanted:g} degC"
    return [Step(ask=ask, temperature=wanted)]


def _hang(mass: float | None) -> list[Step]:
    """Step that asks for a load, rounded to usual weights."""
    if mass is None:
        return []
    wanted = max(_HANGS, round(mass / _HANGS) * _HANGS)
    return [Step(ask=f"hang the {wanted:g} kg load", load_mass=wanted)]


def _work(kind: Kind, dataset: Dataset) -> float:
    """Time of the operator's work in one repeat, minutes."""
    warmings = len(kind.warmed) - 1 if _warm(dataset) else 0
    hangs = len(kind.loads) if len(kind.loads) > 1 else 0
    return warmings * _WARMING + hangs * _HANGING


def _move(length: float, speed: float) -> Step:
    return Step(to=round(length, 3), speed=float(f"{max(speed, 1e-3):.2g}"))


def _warm(dataset: Dataset) -> bool:
    return usual_temperature(dataset) is not None


def _usual(effects: Sequence[Effect], regression: TimeSeriesRegression) -> list[Term]:
    """Every effect that these channels can show, at its usual size."""
    out = []
    for effect in effects:
        if regression.missing_needs(effect):
            continue
        shape = next(iter(Coordinates(effect).grid()))
        usual_step = next(iter(Coordinates(effect).usual_steps()))
        out.append(Term(effect, {**effect.null, **shape, **usual_step}))
    return out
