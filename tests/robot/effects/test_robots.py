"""Effects that only a robot can have, and winches' effects on a robot's lines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from effect_lines import CATALOGUE, ROBOT_EFFECTS
from winchkit.effects import Effect, Term
from winchkit.effects.card import usual_values
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.placement import at_line, placements
from winchkit.errors import FileError
from winchkit.robot import robot_of, robot_with_effects, robot_with_terms, wrap_angle
from winchkit.robot.effects.bind import check_robot, robot_terms
from winchkit.robot.effects.reference import STANDARD_ROBOT, robot_changes, standard_poses
from winchkit.schema.read import read_robot

every = pytest.mark.parametrize("effect", ROBOT_EFFECTS, ids=lambda e: e.id)
INTERFACE = {
    "exit-point": {"x": "m", "y": "m", "z": "m"},
    "anchor-point": {"x": "m", "y": "m", "z": "m"},
    "swivel-radius": {"radius_error": "m"},
    "home-length": {"length": "m"},
    "payload-mass": {"mass_error": "kg"},
    "payload-centre": {"x": "m", "y": "m", "z": "m"},
    "tracker-frame": {"x": "m", "y": "m", "z": "m", "rx": "rad", "ry": "rad", "rz": "rad"},
    "reflector-offset": {"x": "m", "y": "m", "z": "m"},
    "tracker-scale": {"scale_error": "1"},
    "imu-mounting": {"rx": "rad", "ry": "rad", "rz": "rad"},
}
WINCH = """
[line.winch.drum]
kind = "spiral"
winding_radius = "60 mm"
[line.winch.cable]
diameter = "1 mm"
[line.winch.gearbox]
ratio = 20.0
[line.winch.reference]
wound_turns = 4.0
"""


def robot_file(folder: Path, *effects: str) -> Path:
    lines = "".join(
        f'[[line]]\nname = "{i}"\nexit_point = ["{i} m", "0 m", "2 m"]\n'
        f'anchor_point = ["{i / 10} m", "0 m", "0 m"]\n{WINCH}'
        for i in range(1, 5)
    )
    head = 'schema = 1\nkind = "robot"\n[platform]\nmass = "5 kg"\n'
    home = '[home]\nposition = ["2.5 m", "0 m", "1 m"]\n'
    path = folder / "four.toml"
    path.write_text(head + home + lines + "".join(f"[[effect]]\n{e}\n" for e in effects))
    return path


def test_every_effect_of_a_robot_is_there_with_its_parameters() -> None:
    found = {e.id: {p.name: p.unit for p in e.parameters} for e in ROBOT_EFFECTS}
    assert found == INTERFACE
    assert all(p.null == 0 for e in ROBOT_EFFECTS for p in e.parameters)
    assert all(e.needs[0] == "robot" and e.on_robot for e in ROBOT_EFFECTS)


@every
def test_it_vanishes_exactly_at_its_null(effect: Effect) -> None:
    assert robot_changes(effect, effect.null)[1] == {}


@every
def test_it_changes_the_output_that_it_declares_and_no_other(effect: Effect) -> None:
    assert set(robot_changes(effect, usual_values(effect))[1]) >= set(effect.outputs)


@every
def test_its_slope_at_null_agrees_with_its_secant(effect: Effect) -> None:
    output = effect.outputs[0]
    for usual_step in Coordinates(effect).usual_steps():
        whole = robot_changes(effect, effect.null | usual_step)[1][output]
        small = robot_changes(effect, effect.null | {n: v * 1e-3 for n, v in usual_step.items()})[1]
        assert np.allclose(1e3 * small[output], whole, rtol=0.03, atol=3e-3 * np.abs(whole).max())


def test_a_swivel_radius_does_what_the_paper_says() -> None:
    """ΔL = δr (wrap − sin wrap) at the pose, the same at home taken off."""
    _, changes = robot_changes(CATALOGUE["swivel-radius"], {"radius_error": 1e-7})
    robot = robot_of(STANDARD_ROBOT)

    def gain(pose: object) -> np.ndarray:
        wrap = wrap_angle(robot.geometry, pose.position, pose.rotation)[:, 0]  # type: ignore[attr-defined]
        return 1e-7 * (wrap - np.sin(wrap))

    expected = gain(robot.home) - gain(standard_poses())
    assert np.allclose(changes["cable_length"], expected, rtol=0, atol=2e-12)


def test_a_fixed_point_has_no_swivel_radius_to_be_wrong(tmp_path: Path) -> None:
    profile = read_robot(robot_file(tmp_path))
    term = Term(at_line(CATALOGUE["swivel-radius"], "1"), {"radius_error": 1e-3})
    moved, bare = robot_with_terms(profile, [term]), robot_of(profile)
    assert np.array_equal(moved.home_length, bare.home_length)


def test_a_payload_moves_tensions_as_its_moment_asks() -> None:
    """A centre moved by δ: the moments of all force changes add up to R δ × m g."""
    robot = robot_of(STANDARD_ROBOT)
    pose = standard_poses()
    shifted = Term(CATALOGUE["payload-centre"], {"x": 0.01, "y": 0.0, "z": 0.0})
    heavier = robot_with_terms(STANDARD_ROBOT, [shifted])
    extra = heavier.weight(pose) - robot.weight(pose)
    down = np.array([0.0, 0.0, -3.0 * 9.80665])
    expected = np.cross(pose.rotation @ np.array([0.01, 0.0, 0.0]), down)
    assert np.allclose(extra[:, :3], 0.0)
    assert np.allclose(extra[:, 3:], expected)


def test_a_table_acts_on_its_line_or_on_all(tmp_path: Path) -> None:
    path = robot_file(
        tmp_path,
        'id = "exit-point"\nline = "2"\nx = "4 mm"',
        'id = "home-length"\nlength = { 1 = "1 mm", 3 = "-2 mm" }',
        'id = "home-length"\nline = "4"\nlength = "3 mm"',
        'id = "cable-elongation-linear"\naxial_stiffness = "20 kN"',
        'id = "drum-radius"\nline = "1"\nradius_error = "1 mm"',
        'id = "payload-mass"\nmass_error = "0.5 kg"',
    )
    robot, bare = robot_with_effects(read_robot(path)), robot_of(read_robot(path))
    assert robot.geometry.exit_point[1, 0] == pytest.approx(2.004)
    assert robot.platform.mass == 5.5
    unmoved = [0, 2, 3]
    gained = robot.home_length - bare.home_length
    assert gained[unmoved] == pytest.approx([1e-3, -2e-3, 3e-3])
    angle = np.full((1, 4), 10.0)
    slack, tight = robot.lengths_at(angle), robot.lengths_at(angle, tension=100.0)
    assert (tight - slack) == pytest.approx(slack * 100.0 / 20e3, rel=1e-9)
    wound = (bare.lengths_at(angle) - bare.home_length) - (slack - robot.home_length)
    assert wound[0] == pytest.approx([1e-3 * 10 / 20, 0, 0, 0], abs=1e-12)


def test_every_fault_of_a_robots_effects_is_reported_with_its_line(tmp_path: Path) -> None:
    profile = read_robot(
        robot_file(
            tmp_path,
            'id = "exit-point"\nx = "4 mm"',
            'id = "exit-point"\nline = "9"\nx = "4 mm"',
            'id = "payload-mass"\nline = "1"\nmass_error = "1 kg"',
            'id = "pulley-coulomb"\nfriction = 0.02',
            'id = "exit-pont"\nline = "1"',
            'id = "swivel-radius"\nline = "1"\nradius = "1 mm"',
            'id = "home-length"\nline = "1"\nlength = "1 mm"',
            'id = "home-length"\nline = "1"\nlength = "2 mm"',
        )
    )
    told = "\n".join(map(str, check_robot(profile)))
    for words in (
        "this effect acts on one line",
        "no line '9'",
        "acts on the robot as a whole",
        "acts in motion only",
        "did you mean 'exit-point'",
        "unknown key; it has radius_error",
        "is declared twice for one line or for all",
    ):
        assert words in told
    assert all(fault.line for fault in check_robot(profile))
    with pytest.raises(FileError):
        robot_terms(profile)


def test_a_winch_cannot_have_an_effect_of_robots(tmp_path: Path) -> None:
    from winchkit.effects import check_profile
    from winchkit.schema.read import read_profile

    path = tmp_path / "winch.toml"
    path.write_text(
        'schema = 1\nkind = "winch"\n[drum]\nkind = "spiral"\nwinding_radius = "60 mm"\n'
        'layer_growth = "1 mm"\n'
        "[gearbox]\nratio = 1.0\n[reference]\nwound_turns = 1.0\n"
        '[[effect]]\nid = "home-length"\nlength = "1 mm"\n'
    )
    assert "is an effect of a robot" in str(check_profile(read_profile(path))[0])


def test_placements_are_those_that_an_effect_declares() -> None:
    names = ("1", "2")
    found = {e.id for effect in CATALOGUE for e in placements(effect, names)}
    assert {"exit-point/1", "exit-point/2", "payload-mass", "layer-thickness"} <= found
    assert {"cable-elongation-linear", "cable-elongation-linear/1"} <= found
    assert not {"exit-point", "layer-thickness/1", "pulley-coulomb", "cell-gain"} & found


@pytest.mark.parametrize("strained", [False, True])
def test_motor_angles_and_lengths_are_inverse_with_effects(strained: bool) -> None:
    terms = [
        Term(at_line(CATALOGUE["home-length"], "1"), {"length": 2e-3}),
        Term(at_line(CATALOGUE["drum-eccentricity"], "3"), {"eccentricity": 3e-4, "phase": 0.4}),
        Term(CATALOGUE["layer-thickness"], {"thickness_error": 1e-4}),
        Term(CATALOGUE["cable-elongation-linear"], {"axial_stiffness": 2e4}),
    ]
    robot = robot_with_terms(STANDARD_ROBOT, terms)
    tension = np.linspace(20, 60, 8) if strained else 0.0
    pose = standard_poses()
    angles = robot.motor_angles(pose, tension=tension)
    assert np.allclose(robot.lengths_at(angles, tension), robot.lengths(pose), rtol=0, atol=1e-10)


def test_a_robot_that_knows_its_effects_finds_its_platform() -> None:
    """Position error of control before and after: the same angles read by both models."""
    home = Term(at_line(CATALOGUE["home-length"], "2"), {"length": 3e-3})
    rope = Term(CATALOGUE["cable-elongation-linear"], {"axial_stiffness": 2e4})
    truth = robot_with_terms(STANDARD_ROBOT, [home, rope])
    pose, tension = standard_poses(), np.linspace(20, 60, 8)
    angles = truth.motor_angles(pose, tension=tension)
    errors = {
        name: np.linalg.norm(
            robot.poses_at(angles, pose, tension).pose.position - pose.position, axis=1
        )
        for name, robot in (("before", robot_of(STANDARD_ROBOT)), ("after", truth))
    }
    assert np.sqrt(np.mean(errors["before"] ** 2)) > 5e-4
    assert errors["after"].max() < 1e-8
