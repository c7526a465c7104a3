"""Runs that the tests of the diagnosis share: made by the model, or recorded by the plant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from math import pi

import numpy as np

from winchkit.arrays import Array
from winchkit.catalog import find
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.design.discrimination import Weights
from winchkit.diagnosis.regression.base import Regression
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.search import selection_engine
from winchkit.diagnosis.selection.time_series import TimeSeriesSelection
from winchkit.effects.catalogue import load_catalogue
from winchkit.effects.term import Term, modifiers_of
from winchkit.model.line import Line
from winchkit.model.stages import Signals
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.winch import (
    CableSpec,
    DrumSpec,
    GearboxSpec,
    PulleySpec,
    ReferenceSpec,
    WinchProfile,
)
from winchkit.schema.read import read_programme, read_simbench
from winchkit.sim.bench import hiding, profiles_of, programme_path
from winchkit.sim.record import simulate

CATALOGUE = load_catalogue()
UNITS = {"cable_length": "m", "tension": "N", "motor_torque": "N m"}
NOISE = {"cable_length": 3e-4, "tension": 0.8, "motor_torque": 5e-3}
"""Of the instruments, as on the simulated benches."""
ENCODER = 1e-4
"""Noise of the motor's angle, rad."""
GROOVED = WinchProfile(
    name="grooved",
    drum=DrumSpec("grooved", 0.06, groove_pitch=0.005),
    gearbox=GearboxSpec(20.4),
    reference=ReferenceSpec(0.0, 4.0, 4.0),
    cable=CableSpec(diameter=0.004, dead_length=1.5),
    pulley=(PulleySpec(0.04, pi / 2), PulleySpec(0.04, pi / 3)),
)
SPIRAL = replace(GROOVED, name="spiral", drum=DrumSpec("spiral", 0.06, layer_growth=8e-5))


@dataclass(frozen=True)
class Ride:
    """How the motor moves: back and forth by a stroke, with a rest before and after each."""

    samples: int = 400
    rate: float = 50.0
    stroke: float = 400.0
    """rad."""
    period: float = 4.0

    @property
    def time(self) -> Array:
        return np.asarray(np.arange(self.samples) / self.rate)

    @property
    def angle(self) -> Array:
        part = (self.time / self.period) % 1.0
        there, back = (np.clip((part - x) / 0.35, 0.0, 1.0) for x in (0.1, 0.55))
        return np.asarray(self.stroke / 2 * (np.cos(pi * back) - np.cos(pi * there)))


def term(effect_id: str, **values: float) -> Term:
    effect = CATALOGUE[effect_id]
    return Term(effect, effect.null | values)


def made(
    seed: int = 0,
    profile: WinchProfile = GROOVED,
    terms: Sequence[Term] = (),
    noise: Mapping[str, float] = NOISE,
    load_mass: float | None = 10.0,
    ride: Ride = Ride(),
    encoder: float = ENCODER,
    **metadata: str,
) -> Run:
    """What the line predicts along a ride, with white noise on the outputs that are named."""
    random = np.random.default_rng(seed)
    time, angle = ride.time, ride.angle
    line = Line(profile, modifiers_of(terms))
    predicted = line.predict(line.motion(Signals(time, angle, load_mass=load_mass)))
    read = angle + encoder * random.standard_normal(len(time))
    channels = {"motor_angle": Channel(read, "rad")}
    for output, size in noise.items():
        if output in predicted:
            values = predicted[output] + size * random.standard_normal(len(time))
            channels[output] = Channel(values, UNITS[output])
    known = {} if load_mass is None else {"load_mass": f"{load_mass!r} kg"}
    return Run(f"run-{seed}", time, channels, known | metadata)


def engine_for(
    hidden: Sequence[Term], ride: Ride, masses: Sequence[float] = (10.0, 25.0)
) -> TimeSeriesSelection:
    """An inquiry into two runs under each load, with terms hidden in them."""
    runs = [
        made(10 * i + k, GROOVED, hidden, load_mass=mass, ride=ride)
        for i, mass in enumerate(masses)
        for k in range(2)
    ]
    return selection_engine(prepare(runs, GROOVED), CATALOGUE)


def with_channel(run: Run, name: str, values: Array, unit: str = "N") -> Run:
    return replace(run, channels={**run.channels, name: Channel(values, unit)})


def white(noise: Mapping[str, float]) -> Weights:
    """1/σ of every row of a regression under white noise of these rms values, per output."""

    def weights(regression: Regression) -> Array:
        rows = [np.full(s.rows.stop - s.rows.start, noise.get(s.output, np.inf))
                for s in regression.segments]  # fmt: skip
        return np.asarray(1 / np.concatenate(rows))

    return weights


def without(run: Run, *names: str) -> Run:
    return replace(run, channels={k: v for k, v in run.channels.items() if k not in names})


def length_problem(
    residuals: Sequence[Array], ride: Ride, profile: WinchProfile = GROOVED
) -> TimeSeriesRegression:
    """One output only, the length, whose residual is given; all runs are repeats."""
    runs = []
    for seed, residual in enumerate(residuals):
        run = made(seed, profile, noise={"cable_length": 0.0}, ride=ride, encoder=0.0)
        runs.append(with_channel(run, "cable_length", run["cable_length"] + residual, "m"))
    return TimeSeriesRegression(prepare(runs, profile))


@cache
def recorded(*physics: str, seed: int = 7, bench: str = "spiral-bench") -> tuple[Run, ...]:
    """Runs of the demo's two programmes under two loads, twice, with physics hidden."""
    declared = hiding(read_simbench(find("sim", bench)), physics)
    profiles = profiles_of(declared)
    return tuple(
        run
        for name in ("programme-demo-fast", "programme-demo-slow")
        for run in simulate(declared, profiles, read_programme(programme_path(name)), seed=seed)
    )
