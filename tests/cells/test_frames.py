"""The gate before the library: only the exact answer passes, everything else is named."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit.drivers.modbus.frames import AnswerGate, crc16


def rtu(*parts: int) -> bytes:
    body = bytes(parts)
    register = 0xFFFF
    for byte in body:
        register ^= byte
        for _ in range(8):
            register = register >> 1 ^ (0xA001 if register & 1 else 0)
    return body + register.to_bytes(2, "little")


def tcp(transaction: int, *parts: int) -> bytes:
    return struct.pack(">HHH", transaction, 0, len(parts)) + bytes(parts)


ASK = rtu(1, 3, 0, 6, 0, 2)
ANSWER = rtu(1, 3, 4, 0x12, 0x34, 0x56, 0x78)


def asked(packet: bytes = ASK) -> AnswerGate:
    gate = AnswerGate("rtu")
    gate.sent(packet)
    return gate


def kinds(gate: AnswerGate) -> list[tuple[int, str, int]]:
    return [(event.unit, event.kind, event.count) for event in gate.events()]


def test_the_check_sum_is_the_one_of_the_specification() -> None:
    assert crc16(bytes.fromhex("0103000a0001")) == bytes.fromhex("a408")


@given(st.binary(max_size=300))
def test_the_table_agrees_with_the_bits(data: bytes) -> None:
    assert data + crc16(data) == rtu(*data)


def test_an_answer_passes_in_any_pieces() -> None:
    for at in range(1, len(ANSWER)):
        gate = asked()
        assert gate.received(ANSWER[:at]) == b""
        assert gate.received(ANSWER[at:]) == ANSWER
        assert kinds(gate) == []


def test_a_refusal_passes() -> None:
    gate = asked()
    refusal = rtu(1, 0x83, 2)
    assert gate.received(refusal) == refusal


@pytest.mark.parametrize(
    ("came", "event"),
    [
        (rtu(1, 3, 2, 0x12, 0x34), (1, "malformed", 1)),
        (rtu(9, 3, 4, 0x12, 0x34, 0x56, 0x78), (9, "malformed", 1)),
        (rtu(1, 4, 4, 0x12, 0x34, 0x56, 0x78), (1, "malformed", 1)),
        (ANSWER[:-1] + b"\0", (1, "crc", 1)),
        (ANSWER[:4], (1, "malformed", 1)),
        (ASK, (1, "malformed", 1)),
    ],
    ids=["short", "other unit", "other function", "check sum", "cut off", "echo"],
)
def test_what_is_no_answer_is_held_back_and_named(came: bytes, event: tuple[int, str, int]) -> None:
    gate = asked()
    assert gate.received(came) == b""
    assert gate.expire()
    assert kinds(gate) == [event]


def test_silence_is_no_event() -> None:
    gate = asked()
    assert not gate.expire()
    assert kinds(gate) == []


def test_noise_before_an_answer_is_skipped() -> None:
    gate = asked()
    assert gate.received(b"\xff\x01\x03" + ANSWER) == ANSWER
    assert kinds(gate) == [(1, "resynchronised", 3)]


def test_an_old_answer_is_late_whether_it_is_waited_for_or_not() -> None:
    gate = asked()
    gate.expire()
    assert gate.received(ANSWER) == b""
    assert kinds(gate) == [(1, "late", 1)]
    gate.sent(rtu(1, 3, 0, 6, 0, 3))
    longer = rtu(1, 3, 6, 1, 2, 3, 4, 5, 6)
    assert gate.received(ANSWER + longer) == longer
    assert kinds(gate) == [(1, "late", 1)]


def test_a_line_that_echoes_does_not_confirm_what_is_written() -> None:
    gate = asked()
    assert gate.received(ASK + ANSWER) == ANSWER
    write = rtu(1, 6, 0, 5, 0, 7)
    gate.sent(write)
    assert gate.received(write) == b""
    assert gate.received(write) == write


def test_over_tcp_the_transaction_decides() -> None:
    gate = AnswerGate("tcp")
    body = (1, 3, 4, 0x12, 0x34, 0x56, 0x78)
    gate.sent(tcp(7, 1, 3, 0, 6, 0, 2))
    assert gate.received(tcp(6, *body)) == b""
    assert gate.received(tcp(7, *body)) == tcp(7, *body)
    assert kinds(gate) == [(1, "late", 1)]


@given(st.lists(st.binary(max_size=20), max_size=5), st.sampled_from(["rtu", "tcp"]))
def test_noise_never_passes_and_never_raises(noise: list[bytes], framing: str) -> None:
    gate = AnswerGate(framing)  # type: ignore[arg-type]
    gate.sent(ASK if framing == "rtu" else tcp(7, 1, 3, 0, 6, 0, 2))
    for part in noise:
        assert gate.received(part) == b""
    assert gate.expire() == any(noise)
    assert all(event.count > 0 for event in gate.events())


def test_a_line_that_babbles_is_skipped_and_counted() -> None:
    gate = asked()
    for _ in range(100):
        assert gate.received(b"\x55" * 100) == b""
    assert gate.received(ANSWER) == ANSWER
    skipped = sum(event.count for event in gate.events() if event.kind == "resynchronised")
    assert skipped == 10_000


@given(st.integers(0, len(ANSWER) - 1), st.integers(0, 7))
def test_no_single_wrong_bit_passes(at: int, bit: int) -> None:
    data = bytearray(ANSWER)
    data[at] ^= 1 << bit
    assert asked().received(bytes(data)) == b""
