"""Candidate motion programmes, simulated on the nominal model."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.data.dataset import Dataset, assemble
from winchkit.diagnosis.data.decimation import LEAST_RATE
from winchkit.diagnosis.data.repeats import mean_load
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.model.line import Line
from winchkit.model.stages import Signals
from winchkit.model.trajectory import plan
from winchkit.runs.run import Channel, Run
from winchkit.schema.bench import LimitSpec
from winchkit.units import GRAVITY

_MARGIN = 0.05
"""Share of a bench's stroke that is kept free at each end."""
_RESERVE = 1.5
"""Ratio of a bench's limits of speed and tension to what is proposed."""


@dataclass(frozen=True)
class CandidateProgramme:
    """A candidate programme: moves within the stroke with a load at a temperature, one run."""

    name: str
    moves: tuple[tuple[float, float], ...]
    """Target (share of the stroke) and speed (share of the highest speed) of each move."""
    load: float = 1.0
    """In units of the mean load so far."""
    temperature_rise: float = 0.0
    """Above the mean temperature so far, K."""
    hold: float = 0.5
    """Rest after each move, s."""


_THERE_AND_BACK = ((1.0, 1.0), (0.0, 1.0))
"""Moves of a full stroke: position as share of the stroke, speed as share of the highest;
convention."""
_MOTIONS = (
    CandidateProgramme("full stroke", _THERE_AND_BACK),
    CandidateProgramme(
        "five lengths with holds", tuple((x, 0.5) for x in (1, 0.75, 0.5, 0.25, 0)), hold=5.0
    ),
    CandidateProgramme(
        "speed ladder, both directions",
        tuple((x, s) for s in (0.05, 0.2, 0.5, 1.0) for x in (0.6, 0.4)),
    ),
    CandidateProgramme(
        "short reversals, slow and fast",
        tuple((0.5 + 0.01 * k * (-1) ** k, s) for s in (0.02, 0.3) for k in range(1, 6)),
    ),
)
"""Four motions that excite friction, elasticity, creep and the drum; rule of thumb."""
_, _LENGTHS, _LADDER, _REVERSALS = (motion.name for motion in _MOTIONS)
_WARMED = "full stroke, warmed up by 15 K"
_AT_A_PLACE = (
    _LADDER,
    "Where it grows with the speed, the cause is inertia or viscous friction; where it stays the "
    "same, the geometry.",
)
_AT_A_REVERSAL = (
    _REVERSALS,
    "Where it needs a distance after each reversal, the cause is presliding or backlash; where "
    "only the direction counts, Coulomb friction.",
)
_WITH_THE_LOAD = (
    f"{_LENGTHS}, twice the load",
    "It shows whether the error is in proportion to the load, and whether it depends on the "
    "length.",
)
_OVER_TIME = _WARMED, "It shows whether the error follows the temperature."
ISOLATING = {
    "drum_angle": _AT_A_PLACE,
    "motor_angle": _AT_A_PLACE,
    "cable_length": _AT_A_PLACE,
    "position": _AT_A_PLACE,
    "speed": (
        _LADDER,
        "It shows from which speed on the error is there, and whether both directions are alike.",
    ),
    "direction": _AT_A_REVERSAL,
    "reversal_distance": _AT_A_REVERSAL,
    "directed_length": _AT_A_REVERSAL,
    "directed_load": _AT_A_REVERSAL,
    "directed_tension": _AT_A_REVERSAL,
    "load": _WITH_THE_LOAD,
    "tension": _WITH_THE_LOAD,
    "temperature": _OVER_TIME,
    "time": _OVER_TIME,
}
"""Per variable of an unexplained residual the programme that isolates its cause, and what it shows:
it varies what the causes of such a residual differ in."""
_LOADS = {"": 1.0, ", half the load": 0.5, ", twice the load": 2.0}
"""In units of the mean load so far: a ratio of four at weights that a bench has; convention."""
CANDIDATE_PROGRAMMES = (
    *(
        replace(motion, name=motion.name + words, load=load)
        for motion in _MOTIONS
        for words, load in _LOADS.items()
    ),
    CandidateProgramme(_WARMED, _THERE_AND_BACK, temperature_rise=15.0),
)
"""Each motion with each load, and one after warming up: every candidate is one run, so that what is
hung or warmed is a choice as the motion is."""


@dataclass(frozen=True)
class OperatingRange:
    """Operating range of a programme."""

    low: float
    """Shortest free length, m."""
    high: float
    fastest: float
    """Highest speed of the cable, m/s."""
    mass: float | None
    """Mean load so far as a mass, kg; None where it is not known."""
    lightest: float = 0.0
    """Load below which the cable may go slack, kg."""
    heaviest: float = np.inf
    """Load at which the tension limit of the bench is reached with its reserve, kg."""

    def at(self, share: float) -> float:
        """Length at a share of the stroke, m."""
        return self.low + (self.high - self.low) * share

    def load(self, share: float) -> float | None:
        """A share of the mean load, kg."""
        if self.mass is None:
            return None
        return max(self.lightest, min(self.heaviest, self.mass * share))


def range_of_runs(dataset: Dataset) -> OperatingRange:
    """Operating range of the runs so far: stroke, speed and load."""
    recordings = dataset.recordings
    lengths = np.concatenate([r.raw.at.free_length for r in recordings])
    fastest = max(float(np.max(np.abs(r.raw.at.speed))) for r in recordings)
    usual = [m for m in (mean_load(r.signals) for r in recordings) if m is not None]
    mass = float(np.mean(usual)) / GRAVITY if usual else None
    return OperatingRange(float(lengths.min()), float(lengths.max()), fastest, mass)


def range_of_limits(dataset: Dataset, limits: LimitSpec) -> OperatingRange:
    """Operating range within a bench's limits, with a margin; else that of the runs."""
    operating_range = range_of_runs(dataset)
    if limits.length is not None:
        margin = _MARGIN * (limits.length[1] - limits.length[0])
        operating_range = replace(
            operating_range, low=limits.length[0] + margin, high=limits.length[1] - margin
        )
    if limits.tension_slack is not None:
        operating_range = replace(
            operating_range, lightest=limits.tension_slack * _RESERVE / GRAVITY
        )
    if limits.tension_high is not None:
        operating_range = replace(
            operating_range, heaviest=limits.tension_high / _RESERVE / GRAVITY
        )
    return replace(operating_range, fastest=limits.speed / _RESERVE)


def usual_temperature(dataset: Dataset) -> float | None:
    """Mean temperature of the runs, °C; None where a run has none."""
    known = [r.signals.temperature for r in dataset.recordings]
    if any(t is None for t in known):
        return None
    return float(np.mean([np.mean(t) for t in known if t is not None]))


def candidates(
    dataset: Dataset, operating_range: OperatingRange
) -> Iterator[tuple[CandidateProgramme, TimeSeriesRegression]]:
    """Each programme that these channels can distinguish, with the regression of its run.

    Loads are a choice where the load is known, temperatures where there is a thermometer.
    """
    temperature = usual_temperature(dataset)
    for kind in CANDIDATE_PROGRAMMES:
        if (kind.load == 1 or operating_range.mass is not None) and (
            not kind.temperature_rise or temperature is not None
        ):
            yield kind, simulated(dataset, kind, operating_range)


def simulated(
    dataset: Dataset, kind: CandidateProgramme, operating_range: OperatingRange | None = None
) -> TimeSeriesRegression:
    """Regression problem of the simulated run of a programme, on the nominal model."""
    usual = usual_temperature(dataset)
    operating_range = operating_range or range_of_runs(dataset)
    temperature = None if usual is None else usual + kind.temperature_rise
    run = _run(dataset, kind, operating_range, operating_range.load(kind.load), temperature)
    return TimeSeriesRegression(assemble([run], dataset.profile))


def _run(
    dataset: Dataset,
    kind: CandidateProgramme,
    operating_range: OperatingRange,
    mass: float | None,
    temperature: float | None,
) -> Run:
    at = operating_range.low
    pieces = [np.full(round(kind.hold * LEAST_RATE), at)]
    for share, speed in kind.moves:
        target, fastest = operating_range.at(share), operating_range.fastest
        move = plan(target - at, max(speed * fastest, 1e-4), 4 * fastest, 40 * fastest)
        time = np.arange(0.0, move.duration, 1 / LEAST_RATE)
        pieces += [
            at + np.asarray(move.at(time)[0]),
            np.full(round(kind.hold * LEAST_RATE), target),
        ]
        at = target
    length = np.concatenate(pieces)
    time = np.arange(len(length)) / LEAST_RATE
    angle = Line(dataset.profile).nominal_motor_angle(length)
    temperatures = None if temperature is None else np.full_like(time, temperature)
    return _as_run(dataset, time, angle, mass, temperatures)


def _as_run(
    dataset: Dataset, time: Array, angle: Array, mass: float | None, temperature: Array | None
) -> Run:
    """Run in which every output of the data set has the value that the nominal model predicts."""
    line = Line(dataset.profile)
    predicted = line.predict(line.motion(Signals(time, angle, load_mass=mass)))
    channels = {"motor_angle": Channel(angle, "rad")}
    if temperature is not None:
        channels["temperature"] = Channel(temperature, "degC")
    for output in dataset.outputs:
        if output in predicted:
            channels[output] = Channel(predicted[output], "")
    metadata = {} if mass is None else {"load_mass": f"{mass!r} kg"}
    return Run("simulated", time, channels, metadata)
