"""Units of catalogues: composed torques and speeds, by their definitions, and what is refused."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns
from winchkit.runs.importing.units.spelling import read_unit, split_unit

POUND = 0.45359237 * 9.80665
"""N: the avoirdupois pound (1959) by the standard acceleration of gravity."""
INCH = 0.0254
TURN = 2 * math.pi


@pytest.mark.parametrize(
    ("texts", "dimension", "si"),
    [
        (("oz-in", "ozf·in", "ozf.in", "oz in", "in-oz"), "torque", POUND / 16 * INCH),
        (("lbf·in", "lb-in", "in·lbf", "inch-pounds"), "torque", POUND * INCH),
        (("lb-ft", "ft·lbf", "lbf ft", "foot-pound"), "torque", POUND * 12 * INCH),
        (("kgf·cm", "kg-cm", "kgcm", "kp cm"), "torque", 9.80665e-2),
        (("gf·cm", "g·cm"), "torque", 9.80665e-5),
        (("N·cm", "Ncm", "N-cm", "cNm"), "torque", 1e-2),
        (("mN·m", "Nmm", "mNm"), "torque", 1e-3),
        (("MNm", "MN·m"), "torque", 1e6),
        (("daNm",), "torque", 10.0),
        (("kNm", "KNM"), "torque", 1e3),
        (("min⁻¹", "rev/min", "r/min", "rot/min", "1/min"), "angular speed", TURN / 60),
        (("krpm", "kRPM"), "angular speed", TURN * 1000 / 60),
        (("deg/s", "deg_s", "deg per sec", "° s⁻¹", "°/s"), "angular speed", math.radians(1)),
        (("°/min", "deg/min"), "angular speed", math.radians(1) / 60),
        (("rad·s⁻¹", "rad_s", "rad/sec"), "angular speed", 1.0),
        (("rev/s", "rot/s", "RPS"), "angular speed", TURN),
        (("gon",), "angle", TURN / 400),
        (("mdeg",), "angle", math.radians(1e-3)),
        (("in/s",), "speed", INCH),
        (("ft/min",), "speed", 12 * INCH / 60),
    ],
)
def test_units_of_catalogues(texts: tuple[str, ...], dimension: str, si: float) -> None:
    for text in texts:
        unit = read_unit(text)
        assert unit is not None, text
        assert unit.dimension == dimension, text
        assert unit.factor == pytest.approx(si, rel=1e-12), text


@pytest.mark.parametrize("text", ["grad", "GRAD", "mil", "mNM", "lbm", "gm", "tm", "min_s", "in_s"])
def test_a_spelling_of_two_units_is_none(text: str) -> None:
    """Grad and gradian, mN m and MN m without their case, masses and times."""
    unit = read_unit(text)
    assert unit is None or unit.dimension not in {"torque", "angle", "angular speed", "speed"}


@pytest.mark.parametrize(
    ("header", "unit"),
    [
        ("Speed (0.1 rpm)", "0.1 rpm"),
        ("speed 0.1rpm", "0.1rpm"),
        ("Torque (Nm x 100)", "Nm x 100"),
        ("Position (1/10 mm)", "1/10 mm"),
        ("Load cell (500 N)", "500 N"),
        ("Position 1 deg", "deg"),
        ("Torque (% of rated)", "% of rated"),
        ("speed_rad_s", "rad_s"),
        ("Force (Load Cell 1 (N))", "N"),
    ],
)
def test_a_multiple_of_a_unit_is_a_unit_of_its_own(header: str, unit: str) -> None:
    assert split_unit(header)[1] == unit


@pytest.mark.parametrize(
    "header", ["Speed (0.1 rpm)", "speed_rpm_x10", "Speed [x10 rpm]", "speed [kn]", "Speed (kn)"]
)
def test_the_size_of_one_is_asked_where_the_header_does_not_say_it(
    header: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """A tenth of rpm taken for rpm, or knots for kN, would be a wrong number without a word."""
    path = tmp_path_factory.mktemp("log") / "a.csv"
    rows = "\n".join(f"{k / 100},{k % 13},{k % 7}" for k in range(60))
    path.write_text(f"time [s],angle [rad],{header}\n{rows}\n")
    guess = guess_columns(read_table(str(path)))
    assert any("motor_velocity" in question.text for question in guess.questions), guess.questions


def test_a_column_may_be_named_by_its_unit_alone(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    rows = "\n".join(f"{10 * k},{k % 13},{k % 7},{k % 5}" for k in range(60))
    path.write_text(f"ms,deg,rpm,min\n{rows}\n")
    guess = guess_columns(read_table(str(path)))
    found = {item.source: (item.channel, item.factor) for item in guess.assignments}
    assert found["ms"] == ("time", 1e-3)
    assert found["deg"] == ("motor_angle", pytest.approx(math.radians(1)))
    assert found["rpm"] == ("motor_velocity", pytest.approx(TURN / 60))
    assert found["min"][0] == ""
    assert not guess.is_certain
