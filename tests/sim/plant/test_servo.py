"""The drive's inner loops are the same whatever portions time comes in."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from plant_benches import GRAVITY, SPIRAL, plant
from winchkit.sim.plant.plant import WinchPlant
from winchkit.sim.plant.servo import DriveCommand, Servo


def test_two_lags_as_an_ode_solver_has_them() -> None:
    goal, lag = 3.0, 0.004

    def slopes(_: float, state: np.ndarray) -> list[float]:
        return [(goal - state[0]) / lag, (state[0] - state[1]) / lag]

    truth = solve_ivp(slopes, (0.0, 0.02), [0.0, -1.0], rtol=1e-10, atol=1e-12, dense_output=True)
    servo, speed, time = Servo(), -1.0, 0.0
    for dt in (0.001, 0.0003, 0.0007, 0.005, 0.00001, 0.012):
        acceleration = servo.acceleration(
            DriveCommand(speed=goal), angle=0.0, speed=speed, idle_torque=0.0, inertia=1.0, dt=dt
        )
        speed += dt * acceleration
        time += dt
        assert speed == pytest.approx(truth.sol(time)[1], abs=1e-8)


@pytest.mark.parametrize("portions", [(1e-3,), (1e-3 / 3, 2e-3 / 3), (2e-3 / 3, 1e-3 / 3), (1e-4,)])
def test_a_load_weighs_the_same_whatever_the_last_portion(portions: tuple[float, ...]) -> None:
    """A cell that converts in step with the portions would else read another mass."""
    winch, ramp, time = plant(SPIRAL, cable_length=3.0), 300.0, 0.0
    slopes = []
    while time < 0.3:
        for dt in portions:
            time += dt
            winch.advance(dt, DriveCommand(speed=ramp * time))
        slopes.append((winch.motor_velocity, winch.load / winch.load_mass - GRAVITY))
    settled = np.array(slopes[len(slopes) // 2 :])
    arm = settled[:, 1] / ramp
    # The cable's acceleration is the arm times the ramp, within what the arm itself changes.
    assert np.ptp(arm) < 0.01 * abs(arm.mean())
    assert abs(arm.mean()) == pytest.approx(abs(_arm(winch)), rel=0.01)


def _arm(winch: WinchPlant) -> float:
    before = (winch.motor_angle, winch.cable_length)
    winch.advance(0.01, DriveCommand(speed=90.0))
    return float((winch.cable_length - before[1]) / (winch.motor_angle - before[0]))
