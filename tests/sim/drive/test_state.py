"""The state machine of the simulated drive against the standard's table, seen from the bus."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drive_rig import Flywheel, Rig

SOD, RTSO, SO, OE, QSA, FAULT = "SOD", "RTSO", "SO", "OE", "QSA", "FAULT"
MASKS = {
    SOD: (0x4F, 0x40),
    RTSO: (0x6F, 0x21),
    SO: (0x6F, 0x23),
    OE: (0x6F, 0x27),
    QSA: (0x6F, 0x07),
    FAULT: (0x4F, 0x08),
}
ROUTES: dict[str, tuple[int, ...]] = {
    SOD: (),
    RTSO: (0x06,),
    SO: (0x06, 0x07),
    OE: (0x06, 0x07, 0x0F),
    QSA: (0x06, 0x07, 0x0F, 0x02),
    FAULT: (),
}


def state_of(word: int) -> str:
    found = [name for name, (mask, value) in MASKS.items() if word & mask == value]
    assert len(found) == 1, hex(word)
    return found[0]


def expected(state: str, word: int) -> str:
    """Where the standard's control word goes, with ramps over and a motor at rest.

    605Ah = 6: a quick stop stays active, and 16 leads back.
    """
    voltage, no_quick_stop = bool(word & 2), bool(word & 4)
    switch_on, enable = bool(word & 1), bool(word & 8)
    if state == FAULT:
        return SOD if word & 0x80 else FAULT
    if not voltage:
        return SOD
    if not no_quick_stop:
        return {OE: QSA, QSA: QSA}.get(state, SOD)
    if not switch_on:
        return QSA if state == QSA else RTSO
    if state in (SOD,):
        return SOD
    if enable:
        return OE
    return QSA if state == QSA else SO


def in_state(state: str) -> Rig:
    rig = Rig()
    rig.write(0x605A, 0, 6)
    rig.write(0x6060, 0, 9)
    if state == FAULT:
        rig.drive.inject("over-current")
    rig.control(*ROUTES[state])
    rig.run(0.01)
    assert state_of(rig.status) == state
    return rig


@pytest.mark.parametrize("state", list(MASKS))
def test_every_control_word_in_every_state(state: str) -> None:
    for low in range(16):
        for reset in (0, 0x80):
            word = low | reset
            rig = in_state(state)
            rig.control(word)
            rig.run(0.01)
            assert state_of(rig.status) == expected(state, word), f"{state} {word:#x}"


@settings(max_examples=40, deadline=None)
@given(st.lists(st.integers(0, 0xFFFF), min_size=1, max_size=12))
def test_any_sequence_of_control_words(words: list[int]) -> None:
    rig = in_state(SOD)
    state, before = SOD, 0
    for word in words:
        edge = word & ~before & 0x80
        state = expected(state, word if edge else word & ~0x80)
        rig.control(word)
        rig.run(0.003)
        assert state_of(rig.status) == state
        before = word


def test_boot_reports_not_ready_then_switch_on_disabled() -> None:
    rig = Rig(boot=False)
    assert rig.drive.state == 0
    rig.drive.power_on(rig.now, boot_time=0.5)
    rig.run(0.49)
    assert not rig.frames
    rig.run(0.02)
    assert rig.frames[0][1:] == (0x705, b"\0")
    assert state_of(rig.status) == SOD


def test_the_declared_boot_time_is_kept() -> None:
    rig = Rig()
    rig.node.nmt.send_command(0x81)
    start = rig.now
    rig.frames.clear()
    rig.run(1.2)
    boot = next(time for time, cob, _ in rig.frames if cob == 0x705)
    assert 0.5 < boot - start <= 1.0


def test_a_fault_is_left_only_by_a_rising_edge() -> None:
    rig = in_state(SOD)
    rig.control(0x80)
    rig.drive.inject("encoder")
    rig.control(0x80)
    rig.run(0.01)
    assert state_of(rig.status) == FAULT
    rig.control(0x00, 0x80)
    assert state_of(rig.status) == SOD


@pytest.mark.parametrize("kind", ["over-current", "over-voltage", "over-temperature", "encoder"])
def test_a_fault_sends_its_emergency_and_its_end(kind: str) -> None:
    codes = {
        "over-current": (0x2310, 0x03),
        "over-voltage": (0x3210, 0x05),
        "over-temperature": (0x4310, 0x09),
        "encoder": (0x7305, 0x01),
    }
    rig = in_state(OE)
    rig.drive.inject(kind)
    rig.run(0.1)
    code, register = codes[kind]
    assert rig.read(0x603F) == code
    assert rig.read(0x1001) == register
    assert rig.read(0x1003, 1) == code
    rig.control(0x80)
    assert rig.read(0x603F) == 0
    assert rig.read(0x1001) == 0
    assert rig.emergencies() == [code, 0]


def test_an_old_control_word_does_not_move_a_drive_that_stopped_by_itself() -> None:
    rig = in_state(OE)
    rig.watch_host()
    rig.beating = None
    rig.run(0.5)
    assert state_of(rig.status) == QSA
    rig.beating = rig.now
    rig.run(0.5)
    assert state_of(rig.status) == QSA


@pytest.mark.parametrize("brake", [True, False])
@pytest.mark.parametrize("state", [SOD, RTSO, SO, FAULT])
def test_without_power_only_a_brake_holds_the_load(state: str, brake: bool) -> None:
    shaft = Flywheel()
    rig = Rig(shaft, brake=brake)
    if state == FAULT:
        rig.drive.inject("torque off")
    rig.control(*ROUTES[state])
    before = shaft.motor_angle
    rig.run(0.2)
    assert state_of(rig.status) == state
    if brake:
        assert shaft.motor_angle == before
    else:
        assert shaft.motor_angle < before - 0.5 * 49 * 0.2**2


def test_an_enabled_drive_holds_the_load_in_every_mode() -> None:
    for mode in (0, 1, 3, 8, 9):
        shaft = Flywheel(motor_angle=0.0)
        rig = Rig(shaft)
        rig.enable(mode)
        before = shaft.motor_angle
        rig.run(0.2)
        assert shaft.motor_angle == pytest.approx(before, abs=1e-9), mode
        assert state_of(rig.status) == OE
