"""Answers and diagnoses that the tests of the report share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

from winchkit.catalog import find
from winchkit.diagnosis.diagnose import WinchAnswer, diagnose
from winchkit.diagnosis.results import (
    Attribution,
    Diagnosis,
    Doubt,
    Estimate,
    OutputFit,
    Place,
    Step,
)
from winchkit.runs.run import Run
from winchkit.schema.read import read_profile, read_programme, read_simbench
from winchkit.sim.bench import profiles_of, programme_path
from winchkit.sim.record import simulate

NOISY = OutputFit("m", None, 2.5, 1.7e-3, 0.31e-3, 1.63e-3, 0.36e-3, 0.30e-3)
AT_NOISE = OutputFit("N", None, 155.0, 0.75, 0.75, 0.753, 0.753, 0.742)
FRICTIONAL = OutputFit("N m", 5.0, 0.46, 16.5e-3, 3.0e-3, 16.5e-3, 3.04e-3, 2.88e-3)
ELASTIC = Step(
    ("cable-elongation-linear",),
    {"cable-elongation-linear": {"axial_stiffness": Estimate(249_900.0, 7_000.0, "N")}},
    0.95,
)
FRICTION = Step(
    ("pulley-coulomb", "pulley-capstan"),
    {
        "pulley-coulomb": {"friction": Estimate(0.0150, 0.0001, "1")},
        "pulley-capstan": {"friction": Estimate(0.0138, float("nan"), "1")},
    },
    0.9,
    {"pulley-capstan": 0.002},
    law="open",
    doubts=(Doubt("alternatives", "these runs cannot distinguish it from pulley-capstan"),),
)
REFITTED = replace(ELASTIC, refitted=True, file_values={"axial_stiffness": 100_000.0}, share=0.9)
OPEN = replace(
    ELASTIC,
    law="open",
    place=(Place("cable", "cable_length", "load"),),
    doubts=(Doubt("curve", "a free curve over load explains 30 % more: the law is another one"),),
    share=0.4,
)
FIVE_CORNERS = (
    Attribution("tension", "time", 0.64, frequency=8.2),
    Attribution("motor_torque", "drum_angle", 0.49),
    Attribution("tension", "drum_angle", 0.44, order=5),
)


def diagnosis_of(verdict: str, *steps: Step, **more: object) -> Diagnosis:
    """A diagnosis made up from its parts."""
    parts = {
        "outputs": {"cable_length": NOISY, "tension": AT_NOISE},
        "candidates": (),
        "detectable": (),
        "unexplained_share": 0.0,
        "where": (),
        "next_runs": (),
    }
    return Diagnosis(verdict=verdict, steps=steps, **(parts | more))  # type: ignore[arg-type]


@cache
def recorded(bench: str) -> tuple[Run, ...]:
    """Runs of the demo's programme on a shipped simulated bench."""
    declared = read_simbench(find("sim", bench))
    programme = read_programme(programme_path("programme-demo"))
    # Five corners of a drum at 25 Hz are also an order of the motor that is above the band.
    rate = 50.0 if bench == "five-cornered-drum" else 25.0
    return tuple(simulate(declared, profiles_of(declared), programme, seed=3, rate=rate))


@cache
def recorded_both(first: str, second: str) -> tuple[Run, ...]:
    """The same on a bench that hides what two shipped ones hide."""
    one, other = (read_simbench(find("sim", name)) for name in (first, second))
    truth = {
        name: replace(own, hidden=(*own.hidden, *other.truth[name].hidden))
        for name, own in one.truth.items()
    }
    declared = replace(one, truth=truth)
    programme = read_programme(programme_path("programme-demo"))
    return tuple(simulate(declared, profiles_of(declared), programme, seed=3, rate=25.0))


def answered(runs: Sequence[Run]) -> WinchAnswer:
    return diagnose(runs, read_profile(find("profiles", "bench-spiral")))


@cache
def answer_of_both(first: str, second: str) -> WinchAnswer:
    """What the diagnosis says of :func:`recorded_both`."""
    return answered(recorded_both(first, second))


@cache
def answer_of(bench: str) -> WinchAnswer:
    """What the diagnosis says of such a bench."""
    return answered(recorded(bench))
