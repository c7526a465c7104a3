"""Every mode on the simulated drive, which follows the standard by code of its own."""

from __future__ import annotations

import dataclasses
import itertools
import time
from collections.abc import Callable, Iterator

import pytest

from drive_on_bus import DriveOnBus, bus_spec, device
from flywheel import INERTIA
from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.cia402.axis import Cia402Axis
from winchkit.drivers.can.cia402.commission import WatchSpec
from winchkit.drivers.can.cia402.limits import LimitsAtShaft
from winchkit.drivers.can.cia402.modes import HomingState
from winchkit.drivers.can.cia402.profile_parameters import HomingSpec
from winchkit.drivers.can.cia402.state_machine import DriveState, RequestedState
from winchkit.drivers.clock import MonotonicClock
from winchkit.errors import DeviceRefused
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.devices.servo import OptionSpec, PdoSpec

CLOCK = MonotonicClock()
CYCLE = 0.004


def device_in(mode: str) -> DeviceSpec:
    """The generic drive with targets for angle, speed and torque mapped."""
    path = ("0x60C1:1",) if mode == "IP" else ("0x607A", "0x6071")
    spec = device()
    assert spec.servo is not None
    rpdo = (PdoSpec(1, ("0x6040", "0x60FF")), PdoSpec(2, path))
    return dataclasses.replace(
        spec, servo=dataclasses.replace(spec.servo, motion_mode=mode, rpdo=rpdo)
    )


pytestmark = pytest.mark.realtime


class Rig:
    """An axis, its drive, and a control loop in miniature between them."""

    def __init__(self, mode: str, **watch: object) -> None:
        spec = bus_spec()
        self.drive = DriveOnBus(spec).__enter__()
        self.bus = CanBus(spec, "can", CLOCK)
        options = WatchSpec(127, 0.2, CYCLE, True, prove=False, **watch)  # type: ignore[arg-type]
        self.axis = Cia402Axis(self.bus, 1, device_in(mode), options, CLOCK)
        self._syncs = itertools.count(1)

    def close(self) -> None:
        self.bus.close()
        self.drive.__exit__()

    def run(self, requested: RequestedState, count: int, **targets: object) -> None:
        for _ in range(count):
            self.axis.begin_cycle(next(self._syncs), CLOCK.now())
            self.bus.sync()
            self.bus.heartbeat(127, 5)
            time.sleep(CYCLE)
            self.axis.send(requested, **targets)  # type: ignore[arg-type]

    def until(
        self, condition: Callable[[], bool], requested: RequestedState, **targets: object
    ) -> None:
        """Cycles until something holds."""
        for _ in range(1500):
            if condition():
                return
            self.run(requested, 1, **targets)
        raise AssertionError(f"it did not come to that; the drive is {self.axis.state}")

    def enable(self) -> None:
        self.until(lambda: self.axis.state is DriveState.OPERATION_ENABLED, RequestedState.ENABLE)

    def disable(self) -> None:
        self.until(
            lambda: self.axis.state is DriveState.SWITCH_ON_DISABLED and self.axis.at_rest,
            RequestedState.DISABLE,
        )

    @property
    def angle(self) -> float:
        return self.drive.shaft.motor_angle

    @property
    def speed(self) -> float:
        return self.drive.shaft.motor_velocity


@pytest.fixture
def rig_in() -> Iterator[Callable[..., Rig]]:
    rigs: list[Rig] = []

    def make(mode: str = "CSV", **watch: object) -> Rig:
        rigs.append(Rig(mode, **watch))
        rigs[-1].axis.commission()
        return rigs[-1]

    yield make
    for rig in rigs:
        rig.close()


@pytest.mark.parametrize("mode", ["CSP", "IP"])
def test_interpolated_positions_are_followed(rig_in: Callable[..., Rig], mode: str) -> None:
    rig = rig_in(mode)
    rig.enable()
    start = rig.angle
    for step in range(1, 41):
        rig.run(RequestedState.ENABLE, 1, angle=start + 0.01 * step)
    rig.run(RequestedState.ENABLE, 40, angle=start + 0.4)
    assert rig.angle == pytest.approx(start + 0.4, abs=0.01)
    rig.disable()


def test_profile_velocity_ramps_by_itself(rig_in: Callable[..., Rig]) -> None:
    rig = rig_in("PV", acceleration=100.0)
    rig.enable()
    rig.until(lambda: abs(rig.speed - 5.0) < 0.05, RequestedState.ENABLE, velocity=5.0)
    rig.until(
        lambda: "target reached" in rig.axis.status_words, RequestedState.ENABLE, velocity=5.0
    )
    rig.until(lambda: rig.axis.at_rest, RequestedState.RUN_DOWN)
    assert rig.axis.state is DriveState.OPERATION_ENABLED


def test_profile_position_makes_one_move_for_each_target(rig_in: Callable[..., Rig]) -> None:
    rig = rig_in("CSV")
    rig.run(RequestedState.DISABLE, 3)
    rig.axis.switch_mode("PP")
    rig.run(RequestedState.DISABLE, 3)
    rig.axis.set_profile(speed=20.0, acceleration=200.0)
    rig.enable()
    rig.run(RequestedState.ENABLE, 10)
    assert rig.angle == pytest.approx(0.0, abs=0.01), "nothing was asked for"
    for target in (3.0, -1.0, 0.5):
        rig.until(lambda t=target: abs(rig.angle - t) < 0.01, RequestedState.ENABLE, angle=target)
        rig.until(
            lambda: "target reached" in rig.axis.status_words, RequestedState.ENABLE, angle=target
        )
    rig.disable()


def test_a_profile_position_move_is_halted_by_running_down(rig_in: Callable[..., Rig]) -> None:
    rig = rig_in("CSV")
    rig.run(RequestedState.DISABLE, 3)
    rig.axis.switch_mode("PP")
    rig.run(RequestedState.DISABLE, 3)
    rig.axis.set_profile(speed=10.0, acceleration=200.0)
    rig.enable()
    rig.until(lambda: rig.speed > 5.0, RequestedState.ENABLE, angle=1000.0)
    rig.until(lambda: abs(rig.speed) < 0.05, RequestedState.RUN_DOWN)
    assert rig.axis.state is DriveState.OPERATION_ENABLED
    rig.disable()


@pytest.mark.parametrize("mode", ["CST", "PT"])
def test_torque_accelerates_and_a_stop_needs_none(rig_in: Callable[..., Rig], mode: str) -> None:
    rig = rig_in("CSV")
    rig.run(RequestedState.DISABLE, 3)
    rig.axis.switch_mode(mode)
    rig.enable()
    rig.until(lambda: rig.speed > 3.0, RequestedState.ENABLE, torque=0.5)
    assert rig.speed < 3.0 + 0.5 / INERTIA * 0.2, "as 0.5 N m does, and no more"
    rig.until(lambda: abs(rig.speed) < 0.05, RequestedState.RUN_DOWN, torque=0.5)
    rig.disable()


@pytest.mark.parametrize("method", [37, 35])
def test_homing_here_sets_the_zero(rig_in: Callable[..., Rig], method: int) -> None:
    rig = rig_in("CSV")
    rig.enable()
    rig.run(RequestedState.ENABLE, 60, velocity=5.0)
    rig.disable()
    before = rig.axis.feedback
    assert abs(before.angle) > 0.5
    rig.axis.prepare_homing(HomingSpec(method, 5.0, 1.0, 50.0))
    rig.enable()
    rig.run(RequestedState.ENABLE, 10, start=True)
    rig.until(lambda: rig.axis.homing is HomingState.DONE, RequestedState.ENABLE, start=True)
    rig.run(RequestedState.DISABLE, 3)
    rig.disable()
    rig.axis.switch_mode("CSV")
    rig.run(RequestedState.DISABLE, 3)
    assert rig.axis.feedback.angle == pytest.approx(0.0, abs=0.05)
    assert rig.axis.mode_kept
    rig.enable()
    assert rig.axis.feedback.velocity == pytest.approx(0.0, abs=0.1), "no jump back to the old zero"


def test_a_homing_method_that_the_drive_lacks_is_reported(rig_in: Callable[..., Rig]) -> None:
    rig = rig_in("CSV")
    rig.run(RequestedState.DISABLE, 3)
    with pytest.raises(DeviceRefused, match="6098h"):
        rig.axis.prepare_homing(HomingSpec(99, 5.0, 1.0, 50.0))
    assert rig.axis.mode == "CSV"
    rig.enable()


@pytest.mark.parametrize("code", [1, 2, 3, 4])
def test_halt_stays_enabled_whatever_605d_says(rig_in: Callable[..., Rig], code: int) -> None:
    rig = rig_in("CSV", options=OptionSpec(halt=code))
    assert rig.drive.drive.objects.number(0x605D) == code
    rig.enable()
    rig.run(RequestedState.ENABLE, 25, velocity=5.0)
    rig.until(lambda: abs(rig.speed) < 0.05, RequestedState.HALT)
    rig.run(RequestedState.HALT, 5)
    assert rig.axis.state is DriveState.OPERATION_ENABLED
    rig.until(lambda: rig.speed > 4.0, RequestedState.ENABLE, velocity=5.0)


def test_limits_at_the_shaft_are_the_drive_s_own_barrier(rig_in: Callable[..., Rig]) -> None:
    """The host asks for more; the drive stays within 607Dh and shows bit 11."""
    limits = LimitsAtShaft(angle=(-2.0, 2.0), torque=1.5, following_error=1.0)
    rig = rig_in("CSV", limits=limits)
    kept = rig.axis.drive.limits
    assert kept.angle == pytest.approx((-2.0, 2.0), abs=1e-3)
    assert kept.torque == pytest.approx(1.5, abs=2e-3)
    assert kept.following_error == pytest.approx(1.0, abs=1e-3)
    rig.enable()
    rig.until(
        lambda: rig.axis.feedback is not None and rig.axis.feedback.limited,
        RequestedState.ENABLE,
        velocity=10.0,
    )
    rig.run(RequestedState.ENABLE, 100, velocity=10.0)
    assert rig.angle < 2.05
