"""The MuJoCo model of an axis or a winch moves as ``forward``."""

from __future__ import annotations

from math import atan2
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from simulated_profiles import AXIS, GRAVITY, MASS, WINCH, profile_of, torque_run
from winchkit import export_model, forward
from winchkit.dynamics.mjcf import mjcf
from winchkit.effects.bind import terms_of
from winchkit.errors import UsageError

LEVERS = {
    "spring-balancer": 'stiffness = "0.3 N m/rad"\ntorque = "0.4 N m"',
    "joint-gravity": 'amplitude = "0.6 N m"\nphase = "0.3 rad"',
    "drum-unbalance": 'amplitude = "0.6 N m"\nphase = "0.3 rad"',
    "joint-payload": 'lever = "0.2 m"\nphase = "0.3 rad"',
}


@pytest.mark.parametrize("gear", [1, -1, 5, -5])
@pytest.mark.parametrize("effect", LEVERS)
def test_attributes_of_the_joint_move_it_as_forward(tmp_path: Path, effect: str, gear: int) -> None:
    """By MuJoCo's documented law of a joint: (armature + m r²) q'' = gear τ − damping q' −
    stiffness (q − springref) + weight."""
    box = f"\n[gearbox]\nratio = {abs(gear)}\ndirection = {1 if gear > 0 else -1}\n"
    friction = ("motor-viscous", 'viscosity = "0.05 N m s"')
    profile = profile_of(tmp_path, AXIS + box, (effect, LEVERS[effect]), friction)
    torque, mass = 0.8 * np.sin(2 * np.arange(0, 3, 0.01)), None
    if effect == "joint-payload":
        mass = MASS / 3
    run = forward(profile, torque=torque_run(torque), load_mass=mass, initial_speed=0.0)
    tree = ElementTree.fromstring(export_model(profile, "mjcf", load_mass=mass).text)
    (joint,) = tree.iter("joint")
    (inertial,) = tree.iter("inertial")
    (motor,) = tree.iter("motor")
    own = {name: float(text) for name, text in joint.attrib.items() if name not in JOINT}
    heavy, (x, _, z) = float(inertial.attrib["mass"]), map(float, inertial.attrib["pos"].split())
    turned, far = atan2(x, -z), np.hypot(x, z)

    def rates(time: float, state: tuple[float, float]) -> tuple[float, float]:
        q, rate = state
        pulled = float(motor.attrib["gear"]) * np.interp(time, run.time, torque)
        pulled -= own["damping"] * rate - heavy * GRAVITY * far * np.sin(turned - q)
        pulled -= own.get("stiffness", 0.0) * (q - own.get("springref", 0.0))
        return rate, pulled / (own["armature"] + heavy * far**2)

    found = solve_ivp(
        rates, (0, run.time[-1]), (0.0, 0.0), t_eval=run.time, rtol=1e-8, atol=1e-10, max_step=0.01
    )
    np.testing.assert_allclose(gear * found.y[0], run["motor_angle"], atol=1e-5)


JOINT = {"name", "type", "axis", "solreffriction"}


def test_a_load_is_refused_where_it_has_no_meaning(tmp_path: Path) -> None:
    axis = profile_of(tmp_path, AXIS)
    with pytest.raises(UsageError, match="is an axis without a cable"):
        export_model(axis, "mjcf", load_mass=MASS)
    with pytest.raises(UsageError, match="leave the load mass out"):
        export_model(profile_of(tmp_path, WINCH), "c", load_mass=MASS)
    lever = profile_of(tmp_path, AXIS, ("joint-payload", LEVERS["joint-payload"]))
    with pytest.raises(UsageError, match="'joint-payload' needs the load: give --load-mass"):
        export_model(lever, "mjcf")


def test_a_constant_torque_has_no_counterpart(tmp_path: Path) -> None:
    held = profile_of(tmp_path, AXIS, ("spring-balancer", 'torque = "0.4 N m"'))
    assert export_model(held, "mjcf").missing == ("spring-balancer",)


@pytest.mark.parametrize("case", ["pendulum", "winch"])
def test_mujoco_moves_as_forward(tmp_path: Path, case: str) -> None:
    """A pendulum with dry friction, and a hanging load on a layered drum: 0.1 % of the motion."""
    mujoco = pytest.importorskip("mujoco")
    if case == "pendulum":
        profile = profile_of(
            tmp_path, AXIS,
            ("joint-gravity", 'amplitude = "2 N m"\nphase = "0.3 rad"'),
            ("drum-unbalance", 'amplitude = "0.5 N m"\nphase = "-1 rad"'),
            ("motor-coulomb", 'torque = "0.05 N m"'),
            ("motor-viscous", 'viscosity = "0.02 N m s"'),
        )  # fmt: skip
        torque, mass = 0.8 * np.sin(2 * np.arange(0, 5, 0.01)), None
    else:
        drum = 'kind = "archimedean"\nwinding_radius = "50 mm"\nlayer_growth = "2 mm"'
        text = WINCH.replace(
            'kind = "grooved"\nwinding_radius = "50 mm"\ngroove_pitch = "0 mm"', drum
        )
        profile = profile_of(
            tmp_path, text,
            ("motor-coulomb", 'torque = "0.02 N m"'), ("motor-viscous", 'viscosity = "1 mN m s"'),
        )  # fmt: skip
        torque, mass = 0.5 + 0.1 * np.sin(2 * np.arange(0, 4, 0.01)), MASS
    run = forward(profile, torque=torque_run(torque), load_mass=mass, initial_speed=0.0)
    text, missing = mjcf(profile, terms_of(profile), mass)
    assert not missing
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    angle = [0.0]
    for now in run.time[1:]:
        while data.time < now - model.opt.timestep / 2:
            data.ctrl[0] = np.interp(data.time, run.time, torque)
            mujoco.mj_step(model, data)
        angle.append(data.joint("machine").qpos[0] * profile.gearbox.ratio)
    assert np.max(np.abs(angle - run["motor_angle"])) < 1e-3 * np.ptp(run["motor_angle"])


def test_a_profile_without_masses_is_refused(tmp_path: Path) -> None:
    bare = profile_of(tmp_path, AXIS.partition("[motor]")[0])
    with pytest.raises(UsageError, match="no mass that MuJoCo could move"):
        mjcf(bare, [])
    winch = profile_of(tmp_path, WINCH)
    with pytest.raises(UsageError, match="give --load-mass"):
        mjcf(winch, terms_of(winch))
