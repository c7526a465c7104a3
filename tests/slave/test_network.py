"""The slave's NMT, heartbeats and guarding against the bytes of CiA 301."""

from __future__ import annotations

import pytest

from slave import Frame, Nmt
from slave.wire import Wire, emergencies


def beats(frames: list[Frame], node: int = 1) -> list[int]:
    return [frame.data[0] for frame in frames if frame.identifier == 0x700 + node]


def test_boot_up_is_one_zero_byte() -> None:
    wire = Wire(node=5)
    assert wire.frames == [Frame(0x705, b"\x00")]
    assert wire.slave.network.state is Nmt.PRE_OPERATIONAL


def test_nmt_commands_of_the_standard() -> None:
    wire = Wire()
    seen = []
    for command in ("0101", "0201", "8001", "0100", "0102", "8101"):
        wire.send(0x000, command)
        seen.append(wire.slave.network.state)
    assert seen == [
        Nmt.OPERATIONAL,
        Nmt.STOPPED,
        Nmt.PRE_OPERATIONAL,
        Nmt.OPERATIONAL,
        Nmt.OPERATIONAL,  # for node 2
        Nmt.INITIALISING,
    ]
    assert beats(wire.wait(0.05)) == [0]


def test_stopped_answers_no_sdo() -> None:
    wire = Wire()
    assert wire.sdo("4000100000000000") == "4300100092010200"
    wire.send(0x000, "0201")
    assert wire.sdo("4000100000000000") == ""


def test_heartbeats_show_the_state_at_their_period() -> None:
    wire = Wire()
    wire.write(0x1017, 0, 20, 2)
    assert beats(wire.wait(0.099)) == [0x7F] * 5
    wire.start()
    assert set(beats(wire.wait(0.1))) == {0x05}


@pytest.mark.parametrize(
    ("behaviour", "state"), [(0, Nmt.PRE_OPERATIONAL), (1, Nmt.OPERATIONAL), (2, Nmt.STOPPED)]
)
def test_a_lost_heartbeat_is_reported_and_1029h_acts(behaviour: int, state: Nmt) -> None:
    wire = Wire()
    wire.write(0x1029, 1, behaviour, 1)
    wire.write(0x1016, 1, 0x007F0064, 4)
    wire.start()
    wire.wait(0.5)
    assert wire.slave.network.state is Nmt.OPERATIONAL, "not armed before the first heartbeat"
    wire.send(0x77F, "05")
    assert emergencies(wire.wait(0.099)) == []
    assert emergencies(wire.wait(0.003)) == [0x8130]
    assert wire.slave.network.state is state
    assert emergencies(wire.wait(1.0)) == []


def test_guarding_toggles_and_life_guarding_trips() -> None:
    wire = Wire()
    wire.write(0x100C, 0, 50, 2)
    wire.write(0x100D, 0, 2, 1)
    assert wire.wait(0.5) == [], "not armed before the first remote frame"
    replies = [wire.send(0x701, remote=True)[0].data.hex() for _ in range(3)]
    assert replies == ["7f", "ff", "7f"]
    wire.start()
    assert wire.send(0x701, remote=True) == [Frame(0x701, b"\x85")]
    assert emergencies(wire.wait(0.099)) == []
    assert emergencies(wire.wait(0.003)) == [0x8130]


def test_a_heartbeat_period_switches_guarding_off() -> None:
    wire = Wire()
    wire.write(0x1017, 0, 1000, 2)
    wire.wait(0.01)
    assert wire.send(0x701, remote=True) == []


def test_reset_restores_values_of_power_on() -> None:
    wire = Wire()
    wire.write(0x1017, 0, 20, 2)
    wire.send(0x000, "8201")
    wire.wait(0.05)
    assert wire.read(0x1017) == 0
