"""Effects with memory are selected by changes within the runs, not by initial states."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from diagnosis_runs import CATALOGUE, GROOVED, Array, Ride, made, term, with_channel
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.results import Diagnosis

RIDE = Ride(samples=1600, rate=25.0, period=64.0)  # so slow that the tension hardly changes
MASSES = (10.0, 20.0, 35.0)


def told(error: Callable[[float], Array | float]) -> Diagnosis:
    """What is said of a cell that errs by so many newtons under a load (kg), each load twice."""
    runs = []
    for number, mass in enumerate(np.repeat(MASSES, 2)):
        run = made(number, GROOVED, load_mass=float(mass), ride=RIDE)
        runs.append(with_channel(run, "tension", run["tension"] + error(float(mass))))
    return diagnose(runs, GROOVED, CATALOGUE).diagnosis


def test_an_offset_under_one_load_is_not_creep() -> None:
    """Creep far slower than the runs could have any level in each: a ramp is mostly level."""
    found = told(lambda mass: -8.0 if mass == MASSES[1] else 0.0)
    assert found.verdict == "unknown"
    assert found.steps == ()


def test_creep_from_rest_is_found_though_a_ramp_is_mostly_an_offset() -> None:
    creep = term("cell-creep", fraction=0.05, time_constant=10 * RIDE.time[-1])
    runs = [
        made(number, GROOVED, [creep], load_mass=float(mass), ride=RIDE)
        for number, mass in enumerate(np.repeat(MASSES, 2))
    ]
    found = diagnose(runs, GROOVED, CATALOGUE).diagnosis
    assert found.verdict == "explained"
    assert "cell-creep" in found.steps[0].effects
