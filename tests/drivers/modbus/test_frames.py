"""The gate before the library: only the exact answer passes, everything else is named."""

from __future__ import annotations

import struct

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from modbus_peers.faulty_line import crc
from winchkit.drivers.modbus.frames import AnswerGate, crc16
from winchkit.drivers.modbus.tcp_frames import TcpAnswerGate


def rtu(*parts: int) -> bytes:
    return bytes(parts) + crc(bytes(parts))


def tcp(transaction: int, *parts: int) -> bytes:
    return struct.pack(">HHH", transaction, 0, len(parts)) + bytes(parts)


ASK = rtu(1, 3, 0, 6, 0, 2)
ANSWER = rtu(1, 3, 4, 0x12, 0x34, 0x56, 0x78)


def asked(packet: bytes = ASK) -> AnswerGate:
    gate = AnswerGate()
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


READ = (1, 3, 0, 6, 0, 2)
BODY = (1, 3, 4, 0x12, 0x34, 0x56, 0x78)


def asked_tcp(transaction: int = 7) -> TcpAnswerGate:
    gate = TcpAnswerGate()
    gate.sent(tcp(transaction, *READ))
    return gate


def test_over_tcp_the_transaction_decides() -> None:
    gate = asked_tcp(6)
    assert gate.received(tcp(6, *BODY)) == tcp(6, *BODY)
    gate.sent(tcp(7, *READ))
    assert gate.received(tcp(6, *BODY)) == b""
    assert gate.received(tcp(7, *BODY)) == tcp(7, *BODY)
    assert [(event.unit, event.kind) for event in gate.events()] == [(1, "late")]
    assert gate.broken, "a connection with a reply too many is not used again"


@pytest.mark.parametrize(
    "came",
    [
        tcp(8, *BODY),
        tcp(7, 9, *BODY[1:]),
        tcp(7, 1, 4, *BODY[2:]),
        tcp(7, 1, 3, 2, 0x12, 0x34),
        tcp(7, 1, 3, 4, 0x12, 0x34),
        tcp(7, 1, 3, 2, *BODY[3:]),
        tcp(7, *BODY, 0),
        tcp(7, *BODY) + b"\0",
        b"\0" + tcp(7, *BODY),
        b"\0\7\0\1" + tcp(7, *BODY)[4:],
        tcp(7, 1, 0x83, 2, 0),
    ],
    ids=[
        "transaction", "unit", "function", "short", "length", "byte count", "long",
        "a byte behind", "a byte before", "protocol", "long refusal",
    ],
)  # fmt: skip
def test_over_tcp_everything_must_agree(came: bytes) -> None:
    gate = asked_tcp()
    assert gate.received(came) == b""
    gate.expire()
    assert gate.broken


def test_over_tcp_a_refusal_passes_and_an_answer_in_pieces() -> None:
    refusal = tcp(7, 1, 0x83, 2)
    assert asked_tcp().received(refusal) == refusal
    answer = tcp(7, *BODY)
    for at in range(1, len(answer)):
        gate = asked_tcp()
        assert gate.received(answer[:at]) == b""
        assert gate.received(answer[at:]) == answer
        assert not gate.broken


@pytest.mark.parametrize("cut", range(1, 11))
@pytest.mark.parametrize("other", [6, 7])
@pytest.mark.parametrize("pieces", ["one", "two", "by byte"])
def test_a_cut_reply_and_another_reply_never_join(cut: int, other: int, pieces: str) -> None:
    """The reply of 47 of 47 injections: its head is right, its registers are of two frames."""
    gate = asked_tcp(6)
    gate.received(tcp(6, *BODY))
    gate.sent(tcp(7, *READ))
    begin, then = tcp(7, *BODY)[:-cut], tcp(other, *BODY)
    joined = begin + then
    for part in {
        "one": [joined],
        "two": [begin, then],
        "by byte": [begin, *(then[k : k + 1] for k in range(len(then)))],
    }[pieces]:
        assert gate.received(part) == b""
    gate.expire()
    assert gate.broken


@given(
    st.lists(st.sampled_from([0, 0x2B]) | st.integers(0, 255), min_size=14, max_size=14),
    st.integers(0, 13),
)
def test_no_answer_is_refused_for_bytes_that_it_held_before(data: list[int], at: int) -> None:
    """A register that stays meets every transaction number once in 65,000 requests."""
    body = (1, 3, 14, *data)
    gate, number = TcpAnswerGate(), max(int.from_bytes(bytes(body[2 + at : 4 + at])) - 5, 0)
    for k in range(30):
        number = gate.numbers.after(number)
        gate.sent(tcp(number, 1, 3, 0, 6, 0, 7))
        answered = gate.received(tcp(number, *body)) != b""
        assert answered or k == 0
        if not answered:
            return  # nothing was known before the first answer


@pytest.mark.slow
@given(
    st.integers(0, 0xFFFF), st.integers(-120, 120), st.integers(1, 64_999), st.sampled_from([2, 4])
)
@example(0x3CC0, -150, 0x3BC0, 4)
def test_no_answer_is_refused_for_a_register_that_moves_across_the_transactions(
    value: int, step: int, number: int, registers: int
) -> None:
    """A length in 10 um at 0.15 m/s and 100 readings/s, beside two devices that stand still."""
    gate = TcpAnswerGate()
    for k in range(300):
        moving = (6, (value + k * step) & 0xFFFF, 0, 0)[:registers]
        for unit, words in ((1, (97, 0)), (2, moving), (3, (235,))):
            number = gate.numbers.after(number)
            data = b"".join(word.to_bytes(2) for word in words)
            gate.sent(tcp(number, unit, 3, 0, 0, 0, len(words)))
            answer = tcp(number, unit, 3, len(data), *data)
            answered = gate.received(answer) == answer
            assert answered or k < 3
            if not answered:
                return  # a number from before the first answers


def test_a_device_with_two_blocks_has_both_of_them_left_out() -> None:
    """The status block that is read after the value does not make its registers forgotten."""
    gate, number = TcpAnswerGate(), 0x0F02
    for start, word in ((6, 0x1388), (7, 1)):
        number = gate.numbers.after(number)
        gate.sent(tcp(number, 1, 3, 0, start, 0, 1))
        assert gate.received(tcp(number, 1, 3, 2, *word.to_bytes(2)))
    assert gate.numbers.after(0x1387) != 0x1388


@given(
    st.lists(st.lists(st.integers(0, 0xFFFF), min_size=1, max_size=20), max_size=120),
    st.integers(1, 65_000),
)
def test_transaction_numbers_repeat_only_after_most_of_them_were_used(
    blocks: list[list[int]], number: int
) -> None:
    """A number that is used again soon could be that of a late reply."""
    gate = TcpAnswerGate()
    for unit, words in enumerate(blocks):
        gate.numbers.note(bytes((unit,)), b"".join(word.to_bytes(2) for word in words))
    used = set()
    for _ in range(2000):
        number = gate.numbers.after(number)
        assert 1 <= number <= 65_000
        assert number not in used
        used.add(number)


def test_what_was_not_answered_in_time_ends_the_connection() -> None:
    gate = asked_tcp()
    assert not gate.expire()
    assert gate.broken


@given(st.lists(st.binary(max_size=20), max_size=5), st.sampled_from(["rtu", "tcp"]))
def test_noise_never_passes_and_never_raises(noise: list[bytes], framing: str) -> None:
    gate = asked() if framing == "rtu" else asked_tcp()
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


@given(st.integers(0, 0x08FF), st.integers(0, 0xFFFF), st.integers(0, 0xFFFF))
@example(1, 2, 5)
def test_the_answer_to_a_write_passes_whatever_it_looks_like(
    before: int, transaction: int, address: int
) -> None:
    """It repeats the request: ``00 05 00 01`` ends as the head of transaction 1 begins."""
    gate = TcpAnswerGate()
    gate.sent(tcp(before, 1, 3, 0, 6, 0, 2))
    assert gate.received(tcp(before, 1, 3, 4, 9, 9, 9, 9))
    high, low = address.to_bytes(2, "big")
    gate.sent(tcp(transaction, 1, 16, high, low, 0, 1, 2, 0, 99))
    answer = tcp(transaction, 1, 16, high, low, 0, 1)
    assert gate.received(answer) == answer
    assert not gate.broken
