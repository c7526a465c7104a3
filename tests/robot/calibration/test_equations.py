"""Every derivative against finite differences, the reduced step against the whole one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from calibration_cases import elastic_rows, held, measured, robot, rows
from robot_poses.truth import csv
from winchkit.arrays import Array
from winchkit.effects import load_catalogue
from winchkit.model.drum import drum_of
from winchkit.robot import Pose, rotation_of
from winchkit.robot.calibration.calibrate import calibrate, equations_of
from winchkit.robot.calibration.options import Options
from winchkit.robot.calibration.selection import with_instruments
from winchkit.robot.forces.elongation import strain_of
from winchkit.robot.geometry.constraints import winding_of
from winchkit.robot.identification.bundle_adjustment import BundleState, moved
from winchkit.robot.identification.equations import RobotEquations
from winchkit.robot.identification.instruments import declared_instruments
from winchkit.robot.identification.parameters import LAWS
from winchkit.schema.profiles.winch import DrumSpec, GearboxSpec, ReferenceSpec, WinchProfile

FEW = 6


def equations(
    *effects: str, middle_force: float | None = None
) -> tuple[RobotEquations, BundleState]:
    """Everything measured at a few poses, and a state a little off."""
    text = csv(
        elastic_rows(FEW, 3), angles=True, swivel=True, length=True, tension=middle_force is None
    )
    found = measured(text)
    angles = found.angles.copy()
    angles[0, 2], angles[1, 0] = np.nan, np.nan
    made = equations_of(
        robot(), replace(found, angles=angles), Options(effects, middle_force=middle_force)
    )
    rng = np.random.default_rng(0)
    scale = made.parameters.std
    values = made.parameters.nominal + 0.3 * scale * np.abs(rng.normal(size=len(scale)))
    true = [row.angles for row in elastic_rows(FEW, 3)]
    turned = rotation_of(*(np.array(true) + 0.01 * rng.normal(size=(FEW, 3))).T)
    return made, BundleState(values, Pose(found.position + 1e-3, turned))


def residuals(made: RobotEquations, state: BundleState) -> dict[str, Array]:
    return {rows.kind: rows.residual for rows in made.rows(state)}


def slopes(made: RobotEquations, state: BundleState, k: int, size: float) -> dict[str, Array]:
    """Differences of the residuals over twice a step of the parameter k, divided by them."""
    step = np.zeros(len(state.values))
    step[k] = size
    up, down = (
        residuals(made, BundleState(state.values + change, state.pose)) for change in (step, -step)
    )
    return {kind: (up[kind] - down[kind]) / (2 * size) for kind in up}


@pytest.mark.slow
@pytest.mark.parametrize(
    "effects",
    [
        ("cable-elongation-linear",),
        ("cable-elongation-quartic",),
        ("cable-elongation-exponential", "payload-mass", "payload-centre"),
        ("home-length",),
        ("gear-ratio",),
        ("gear-ratio/3",),
    ],
)
def test_derivatives_are_those_of_the_residuals(effects: tuple[str, ...]) -> None:
    made, state = equations(*effects)
    kinds = {"closure", "position", "rotation", "swivel", "cable_length"}
    assert kinds <= set(made.kinds)
    derived = {r.kind: r.by_values for r in made.rows(state) if r.by_values is not None}
    assert len(derived) > 1
    for k in np.flatnonzero(made.parameters.free):
        std = made.parameters.std[k]
        slope = slopes(made, state, k, 1e-3 * std)
        for kind, by_values in derived.items():
            # Forces by geometry are left out of the balance's derivatives, by design.
            if kind == "balance" and not made.parameters.all[k].name.startswith("payload"):
                continue
            own = by_values[..., k] * std
            np.testing.assert_allclose(own, slope[kind] * std, rtol=1e-5, atol=1e-8)


def test_derivatives_by_the_pose_are_those_of_the_residuals() -> None:
    made, state = equations("cable-elongation-linear")
    for rows_ in made.rows(state):
        for k in range(6):
            step = np.zeros((FEW, 6))
            step[:, k] = 1e-6
            up = residuals(made, moved(state, state.values, step))[rows_.kind]
            down = residuals(made, moved(state, state.values, -step))[rows_.kind]
            # A whole rotation's residual is a few mrad: its derivative is the unit matrix to that.
            loose = 0.02 if rows_.kind == "rotation" else 1e-6
            np.testing.assert_allclose(
                np.where(np.isfinite(up), rows_.by_pose[..., k], np.nan),
                (up - down) / 2e-6,
                rtol=1e-5,
                atol=loose,
            )


def test_computed_forces_change_strain_by_the_payload_as_they_should() -> None:
    made, state = equations(
        "cable-elongation-linear", "payload-mass", "payload-centre", middle_force=40.0
    )
    block = made.parameters.block
    closure = next(r for r in made.rows(state) if r.kind == "closure")
    assert closure.by_values is not None
    for k in (*block["payload_mass"], *block["payload_centre"]):
        slope = slopes(made, state, k, 1e-4)["closure"]
        np.testing.assert_allclose(closure.by_values[..., k], slope, rtol=1e-4, atol=1e-9)


def test_the_reduced_fit_is_the_minimum_of_the_whole_one() -> None:
    """A dense least-squares step over all poses and parameters moves nothing any more."""
    few = measured(csv(rows(12, 5)))
    options = Options(sigma={"closure": 6e-6, "position": 2e-5})
    free = replace(robot(), profile=replace(robot().profile, prior={}))
    found = calibrate(free, few, held(), options)
    equations_, state = found.equations, found.solution.state
    scale = equations_.parameters.std
    count, many = len(scale), len(few)
    blocks, right = [], []
    for rows_ in equations_.rows(state):
        sigma = found.weights.sigma[rows_.kind]
        for j in range(many):
            block = np.zeros((rows_.residual.shape[1], count + 6 * many))
            if rows_.by_values is not None:
                block[:, :count] = rows_.by_values[j] * scale / sigma
            block[:, count + 6 * j : count + 6 * j + 6] = rows_.by_pose[j] / sigma
            blocks.append(block)
            right.append(rows_.residual[j] / sigma)
    prior = np.zeros((count, count + 6 * many))
    prior[:, :count] = np.eye(count)
    blocks.append(prior)
    shift = state.values - equations_.parameters.nominal
    right.append(np.divide(shift, scale, out=np.zeros(count), where=scale > 0))
    whole = np.concatenate(blocks)
    step = np.linalg.lstsq(whole, -np.concatenate(right), rcond=None)[0]
    posterior = np.linalg.inv(whole.T @ whole)[:count, :count]
    std = np.sqrt(np.diagonal(posterior)) * scale
    np.testing.assert_allclose(found.observed.std[scale > 0], std[scale > 0], rtol=1e-4)
    assert np.max(np.abs(step[:count] * scale)[scale > 0] / std[scale > 0]) < 0.02


def winch(drum: DrumSpec) -> WinchProfile:
    return WinchProfile(
        "w", drum, ReferenceSpec(motor_angle=0.7, wound_turns=4.2), GearboxSpec(3.0, -1)
    )


DRUMS = [
    DrumSpec("spiral", 0.06, layer_growth=5e-4),
    DrumSpec("archimedean", 0.05, layer_growth=4e-4),
    DrumSpec("grooved", 0.04, groove_pitch=6e-3),
    DrumSpec("squared", 0.03, build_up=2e-5),
]


@given(
    st.lists(st.floats(-60.0, 60.0), min_size=1, max_size=5),
    st.floats(0.9, 1.1),
    st.floats(0.5, 2.0),
)
def test_winding_is_the_drums_own_at_any_radius_and_growth(
    angles: list[float], wider: float, thicker: float
) -> None:
    winches = [winch(drum) for drum in DRUMS]
    angle = np.array(angles)
    made = winding_of(winches, np.repeat(angle[:, None], 4, axis=1))
    radius = np.array([drum.winding_radius for drum in DRUMS]) * wider
    growth = 5e-4 * thicker
    wound = made.wound(radius, growth)
    for i, drum in enumerate(DRUMS):
        layered = drum.kind in {"spiral", "archimedean"}
        changed = replace(
            drum, winding_radius=float(radius[i]), layer_growth=growth if layered else None
        )
        law, home = drum_of(winch(changed)), np.asarray(2 * np.pi * 4.2)
        turned = -(angle - 0.7) / 3.0
        np.testing.assert_allclose(
            wound[:, i], law.wound(home + turned) - law.wound(home), rtol=1e-9, atol=1e-12
        )


@pytest.mark.parametrize(
    ("law", "values"),
    [
        ("cable-elongation-linear", [5e-6]),
        ("cable-elongation-quartic", [5e-6, 80.0, 2e4, 1e7]),
        ("cable-elongation-exponential", [2e-3, 150.0]),
    ],
)
def test_strain_is_that_of_the_catalogue(law: str, values: list[float]) -> None:
    """The catalogue's effects for winches solve the same laws in another way."""
    tension = np.array([-5.0, 0.0, 12.0, 80.0, 400.0])
    strain, by = strain_of(law, np.array(values), tension)
    names = {p.name: 1 / v if p.reciprocal else v for p, v in zip(LAWS[law], values, strict=True)}

    class Ropes:
        stressed_length = np.ones(5)
        tension = np.maximum(np.array([-5.0, 0.0, 12.0, 80.0, 400.0]), 0.0)

    effect = load_catalogue()[law]
    np.testing.assert_allclose(strain, effect.apply(np.zeros(5), Ropes(), names), atol=1e-12)
    for k, value in enumerate(values):
        step = np.zeros(len(values))
        step[k] = 1e-5 * value
        up, down = (strain_of(law, np.array(values) + s * step, tension)[0] for s in (1, -1))
        np.testing.assert_allclose(by[:, k], (up - down) / (2e-5 * value), rtol=1e-6, atol=1e-14)


def test_gains_of_cells_and_scales_of_counters_have_the_derivatives_of_their_residuals() -> None:
    made, state = equations()
    own = declared_instruments(made.robot, made.measured)
    made = with_instruments(made, replace(own, free=frozenset({"cell_gain", "length_scale"})))
    values = made.parameters.nominal
    values[made.parameters.block["cell_gain"]] = 0.02
    values[made.parameters.block["length_scale"]] = -0.01
    state = BundleState(values, state.pose)
    for block in ("cell_gain", "length_scale", "length_offset"):
        for k in made.parameters.block[block]:
            by_difference = slopes(made, state, k, 1e-6)
            for rows_ in made.rows(state):
                slope = np.nan_to_num(by_difference[rows_.kind])
                found = np.zeros_like(slope) if rows_.by_values is None else rows_.by_values[..., k]
                np.testing.assert_allclose(np.nan_to_num(found), slope, rtol=1e-6, atol=1e-6)
