"""Channels by name, unit and the ratio of angle and velocity; and what is asked."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from logger_layouts import motion
from winchkit.runs.importing.answers import Answers, read_column
from winchkit.runs.importing.assignment import Assignment, Guess
from winchkit.runs.importing.consistency import likely_counts, ratio_of
from winchkit.runs.importing.formats.cells import number
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.formats.stamps import epoch_unit, read_stamps
from winchkit.runs.importing.guess import guess_columns
from winchkit.runs.importing.names import meaning_of, words_of
from winchkit.runs.importing.units.spelling import read_unit, split_unit
from winchkit.schema.mapping import CHANNEL_DIMENSIONS, CHANNELS, DATE, MATRIX, POSE_DIMENSIONS
from winchkit.units import UNITS

TURN = 2 * math.pi


def guess(path: Path, columns: dict[str, np.ndarray], answers: Answers | None = None) -> Guess:
    table = np.stack(list(columns.values()), axis=1)
    lines = [",".join(columns), *(",".join(f"{v:.12g}" for v in row) for row in table)]
    path.write_text("\n".join(lines) + "\n")
    return guess_columns(read_table(path), answers)


def of(found: Guess, channel: str) -> Assignment:
    return next(item for item in found.assignments if item.channel == channel)


@pytest.mark.parametrize(
    ("text", "dimension", "factor"),
    [
        ("1/min", "angular speed", TURN / 60),
        ("min^-1", "angular speed", TURN / 60),
        ("U/min", "angular speed", TURN / 60),
        ("RPM", "angular speed", TURN / 60),
        ("°/s", "angular speed", math.pi / 180),
        ("deg/sec", "angular speed", math.pi / 180),
        ("N·m", "torque", 1.0),
        ("N.m", "torque", 1.0),
        ("Nm", "torque", 1.0),
        ("mNm", "torque", 1e-3),
        ("Ncm", "torque", 1e-2),
        ("in-lb", "torque", 0.112984829),
        ("mN", "force", 1e-3),
        ("MN", "force", 1e6),
        ("lbf", "force", 4.4482216),
        ("daN", "force", 10.0),
        ("µm", "length", 1e-6),
        ("Millimeters", "length", 1e-3),
        ("[°]", "angle", math.pi / 180),
        ("(Grad)", "angle", math.pi / 180),
        ("Umdr.", "angle", TURN),
        ("µs", "time", 1e-6),
        ("Seconds", "time", 1.0),
        ("‰", "share", 1e-3),
        ("mV/V", "bridge", 1.0),
        ("V (Voltage)", "voltage", 1.0),
        ("Inkr", "counts", 1.0),
    ],
)
def test_units_as_others_spell_them(text: str, dimension: str, factor: float) -> None:
    found = read_unit(text)
    assert found is not None
    assert found.dimension == dimension
    assert found.factor == pytest.approx(factor, rel=1e-6)


@pytest.mark.parametrize("dimension", ["angle", "angular speed", "torque", "force", "length"])
def test_every_unit_of_ours_is_read(dimension: str) -> None:
    for unit, value in UNITS[dimension].items():
        found = read_unit(unit)
        assert found is not None
        assert (found.dimension, found.factor) == (dimension, value)


def test_temperatures_have_offsets() -> None:
    fahrenheit, kelvin = read_unit("°F"), read_unit("K")
    assert fahrenheit is not None
    assert kelvin is not None
    assert 212 * fahrenheit.factor + fahrenheit.offset == pytest.approx(100.0)
    assert 273.15 * kelvin.factor + kelvin.offset == pytest.approx(0.0)


@pytest.mark.parametrize(
    ("text", "name", "unit"),
    [
        ("Torque (Nm)", "Torque", "Nm"),
        ("speed/rpm", "speed", "rpm"),
        ("pos_deg", "pos", "deg"),
        ("vel_rad/s", "vel", "rad/s"),
        ("Kraft in N", "Kraft", "N"),
        ("Position actual value [inc]", "Position actual value", "inc"),
        ("time, s", "time", "s"),
        ("Motor (left)", "Motor (left)", ""),
        ("motor_a", "motor_a", ""),
        ("joint_position_in", "joint_position_in", ""),
        ("Drehzahl [1/min]", "Drehzahl", "1/min"),
    ],
)
def test_unit_of_a_header_cell(text: str, name: str, unit: str) -> None:
    assert split_unit(text) == (name, unit)


@pytest.mark.parametrize(
    ("channel", "names"),
    [
        ("motor_angle", "Winkel_ist, theta, Mot_pos, CurrentEncoderReading, Current Position"),
        ("motor_velocity", "Drehzahl, vitesse, velocidad, theta_dot, q_dot, phi dot"),
        ("motor_torque", "Istdrehmoment, couple, tau_meas, eff_j1, eff_left_knee"),
        ("tension", "Seilkraft, fuerza, LoadCell, current load"),
        ("cable_length", "Seillänge"),
        ("time", "Zeit, tiempo, st_out.t, log/time, run.data.Zeit"),
        ("temperature", "Cell temperature"),
        ("current", "Motor current, Current"),
        ("A.motor_angle", "A.motor_angle"),
        ("platform_x", "pose.position.x, linear_position.x"),
        ("platform_y", "position.y"),
        ("platform_z", "transform.translation.z"),
        ("platform_qx", "pose.orientation.x"),
        # Set points, predictions, second derivatives and components of a motion.
        ("", "Position demand value, Sollwinkel, Winkel Soll, Following error actual value"),
        ("", "tau_model, torque_predicted, theta_ddot, q_ddot"),
        ("", "linear_acceleration.x, linear.y, angular.z, angular_velocity.x, twist.linear.x"),
        ("", "magnetic_field.z, imu acc x, gyro_z"),
        # An efficiency is no effort.
        (None, "eff, eff_mech, efficiency 2, motor_eff"),
    ],
)
def test_names_of_channels(channel: str | None, names: str) -> None:
    for name in names.split(", "):
        meaning = meaning_of(name)
        assert (None if meaning is None else meaning.channel) == channel, name


@pytest.mark.parametrize(
    ("name", "others"), [("x [in]", ()), ("z [mm]", ()), ("x [in]", ("y [in]",))]
)
def test_a_coordinate_without_others_is_the_position_of_a_linear_axis(
    name: str, others: tuple[str, ...], tmp_path: Path
) -> None:
    m = motion()
    columns = {"t [s]": m.time, **dict.fromkeys((name, *others), m.angle), "force [N]": m.torque}
    found = {item.channel for item in guess(tmp_path / "log.csv", columns).assignments}
    assert ({"position", "force"} <= found) == (not others)


def test_words_are_separated() -> None:
    assert words_of("MotorPos_ist2") == "motor pos ist 2"
    assert words_of("fActTorque") == "f act torque"


@pytest.mark.parametrize("angle", ["rad", "deg", "turn"])
@pytest.mark.parametrize("speed", ["rad/s", "deg/s", "rpm", "turn/s"])
def test_the_unit_of_a_velocity_follows_from_the_angle(
    angle: str, speed: str, tmp_path: Path
) -> None:
    m = motion()
    factor = UNITS["angular speed"].get(speed, TURN)
    columns = {
        "t [s]": m.time,
        f"angle [{angle}]": m.angle / UNITS["angle"][angle],
        "speed": m.velocity / factor,
    }
    item = of(guess(tmp_path / "log.csv", columns), "motor_velocity")
    assert item.factor == pytest.approx(factor)
    assert item.confidence == "derived"


def test_the_unit_of_an_angle_and_of_the_time_follow_from_the_others(tmp_path: Path) -> None:
    m = motion()
    columns = {
        "t [s]": m.time,
        "angle": m.angle * 180 / math.pi,
        "speed [rpm]": m.velocity * 9.5493,
    }
    assert of(guess(tmp_path / "a.csv", columns), "motor_angle").factor == pytest.approx(
        math.pi / 180
    )
    columns = {"t": m.time * 1e3, "angle [rad]": m.angle, "speed [rad/s]": m.velocity}
    assert of(guess(tmp_path / "b.csv", columns), "time").factor == pytest.approx(1e-3)


def test_equal_units_of_angle_and_velocity_are_ambiguous_and_asked(tmp_path: Path) -> None:
    m = motion()
    found = guess(tmp_path / "log.csv", {"t [s]": m.time, "angle": m.angle, "speed": m.velocity})
    assert [q.options[0] for q in found.questions] == [
        '--column "motor_angle=angle [UNIT]"',
        '--column "motor_velocity=speed [UNIT]"',
    ]


def test_counts_per_turn_follow_from_a_velocity_with_unit(tmp_path: Path) -> None:
    m = motion()
    counts = np.round(m.angle / TURN * 10_000)
    columns = {"t [s]": m.time, "position [inc]": counts, "speed [rpm]": m.velocity * 60 / TURN}
    found = guess(tmp_path / "log.csv", columns)
    assert of(found, "motor_angle").factor == pytest.approx(TURN / 10_000)
    alone = guess(tmp_path / "b.csv", {"t [s]": m.time, "position [inc]": counts})
    assert alone.questions[0].options[0] == "--counts-per-turn 4096"


def test_counts_per_turn_are_used_where_the_file_has_no_unit(tmp_path: Path) -> None:
    angle = np.round(4096 * np.sin(np.arange(300) / 50))
    columns = {"time [s]": np.arange(300) / 100, "Measured Pos (raw)": angle}
    found = guess(tmp_path / "a.csv", columns, Answers(counts_per_turn=4096))
    assert not found.questions
    assert of(found, "motor_angle").factor == pytest.approx(TURN / 4096)


def test_the_value_of_a_velocity_in_its_own_unit_is_in_the_question(tmp_path: Path) -> None:
    """A servo of 0.229 rpm per unit, whose angle is in counts."""
    time = np.arange(600) / 100
    counts = np.round(4096 * np.sin(time))
    raw = np.round(TURN * np.cos(time) / (0.229 * TURN / 60))
    columns = {"time [s]": time, "Measured Pos (raw)": counts, "Measured Vel (raw)": raw}
    found = guess(tmp_path / "a.csv", columns, Answers(counts_per_turn=4096))
    (question,) = found.questions
    factor = float(question.options[0].split("*")[1].split(" ")[0])
    assert factor == pytest.approx(0.229 * TURN / 60, rel=0.01)
    answered = Answers(counts_per_turn=4096, columns=(read_column(question.options[0][10:-1]),))
    assert not guess(tmp_path / "a.csv", columns, answered).questions


@pytest.mark.parametrize(
    "name",
    ["boom angle [deg]", "sway_angle [rad]", "angle of attack [deg]", "Pendelwinkel [°]",
     "fleet angle [deg]", "kite_pos_east [m]",
     "AngularIncrement_deg", "RopeVelocity [rad/s]", "cable speed [rpm]", "Line speed [1/min]",
     "droop pulses [pulses]", "elevation [deg]"],
)  # fmt: skip
def test_angles_of_other_bodies_are_not_the_motors(name: str, tmp_path: Path) -> None:
    time = np.arange(300) / 100
    columns = {"time [s]": time, name: np.sin(time), "tension [N]": 100 + np.cos(time)}
    found = guess(tmp_path / "a.csv", columns)
    assert {item.channel for item in found.used} == {"time", "tension"}


@pytest.mark.parametrize("name", ["motor swing angle [deg]", "drum angle [deg]", "angle [deg]"])
def test_angles_of_the_motor_are_named(name: str, tmp_path: Path) -> None:
    time = np.arange(300) / 100
    found = guess(tmp_path / "a.csv", {"time [s]": time, name: np.sin(time)})
    assert found.is_certain


def test_short_names_of_a_current_and_a_set_point(tmp_path: Path) -> None:
    time = np.arange(300) / 100
    columns = {
        "Time": time,
        "vel [rad/s]": np.cos(time),
        "cur [A]": np.sin(time),
        "tar_vel [rad/s]": np.cos(time),
    }
    found = guess(tmp_path / "a.csv", columns, Answers(torque_constant=0.1))
    assert of(found, "motor_velocity").source == "vel"
    assert of(found, "motor_torque").factor == pytest.approx(0.1)


def test_a_time_of_which_no_channel_is_used_is_not_asked(tmp_path: Path) -> None:
    count = np.arange(1.0, 301.0)
    columns = {
        "time_ground": count,
        "wind speed [m/s]": np.cos(count),
        "time [s]": count / 100,
        "motor angle [deg]": np.sin(count / 100),
    }
    found = guess(tmp_path / "a.csv", columns)
    assert not found.questions
    assert of(found, "time").source == "time"


def test_the_angle_of_a_joint_needs_consent(tmp_path: Path) -> None:
    time = np.arange(300) / 100
    found = guess(tmp_path / "a.csv", {"time [s]": time, "ankle_angle [deg]": np.sin(time)})
    assert of(found, "motor_angle").confidence == "derived"
    assert not found.is_certain


def test_a_wind_speed_and_a_constant_are_no_channels(tmp_path: Path) -> None:
    time = np.arange(300) / 100
    columns = {
        "time [s]": time,
        "motor angle [deg]": np.sin(time),
        "hook load [kN]": 2 + np.sin(time),
        "wind speed [1/s]": np.cos(time),
        "torque constant [Nm/A]": np.cos(time),
    }
    found = guess(tmp_path / "a.csv", columns)
    assert {item.channel for item in found.used} == {"time", "motor_angle", "load"}


def test_an_opposite_sense_and_a_wrong_unit_are_reported(tmp_path: Path) -> None:
    m = motion()
    columns = {"t [s]": m.time, "angle [rad]": m.angle, "speed [rad/s]": -m.velocity}
    found = guess(tmp_path / "a.csv", columns)
    assert of(found, "motor_velocity").factor == -1.0
    assert any("opposite sense" in note for note in found.notes)
    columns["speed [rad/s]"] = m.velocity * 60 / TURN
    wrong = guess(tmp_path / "b.csv", columns)
    assert any("is a unit, a gear ratio or a resolution wrong?" in note for note in wrong.notes)


def test_a_ratio_needs_proportional_signals() -> None:
    m = motion()
    assert ratio_of(m.time, m.angle, m.velocity) is not None
    assert ratio_of(m.time, m.angle, np.random.default_rng(0).standard_normal(len(m.time))) is None
    assert ratio_of(m.time, np.ones(len(m.time)), m.velocity) is None


@pytest.mark.parametrize(
    ("estimate", "counts"), [(4093.0, 4096), (10_020.0, 10_000), (777.7, None)]
)
def test_usual_resolutions(estimate: float, counts: int | None) -> None:
    assert likely_counts(estimate) == counts


def test_constants_are_asked_and_used(tmp_path: Path) -> None:
    m = motion()
    columns = {
        "t [s]": m.time,
        "angle [rad]": m.angle,
        "torque [%]": 50 * m.torque,
        "cell [mV/V]": m.tension / 250,
    }
    keys = [q.key for q in guess(tmp_path / "log.csv", columns).questions]
    assert keys == ["rated_torque", "sensitivity", "capacity"]
    answers = Answers(rated_torque=2.0, sensitivity=2.0, capacity=500.0)
    found = guess(tmp_path / "log.csv", columns, answers)
    assert of(found, "motor_torque").factor == pytest.approx(0.02)
    assert of(found, "tension").factor == pytest.approx(250.0)


def test_two_columns_that_fit_equally_are_asked(tmp_path: Path) -> None:
    m = motion()
    columns = {"t [s]": m.time, "angle [rad]": m.angle, "left force [N]": m.tension,
               "right force [N]": m.tension}  # fmt: skip
    (question,) = guess(tmp_path / "log.csv", columns).questions
    assert question.options == (
        '--column "tension=left force"',
        '--column "tension=right force"',
        '--column "tension="',
    )


def test_the_motor_is_preferred_to_the_output_and_set_points_are_left_out(tmp_path: Path) -> None:
    m = motion()
    columns = {"t [s]": m.time, "output position [deg]": m.angle, "motor position [deg]": m.angle,
               "target position [deg]": m.angle, "torque [Nm]": m.torque,
               "current [A]": m.torque}  # fmt: skip
    found = guess(tmp_path / "log.csv", columns)
    assert not found.questions
    assert of(found, "motor_angle").source == "motor position"
    assert of(found, "motor_torque").source == "torque"


def test_numbered_columns_are_winches_and_their_cells_too(tmp_path: Path) -> None:
    m = motion()
    columns = {"t [s]": m.time, "Axis1.ActPos [deg]": m.angle, "Axis2.ActPos [deg]": -m.angle,
               "Axis1.ActTorque [Nm]": m.torque, "Axis2.ActTorque [Nm]": m.torque,
               "Cell 1 [N]": m.tension, "Cell 2 [N]": m.tension}  # fmt: skip
    found = guess(tmp_path / "log.csv", columns)
    assert not found.questions
    bases = ("motor_angle", "motor_torque", "tension")
    assert {item.channel for item in found.used} == {
        "time",
        *(f"{n}.{base}" for n in "12" for base in bases),
    }
    assert of(found, "2.motor_angle").source == "Axis2.ActPos"


def test_columns_of_the_user_have_precedence() -> None:
    given = read_column("motor_torque=vir*35.15 [N m]")
    assert (given.channel, given.source, given.factor, given.unit) == (
        "motor_torque",
        "vir",
        35.15,
        "N m",
    )
    assert read_column("tension=").source == ""
    other = read_column("motor_torque=-Iq [A]")
    assert (other.source, other.sign, other.unit) == ("Iq", -1.0, "A")
    assert read_column("motor_torque=u*gtau").constant == "gtau"
    words = r"is no channel|no known unit|is not CHANNEL|is a unit of"
    for text in ("tenson=x", "tension=x [furlong]", "x", "tension=x [deg]", "A.motor_angle=x [N]"):
        with pytest.raises(ValueError, match=words):
            read_column(text)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("motor_angle=4 [mm]", "of a linear axis this is position=4 [mm]"),
        ("motor_torque=F [N]", "of a linear axis this is force=F [N]"),
        ("force=Iq [mA]", "with a factor: 'force=Iq*35.1 [N]'"),
    ],
)
def test_a_unit_of_another_quantity_gets_the_column_that_has_it(text: str, words: str) -> None:
    with pytest.raises(ValueError, match=re.escape(words)):
        read_column(text)


def test_a_minus_changes_the_sign_of_a_column(tmp_path: Path) -> None:
    time = np.arange(200) / 50
    columns = {"time [s]": time, "Pos [deg]": 10 * time, "M": np.sin(time), "Iq": np.cos(time)}
    answers = Answers(
        columns=(read_column("motor_torque=-Iq [A]"), read_column("tension=-M*2 [kN]")),
        torque_constant=0.12,
    )
    found = guess(tmp_path / "a.csv", columns, answers)
    assert found.questions == ()
    assert of(found, "motor_torque").factor == pytest.approx(-0.12)
    assert of(found, "tension").factor == pytest.approx(-2000.0)


def test_axes_of_an_odrive_are_in_turns(tmp_path: Path) -> None:
    """Names as its live plotter writes them, without units."""
    time = np.arange(300) / 30 + 0.1
    turns = np.sin(time)
    columns = {
        "time": time,
        "ODrive 0 Position": turns,
        "ODrive 0 Velocity": np.cos(time),
        "ODrive 0 Current": 1.25 * np.sign(turns),
    }
    found = guess(tmp_path / "a.csv", columns, Answers(torque_constant=8.27 / 150))
    assert found.questions == ()
    assert of(found, "motor_angle").factor == pytest.approx(2 * np.pi)
    assert of(found, "motor_velocity").factor == pytest.approx(2 * np.pi)
    assert of(found, "motor_angle").confidence == "assumed"


def test_a_channel_can_be_left_out(tmp_path: Path) -> None:
    m = motion()
    columns = {"t [s]": m.time, "angle [rad]": m.angle, "torque [Nm]": m.torque}
    answers = Answers(columns=(read_column("motor_torque="),))
    found = guess(tmp_path / "log.csv", columns, answers)
    assert {item.channel for item in found.used} == {"time", "motor_angle"}


def test_channels_of_a_mapping_are_those_of_a_run() -> None:
    """The schema cannot import the run's tables: they are equal."""
    assert {
        "time": "time",
        DATE: "time",
        **CHANNEL_DIMENSIONS,
        **POSE_DIMENSIONS,
        **dict.fromkeys(MATRIX, "ratio"),
    } == CHANNELS


def test_stamps() -> None:
    two = read_stamps(["2026-03-04T09:30:15.25+01:00", "2026-03-04 08:30:15,5Z"])
    assert two.values[1] - two.values[0] == pytest.approx(0.25)
    days = read_stamps(["13/2/2026 01:00:00 PM", "1/3/2026 13:00:00"])
    assert days.values[1] - days.values[0] == pytest.approx(16 * 86_400)
    assert read_stamps(["25:00:00", "12:00:00"]).wrong == (0,)
    assert epoch_unit(np.array([1.7e12, 1.7e12 + 10])) == "ms"
    assert epoch_unit(np.array([0.0, 0.01, 0.02])) is None
    assert epoch_unit(np.array([46000.0, 46000.0000001, 46000.0000002])) == "excel"


@pytest.mark.parametrize("unit", ["V", "counts", "LSB"])
def test_the_output_of_an_amplifier_or_converter_needs_a_factor(unit: str, tmp_path: Path) -> None:
    m = motion()
    columns = {"t [s]": m.time, "angle [rad]": m.angle, f"load cell [{unit}]": m.tension / 80}
    (question,) = guess(tmp_path / "log.csv", columns).questions
    assert question.options == ('--column "tension=load cell*FACTOR [N]"',)
    answers = Answers(columns=(read_column("tension=load cell*80 [N]"),))
    found = guess(tmp_path / "log.csv", columns, answers)
    assert not found.questions
    assert of(found, "tension").factor == pytest.approx(80.0)


def test_numbers_as_people_write_them() -> None:
    assert number("−1.5", ".") == -1.5
    assert number("1\u202f234,5", ",") == 1234.5
    assert number("1'234.5", ".") == 1234.5
    assert number("1.234,5", ",") == 1234.5
    assert number("1,234", ".") is None


def test_a_clock_without_a_name_is_the_only_column_that_increases_evenly(tmp_path: Path) -> None:
    """As in a recording of a hanging robot: arrays of a MAT structure, time in ``st.t_r``."""
    t = 421.448 + 0.001 * np.arange(400)
    found = guess(
        tmp_path / "log.csv",
        {
            "st_t_r": t,
            "angle [rad]": np.sin(t),
            "vicon_idx": 1.0 + 10.0 * np.arange(400),
            "epsilon": np.cumsum(np.random.default_rng(1).uniform(0.1, 2.0, 400)),
        },
    )
    clock = of(found, "time")
    assert (clock.source, clock.unit, clock.confidence) == ("st_t_r", "s", "assumed")


def test_two_columns_that_increase_evenly_are_no_clock(tmp_path: Path) -> None:
    t = 0.1 + 0.001 * np.arange(400)
    found = guess(tmp_path / "log.csv", {"one": t, "two": 2 * t, "angle [rad]": np.sin(t)})
    assert not any(item.channel == "time" for item in found.assignments)
    assert any("no column is time" in question.text for question in found.questions)


def joints(gain: float = 1.0) -> dict[str, np.ndarray]:
    """Three joints of one robot: the first moves, the second follows it, the third is locked."""
    m = motion()
    moved = {"1": 1.0, "2": 0.5, "3": 0.0}
    columns = {"time [s]": m.time}
    columns |= {f"Position{k}": gain * m.angle * share for k, share in moved.items()}
    columns |= {f"Velocity{k}": gain * m.velocity * share for k, share in moved.items()}
    columns |= {f"PositionCmptd{k}": gain * m.angle * share for k, share in moved.items()}
    columns |= {f"Torque{k}": m.torque * (1 + share) for k, share in moved.items()}
    columns |= {f"TorqueCur{k}": m.torque * (1.1 + share) for k, share in moved.items()}
    return columns


def test_one_answer_holds_for_the_columns_of_all_joints_that_are_named_alike(
    tmp_path: Path,
) -> None:
    found = guess(tmp_path / "log.csv", joints())
    assert [q.text.split("?")[0].split(" has")[0] for q in found.questions] == [
        "which column is 1.motor_torque",
        "'Position1' (1.motor_angle)",
        "'Velocity1' (1.motor_velocity)",
    ]
    texts = ("1.motor_angle=Position1 [rad]", "1.motor_torque=TorqueCur1 [N m]")
    answers = Answers(columns=tuple(map(read_column, texts)))
    answered = guess(tmp_path / "log.csv", joints(), answers)
    assert not answered.questions
    for winch in "123":
        assert of(answered, f"{winch}.motor_angle").source == f"Position{winch}"
        assert of(answered, f"{winch}.motor_torque").source == f"TorqueCur{winch}"
        velocity = of(answered, f"{winch}.motor_velocity")
        assert (velocity.unit, velocity.factor) == ("rad/s", 1.0)


def test_a_joint_that_the_user_names_brings_its_other_columns(tmp_path: Path) -> None:
    texts = ("motor_angle=Position2 [deg]", "motor_torque=TorqueCur2 [N m]")
    answers = Answers(columns=tuple(map(read_column, texts)))
    found = guess(tmp_path / "log.csv", joints(180 / math.pi), answers)
    assert not found.questions
    assert {item.channel: item.source for item in found.used} == {
        "time": "time",
        "motor_angle": "Position2",
        "motor_velocity": "Velocity2",
        "motor_torque": "TorqueCur2",
    }
    assert of(found, "motor_velocity").unit == "deg/s"


def test_a_constant_column_is_no_channel_of_a_motor_that_moves(tmp_path: Path) -> None:
    m = motion()
    columns = {"time [s]": m.time, "position [rad]": m.angle, "torque enable": m.time * 0 + 1}
    still = {"time [s]": m.time, "position [rad]": m.time * 0 + 2.5, "torque [Nm]": m.torque}
    assert {i.channel for i in guess(tmp_path / "a.csv", columns).used} == {"time", "motor_angle"}
    # A locked drive has a constant angle and a torque.
    assert {i.channel for i in guess(tmp_path / "b.csv", still).used} == {
        "time",
        "motor_angle",
        "motor_torque",
    }
    speed = {"time [s]": m.time, "position [rad]": m.time * 0, "speed [rad/s]": m.velocity}
    assert {i.channel for i in guess(tmp_path / "c.csv", speed).used} == {"time", "motor_velocity"}


def test_a_number_in_round_brackets_is_a_name_and_no_unit(tmp_path: Path) -> None:
    m = motion()
    columns = {"time [s]": m.time}
    for k in "123":
        columns |= {f"pos ({k}) [rad]": m.angle, f"current ({k}) [A]": m.torque}
    columns = {name.replace(" [rad]", ""): values for name, values in columns.items()}
    columns = {name.replace(" [A]", ""): values for name, values in columns.items()}
    answers = Answers(columns=(read_column("1.motor_angle=pos (1) [rad]"),), torque_constant=0.1)
    found = guess(tmp_path / "log.csv", columns, answers)
    assert not found.questions
    assert {item.channel for item in found.used} == {
        "time",
        *(f"{k}.{base}" for k in "123" for base in ("motor_angle", "motor_torque")),
    }


def test_a_current_without_a_unit_needs_consent_and_whole_numbers_a_unit(tmp_path: Path) -> None:
    m = motion()
    columns = {"time [s]": m.time, "position [rad]": m.angle, "current": m.torque / 0.12}
    found = guess(tmp_path / "a.csv", columns, Answers(torque_constant=0.12))
    assert of(found, "motor_torque").confidence == "assumed"
    assert not found.is_certain
    columns["current"] = np.round(m.torque / 0.12 / 6.5e-3)
    found = guess(tmp_path / "b.csv", columns, Answers(torque_constant=0.12))
    assert [q.options for q in found.questions] == [
        ('--column "motor_torque=current*FACTOR [N m]"', '--column "motor_current=current [mA]"')
    ]
    mended = Answers(columns=(read_column("motor_torque=current*0.00078 [N m]"),))
    assert not guess(tmp_path / "b.csv", columns, mended).questions


def test_whole_numbers_of_less_than_a_turn_may_be_counts(tmp_path: Path) -> None:
    m = motion()
    small = np.round(2048 + 60 * np.sin(m.time))
    columns = {"time [s]": m.time, "pos": small}
    (question,) = guess(tmp_path / "log.csv", columns).questions
    assert question.key == "counts_per_turn"
    found = guess(tmp_path / "log.csv", columns, Answers(counts_per_turn=4096))
    assert of(found, "motor_angle").factor == pytest.approx(TURN / 4096)


def test_a_number_of_the_row_is_no_time_beside_an_even_clock(tmp_path: Path) -> None:
    m = motion()
    path = tmp_path / "log.csv"
    rows = enumerate(zip(m.time, m.angle, strict=True))
    path.write_text("".join(f"{n},{t:.6f},{a:.9g}\n" for n, (t, a) in rows))
    found = guess_columns(read_table(path))
    assert of(found, "time").source == "2"
    # The only column that increases evenly may be a time in steps of one.
    path.write_text("".join(f"{n},{a:.9g}\n" for n, a in enumerate(m.angle)))
    assert of(guess_columns(read_table(path)), "time").source == "1"


def test_a_name_that_ends_with_time_is_a_clock_where_it_increases(tmp_path: Path) -> None:
    m = motion()
    columns = {"motor_pos [rad]": m.angle, "motor_time [ms]": m.time * 0 + 5,
               "sensor_time [ms]": m.time * 1e3}  # fmt: skip
    assert of(guess(tmp_path / "log.csv", columns), "time").source == "sensor_time"


def test_numbers_are_no_date_by_the_name_data(tmp_path: Path) -> None:
    m = motion()
    columns = {"time [s]": m.time, "field.data [N]": m.tension, "data": m.torque}
    found = guess(tmp_path / "log.csv", columns)
    assert of(found, "tension").source == "field.data"
    assert [i.reason for i in found.assignments if i.source == "data"] == ["unknown name"]


def test_the_current_of_a_winch_is_kept_for_that_winch(tmp_path: Path) -> None:
    m = motion()
    columns = {"time [s]": m.time, "m1_pos [rad]": m.angle, "m2_pos [rad]": m.angle,
               "m1_current [A]": m.torque, "m2_current [A]": m.torque}  # fmt: skip
    (question,) = guess(tmp_path / "log.csv", columns).questions
    assert question.options[1] == '--column "1.motor_current=m1_current [A]"'
    answers = Answers(columns=(read_column("1.motor_current=m1_current [A]"),))
    found = guess(tmp_path / "log.csv", columns, answers)
    assert not found.questions
    assert of(found, "2.motor_current").source == "m2_current"


def test_a_channel_that_one_winch_does_not_have_is_asked_for_no_other(tmp_path: Path) -> None:
    m = motion()
    columns = {"time [s]": m.time, "m1_pos [rad]": m.angle, "m2_pos [rad]": m.angle,
               "m1_load": m.torque, "m2_load": m.torque}  # fmt: skip
    (question,) = guess(tmp_path / "log.csv", columns).questions
    assert '--column "1.tension="' in question.text
    answers = Answers(columns=(read_column("1.tension="),))
    assert not guess(tmp_path / "log.csv", columns, answers).questions


@pytest.mark.parametrize(
    "name", ["brake torque", "Compensated brake torque", "Load torque", "Lastmoment", "ext. torque"]
)
def test_the_torque_of_a_brake_or_of_the_load_is_not_the_motors(name: str, tmp_path: Path) -> None:
    m = motion()
    columns = {"time [s]": m.time, "angle [rad]": m.angle, f"{name} [Nm]": m.torque}
    assert {i.channel for i in guess(tmp_path / "log.csv", columns).used} == {"time", "motor_angle"}


def test_a_first_column_that_seldom_changes_is_no_clock(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    path.write_text("".join(f"{24 + k // 20} {2.5 + 0.1 * (k % 7)}\n" for k in range(600)))
    assert not guess_columns(read_table(path)).used


def test_a_vector_of_few_values_beside_a_recording_is_a_parameter(tmp_path: Path) -> None:
    """``q`` of a robot's start pose, beside the recorded angles."""
    m = motion()
    path = tmp_path / "log.mat"
    arrays = {"t": m.time, "position": m.angle, "torque": m.torque, "q": np.arange(7) / 3}
    savemat(path, arrays)
    found = guess_columns(read_table(path))
    assert of(found, "motor_angle").source == "position"
    assert "parameter" in next(a.reason for a in found.assignments if a.source == "q")


@pytest.mark.parametrize(
    ("unit", "asked", "constant", "factor"),
    [
        ("%", "is in %: of which torque?", {"rated_torque": 2.4}, 0.024),
        ("A", "is a current: which torque constant?", {"torque_constant": 0.12}, 0.12),
        ("V", "is in V: how many N m is 1?", {}, None),
    ],
)
def test_a_unit_that_the_user_names_is_asked_for_its_constant(
    tmp_path: Path, unit: str, asked: str, constant: dict[str, float], factor: float | None
) -> None:
    """The file has no unit; the answer was lost, and the same question came again without end."""
    time = np.arange(0.0, 2.0, 0.01)
    columns = {"time": time, "angle [rad]": np.sin(time), "torque": np.cos(5 * time)}
    (question,) = guess(tmp_path / "log.csv", columns).questions
    assert "% (of a rated torque), A (a current)" in question.text
    given = Answers(columns=(read_column(f"motor_torque=torque [{unit}]"),))
    (question,) = guess(tmp_path / "log.csv", columns, given).questions
    assert asked in question.text
    if factor is not None:
        known = Answers(columns=given.columns, **constant)  # type: ignore[arg-type]
        found = guess(tmp_path / "log.csv", columns, known)
        assert not found.questions
        assert of(found, "motor_torque").factor == pytest.approx(factor)
