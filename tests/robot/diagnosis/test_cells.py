"""Cable forces behind what a robot's cells show, whatever the cells do to them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from robot_poses.cases import CASES
from robot_poses.hidden import profile_text, record
from winchkit.effects import Term, load_catalogue
from winchkit.effects.placement import at_line
from winchkit.robot import robot_with_terms
from winchkit.robot.diagnosis.adjustment import equations_of, geometry_parameters
from winchkit.robot.diagnosis.dataset import prepare_poses
from winchkit.runs import read_run
from winchkit.schema.read import read_robot


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        ("cell-gain", {"gain_error": 0.04}),
        ("cell-gain", {"gain_error": 2.0}),
        ("cell-gain", {"gain_error": -0.6}),
        ("cell-offset", {"offset": 12.0}),
        ("cell-nonlinearity", {"quadratic": 300.0}),
    ],
)
def test_a_force_is_what_the_cell_would_show_as_measured(
    effect: str, values: dict[str, float], tmp_path: Path
) -> None:
    """Against the effects' formulas: (1 + g) T, T + o, T + q (T/500 N)²."""
    path = tmp_path / "robot.toml"
    path.write_text(profile_text())
    profile = read_robot(path)
    run = record(CASES[0], tmp_path, "poses.csv", count=12, repeats=0)
    dataset = prepare_poses([read_run(run)], profile)
    term = Term(at_line(load_catalogue()[effect], "2"), values)
    robot = robot_with_terms(profile, [term])
    geometry = geometry_parameters(dataset)
    force = equations_of(dataset, geometry).forces(geometry.nominal, robot)
    t, shown = force[:, 1], dataset.measured.tension
    said = {
        "cell-gain": t * (1 + values.get("gain_error", 0.0)),
        "cell-offset": t + values.get("offset", 0.0),
        "cell-nonlinearity": t + values.get("quadratic", 0.0) * (t / 500.0) ** 2,
    }[effect]
    assert np.allclose(said, shown[:, 1], rtol=0, atol=1e-6)
    assert np.array_equal(np.delete(force, 1, axis=1), np.delete(shown, 1, axis=1))


@pytest.mark.filterwarnings("error")
def test_a_characteristic_that_never_shows_the_reading_gives_finite_forces(tmp_path: Path) -> None:
    """T − 5 kN (T/500 N)² has its extremum of 12.5 N at 25 N: no force shows more."""
    path = tmp_path / "robot.toml"
    path.write_text(profile_text())
    profile = read_robot(path)
    dataset = prepare_poses([read_run(record(CASES[0], tmp_path, "p.csv", count=12))], profile)
    assert np.nanmin(dataset.measured.tension[:, 1]) > 12.5
    term = Term(at_line(load_catalogue()["cell-nonlinearity"], "2"), {"quadratic": -5000.0})
    geometry = geometry_parameters(dataset)
    robot = robot_with_terms(profile, [term])
    force = equations_of(dataset, geometry).forces(geometry.nominal, robot)
    assert np.isfinite(force[:, 1]).all()
    assert np.abs(force[:, 1]).max() < 20 * np.nanmax(dataset.measured.tension[:, 1])
