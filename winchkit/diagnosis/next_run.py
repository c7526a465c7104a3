"""Which run would tell two effects apart: programmes tried on the model before they are run.

For each of a few kinds of programme the line is predicted with one effect; what no size of the
other can imitate, in units of the noise, is the noncentrality λ (Hunter and Reiner, 1965).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import ncx2

from winchkit.diagnosis.dataset import Dataset, assemble
from winchkit.diagnosis.problem import Hypothesis, Problem
from winchkit.diagnosis.repeats import mean_load
from winchkit.diagnosis.result import NextRun
from winchkit.effects.bind import Term
from winchkit.model.line import GRAVITY, Line
from winchkit.model.stages import Signals
from winchkit.model.trajectory import plan
from winchkit.runs.run import Channel, Run

__all__ = ["KINDS", "Kind", "next_runs"]

Array = NDArray[np.float64]
_RATE = 20.0
_CHI2 = 3.841
_OFFERED = 2
_WORTHWHILE = 0.2


@dataclass(frozen=True)
class Kind:
    """A kind of programme: moves within the stroke seen so far, loads, temperatures."""

    name: str
    moves: tuple[tuple[float, float], ...]
    """Where to (share of the stroke) and how fast (share of the highest speed)."""
    loads: tuple[float, ...] = (1.0,)
    """In units of the mean load so far; one run each."""
    warmed: tuple[float, ...] = (0.0,)
    """Kelvin above the temperature so far; one run each."""
    hold: float = 0.5
    """After each move, s."""


_THERE_AND_BACK = ((1.0, 1.0), (0.0, 1.0))
KINDS = (
    Kind("full stroke, one load", _THERE_AND_BACK),
    Kind("full stroke, three loads", _THERE_AND_BACK, loads=(0.5, 1.0, 2.0)),
    Kind(
        "one load at five lengths, with holds",
        tuple((x, 0.5) for x in (1, 0.75, 0.5, 0.25, 0)),
        hold=5.0,
    ),
    Kind(
        "speed ladder, both directions",
        tuple((x, s) for s in (0.05, 0.2, 0.5, 1.0) for x in (0.6, 0.4)),
    ),
    Kind(
        "short reversals, slow and fast",
        tuple((0.5 + 0.01 * k * (-1) ** k, s) for s in (0.02, 0.3) for k in range(1, 6)),
    ),
    Kind("full stroke, warmed up by 15 K", _THERE_AND_BACK, warmed=(0.0, 15.0)),
)


def next_runs(
    dataset: Dataset, pairs: Sequence[tuple[Term, Term]], noise: dict[str, float]
) -> tuple[NextRun, ...]:
    """The programmes that separate each pair best per minute, with the power they would have."""
    if not pairs:
        return ()
    out: list[NextRun] = []
    tried = [(kind, _imagined(dataset, kind)) for kind in KINDS]
    for first, second in pairs:
        offers = []
        for kind, problem in tried:
            minutes = sum(r.signals.time[-1] for r in problem.dataset.recordings) / 60
            strength = _separation(problem, first, second, noise)
            power = float(ncx2.sf(_CHI2, 1, strength)) if strength > 0 else 0.05
            offers.append((strength / minutes, power, kind.name))
        # Any programme sure to separate them will do: of those the quickest per minute.
        offers.sort(key=lambda offer: (-round(offer[1], 2), -offer[0]))
        names = (first.effect.id, second.effect.id)
        useful = [offer for offer in offers if offer[1] >= _WORTHWHILE][:_OFFERED]
        out += [NextRun(names, name, power) for _, power, name in useful]
        if not useful:
            # No motion separates them: what does is on the card, and its power is not known.
            out.append(NextRun(names, first.effect.told_apart, float("nan")))
    return tuple(out)


def _separation(problem: Problem, first: Term, second: Term, noise: dict[str, float]) -> float:
    """Noncentrality λ of the first effect where the second may take any size."""
    weight = np.empty(problem.rows)
    for segment in problem.segments:
        weight[segment.rows] = 1 / max(noise.get(segment.output, np.inf), 1e-300)
    shown = problem.change(Hypothesis().with_term(first, problem.runs)) * weight
    rival = Hypothesis().with_term(second, problem.runs)
    imitation = problem.jacobian(problem.vector(rival), rival) * weight[:, None]
    whole = np.column_stack([imitation, problem.change(rival) * weight])
    if not np.isfinite(whole).all() or not np.isfinite(shown).all():
        return 0.0
    left = shown - whole @ np.linalg.lstsq(whole, shown, rcond=1e-10)[0]
    return float(left @ left)


def _imagined(dataset: Dataset, kind: Kind) -> Problem:
    """A problem whose runs follow a kind of programme and measure what the nominal line says."""
    warm = all(r.signals.temperature is not None for r in dataset.recordings)
    runs = []
    for load in kind.loads:
        for warmed in kind.warmed if warm else (0.0,):
            runs.append(_run(dataset, kind, load, warmed))
    return Problem(assemble(runs, dataset.profile))


def _run(dataset: Dataset, kind: Kind, load: float, warmed: float) -> Run:
    recordings = dataset.recordings
    lengths = np.concatenate([r.raw.at.free_length for r in recordings])
    low, high = float(lengths.min()), float(lengths.max())
    fastest = max(float(np.max(np.abs(r.raw.at.speed))) for r in recordings)
    at = low
    pieces = [np.full(round(kind.hold * _RATE), low)]
    for share, speed in kind.moves:
        target = low + (high - low) * share
        move = plan(target - at, max(speed * fastest, 1e-4), 4 * fastest, 40 * fastest)
        time = np.arange(0.0, move.duration, 1 / _RATE)
        pieces += [at + np.asarray(move.at(time)[0]), np.full(round(kind.hold * _RATE), target)]
        at = target
    length = np.concatenate(pieces)
    time = np.arange(len(length)) / _RATE
    line = Line(dataset.profile)
    angle = np.array([line.motor_angle(float(x)) for x in length])
    usual = [m for m in (mean_load(r.signals) for r in recordings) if m is not None]
    mass = load * float(np.mean(usual)) / GRAVITY if usual else None
    return _as_run(dataset, time, angle, mass, _temperature(dataset, time, warmed))


def _temperature(dataset: Dataset, time: Array, warmed: float) -> Array | None:
    known = [r.signals.temperature for r in dataset.recordings]
    if any(t is None for t in known):
        return None
    usual = float(np.mean([np.mean(t) for t in known if t is not None]))
    return usual + warmed * np.ones_like(time)


def _as_run(
    dataset: Dataset, time: Array, angle: Array, mass: float | None, temperature: Array | None
) -> Run:
    """A run on which every output that the dataset measures shows what the nominal line says."""
    line = Line(dataset.profile)
    predicted = line.predict(line.motion(Signals(time, angle, load_mass=mass)))
    channels = {"motor_angle": Channel(angle, "rad")}
    if temperature is not None:
        channels["temperature"] = Channel(temperature, "degC")
    for output in dataset.outputs:
        if output in predicted:
            channels[output] = Channel(predicted[output], "")
    metadata = {} if mass is None else {"load_mass": f"{mass!r} kg"}
    return Run("imagined", time, channels, metadata)
