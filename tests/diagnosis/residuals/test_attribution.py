"""Residual attribution: the simplest variable that explains the residual."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pytest

from diagnosis_runs import GROOVED, Ride, made, recorded, with_channel
from winchkit.catalog import find
from winchkit.diagnosis.compare import compare
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.residuals.attribution import Attribution, attributions, ranked
from winchkit.diagnosis.search import selection_engine
from winchkit.effects import load_catalogue
from winchkit.schema.read import read_profile


@dataclass(frozen=True)
class Told:
    """A variable and the share that it explains."""

    variable: str
    share: float


def followed(*physics: str) -> list[Attribution]:
    """What the errors follow."""
    profile = read_profile(find("profiles", "bench-spiral"))
    engine = selection_engine(prepare(recorded(*physics), profile), load_catalogue())
    present, _ = engine.fit_with_noise(engine.initial_model)
    return attributions(engine.regression, present.residual)


def first_followed(*physics: str) -> dict[str, str]:
    """Per output the variable that its error follows most."""
    out: dict[str, str] = {}
    for found in followed(*physics):
        out.setdefault(found.output, found.variable)
    return out


def test_the_angles_and_the_length_are_one_variable() -> None:
    told = {"drum_angle", "motor_angle", "cable_length"}
    lengths = [f.variable for f in followed("fat drum") if f.output == "cable_length"]
    assert len(told.intersection(lengths)) == 1


@pytest.mark.slow
def test_friction_at_one_place_is_located_by_place_and_direction() -> None:
    first = first_followed("sticky place")
    assert first["tension"] == "directed_length"
    assert first["motor_torque"] == "directed_length"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("physics", "output", "variable"),
    [("sticky pulleys", "tension", "directed_load"), ("motor drag", "motor_torque", "direction")],
)
def test_what_changes_with_the_direction_is_attributed_to_it(
    physics: str, output: str, variable: str
) -> None:
    """Friction of a pulley is in proportion to the load as well."""
    assert first_followed(physics)[output] == variable


def test_what_grows_with_the_length_is_not_attributed_to_direction_too() -> None:
    assert first_followed("fat drum")["cable_length"] != "directed_length"


@pytest.mark.parametrize(
    ("found", "kept"),
    [
        (
            [Told("directed_length", 0.9), Told("cable_length", 0.3)],
            ["directed_length", "cable_length"],
        ),
        ([Told("cable_length", 0.88), Told("directed_length", 0.9)], ["cable_length"]),
        ([Told("directed_length", 0.5), Told("direction", 0.48)], ["direction"]),
        ([Told("directed_length", 0.5)], ["directed_length"]),
        ([Told("time", 0.4), Told("speed", 0.41)], ["speed", "time"]),
    ],
)
def test_two_variables_at_once_must_explain_clearly_more(
    found: Sequence[Told], kept: Sequence[str]
) -> None:
    assert [item.variable for item in ranked(found)] == kept


def test_drag_in_proportion_to_the_load_follows_load_and_direction_not_the_time() -> None:
    """Three loads of which every run repeats one motion: the time has the direction in it."""
    runs = []
    for mass in (5.0, 15.0, 40.0):
        run = made(int(mass), load_mass=mass, ride=Ride(samples=1200))
        rate = np.gradient(run["motor_angle"], run.time)
        runs.append(with_channel(run, "tension", run["tension"] * (1.0 + 0.05 * np.sign(rate))))
    followed = compare(runs, GROOVED).outputs["tension"].follows
    shares = dict(followed)
    assert followed[0][0] == "directed_load"
    assert shares["directed_load"] > shares["direction"] + 0.2, "the load is in it"
    assert "time" not in shares


def test_what_follows_nothing_but_the_time_is_attributed_to_it() -> None:
    run = made(1, ride=Ride(samples=1200))
    drift = with_channel(run, "tension", run["tension"] + 0.2 * run.time)
    assert compare([drift], GROOVED).outputs["tension"].follows[0][0] == "time"
