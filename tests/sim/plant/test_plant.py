"""The plant: the nominal winch, virtual work, energy, the drive's loops, noise of the readings."""

from dataclasses import replace
from itertools import pairwise
from math import pi
from random import Random

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from plant_benches import GRAVITY, GROOVED, SPIRAL, cruise, hide, plant
from winchkit.errors import FileError, UsageError
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.simbench import HiddenSpec, NoiseSpec, WinchTruth
from winchkit.sim.plant.kinematics import Kinematics
from winchkit.sim.plant.plant import WinchPlant
from winchkit.sim.plant.sensors import GaussianNoise, Measurement
from winchkit.sim.plant.servo import DriveCommand, Servo
from winchkit.sim.schedule import plan


def lift(
    winch: WinchPlant, distance: float, sample: float = 0.01, speed: float = 100.0
) -> list[dict[str, float]]:
    """Follow an S-curve of the motor angle and note the truth on the way."""
    move = plan(distance, speed, 200.0, 800.0)
    start = winch.motor_angle
    rows = []
    count = int((move.duration + 0.5) / 1e-3)
    for step in range(1, count + 1):
        gone, now = move.at(step * 1e-3)
        winch.advance(1e-3, DriveCommand(angle=start + gone, speed=now))
        if step % round(sample / 1e-3) == 0:
            names = ("time", "motor_angle", "motor_torque", "tension", "load", "cable_length")
            rows.append({name: getattr(winch, name) for name in names})
    return rows


def column(rows: list[dict[str, float]], name: str) -> np.ndarray:
    return np.array([row[name] for row in rows])


@pytest.mark.parametrize("profile", [SPIRAL, GROOVED], ids=lambda p: p.name)
@pytest.mark.parametrize("direction", [1, -1])
def test_the_declared_winch_is_the_nominal_one(profile: WinchProfile, direction: int) -> None:
    profile = replace(profile, gearbox=replace(profile.gearbox, direction=direction))
    rows = lift(plant(profile, cable_length=3.0), direction * 300.0, sample=0.001)
    chain = Kinematics.of(profile)
    angle, time = column(rows, "motor_angle"), column(rows, "time")
    length = np.array([chain.cable_length(x) for x in angle])
    assert column(rows, "cable_length") == pytest.approx(length, abs=7e-6)
    assert length[-1] < 2.2
    assert column(rows, "tension") == pytest.approx(column(rows, "load"))
    # m (g − ℓ̈) over windows that are long beside a climb of the cable on the drum
    speed = np.gradient(length, time)
    window = 100
    mean = column(rows, "load")[1:].reshape(-1)[: len(rows) // window * window - window]
    mean = mean.reshape(-1, window).mean(axis=1)
    acceleration = (speed[window::window] - speed[:-window:window])[: len(mean)] / (window * 1e-3)
    assert mean[1:-1] == pytest.approx(20 * (GRAVITY - acceleration)[1:-1], abs=0.6)


@pytest.mark.parametrize(
    "hidden",
    [
        hide("fat drum", radius_error="1 mm"),
        hide("wrong ratio", ratio_error="1 %"),
        hide("eccentric drum", eccentricity="2 mm"),
        hide("five-cornered drum", amplitude="1 mm"),
        hide("guide offset", offset="0.1 m", mismatch="5 mm"),
        hide("wavy gear", amplitude="0.01 rad", order=2),
    ],
    ids=lambda spec: spec.physics,
)
def test_virtual_work(hidden: HiddenSpec) -> None:
    """Every kinematic error shows in the torque as the derivative of the length."""
    winch = plant(GROOVED, hidden)
    rows = lift(winch, 30.0, sample=0.001, speed=15.0)
    for before, here, after in zip(rows[:-2:37], rows[1:-1:37], rows[2::37], strict=False):
        turned = after["motor_angle"] - before["motor_angle"]
        if turned < 0.01:
            continue
        arm = -(after["cable_length"] - before["cable_length"]) / turned
        assert here["motor_torque"] == pytest.approx(arm * here["tension"], rel=2e-4)


@pytest.mark.parametrize(
    "hidden",
    [(), (hide("elastic rope"),), (hide("soft frame"), hide("eccentric drum"))],
    ids=["rigid", "elastic", "soft"],
)
def test_energy(hidden: tuple[HiddenSpec, ...]) -> None:
    """Between two rests the motor's work is the load's lift."""
    winch = plant(SPIRAL, *hidden, cable_length=3.0)
    rows = lift(winch, 200.0, sample=0.001)
    work = sum(
        (a["motor_torque"] + b["motor_torque"]) / 2 * (b["motor_angle"] - a["motor_angle"])
        for a, b in pairwise(rows)
    )
    lifted = rows[0]["cable_length"] - rows[-1]["cable_length"]
    assert work == pytest.approx(20 * GRAVITY * lifted, rel=2e-3)


def test_shorthands_of_the_profile_are_true() -> None:
    cable = replace(GROOVED.cable, axial_stiffness=200e3, mass_per_length=0.2)
    profile = replace(GROOVED, cable=cable, gearbox=replace(GROOVED.gearbox, efficiency=0.9))
    winch = plant(profile)
    cruise(winch, 0.0, 0.5)
    weight = 20 * GRAVITY
    assert winch.cable_length == pytest.approx(4.0 + weight * 5.5 / 200e3, abs=1e-7)
    assert winch.tension == pytest.approx(weight + 0.2 * GRAVITY * 4.0, rel=1e-6)
    with pytest.raises(FileError, match="declares it too"):
        plant(profile, hide("elastic rope"))


def test_overrides_of_the_profile_are_true() -> None:
    truth = WinchTruth(overrides={"drum.winding_radius": "66 mm", "pulley.1.wrap": "10 deg"})
    winch = WinchPlant(GROOVED, truth, seed=1)
    nominal = plant(GROOVED)
    for each in (winch, nominal):
        cruise(each, 50.0, 1.0)
    wound = (4.0 - winch.cable_length) / (4.0 - nominal.cable_length)
    assert wound == pytest.approx(1.1, rel=1e-3)


@pytest.mark.parametrize(
    ("key", "raw", "message"),
    [
        ("drum.radius", "60 mm", "no key 'radius'"),
        ("drum.winding_radius", "60 kg", "unit of mass, not of length"),
        ("drum.kind", "grooved", "is not a number"),
        ("pulley.7.wrap", "1 rad", "not a position in a list of 2"),
    ],
)
def test_an_override_that_cannot_be(key: str, raw: str, message: str) -> None:
    with pytest.raises(FileError, match=message):
        WinchPlant(GROOVED, WinchTruth(overrides={key: raw}), seed=1)


def test_every_fault_of_what_is_hidden_is_named() -> None:
    with pytest.raises(FileError) as caught:
        plant(GROOVED, hide("elastik rope"), hide("soft frame", stiffness="3 N", mass=2))
    text = str(caught.value)
    assert "did you mean 'elastic rope'" in text
    assert "soft frame'.stiffness" in text
    assert "soft frame'.mass" in text


def test_a_torque_limit_holds() -> None:
    winch = plant(SPIRAL)
    holding = 20 * GRAVITY * Kinematics.of(SPIRAL).arm(SPIRAL.reference.motor_angle)
    limit = 1.2 * holding
    reached = 0.0
    for _ in range(400):
        winch.advance(1e-3, DriveCommand(speed=300.0, torque_limit=limit))
        reached = max(reached, winch.motor_torque)
    assert reached == pytest.approx(limit, rel=1e-3)
    # 20 % of the weight is left to accelerate the load.
    rise = winch.motor_velocity * Kinematics.of(SPIRAL).arm(winch.motor_angle) / 0.4
    assert rise == pytest.approx(0.2 * GRAVITY, rel=0.05)


def test_the_brake_stops_and_holds() -> None:
    winch = plant(SPIRAL)
    cruise(winch, -150.0, 0.3)
    winch.advance(0.2, DriveCommand.off(brake=True))
    there = winch.motor_angle
    winch.advance(1.0, DriveCommand.off(brake=True))
    assert winch.motor_velocity == 0.0
    assert winch.motor_angle == there
    assert winch.motor_torque == 0.0
    assert winch.tension == pytest.approx(20 * GRAVITY)


@pytest.mark.parametrize("hidden", [(), (hide("heavy rotor", inertia="40 kg cm^2"),)])
def test_without_brake_and_power_the_load_falls(hidden: tuple[HiddenSpec, ...]) -> None:
    winch = plant(GROOVED, *hidden)
    winch.advance(0.1, DriveCommand.off(brake=False))
    arm = Kinematics.of(GROOVED).arm(0.0)
    inertia = 4e-3 if hidden else 0.0
    fall = GRAVITY * 20 * arm**2 / (20 * arm**2 + inertia)
    assert winch.cable_length - 4.0 == pytest.approx(fall * 0.1**2 / 2, rel=0.03)
    assert winch.motor_torque == 0.0


def test_another_load_hangs_still() -> None:
    winch = plant(GROOVED, hide("elastic rope"))
    before = winch.cable_length
    winch.hang(40.0)
    assert winch.load == pytest.approx(40 * GRAVITY)
    assert winch.cable_length - before == pytest.approx(20 * GRAVITY * 5.5 / 300e3, rel=1e-6)
    with pytest.raises(UsageError, match="is impossible"):
        winch.hang(0.0)


def test_time_goes_forward_in_any_portion() -> None:
    once, often = plant(SPIRAL, hide("elastic rope")), plant(SPIRAL, hide("elastic rope"))
    once.advance(0.5, DriveCommand(speed=60.0))
    for _ in range(1000):
        often.advance(0.0005, DriveCommand(speed=60.0))
    assert often.time == pytest.approx(once.time)
    # The drive's loops lag by a share of a step, so by a part of its travel.
    assert often.motor_angle == pytest.approx(once.motor_angle, abs=60 * 0.5e-3)
    assert often.cable_length == pytest.approx(once.cable_length, abs=60 * 0.5e-3 * 0.0033)
    with pytest.raises(UsageError, match="cannot advance"):
        once.advance(-1.0, DriveCommand())
    once.advance(0.0, DriveCommand())
    assert once.time == pytest.approx(0.5)


def test_a_move_ends_where_it_should() -> None:
    winch = plant(SPIRAL)
    rows = lift(winch, 2 * pi * 20)
    assert rows[-1]["motor_angle"] == pytest.approx(0.3 + 2 * pi * 20, abs=1e-4)
    assert winch.motor_velocity == pytest.approx(0.0, abs=1e-3)


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


COUNT = 40_000


def samples(colour: float, interval: float = 0.02) -> np.ndarray:
    noise = GaussianNoise(2.0, colour, 0.5, Random(7))
    return np.array([noise.sample(interval) for _ in range(COUNT)])


@pytest.mark.parametrize("colour", [0.0, 0.3, 1.0])
def test_size_and_memory(colour: float) -> None:
    x = samples(colour)
    effective = COUNT / (1 + 2 * 25 * colour)
    assert np.std(x) == pytest.approx(2.0, rel=4 / np.sqrt(effective))
    assert abs(np.mean(x)) < 4 * 2.0 / np.sqrt(effective)
    for lag in (1, 25, 60):
        expected = colour * np.exp(-lag * 0.02 / 0.5)
        found = np.corrcoef(x[:-lag], x[lag:])[0, 1]
        assert found == pytest.approx(expected, abs=5 / np.sqrt(effective))


def test_memory_counts_time_and_not_samples() -> None:
    fast, slow = samples(1.0, 0.005), samples(1.0, 0.5)
    assert np.corrcoef(fast[:-1], fast[1:])[0, 1] > 0.97
    assert np.corrcoef(slow[:-1], slow[1:])[0, 1] == pytest.approx(np.exp(-1), abs=0.02)


def readings(seed: int) -> list[Measurement]:
    noise = NoiseSpec(3e-4, 0.8, 5e-3, 0.8, 0.05, 0.3, 0.5)
    truth = WinchTruth(hidden=(hide("elastic rope"),))
    winch = WinchPlant(GROOVED, truth, seed=seed, noise=noise)
    out = []
    for _ in range(500):
        winch.advance(0.004, DriveCommand(speed=20.0))
        out.append(winch.measure())
    return out


def test_a_seed_brings_everything_back() -> None:
    assert readings(3) == readings(3)


def test_seeds_and_instruments_differ() -> None:
    one, other = readings(3), readings(4)
    assert [m.motor_angle for m in one] == [m.motor_angle for m in other]
    errors = {
        (name, seed): np.array([getattr(m, name) for m in rows])
        for seed, rows in ((3, one), (4, other))
        for name in ("tension", "load", "cable_length", "motor_torque", "temperature")
    }
    differences = errors["tension", 3] - errors["tension", 4]
    assert np.std(differences) == pytest.approx(0.8 * np.sqrt(2), rel=0.35)
    load = errors["load", 3] - errors["load", 4]
    assert abs(np.corrcoef(differences, load)[0, 1]) < 0.35


def test_without_noise_the_instruments_measure_the_truth() -> None:
    winch = WinchPlant(GROOVED, WinchTruth(), seed=1)
    winch.advance(0.5, DriveCommand(speed=30.0))
    read = winch.measure()
    for name in ("motor_angle", "motor_velocity", "motor_torque", "tension", "load"):
        assert getattr(read, name) == getattr(winch, name)
    assert read.cable_length == winch.cable_length
    assert read.temperature == winch.temperature == 20.0
