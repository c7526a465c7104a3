"""Motion and cable forces of a platform are those of MuJoCo: benchmarks/robot_mujoco.py, small."""

from __future__ import annotations

import pytest

from robot_mujoco import CASES, FIGURES, LIMIT, Case, compared


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.profile)
def test_a_random_trajectory_is_that_of_mujoco(case: Case) -> None:
    pytest.importorskip("mujoco")
    found = compared(case, [31, 0], duration=1.5)
    assert all(float(found[name]) < LIMIT for name in FIGURES), found
    assert float(found["least_force_N"]) > 0
    assert float(found["largest_displacement_m"]) > 0.02
