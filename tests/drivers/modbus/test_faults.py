"""A polled instrument against a peer that misbehaves: never a wrong number, always a count."""

from __future__ import annotations

import struct

import pytest

from modbus_cell import PATIENT, cell, collected, polled, weigh
from modbus_peer import Peer
from waiting import until
from winchkit.errors import ConnectionLost, DeviceRefused, NoReply, NotPermitted


def test_after_a_damaged_answer_no_time_out_is_waited_for() -> None:
    """The connection is opened anew at once: with a time-out of a minute readings go on."""
    instrument = cell()
    damaged = {5, 12, 13}
    cut = lambda _u, number, body: (0.0, body[:-2] if number in damaged else body)  # noqa: E731
    with Peer(behave=cut) as peer:
        weigh(peer, 19_613)
        readings = collected(instrument)
        with polled(peer, instrument, timeout=60.0):
            until(lambda: len(readings) > 20, within=10.0)
    usable = [reading.value for reading in readings if reading.quality.usable]
    assert usable == pytest.approx([196.13] * len(usable))
    assert peer.connections >= 1 + len(damaged)


def test_readings_come_with_their_times() -> None:
    instrument = cell()
    with Peer() as peer:
        weigh(peer, 19_613)
        readings = collected(instrument)
        with polled(peer, instrument):
            until(lambda: len(readings) > 20)
    for reading in readings:
        assert reading.value == pytest.approx(196.13)
        # Of a slow answer the middle of the possible instants may lie
        # behind the request, the earliest does not.
        earliest = reading.t_sample - reading.t_uncertainty
        assert earliest < reading.t_request <= reading.t_receive
        assert reading.t_sample < reading.t_receive
        assert reading.t_uncertainty < 0.1
    assert instrument.counters.duplicates >= 19
    lengths = [count for _, _, _, count in peer.requests]
    assert set(lengths) == {7, 8, 9}
    assert all(
        len(set(three)) == 3 for three in zip(lengths, lengths[1:], lengths[2:], strict=False)
    )


def test_a_late_reply_is_never_taken_for_the_next_request() -> None:
    """Every third answer comes late and with a value of its own, which must never be seen."""
    instrument = cell()

    def late(_unit: int, number: int, pdu: bytes) -> tuple[float, bytes]:
        if number % 3 or len(pdu) < 6:
            return 0.0, pdu
        poisoned = bytearray(pdu)
        struct.pack_into(">HH", poisoned, 2 + 2 * 3, 0, 55_555)
        return 0.13, bytes(poisoned)

    with Peer(behave=late) as peer:
        weigh(peer, 1000)
        readings = collected(instrument)
        with polled(peer, instrument, timeout=0.05):
            until(lambda: instrument.counters.timeouts >= 5, within=6.0)
        assert peer.connections > 5, "after each timeout the connection is a new one"
    assert instrument.counters.reconnects >= 4
    assert {reading.raw for reading in readings} == {1000}


def test_a_short_reply_is_refused() -> None:
    instrument = cell()

    def short(_unit: int, number: int, pdu: bytes) -> tuple[float, bytes]:
        return 0.0, pdu if number < 4 else bytes((3, 4)) + b"\x12\x34\x56\x78"

    with Peer(behave=short) as peer:
        weigh(peer, 1000)
        readings = collected(instrument)
        with polled(peer, instrument):
            until(lambda: instrument.counters.malformed >= 1)
            # Between two refusals the line is opened anew.
            until(lambda: isinstance(instrument.problem, NoReply))
    assert {reading.raw for reading in readings} == {1000}


def test_a_device_that_refuses_longer_blocks_is_read_without_them() -> None:
    instrument = cell()
    with Peer(end=13) as peer:
        weigh(peer, 1000)
        readings = collected(instrument)
        with polled(peer, instrument):
            until(lambda: len(readings) > 10)
        assert sum(count == 8 for *_, count in peer.requests) == 1
    assert instrument.counters.exceptions == 0


def test_an_exception_is_counted_and_reported() -> None:
    instrument = cell()
    with Peer(end=5) as peer, polled(peer, instrument):
        until(lambda: instrument.counters.exceptions >= 1)
        assert isinstance(instrument.problem, DeviceRefused)
        assert "illegal address" in str(instrument.problem)
    assert instrument.latest is None


def test_one_dead_device_does_not_stop_the_others() -> None:
    alive, dead = cell(1), cell(2)

    def silent(unit: int, _number: int, pdu: bytes) -> tuple[float, bytes] | None:
        return None if unit == 2 else (0.0, pdu)

    with Peer(behave=silent) as peer:
        weigh(peer, 1000)
        with polled(peer, alive, dead):
            until(lambda: dead.counters.timeouts >= 2, within=5.0)
            before = alive.counters.readings
            until(lambda: alive.counters.readings > before + 30, within=5.0)
        assert peer.connections > 1
    assert alive.counters.timeouts == alive.counters.drops == 0
    assert isinstance(dead.problem, NoReply)
    assert "unit 2" in str(dead.problem)


def test_a_lost_connection_is_opened_again() -> None:
    instrument = cell()
    with Peer() as peer:
        weigh(peer, 1000)
        readings = collected(instrument)
        with polled(peer, instrument):
            until(lambda: len(readings) > 5)
            peer.hang_up()
            until(lambda: peer.connections == 2)
            count = len(readings)
            until(lambda: len(readings) > count + 5)
    assert {reading.raw for reading in readings} == {1000}


def test_no_server_listens() -> None:
    instrument = cell()
    with Peer() as peer:
        pass
    with polled(peer, instrument):
        until(lambda: instrument.problem is not None)
        assert isinstance(instrument.problem, ConnectionLost)
        assert f"127.0.0.1:{peer.port}" in str(instrument.problem)


def obey(peer: Peer, address: int, value: int) -> None:
    """Tare sets the bit of the net value in the status."""
    if (address, value) == (5, 7):
        peer.registers[6] |= 1 << 10


def test_commands_reach_the_device_between_polls_and_are_seen_obeyed() -> None:
    instrument = cell(timeout=PATIENT)
    with Peer(written=obey) as peer:
        weigh(peer, 1000)
        with polled(peer, instrument, timeout=PATIENT) as slow:
            until(lambda: instrument.latest is not None)
            slow.command(instrument, "tare")
            assert (1, 16, 5, 7) in peer.requests
            assert instrument.tared
            with pytest.raises(NotPermitted, match=r"no command .weigh.; its device file has tare"):
                slow.command(instrument, "weigh")


def test_a_command_that_is_taken_and_not_obeyed_is_reported() -> None:
    instrument = cell(timeout=PATIENT)
    with Peer() as peer:
        weigh(peer, 1000)
        with polled(peer, instrument, timeout=PATIENT) as slow:
            until(lambda: instrument.latest is not None)
            with pytest.raises(DeviceRefused, match=r"not confirm it within 1 s.*'net' to come"):
                slow.command(instrument, "tare")


def test_the_eeprom_is_written_on_purpose_only() -> None:
    instrument = cell(timeout=PATIENT)
    with Peer() as peer:
        weigh(peer, 1000)
        with polled(peer, instrument, timeout=PATIENT) as slow:
            until(lambda: instrument.latest is not None)
            with pytest.raises(NotPermitted, match="EEPROM"):
                slow.command(instrument, "store")
            assert not any(function == 16 for _, function, _, _ in peer.requests)
            instrument.may_store = True
            slow.command(instrument, "store")
            assert (1, 16, 5, 99) in peer.requests
