"""Choice of the next run: which pairs it separates, and which effects become detectable."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.data.dataset import Dataset
from winchkit.diagnosis.design.detectability import DetectionThreshold
from winchkit.diagnosis.design.discrimination import (
    LEAST_POWER,
    Weights,
    information_of,
    power_to_separate,
    separation,
)
from winchkit.diagnosis.design.programmes import (
    CandidateProgramme,
    OperatingRange,
    candidates,
    range_of_runs,
    usual_temperature,
)
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.effects.effect import Effect
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term
from winchkit.schema.programme import Programme, ProgrammeStep

_HIGH_POWER = 0.9
"""Power below which a programme is not worth a run."""
_RUN_MINUTES, _LOADING_MINUTES, _WARMING_MINUTES = 10.0, 1 / 3, 20.0
"""Time of an operator to prepare, watch and keep a run, to change a load, to warm the machine,
minutes; rule of thumb: 3 to 30 minutes for a run give the same first programme (32 of 32 winches of
``benchmarks/plan_runs.py``), since moving takes a minute or two."""
_FULL = 18.33
"""λ of 90 % power against a limit of 9: (3 + Φ⁻¹(0.9))²; theory."""
_SOME = 0.1
"""Runs of a programme from which it belongs to a set of runs that is not whole; numerical."""
_WEIGHT_STEP = 0.5
"""Loads are proposed in steps of this, kg; convention: weights at hand."""


@dataclass(frozen=True)
class Offer:
    """A candidate programme with its time and power."""

    kind: CandidateProgramme
    minutes: float
    """Motion of all repeats, and the operator's work."""
    powers: tuple[float, ...]
    """Power to separate each pair."""
    shows: tuple[str, ...]
    """Effects of usual size that become detectable."""

    @property
    def worth(self) -> tuple[float, ...]:
        """Sort key within the shortest set of runs and of the others, larger is better.

        Pairs separated with at least 90 % power come first, then the sum of powers, then that per
        minute; where nothing is to be separated, effects that become detectable per minute.
        """
        separated = sum(power >= _HIGH_POWER for power in self.powers)
        summed = round(sum(power for power in self.powers if power >= LEAST_POWER), 1)
        per_minute, detected_per_minute = 1 / self.minutes, len(self.shows) / self.minutes
        return (
            (separated, summed, per_minute, detected_per_minute)
            if summed
            else (0.0, 0.0, detected_per_minute, per_minute)
        )

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
    weights: Weights,
    effects: Sequence[Effect],
    *,
    threshold: DetectionThreshold,
    repeats: int = 2,
    operating_range: OperatingRange | None = None,
) -> list[Offer]:
    """Candidate programmes within an operating range, by default that of the runs, best first."""
    dataset = regression.dataset
    operating_range = operating_range or range_of_runs(dataset)
    usual = [
        (term, information_of(regression, term, None, weights))
        for term in _usual(effects, regression)
    ]
    hidden = [
        (t, known)
        for t, known in usual
        if known and not _is_detected(threshold, t, known.residual_ss)
    ]
    known_pairs = [(a, b, information_of(regression, a, b, weights)) for a, b in pairs]
    out: list[Offer] = []
    strengths = []
    for kind, run in candidates(dataset, operating_range):
        motion = run.dataset.recordings[0].signals.time[-1] / 60
        minutes = repeats * motion + _operator_minutes(kind)
        strengths.append(
            [
                separation(run, a, b, weights, known=known, repeats=repeats)
                for a, b, known in known_pairs
            ]
        )
        powers = tuple(power_to_separate(strength) for strength in strengths[-1])
        shows = tuple(
            term.effect.id
            for term, known in hidden
            if _is_detected(
                threshold,
                term,
                known.residual_ss
                + separation(run, term, None, weights, known=known, repeats=repeats),
            )
        )
        out.append(Offer(kind, minutes, powers, shows))
    minutes = np.array([_RUN_MINUTES + offer.minutes for offer in out])
    chosen = _fewest_runs(np.array(strengths), minutes) >= _SOME
    order = sorted(range(len(out)), key=lambda i: (chosen[i], out[i].worth), reverse=True)
    return [out[i] for i in order]


def _fewest_runs(strengths: Array, minutes: Array) -> Array:
    """Runs of each programme that together separate every pair in the least time.

    ``strengths`` are λ, (n_programmes, n_pairs). A linear programme: the shares of the λ that a
    pair needs, at most one each, add up to one of every pair that some run separates.
    """
    from scipy.optimize import linprog  # Slow to import, and needed by a plan only.

    wanted = [p for p in strengths.T if power_to_separate(float(np.max(p))) >= LEAST_POWER]
    if not wanted:
        return np.zeros(len(strengths))
    shares = np.minimum(np.array(wanted) / _FULL, 1.0)
    found = linprog(minutes, A_ub=-shares, b_ub=-np.ones(len(shares)))
    assert found.x is not None, "enough runs of each programme separate every pair that is wanted"
    return np.asarray(found.x)


def _is_detected(threshold: DetectionThreshold, term: Term, noncentrality: float) -> bool:
    """Whether an effect of noncentrality λ is detected with at least 90 % power."""
    return threshold.power(noncentrality, Coordinates(term.effect).n_parameters) >= _HIGH_POWER


def inseparable(
    found: Sequence[Offer], pairs: Sequence[tuple[Term, Term]]
) -> list[tuple[Term, Term]]:
    """Pairs that none of these programmes separates."""
    return [
        pair
        for index, pair in enumerate(pairs)
        if max(offer.powers[index] for offer in found) < LEAST_POWER
    ]


def programme_of(
    dataset: Dataset,
    kind: CandidateProgramme,
    name: str,
    operating_range: OperatingRange | None = None,
    repeats: int = 2,
) -> Programme:
    """Motion programme of a kind for ``winchkit run``, by default in the range of the runs."""
    operating_range = operating_range or range_of_runs(dataset)
    steps: list[ProgrammeStep] = []
    if kind.temperature_rise:
        steps += _temperature_step(dataset, kind.temperature_rise)
    steps += _load_step(operating_range.load(kind.load))
    steps.append(_move_step(operating_range.low, operating_range.fastest))
    for share, speed in kind.moves:
        steps += [
            _move_step(operating_range.at(share), speed * operating_range.fastest),
            ProgrammeStep(hold=kind.hold),
        ]
    about = f"{kind.name}; proposed from {len(dataset.recordings)} runs of {dataset.profile.name}"
    return Programme(name, tuple(steps), repeat=repeats, description=about)


def _temperature_step(dataset: Dataset, rise: float) -> list[ProgrammeStep]:
    """Step that asks for a temperature, in whole degrees Celsius."""
    usual = usual_temperature(dataset)
    if usual is None:
        return []
    target = float(round(usual + rise))
    ask = f"bring cable and machine to {target:g} degC"
    return [ProgrammeStep(ask=ask, temperature=target)]


def _load_step(mass: float | None) -> list[ProgrammeStep]:
    """Step that asks for a load, rounded to usual weights."""
    if mass is None:
        return []
    target = max(_WEIGHT_STEP, round(mass / _WEIGHT_STEP) * _WEIGHT_STEP)
    return [ProgrammeStep(ask=f"hang the {target:g} kg load", load_mass=target)]


def _operator_minutes(kind: CandidateProgramme) -> float:
    """Time of the operator's work, minutes."""
    return (_LOADING_MINUTES if kind.load != 1 else 0.0) + (
        _WARMING_MINUTES if kind.temperature_rise else 0.0
    )


def _move_step(length: float, speed: float) -> ProgrammeStep:
    return ProgrammeStep(to=round(length, 3), speed=float(f"{max(speed, 1e-3):.2g}"))


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
