"""Angles that wrap are unwrapped, jumps that are no motion cut a run, and lost signs are found."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from winchkit.arrays import Array
from winchkit.cli import main
from winchkit.errors import RunError
from winchkit.runs import read_run
from winchkit.runs.importing.answers import Answers
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns
from winchkit.runs.importing.mapping import guess_by, mapping_of
from winchkit.runs.importing.runs import read_mapped, run_of
from winchkit.runs.importing.stored.numbers import wrap_of
from winchkit.runs.importing.stored.sign_bits import lost_sign
from winchkit.runs.importing.streams import streams_of

TURN = 2 * np.pi
TIME = np.arange(1200) / 100
ANGLE = 16 * np.sin(TURN * 0.15 * TIME)
SPEED = 16 * TURN * 0.15 * np.cos(TURN * 0.15 * TIME)


def write(path: Path, columns: dict[str, Array]) -> Path:
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join(f"{value:.12g}" for value in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def log(path: Path, head: str, stored: Array, time: Array = TIME) -> Path:
    rows = slice(0, len(stored))
    return write(path, {"time [s]": time[rows], head: stored, "motor_torque [N m]": ANGLE[rows]})


def command(*arguments: str | Path) -> tuple[int, str]:
    result = CliRunner().invoke(main, ["import", *map(str, arguments)])
    return result.exit_code, result.output


@pytest.mark.parametrize("shift", [0.0, 0.5])
@pytest.mark.parametrize(
    ("head", "si", "modulus", "resolution"),
    [
        ("motor_angle [deg]", np.pi / 180, 360.0, 1e-3),
        ("motor_angle [rad]", 1.0, TURN, 1e-4),
        ("motor_angle [turn]", TURN, 1.0, 1e-5),
        ("Position actual value [counts]", TURN / 65536, 65536.0, 1.0),
        ("Position actual value [counts]", TURN / 65536, 2.0**32, 1.0),
        ("position", TURN / 65536, 2.0**16, 1.0),
        ("encoder [counts]", TURN / 65536, 2.0**17, 1.0),
    ],
)
def test_a_wrapped_angle_is_unwrapped_and_reported(
    head: str, si: float, modulus: float, resolution: float, shift: float, tmp_path: Path
) -> None:
    """Over its whole range from 0, and over half of it to either side."""
    start = 2.0**31 - 20_000 if modulus == 2.0**32 and shift else 0.0
    numbers = np.round((ANGLE / si + start) / resolution) * resolution
    low = -shift * modulus
    stored = np.mod(numbers - low, modulus) + low
    guess = guess_columns(
        read_table(log(tmp_path / "a.csv", head, stored)), Answers(counts_per_turn=65536)
    )
    assert not guess.questions
    assert any("wraps at" in note for note in guess.notes)
    run = run_of(streams_of(guess), {})
    angle = run["motor_angle"]
    assert angle - angle[0] == pytest.approx(ANGLE - ANGLE[0], abs=1.01 * resolution * si)
    again = read_mapped(tmp_path / "a.csv", mapping_of("m", [("a", guess)]))
    assert np.array_equal(again["motor_angle"], angle)


@pytest.mark.parametrize("lost", [(110, 130), (60, 80), (300, 330)])
def test_a_single_wrap_is_found_on_either_side_of_lost_rows(
    lost: tuple[int, int], tmp_path: Path
) -> None:
    """Also in the shorter part, and where the whole motion is less than a turn from end to end."""
    angle = 5.0 + 2.8 * np.sin(TURN * 0.08 * TIME)
    rows = np.setdiff1d(np.arange(500), np.arange(*lost))
    path = log(tmp_path / "a.csv", "motor_angle [rad]", np.mod(angle, TURN)[rows], TIME[rows])
    run = run_of(streams_of(guess_columns(read_table(path))), {})
    assert np.ptp(run["motor_angle"] - angle[rows]) < 1e-6


def test_a_velocity_beside_a_wrapped_angle_is_kept(tmp_path: Path) -> None:
    columns = {
        "time [s]": TIME,
        "angle [deg]": np.mod(np.degrees(ANGLE), 360),
        "speed": SPEED * 30 / np.pi,
    }
    guess = guess_columns(read_table(write(tmp_path / "a.csv", columns)))
    (speed,) = [item for item in guess.used if item.channel == "motor_velocity"]
    assert (speed.unit, speed.factor) == ("rpm", pytest.approx(np.pi / 30))


def test_a_modulus_that_is_no_usual_one_is_asked(tmp_path: Path) -> None:
    stored = np.mod(np.round(ANGLE * 1e4), 77_000)
    path = log(tmp_path / "a.csv", "position [counts]", stored)
    (question,) = guess_columns(read_table(path), Answers(counts_per_turn=62832)).questions
    assert question.options[1] == '--modulo "position=0"'
    assert float(question.options[0].split("=")[1].strip('"')) == pytest.approx(77_000, rel=0.01)
    told = Answers(counts_per_turn=62832, modulo=(("position", 77_000.0),))
    run = run_of(streams_of(guess_columns(read_table(path), told)), {})
    assert np.ptp(run["motor_angle"]) == pytest.approx(np.ptp(ANGLE), rel=1e-3)


@pytest.mark.parametrize(("turn", "unit"), [(360.0, "deg"), (TURN, "rad"), (1.0, "turn")])
def test_the_number_at_which_an_angle_wraps_gives_its_unit(
    turn: float, unit: str, tmp_path: Path
) -> None:
    path = log(tmp_path / "a.csv", "theta", np.round(np.mod(ANGLE / TURN, 1) * turn, 6))
    guess = guess_columns(read_table(path))
    assert not guess.questions
    (item,) = [one for one in guess.used if one.channel == "motor_angle"]
    assert (item.unit, item.confidence) == (unit, "derived")
    run = run_of(streams_of(guess), {})
    assert run["motor_angle"] == pytest.approx(ANGLE - ANGLE[0], abs=1e-4)


def test_steps_of_more_than_a_quarter_of_a_turn_are_asked(tmp_path: Path) -> None:
    """150° from row to row: forwards, or 210° backwards."""
    stored = np.mod(150.3 * np.arange(300), 360)
    path = log(tmp_path / "a.csv", "motor_angle [deg]", stored)
    assert "wrap" in guess_columns(read_table(path)).questions[0].text


@given(st.integers(0, 2**32 - 1), st.floats(0.01, 500.0))
def test_no_motion_is_taken_for_a_wrap(seed: int, size: float) -> None:
    """Smooth motions of any size, that stand still in between, are the angle itself."""
    rng = np.random.default_rng(seed)
    knots = np.repeat(np.cumsum(rng.normal(size=12)), 2)
    motion = np.interp(np.linspace(0, 23, 800), np.arange(24), knots) * size
    assert wrap_of(motion + 1e-3 * rng.normal(size=800), (360.0, 180.0, TURN, 1.0)) is None


@pytest.mark.parametrize("cause", ["homed", "lost turns", "lost rows"])
def test_a_jump_cuts_a_run_in_two(cause: str, tmp_path: Path) -> None:
    angle = ANGLE.copy()
    if cause == "homed":
        angle[700:] += 3 - angle[700]
    elif cause == "lost turns":
        angle[700:] -= 5 * TURN
    else:
        angle = np.concatenate((angle[:400], angle[560:]))
    path = log(tmp_path / "a.csv", "motor_angle [rad]", angle)
    code, output = command(path, "-o", tmp_path / "runs", "-y")
    assert code == 0
    assert "motor_angle jumps by" in output
    assert "(line " in output
    names = sorted(item.name for item in (tmp_path / "runs").glob("*.csv"))
    assert names == ["a-piece1.csv", "a-piece2.csv"]
    first, second = (read_run(tmp_path / "runs" / name) for name in names)
    cut = 400 if cause == "lost rows" else 700
    assert (len(first), len(second)) == (cut, len(angle) - cut)
    assert first["motor_angle"] == pytest.approx(angle[:cut])
    assert second["motor_angle"] == pytest.approx(angle[cut:])
    with pytest.raises(RunError, match="winchkit import writes the pieces"):
        read_run(path, mapping=tmp_path / "runs" / "mapping.toml")


def test_a_gap_of_a_counter_that_wraps_cuts_a_run(tmp_path: Path) -> None:
    """In half a second of up to 15 rad/s a turn may be lost, in 50 ms it is not."""
    stored = np.mod(np.degrees(ANGLE), 360)
    for lost, names in ((50, ["a-piece1.csv", "a-piece2.csv"]), (5, ["a.csv"])):
        kept = np.r_[0:600, 600 + lost : len(TIME)]
        path = log(tmp_path / "a.csv", "motor_angle [deg]", stored[kept], TIME[kept])
        folder = tmp_path / str(lost)
        code, output = command(path, "-o", folder, "-y")
        assert code == 0
        assert ("may have wrapped" in output) == (len(names) > 1)
        assert sorted(item.name for item in folder.glob("*.csv")) == names


def test_a_counter_that_wraps_in_a_gap_alone_cuts_a_run(tmp_path: Path) -> None:
    """No other step says that it wraps: its rate over the gap is that of no motion."""
    time = np.delete(np.arange(400) / 100, slice(195, 206))
    counts = np.mod(20_000 + 22_768 * time + 50 * np.sin(9 * time), 65_536)
    path = log(tmp_path / "a.csv", "position [counts]", np.round(counts), time)
    code, output = command(path, "-o", tmp_path / "runs", "-y", "--counts-per-turn", "4096")
    assert code == 0
    assert "rows were lost" in output
    pieces = [read_run(item) for item in sorted((tmp_path / "runs").glob("*.csv"))]
    assert [len(piece) for piece in pieces] == [195, 194]


def test_motions_and_spikes_are_no_jumps(tmp_path: Path) -> None:
    """Steps between slow samples at rest, one spike, one fast move that the velocity has."""
    steps = np.repeat([0.0, 5.0, 5.0, 12.0, 0.0], 60) + 1e-3 * np.sin(np.arange(300))
    spike = ANGLE.copy()
    spike[500] += 40
    for values in (steps, spike):
        path = log(tmp_path / "a.csv", "motor_angle [rad]", values)
        code, output = command(path, "-o", tmp_path / "runs", "-y", "--replace")
        assert code == 0
        assert "jumps by" not in output
    moved, speed = ANGLE.copy(), SPEED.copy()
    moved[700:] += 10
    speed[699:701] += 1000
    columns = {"time [s]": TIME, "motor_angle [rad]": moved, "motor_velocity [rad/s]": speed}
    code, output = command(
        write(tmp_path / "b.csv", columns), "-o", tmp_path / "runs", "-y", "--replace"
    )
    assert code == 0
    assert "jumps by" not in output


@pytest.mark.parametrize("kind", ["two's complement", "sign and magnitude"])
@pytest.mark.parametrize(("bits", "decimals"), [(8, 0), (16, 0), (16, 1), (32, 0), (32, 1)])
def test_the_sign_of_a_coarse_signal_is_asked_and_restored(
    bits: int, kind: str, decimals: int, tmp_path: Path
) -> None:
    """−5 to 5 ‰ of 2 N m, once for both of two columns that are named alike."""
    true = np.round(4.4 * np.sign(np.sin(TIME)) + 0.6 * np.sin(7 * TIME))
    negative = 2.0**bits + true if kind == "two's complement" else 2.0 ** (bits - 1) - true
    stored = np.where(true < 0, negative, true) / 10**decimals
    columns = {
        "time [s]": TIME,
        "1.position [rad]": ANGLE,
        "2.position [rad]": ANGLE,
        "1.torque [‰]": stored,
        "2.torque [‰]": np.roll(stored, 7),
    }
    path = write(tmp_path / "a.csv", columns)
    (question,) = guess_columns(read_table(path), Answers(rated_torque=2.0)).questions
    assert question.options[0] == '--signed "1.torque" --signed "2.torque"'
    assert kind in question.text
    told = Answers(rated_torque=2.0, signed=("1.torque", "2.torque"))
    run = run_of(streams_of(guess_columns(read_table(path), told)), {})
    expected = true / 10**decimals * 2e-3
    assert run["1.motor_torque"] == pytest.approx(expected, abs=1e-9)
    assert np.max(np.abs(run["2.motor_torque"])) <= 0.0101


def test_per_cent_that_are_all_negative_have_lost_their_sign() -> None:
    values = 65531.0 + np.arange(3)
    assert lost_sign(values.astype(np.float64), is_small=True) is not None
    assert lost_sign(values.astype(np.float64)) is None


@pytest.mark.parametrize(
    ("unit", "modulus", "decimals"),
    [("ms", 2**16, 0), ("ms", 2**32, 0), ("us", 2**32, 0), ("ms", 2**32 / 1000, 3)],
)
def test_a_clock_that_wraps_goes_on(
    unit: str, modulus: float, decimals: int, tmp_path: Path
) -> None:
    """As ``millis()`` of 16 bits, and ``micros()``, which does so every 72 minutes."""
    counted = TIME * (1e3 if unit == "ms" else 1e6)
    start = modulus - counted[100] - 0.5
    stored = np.round(np.mod(counted + start, modulus), decimals)
    head = f"clock [{unit}]"
    path = write(tmp_path / "a.csv", {head: stored, "motor_angle [rad]": ANGLE})
    guess = guess_columns(read_table(path))
    assert any(f"wraps at {modulus:.12g} (once)" in note for note in guess.notes)
    again = guess_by(read_table(path), mapping_of("m", [("a", guess)]))
    for found in (guess, again):
        time = run_of(streams_of(found), {}).time
        assert time == pytest.approx(TIME - TIME[0], abs=1e-3 if unit == "ms" else 1e-6)


def test_two_levels_of_a_force_are_no_signs_of_a_byte() -> None:
    values = np.array([2.0, 3.0, 252.0, 253.0])
    assert lost_sign(values, is_small=True) is not None
    assert lost_sign(values) is None


def test_a_torque_far_beyond_the_rated_one_is_reported(tmp_path: Path) -> None:
    path = log(tmp_path / "a.csv", "motor_angle [rad]", ANGLE)
    found = guess_columns(read_table(path), Answers(rated_torque=0.2))
    assert any("80 times the rated torque" in note for note in found.notes)
