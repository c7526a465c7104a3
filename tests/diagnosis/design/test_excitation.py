"""What runs cannot show is said, where it is so and only there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest

from diagnosis_runs import GROOVED, Array, Ride, made, with_channel
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.design.excitation import missing_excitation
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.runs.run import Run

RIDE = Ride(samples=200)
NOTES = {
    "repeat": "no run repeats another",
    "no force": "no load and no tension",
    "one load": "one load only",
    "one way": "one direction only",
    "no reversal": "no reversals",
    "one speed": "one speed only",
    "no warmth": "no temperature measured",
    "constant warmth": "temperature nearly constant",
}


def said(runs: Sequence[Run]) -> set[str]:
    notes = missing_excitation(TimeSeriesRegression(prepare(runs, GROOVED)))
    found = {key for note in notes for key, start in NOTES.items() if note.startswith(start)}
    assert len(found) == len(notes)
    return found


def warm(run: Run, by: float = 3.0) -> Run:
    return with_channel(run, "temperature", np.linspace(20, 20 + by, len(run)), "degC")


def runs(
    masses: Sequence[float | None] = (10.0, 20.0), repeats: int = 2, by: float = 3.0, **more: object
) -> list[Run]:
    return [
        warm(made(10 * index + seed, load_mass=mass, ride=RIDE, **more), by)  # type: ignore[arg-type]
        for index, mass in enumerate(masses)
        for seed in range(repeats)
    ]


def test_good_runs_leave_nothing_to_say() -> None:
    assert said(runs()) == set()


@pytest.mark.parametrize(
    ("given", "note"),
    [
        (runs(repeats=1), "repeat"),
        (runs(masses=(10.0,)), "one load"),
        (runs(masses=(10.0, 10.3)), "one load"),
        (runs(by=0.5), "constant warmth"),
        (runs(noise={"cable_length": 3e-4, "motor_torque": 5e-3}, masses=(None,)), "no force"),
    ],
    ids=["no repeats", "one load", "two loads that are one", "no warmth", "no force"],
)
def test_what_is_missing_is_said(given: list[Run], note: str) -> None:
    assert said(given) == {note}


def test_a_temperature_that_one_run_lacks_is_not_measured() -> None:
    given = runs()
    given[1] = made(1, ride=RIDE)
    assert said(given) == {"no warmth"}


@pytest.mark.parametrize("sign", [1, -1])
def test_one_direction_is_said(sign: int) -> None:
    given = []
    for run in runs():
        half = slice(0, len(run) // 2)
        channels = {k: replace(c, values=c.values[half]) for k, c in run.channels.items()}
        one = replace(run, time=run.time[half], channels=channels)
        turned = one["motor_angle"] * sign
        length = one["cable_length"] if sign > 0 else 8.0 - one["cable_length"]
        one = with_channel(one, "motor_angle", turned, "rad")
        given.append(with_channel(one, "cable_length", length, "m"))
    assert said(given) == {"one way"}


def one_way(run: Run, inwards: bool) -> Run:
    """The first half of a ride, or its second, in which the motor turns back."""
    half = slice(0, len(run) // 2) if inwards else slice(len(run) // 2, len(run))
    channels = {k: replace(c, values=c.values[half]) for k, c in run.channels.items()}
    return replace(run, time=run.time[half] - run.time[half][0], channels=channels)


def test_both_directions_without_a_reversal_are_said() -> None:
    given = [one_way(run, inwards) for inwards in (True, False) for run in runs()]
    assert said(given) == {"no reversal"}


@dataclass(frozen=True)
class Steady(Ride):
    """Back and forth at one speed, turned around within a tenth of a second."""

    @property
    def angle(self) -> Array:
        speed = np.sign(np.sin(2 * np.pi * self.time / self.period))
        smooth = np.convolve(np.pad(speed, 5, mode="edge"), np.ones(11) / 11, mode="valid")
        return np.asarray(np.cumsum(smooth) / self.rate * 100.0)


def test_one_speed_is_said() -> None:
    given = [
        warm(made(10 * index + seed, load_mass=mass, ride=Steady(samples=400)))
        for index, mass in enumerate((10.0, 20.0))
        for seed in range(2)
    ]
    assert said(given) == {"one speed"}


def test_a_note_reports_what_to_do() -> None:
    (note,) = missing_excitation(TimeSeriesRegression(prepare(runs(repeats=1), GROOVED)))
    assert "outside the catalogue cannot be excluded" in note
    assert "record one programme twice" in note
