"""Robot files: the papers' ones hold the papers' numbers; faults are reported with their lines."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result
from scipy.spatial.transform import Rotation

from command_line import invoke
from robot_cases import shipped
from winchkit.arrays import Array
from winchkit.errors import FileError
from winchkit.robot import ForceLimits, quadratic
from winchkit.schema.profiles.instruments import FrameSpec
from winchkit.schema.read import read_robot

PAPERS = ("cabtive", "ipanema3", "winding-device-8")
HEAD = """\
schema = 1
kind = "robot"
[platform]
mass = "10 kg"
center_of_mass = ["0 mm", "0 mm", "-50 mm"]
[home]
position = ["0 m", "0 m", "1 m"]
"""
CORNERS = ((1, 1), (-1, 1), (-1, -1), (1, -1))


def line(name: str, x: float, y: float, z: float = 3.0, side: float = 0.1) -> str:
    return f"""\
[[line]]
name = "{name}"
exit_point = ["{2 * x:g} m", "{2 * y:g} m", "{z:g} m"]
anchor_point = ["{0.2 * x:g} m", "{0.2 * y:g} m", "{side:g} m"]
winch = "bench-spiral"
"""


FOUR = HEAD + "".join(line(str(n + 1), *corner) for n, corner in enumerate(CORNERS))
EIGHT = FOUR + "".join(
    line(str(n + 5), 0.9 * x, 1.1 * y, side=-0.1) for n, (x, y) in enumerate(CORNERS)
)
INSIDE = (
    FOUR.replace('"3 m"]', '"1.1 m"]', 1)
    .replace('["2 m", "2 m"', '["0.195 m", "0.2 m"')
    .replace("winch", 'swivel_radius = "20 mm"\nwinch', 1)
)
Check = Callable[[str], Result]


@pytest.fixture
def check(tmp_path: Path) -> Check:
    def run(text: str) -> Result:
        file = tmp_path / "robot.toml"
        file.write_text(text)
        return invoke("check", file)

    return run


@pytest.mark.parametrize("name", PAPERS)
def test_check_accepts_the_papers_robots_and_their_winches(name: str) -> None:
    folder = Path(__file__).parents[3] / "profiles"
    winch = {"winding-device-8": "winding-device"}.get(name, name) + "-winch.toml"
    result = invoke("check", folder / f"{name}.toml", folder / winch)
    assert result.exit_code == 0, result.stderr
    assert f"ok (robot '{name}')" in result.stdout
    assert result.stderr == ""


def test_cabtive_is_tables_2_and_3() -> None:
    robot = shipped("cabtive")
    geometry = robot.geometry
    np.testing.assert_allclose(geometry.exit_point[2], [-0.1414, 0.0562, 1.0914])
    np.testing.assert_allclose(geometry.exit_point[:, 0].sum(), 2.8824)
    np.testing.assert_allclose(geometry.exit_point[:, 1].sum(), 4.4727)
    np.testing.assert_allclose(geometry.exit_point[:, 2].sum(), 4.543)
    np.testing.assert_allclose(geometry.anchor_point[5], [-0.0273, 0.0961, -0.073])
    np.testing.assert_allclose(geometry.anchor_point.sum(axis=0), [0, 0, -0.584], atol=1e-12)
    np.testing.assert_allclose(geometry.swivel_radius, 8.6e-3)
    assert {winch.drum.winding_radius for winch in robot.winches} == {0.06}
    assert {winch.cable.diameter for winch in robot.winches} == {0.48e-3}
    assert robot.profile.prior["winding_radius"].bounds == pytest.approx((0.059, 0.061))


def test_ipanema3_is_table_1() -> None:
    robot = shipped("ipanema3")
    np.testing.assert_allclose(robot.geometry.exit_point[3], [-8.54, 5.46, 3.22])
    np.testing.assert_allclose(robot.geometry.anchor_point[6], [-0.09, -0.75, 0.26])
    np.testing.assert_allclose(robot.geometry.exit_point.sum(axis=0), [-2.01, 1.34, 10.66])
    np.testing.assert_allclose(robot.geometry.anchor_point.sum(axis=0), 0.0, atol=1e-12)


def test_the_winding_devices_robot_hangs_on_eight_cables() -> None:
    robot = shipped("winding-device-8")
    found = quadratic(
        robot.structure(robot.home)[0], robot.weight(robot.home)[0], ForceLimits(10.0, 1000.0)
    )
    assert found.feasible
    assert robot.profile.platform.mass * 9.80665 == pytest.approx(1000, abs=0.1)


@pytest.mark.parametrize("text", [FOUR, EIGHT], ids=["hanging", "held"])
def test_a_robot_of_ones_own_is_a_file(check: Check, text: str) -> None:
    result = check(text)
    assert result.exit_code == 0, result.stderr
    assert result.stderr == ""


def test_every_fault_of_the_file_with_its_line(tmp_path: Path) -> None:
    text = FOUR.replace('"-2 m", "2 m", "3 m"', '"-2 m", "2 mm", "3"').replace(
        'position = ["0 m", "0 m", "1 m"]', 'position = ["0 m", "0 m"]'
    )
    text = text.replace('mass = "10 kg"', 'mas = "10 kg"')
    text += 'swivel_radius = "-3 mm"\nswivel_axis = [0, 0, "up"]\n'
    file = tmp_path / "wrong.toml"
    file.write_text(text)
    with pytest.raises(FileError) as caught:
        read_robot(file)
    numbered = {fault.line for fault in caught.value.faults}
    wanted = [
        text[: text.index(word)].count("\n") + 1
        for word in ("mas =", "position =", '"2 mm", "3"', "swivel_radius", "swivel_axis")
    ]
    assert set(wanted) <= numbered


def test_an_exit_point_that_is_anothers_is_reported_on_its_own_line(tmp_path: Path) -> None:
    text = FOUR + line("5", -1, -1, side=0.2)
    file = tmp_path / "twice.toml"
    file.write_text(text)
    with pytest.raises(FileError, match=r"line\[5\]\.exit_point: is that of line 3") as caught:
        read_robot(file)
    assert text.splitlines()[(caught.value.faults[0].line or 0) - 1].startswith("exit_point")
    assert caught.value.faults[0].line == len(text.splitlines()) - 2


@pytest.mark.parametrize(
    ("text", "code", "words"),
    [
        (
            EIGHT.replace('"1 m"]', '"4 m"]'),
            3,
            "robot.toml:6: home: no pulling cables hold the platform of 10 kg there",
        ),
        (INSIDE, 3, "the anchor of line 1 lies inside its swivel pulley (swivel_radius 20 mm)"),
        (
            FOUR.replace("10 kg", "0 kg"),
            3,
            "4 lines leave the platform free, only its weight settles its pose; give mass",
        ),
        (
            EIGHT.replace("10 kg", "0 kg"),
            0,
            "without mass nothing keeps the cables taut; give mass (warning)",
        ),
    ],
    ids=["cables would push", "anchor inside a pulley", "hanging without mass", "held without"],
)
def test_a_robot_that_cannot_hold_its_platform(
    check: Check, text: str, code: int, words: str
) -> None:
    result = check(text)
    assert result.exit_code == code
    assert words in result.stderr


def test_a_hanging_platform_that_would_not_rest_at_home(check: Check) -> None:
    """A warning with the place at which it would: taken over, it is gone."""
    text = FOUR.replace('position = ["0 m", "0 m", "1 m"]', 'position = ["0.1 m", "0.1 m", "1 m"]')
    result = check(text)
    assert result.exit_code == 0
    assert "home: the platform does not rest there" in result.stderr
    told = result.stderr.split("hangs at ")[1].split(" (warning)")[0]
    position, rotation = told.split(", rotation = ")
    moved = text.replace('position = ["0.1 m", "0.1 m", "1 m"]', position, 1)
    moved = moved.replace("[[line]]", f"rotation = {rotation}\n[[line]]", 1)
    again = check(moved)
    assert again.exit_code == 0
    assert again.stderr == ""


def measured(turned: Rotation, place: Array) -> str:
    """A table with the frame through points, which a tracker saw from this pose."""
    own = {"origin": place, "x_point": place + turned.apply([2.0, 0.0, 0.3])}
    points = [f"{k} = [{', '.join(map(_metres, v))}]" for k, v in own.items()]
    up = ", ".join(map(repr, turned.apply([0, 0, 1]).tolist()))
    return f"[instrument.tracker]\nframe = {{ {', '.join(points)}, up = [{up}] }}\n"


def _metres(value: float) -> str:
    return f'"{float(value)!r} m"'


def test_a_frame_through_measured_points_and_a_home_pose_as_the_tracker_showed_it(
    tmp_path: Path,
) -> None:
    turned, place = Rotation.from_euler("ZYX", [130, 2, -3], degrees=True), np.array([3.0, -1, 2])
    home = place + turned.apply([0.01, 0.02, 1.03])  # with a reflector beside the origin
    angles = ", ".join(f'"{a!r} rad"' for a in turned.as_euler("ZYX")[::-1].tolist())
    seen = f"position = [{', '.join(map(_metres, home))}]\nrotation = [{angles}]"
    text = FOUR.replace('position = ["0 m", "0 m", "1 m"]', f'frame = "tracker"\n{seen}')
    path = tmp_path / "robot.toml"
    path.write_text(text + measured(turned, place) + 'reflector = ["10 mm", "20 mm", "30 mm"]\n')
    profile = read_robot(path)
    frame = profile.instrument.tracker.frame
    assert isinstance(frame, FrameSpec)
    assert frame.position == pytest.approx(tuple(place))
    assert Rotation.from_euler("ZYX", frame.rotation[::-1]).as_matrix() == pytest.approx(
        turned.as_matrix()
    )
    assert profile.home.position == pytest.approx((0, 0, 1), abs=1e-12)
    assert profile.home.rotation == pytest.approx((0, 0, 0), abs=1e-12)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        (
            'frame = { origin = ["0 m", "0 m", "0 m"], x_point = ["0 m", "1 mm", "2 m"] }',
            "gives no x axis",
        ),
        ('frame = { origin = ["0 m", "0 m", "0 m"] }', "measured points"),
        ('frame = "unknown"', "home.frame: needs the frame and the reflector"),
    ],
)
def test_points_that_give_no_frame(check: Check, table: str, words: str) -> None:
    text = FOUR.replace("[home]", '[home]\nframe = "tracker"')
    result = check(f"{text}\n[instrument.tracker]\n{table}\n")
    assert result.exit_code == 3
    assert words in result.stderr


@pytest.mark.parametrize(("third", "code"), [("0.7 kg m^2", 0), ("0.8 kg m^2", 3)])
def test_no_body_has_a_moment_above_the_sum_of_the_others(
    check: Check, third: str, code: int
) -> None:
    moments = f'inertia = ["0.3 kg m^2", "0.4 kg m^2", "{third}"]\n'
    result = check(FOUR.replace("[home]", f"{moments}[home]"))
    assert result.exit_code == code, result.stderr
    assert ("above the sum" in result.stderr) == (code == 3)
