"""The SocketCAN interface on pairs of sockets, whose other end is Python's own socket module."""

from __future__ import annotations

import socket
import struct
import time
from collections.abc import Iterator
from types import SimpleNamespace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from winchkit.drivers.can.bus.socketcan import ReceivedFrame, SocketCan, _Messages, parse_socketcan

_TIMESTAMPNS, _RXQ_OVFL = 35, 40
_PACKET = struct.Struct("=IB3x8s")
DATA_FRAMES = st.lists(st.tuples(st.integers(0, 0x7FF), st.binary(max_size=8)), max_size=70)


def control(kind: int, content: bytes) -> bytes:
    """A control message as CMSG(3) lays it out, with the padding up to the next one."""
    word = struct.calcsize("@N")
    message = struct.pack("@Nii0N", struct.calcsize("@Nii0N") + len(content), 1, kind) + content
    return message + bytes(-len(message) % word)


def stamped(seconds: int, nanoseconds: int) -> bytes:
    return control(_TIMESTAMPNS, struct.pack("@ll", seconds, nanoseconds))


CONTROLS = st.one_of(
    st.builds(stamped, st.integers(0, 1 << 40), st.integers(0, 999_999_999)),
    st.builds(control, st.sampled_from([_RXQ_OVFL, 20]), st.binary(min_size=3, max_size=16)),
    st.builds(control, st.just(_TIMESTAMPNS), st.binary(max_size=16)),
    st.binary(max_size=32),
)
"""Time stamps, counts of drops, messages of another kind and fragments."""


@pytest.fixture(scope="module")
def ends() -> Iterator[tuple[SocketCan, socket.socket]]:
    here, there = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with here, there:
        yield SocketCan(SimpleNamespace(socket=here)), there


@settings(max_examples=20)
@given(frames=DATA_FRAMES)
def test_many_frames_are_sent_by_one_call(
    ends: tuple[SocketCan, socket.socket], frames: list[tuple[int, bytes]]
) -> None:
    """In their order, up to 64 of them; without any it sends nothing."""
    port, other = ends
    sent = port.send_together(frames)
    assert sent == min(64, len(frames))
    for identifier, data in frames[:sent]:
        assert other.recv(100) == _PACKET.pack(identifier, len(data), data)


@settings(max_examples=20)
@given(frames=DATA_FRAMES)
def test_all_frames_that_wait_are_taken(
    ends: tuple[SocketCan, socket.socket], frames: list[tuple[int, bytes]]
) -> None:
    port, other = ends
    for identifier, data in frames:
        other.send(_PACKET.pack(identifier, len(data), data))
    taken = [*port.receive(0.001), *port.receive(0.001)]
    assert taken == [ReceivedFrame(identifier, data) for identifier, data in frames]


def test_frames_of_a_real_socket_have_the_time_stamp_of_the_kernel() -> None:
    here, there = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    with here, there:
        here.setsockopt(socket.SOL_SOCKET, _TIMESTAMPNS, 1)
        before = time.time()
        for number in range(3):
            there.send(_PACKET.pack(0x180 + number, 1, b"a"))
        after = time.time()
        frames = SocketCan(SimpleNamespace(socket=here)).receive(1.0)
    assert [frame.identifier for frame in frames] == [0x180, 0x181, 0x182]
    stamps = [frame.stamp for frame in frames]
    assert stamps == sorted(stamps)
    assert all(before - 1e-3 <= stamp <= after + 1e-3 for stamp in stamps)


@pytest.mark.parametrize(("flags", "ours"), [(0x800, True), (0x4, False), (0x0, False)])
def test_a_frame_that_this_socket_has_sent_is_marked_by_linux(
    ends: tuple[SocketCan, socket.socket], flags: int, ours: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """MSG_CONFIRM: of this socket; MSG_DONTROUTE: of another one of this computer."""
    port, other = ends
    receive = port._recvmmsg

    def marked(*arguments: object) -> int:
        """The flags of the first message as the kernel would set them in ``struct mmsghdr``."""
        count = int(receive(*arguments))
        struct.pack_into("@i", port._incoming._headers, struct.calcsize("@PIPNPN"), flags)
        return count

    monkeypatch.setattr(port, "_recvmmsg", marked)
    other.send(_PACKET.pack(0x201, 2, b"\x06\0"))
    assert list(port.receive(0.05)) == ([] if ours else [ReceivedFrame(0x201, b"\x06\0")])


def test_a_closed_socket_is_an_error() -> None:
    here, there = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    port = SocketCan(SimpleNamespace(socket=here))
    here.close()
    there.close()
    with pytest.raises(OSError, match="Bad file descriptor"):
        port.receive(0.05)
    assert port.send_together([(0x201, b"")]) == 0


def test_frames_with_their_control_messages() -> None:
    raw = _PACKET.pack(0x181, 3, b"abcgarba")
    assert parse_socketcan(raw, stamped(12, 500_000_000)) == (
        ReceivedFrame(0x181, b"abc", 12.5),
        None,
    )
    drops = control(_RXQ_OVFL, struct.pack("=I", 7))
    for both in (stamped(12, 0) + drops, drops + stamped(12, 0)):
        assert parse_socketcan(raw, both) == (ReceivedFrame(0x181, b"abc", 12.0), 7)
    assert parse_socketcan(raw, control(20, bytes(3)) + drops)[1] == 7, "of another kind"
    error = _PACKET.pack(0x20000040, 8, bytes(8))
    assert parse_socketcan(error, b"")[0] == ReceivedFrame(0x40, bytes(8), 0.0, error=True)


@settings(max_examples=50)
@given(raw=st.binary(max_size=20), extra=st.binary(max_size=64))
def test_no_content_of_the_kernel_s_memory_raises(raw: bytes, extra: bytes) -> None:
    frame, _ = parse_socketcan(raw, extra)
    assert frame is None or len(frame.data) <= 8


@settings(max_examples=200)
@given(
    messages=st.lists(
        st.tuples(
            st.sampled_from([0x181, 0x7FF, 0x20000040, 0x80000181, 0x40000181]),
            st.binary(max_size=8),
            st.sampled_from([16, 16, 16, 9]),
            st.lists(CONTROLS, max_size=3).map(b"".join),
        ),
        max_size=64,
    )
)
def test_messages_of_one_call_are_what_they_are_one_by_one(
    messages: list[tuple[int, bytes, int, bytes]],
) -> None:
    """Of the kernel's results only what ``struct mmsghdr`` says is read."""
    room = 128
    memory, expected = _Messages(room), []
    size_of = struct.calcsize("@PIPNPNi0PI0P")
    used_at, length_at = struct.calcsize("@PIPNP"), struct.calcsize("@PIPNPNi0P")
    newest = None
    for k, (identifier, data, length, extra) in enumerate(messages):
        raw = _PACKET.pack(identifier, len(data), data)
        memory._frames[k * 16 : k * 16 + 16] = raw
        memory._control[k * room : k * room + len(extra)] = extra
        struct.pack_into("@N", memory._headers, k * size_of + used_at, len(extra))
        struct.pack_into("@I", memory._headers, k * size_of + length_at, length)
        frame, drops = parse_socketcan(raw[:length], extra)
        expected += [] if frame is None else [frame]
        newest = newest if drops is None else drops
    assert memory.taken(len(messages)) == (expected, newest)


@pytest.mark.parametrize("identifier", [0x80000181, 0x40000181, 0xC0000181])
def test_long_identifiers_and_remote_frames_have_no_receiver(identifier: int) -> None:
    raw = _PACKET.pack(identifier, 0, bytes(8))
    assert parse_socketcan(raw, b"") == (None, None)
    assert parse_socketcan(raw[:9], b"") == (None, None)
