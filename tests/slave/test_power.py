"""The slave's power state machine and motion against CiA 402-2."""

from __future__ import annotations

import math

import pytest

from slave import Declared, State
from slave.wire import Wire, emergencies, moving

_STATES = {
    State.SWITCH_ON_DISABLED: (),
    State.READY: (0x06,),
    State.SWITCHED_ON: (0x06, 0x07),
    State.ENABLED: (0x06, 0x07, 0x0F),
}
_TABLE = [
    # Figure 5 and table 27 of CiA 402-2: from, control word, to
    (State.SWITCH_ON_DISABLED, 0x06, State.READY),
    (State.SWITCH_ON_DISABLED, 0x07, State.SWITCH_ON_DISABLED),
    (State.SWITCH_ON_DISABLED, 0x0F, State.SWITCH_ON_DISABLED),
    (State.READY, 0x07, State.SWITCHED_ON),
    (State.READY, 0x00, State.SWITCH_ON_DISABLED),
    (State.READY, 0x02, State.SWITCH_ON_DISABLED),
    (State.SWITCHED_ON, 0x0F, State.ENABLED),
    (State.SWITCHED_ON, 0x06, State.READY),
    (State.SWITCHED_ON, 0x00, State.SWITCH_ON_DISABLED),
    (State.SWITCHED_ON, 0x02, State.SWITCH_ON_DISABLED),
    (State.ENABLED, 0x07, State.SWITCHED_ON),
    (State.ENABLED, 0x06, State.READY),
    (State.ENABLED, 0x00, State.SWITCH_ON_DISABLED),
    (State.ENABLED, 0x02, State.SWITCH_ON_DISABLED),
    (State.ENABLED, 0x80, State.ENABLED),
]


def in_state(state: State) -> Wire:
    wire = Wire()
    wire.write(0x6060, 0, 9, 1)
    for word in _STATES[state]:
        wire.write(0x6040, 0, word, 2)
        wire.wait(0.002)
    assert wire.slave.power.state is state
    return wire


@pytest.mark.parametrize(("before", "word", "after"), _TABLE)
def test_control_words(before: State, word: int, after: State) -> None:
    wire = in_state(before)
    wire.write(0x6040, 0, word, 2)
    wire.wait(0.01)
    assert wire.slave.power.state is after
    assert wire.status() == after.value


@pytest.mark.parametrize(
    ("option", "during", "after"),
    [
        (0, State.SWITCH_ON_DISABLED, State.SWITCH_ON_DISABLED),
        (1, State.QUICK_STOP, State.SWITCH_ON_DISABLED),
        (2, State.QUICK_STOP, State.SWITCH_ON_DISABLED),
        (5, State.QUICK_STOP, State.QUICK_STOP),
        (6, State.QUICK_STOP, State.QUICK_STOP),
    ],
)
def test_quick_stop_by_its_option_code(option: int, during: State, after: State) -> None:
    wire = moving()
    wire.write(0x605A, 0, option, 2)
    unit = wire.slave.motion.velocity_unit
    wire.write(0x6084, 0, round(100 / unit), 4)
    wire.write(0x6085, 0, round(200 / unit), 4)
    wire.write(0x6040, 0, 0x02, 2)
    wire.wait(0.05)
    assert wire.slave.power.state is during
    ramp = {1: 100, 5: 100}.get(option, 200)
    expected = 20 - ramp * (0.05 - (0 if option == 0 else wire.slave.declared.lag))
    if option:
        assert wire.slave.motor.velocity == pytest.approx(expected, abs=0.3)
    wire.wait(0.4)
    assert wire.slave.power.state is after
    assert wire.slave.motor.velocity == 0
    wire.write(0x6040, 0, 0x0F, 2)
    wire.wait(0.01)
    assert (wire.slave.power.state is State.ENABLED) is (option >= 5)


@pytest.mark.parametrize(
    ("option", "state"),
    [
        (0, State.ENABLED),
        (1, State.FAULT),
        (2, State.SWITCH_ON_DISABLED),
        (3, State.SWITCH_ON_DISABLED),
    ],
)
def test_6007h_acts_on_nmt_stopped(option: int, state: State) -> None:
    wire = moving()
    wire.write(0x6007, 0, option, 2)
    wire.send(0x000, "0201")
    wire.wait(1.0)
    assert wire.slave.power.state is state


def test_6007h_does_not_act_on_pre_operational() -> None:
    wire = moving()
    wire.write(0x6007, 0, 3, 2)
    wire.send(0x000, "8001")
    wire.wait(1.0)
    assert wire.slave.power.state is State.ENABLED
    assert wire.slave.motor.velocity > 19


def test_a_fault_is_reported_and_reset_by_an_edge() -> None:
    wire = moving()
    wire.slave.inject("drive fault", 0x7305)
    assert emergencies(wire.wait(0.01)) == [0x7305]
    wire.wait(1.0)
    assert (wire.status(), wire.read(0x603F), wire.read(0x1001) & 1) == (0x08, 0x7305, 1)
    wire.write(0x6040, 0, 0x80, 2)
    assert wire.status() == 0x08, "its cause stands"
    wire.slave.mend("drive fault")
    wire.write(0x6040, 0, 0x80, 2)
    assert wire.status() == 0x08, "no edge"
    wire.write(0x6040, 0, 0x00, 2)
    wire.write(0x6040, 0, 0x80, 2)
    assert emergencies(wire.wait(0.01)) == [0x0000]
    assert (wire.status(), wire.read(0x603F)) == (0x40, 0)


def test_the_enable_input_takes_the_torque_and_gives_none_back() -> None:
    wire = moving()
    wire.slave.inject("enable input open")
    assert wire.status() == 0x40
    wire.write(0x6040, 0, 0x06, 2)
    assert wire.status() == 0x40
    wire.slave.mend("enable input open")
    wire.wait(1.0)
    assert wire.status() == 0x40
    wire.write(0x6040, 0, 0x06, 2)
    assert wire.status() == 0x21


def test_profile_velocity_keeps_its_ramp() -> None:
    wire = Wire()
    wire.enable(3)
    unit = wire.slave.motion.velocity_unit
    wire.write(0x6083, 0, round(50 / unit), 4)
    wire.write(0x60FF, 0, round(20 / unit), 4)
    wire.wait(0.2)
    assert wire.slave.motor.velocity == pytest.approx(50 * (0.2 - 0.005), abs=0.2)


def test_profile_position_arrives() -> None:
    wire = Wire()
    wire.enable(1)
    unit = wire.slave.motion.velocity_unit
    for index in (0x6083, 0x6084):
        wire.write(index, 0, round(100 / unit), 4)
    wire.write(0x6081, 0, round(30 / unit), 4)
    wire.write(0x607A, 0, 65536 * 2, 4)
    wire.write(0x6040, 0, 0x1F, 2)
    assert wire.read(0x6041) & 0x1400 == 0x1000
    wire.write(0x6040, 0, 0x0F, 2)
    wire.wait(3.0)
    assert wire.slave.motor.angle == pytest.approx(4 * math.pi, abs=1e-3)
    assert wire.read(0x6041) & 0x1400 == 0x0400


def test_cyclic_position_follows_its_targets() -> None:
    wire = Wire()
    wire.start()
    wire.enable(8)
    for n in range(1, 101):
        wire.write(0x607A, 0, 100 * n, 4)
        wire.send(0x080)
        wire.wait(0.004)
    speed = 100 * wire.slave.motion.unit / 0.004
    assert wire.slave.motor.velocity == pytest.approx(speed, rel=1e-2)
    assert wire.slave.motor.angle == pytest.approx(1e4 * wire.slave.motion.unit, abs=0.01 * speed)


def test_homing_sets_the_position() -> None:
    wire = Wire(declared=Declared(home_switch=1.0))
    wire.enable(6)
    unit = wire.slave.motion.velocity_unit
    wire.write(0x6098, 0, 17, 1)
    wire.write(0x6099, 1, round(5 / unit), 4)
    wire.write(0x6099, 2, round(1 / unit), 4)
    wire.write(0x607C, 0, 500, 4)
    wire.write(0x6040, 0, 0x1F, 2)
    assert wire.read(0x6041) & 0x3400 == 0
    wire.wait(5.0)
    assert wire.read(0x6041) & 0x3400 == 0x1400
    assert wire.slave.motor.angle == pytest.approx(1.0, abs=1e-3)
    assert wire.read(0x6064) == 500


@pytest.mark.parametrize("bits", [16, 24, 32])
def test_the_counter_wraps_at_its_bits(bits: int) -> None:
    wire = Wire(declared=Declared(counter_bits=bits))
    top = 2 ** (bits - 1)
    wire.slave.inject("position wraps", 0)
    assert wire.read(0x6064) == top - 1
    wire.slave.motor.angle += wire.slave.motion.unit
    assert wire.read(0x6064) - (1 << 32) == -top


def test_a_coarse_velocity() -> None:
    rpm = math.pi / 30
    wire = moving(0.16, declared=Declared(velocity_resolution=rpm))
    shown = wire.read(0x606C) * wire.slave.motion.velocity_unit
    assert shown == pytest.approx(2 * rpm, rel=1e-3)
