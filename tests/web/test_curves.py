"""Variable, fold and bins of a candidate's signature, on curves that are known in closed form."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("starlette")

from winchkit.arrays import Array
from winchkit.runs.run import Channel, Run
from winchkit.web.channels import lines_of
from winchkit.web.curves import OutputCurves, recorded_curves

N = 4000
TURNS = np.linspace(0.0, 12.0, N)
ANGLE = 2 * np.pi * TURNS
LENGTH = 10.0 - 0.06 * ANGLE
SPEED = np.where(np.arange(N) % 1000 < 500, 0.1, -0.1)


def curves(residual: Array, angle: Array = ANGLE) -> OutputCurves:
    return OutputCurves(
        output="cable_length",
        time=np.arange(N) * 0.02,
        measured=LENGTH,
        predicted=LENGTH - residual,
        residual=residual,
        starts=((0.0, "run"),),
        noise=1e-4,
        variables={"drum_angle": angle, "cable_length": LENGTH, "speed": SPEED},
        shares={"drum_angle": 0.9, "cable_length": 0.5, "speed": 0.0},
        sizes=(10.0, 1e-3),
    )


@pytest.mark.parametrize("order", [1, 3, 8])
def test_a_periodic_change_is_folded_with_eight_bins_per_period(order: int) -> None:
    change = 1e-3 * np.sin(order * ANGLE + 0.4)
    found = curves(change)
    assert found.main_variable(change) == ("drum_angle", order)
    drawn = found.signature(change, "drum_angle", order)
    assert len(drawn["bins"]) >= 8 * order
    assert max(drawn["bins"]) < 360.0
    expected = 1.0 * np.sin(order * np.radians(drawn["bins"]) + 0.4)
    assert np.allclose(drawn["signature"], expected, atol=0.11), "mm, mean over an eighth period"


def test_a_trend_over_one_turn_is_no_period() -> None:
    one_turn = ANGLE / 12.0
    change = 1e-3 * (one_turn - one_turn.mean())
    variable, order = curves(change, one_turn).main_variable(change) or ("", 0)
    assert (variable, order) in {("drum_angle", None), ("cable_length", None)}


def test_a_change_with_the_direction_is_drawn_over_the_speed() -> None:
    change = 1e-3 * np.sign(SPEED)
    assert curves(change).main_variable(change) == ("speed", None)


def test_bins_of_an_unwrapped_angle_grow_with_the_samples() -> None:
    drawn = curves(np.sin(0.5 * ANGLE)).signature(np.sin(0.5 * ANGLE), "drum_angle", None)
    assert len(drawn["bins"]) == int(np.sqrt(N))


def test_a_change_that_nothing_explains_has_no_variable() -> None:
    noise = np.random.default_rng(1).normal(size=N)
    assert curves(noise).main_variable(noise) is None
    assert curves(noise).main_variable(np.zeros(N)) is None


def test_runs_are_drawn_as_recorded_before_they_are_compared() -> None:
    time = np.arange(1000) * 0.02
    runs = [
        Run(
            name,
            5.0 + time,
            {"motor_angle": Channel(time, "rad"), "tension": Channel(factor * time, "N")},
            {"load_mass": f"{factor:g} kg"},
        )
        for name, factor in (("one", 10.0), ("two", 20.0))
    ]
    found = recorded_curves(runs)
    assert list(found) == ["tension"]
    shown = found["tension"].over_time(0.0, 40.0, 400)
    assert shown["samples"] == 2000
    assert max(shown["measured"]) == pytest.approx(20.0 * time[-1], rel=1e-4)
    assert shown["runs"] == [{"at": 0.0, "name": "10 kg"}, {"at": 20.0, "name": "20 kg"}]
    assert set(shown["predicted"]) == set(shown["residual"]) == {None}
    assert not found["tension"].is_compared


def test_any_channel_is_drawn_over_any_other() -> None:
    time = np.arange(20_000) * 0.001
    angle = np.cos(2 * np.pi * 0.1 * time)
    loop = {
        "motor_angle": Channel(angle, "rad"),
        "tension": Channel(np.sin(0.2 * np.pi * time), "N"),
    }
    runs = [
        ("loop", Run("loop", 7.0 + time, loop)),
        ("bare", Run("bare", time, dict([*loop.items()][:1]))),
    ]
    found = lines_of(runs, "tension", "motor_angle")
    (line,) = found["lines"]
    assert (line["name"], line["unit"], line["x_unit"]) == ("loop", "N", "rad")
    assert len(line["x"]) <= 3300
    np.testing.assert_allclose(np.hypot(line["x"], line["y"]), 1.0, atol=1e-4)
    assert {max(line["x"]), min(line["x"])} == {1.0, -1.0}, "extremes of both channels stay"
    assert found["difference"] is None
    (over_time,) = lines_of(runs, "tension")["lines"]
    assert over_time["x_unit"] == "s"
    np.testing.assert_allclose(
        over_time["y"], np.sin(0.2 * np.pi * np.array(over_time["x"])), atol=1e-4
    )
    assert lines_of(runs, "load", "tension")["lines"] == []


def test_the_residual_is_drawn_over_a_chosen_variable() -> None:
    found = curves(1e-3 * np.sin(ANGLE)).multiples(variables=["speed"])
    assert [panel["variable"] for panel in found["panels"]] == ["speed"]
    assert [name for name, _ in found["variables"]] == ["drum_angle", "cable_length", "speed"]
