"""The power state machine on a bus: how the host enables, stops and resets, as a witness sees."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from bus_rig import Rig
from drive_server import NODE
from master import Master
from winchkit.drivers.can.cia402.state_machine import DriveState, RequestedState
from winchkit.errors import NotPermitted

pytestmark = pytest.mark.realtime

UPWARDS = {0x06, 0x07, 0x0F}
"""Commands of transitions 2, 3, 4 and 16."""


@pytest.fixture
def master(rig: Rig) -> Iterator[Master]:
    with Master(rig) as opened:
        yield opened


def test_states_and_transitions_one_by_one(rig: Rig, master: Master) -> None:
    master.commission()
    rig.forget()
    master.until(RequestedState.ENABLE, DriveState.OPERATION_ENABLED)
    assert rig.states() == ["SWITCH_ON_DISABLED", "READY", "SWITCHED_ON", "OPERATION_ENABLED"]
    words = [word for word in rig.witness.words() if word & 0x8F]
    # The last word of one transition is repeated until the status word says that it is done.
    assert list(dict.fromkeys(words)) == [0x06, 0x07, 0x0F]
    rig.forget()
    master.until(RequestedState.DISABLE, DriveState.SWITCH_ON_DISABLED)
    assert rig.states() == ["OPERATION_ENABLED", "QUICK_STOP_ACTIVE", "SWITCH_ON_DISABLED"]
    assert not UPWARDS & set(rig.witness.words()[1:])


def test_a_mode_that_the_drive_lacks_is_refused_before_anything_is_written(
    rig: Rig, master: Master
) -> None:
    rig.drive.put(0x6502, 0, 0x05)
    with pytest.raises(NotPermitted, match="no mode CSV; it has PP, PV"):
        master.commission()
    assert 0x6060 not in {index for index, _, _ in rig.witness.writes()}
    assert rig.drive.number(0x6061) == 0


def test_the_mode_is_verified_and_kept_under_watch(rig: Rig, master: Master) -> None:
    master.commission()
    assert rig.drive.number(0x6061) == 9
    modes = [value & 0xFF for index, _, value in rig.witness.writes() if index == 0x6060]
    assert modes == [9]
    master.cycles(RequestedState.DISABLE, 3)
    assert master.axis.mode_kept
    # Another master changes it behind our back.
    rig.witness.send(0x600 + NODE, bytes.fromhex("2F60600003000000"))
    master.cycles(RequestedState.DISABLE, 10)
    assert not master.axis.mode_kept


@pytest.mark.parametrize(
    "requested", [RequestedState.STOP, RequestedState.DISABLE, RequestedState.RESET]
)
@pytest.mark.parametrize(
    ("start", "way"),
    [
        (DriveState.SWITCH_ON_DISABLED, ()),
        (DriveState.READY_TO_SWITCH_ON, (0x06,)),
        (DriveState.SWITCHED_ON, (0x06, 0x07)),
        (DriveState.OPERATION_ENABLED, (0x06, 0x07, 0x0F)),
        (DriveState.QUICK_STOP_ACTIVE, (0x06, 0x07, 0x0F, 0x02)),
    ],
    ids=lambda item: str(item) if isinstance(item, DriveState) else "",
)
def test_a_stop_never_energises(
    rig: Rig, master: Master, start: DriveState, way: tuple[int, ...], requested: RequestedState
) -> None:
    rig.drive.put(0x605A, 0, 6)  # stays in quick stop active
    master.commission()
    for word in way:
        master.send_word(word)
    master.await_silently(lambda: master.state is start)
    rig.forget()
    master.cycles(requested, 8)
    assert not UPWARDS & set(rig.witness.words())
    after = rig.states()
    assert "OPERATION_ENABLED" not in after[1:]
    assert after[-1] in ("SWITCH_ON_DISABLED", "QUICK_STOP_ACTIVE")


@pytest.mark.parametrize("code", [1, 2, 5, 6])
def test_a_stop_ends_disabled_whatever_605a_says(rig: Rig, master: Master, code: int) -> None:
    rig.drive.put(0x605A, 0, code)
    master.commission()
    master.until(RequestedState.ENABLE, DriveState.OPERATION_ENABLED)
    master.cycles(RequestedState.ENABLE, 10, velocity=4.0)
    rig.forget()
    master.until(RequestedState.DISABLE, DriveState.SWITCH_ON_DISABLED)
    assert set(rig.witness.words()[1:]) <= {0x00, 0x02}
    assert abs(rig.drive.see()["velocity"]) < 0.05


def test_a_reset_of_a_fault_stays_disabled(rig: Rig, master: Master) -> None:
    master.commission()
    master.until(RequestedState.ENABLE, DriveState.OPERATION_ENABLED)
    rig.drive.inject("over-current")
    master.until(RequestedState.DISABLE, DriveState.FAULT)
    rig.forget()
    master.until(RequestedState.RESET, DriveState.SWITCH_ON_DISABLED)
    master.cycles(RequestedState.RESET, 5)
    assert rig.state() == "SWITCH_ON_DISABLED"
    assert rig.states() == ["FAULT", "SWITCH_ON_DISABLED"]
    assert set(rig.witness.words()) <= {0x00, 0x02, 0x80}
    assert rig.witness.words().count(0x80) == 1, "an edge of bit 7, and no more"
    assert rig.drive.see()["error"] == 0
