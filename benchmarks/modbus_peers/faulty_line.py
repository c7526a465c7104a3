"""A Modbus line between client and server that delays, cuts, joins, copies, reorders replies.

``faulty_line.py tcp PORT`` forwards to a server on 127.0.0.1 and prints its own port;
``faulty_line.py rtu`` prints two pseudo-terminals, the server's and the client's. Written from the
Modbus specifications (Application Protocol V1.1b3, Serial Line V1.02, TCP/IP Guide V1.0b) alone; it
knows frames and no device, and shares no code with winchkit.

Over TCP a held reply may also be handed over on a later connection, or, as some gateways do with
what their serial line says too late, as the answer to a later request (``retag``). Statistics come
as one JSON line on stdout when the input ends.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import random
import struct
import sys
import tty
from collections import Counter, deque
from collections.abc import Callable

FAULTS = (
    "late", "late in order", "cut", "join", "swap", "late then cut", "cut then copy", "copy",
    "split", "lost", "noise before", "noise behind",
)  # fmt: skip
ONLY_TCP = ("retag",)
ONLY_RTU = ("damaged",)
GAP = 0.003
COPY_REQUESTS = 2
"""Three requests in a row differ in length; a later copy cannot be distinguished from an answer."""
HELD = 0.3
"""So long a reply that waits for the next one is held at most, s."""


def crc(frame: bytes) -> bytes:
    """CRC-16/MODBUS, bit by bit, low byte first."""
    register = 0xFFFF
    for byte in frame:
        register ^= byte
        for _ in range(8):
            register = register >> 1 ^ (0xA001 if register & 1 else 0)
    return register.to_bytes(2, "little")


def request_size(data: bytes, rtu: bool) -> int:
    """Size of the request that data begins with, 0 where that is not known yet."""
    if not rtu:
        return 6 + struct.unpack_from(">H", data, 4)[0] if len(data) >= 6 else 0
    if len(data) < 7:
        return 0
    return 9 + data[6] if data[1] == 16 else 8


def reply_size(data: bytes, rtu: bool) -> int:
    """Size of the reply that data begins with, 0 where that is not known yet."""
    if not rtu:
        return request_size(data, rtu=False)
    if len(data) < 3:
        return 0
    if data[1] & 0x80:
        return 5
    return 5 + data[2] if data[1] in (3, 4) else 8


class FaultyLine:
    """Decides what becomes of each reply."""

    def __init__(self, options: argparse.Namespace) -> None:
        self.rtu = options.kind == "rtu"
        self.share = options.share
        self.timeout = options.timeout
        self.latest = options.latest
        self.copy_within = options.copy_within
        only = ONLY_RTU if self.rtu else ONLY_TCP
        self.faults = [f for f in (*FAULTS, *only) if f not in options.without]
        self.random = random.Random(options.seed)
        self.done: Counter[str] = Counter()
        self.to_client: Callable[[bytes], None] = lambda _data: None
        self.held: list[tuple[str, bytes]] = []
        self.stale: deque[bytes] = deque()
        """PDUs that are handed over as answers to later requests."""
        self.jammed_until = 0.0
        self.requests = 0
        """Requests that were passed on."""

    def reply(self, frame: bytes) -> None:
        """Pass a reply of the server on, or not."""
        if self.held:
            self._release(frame)
            return
        if self.stale and not self.rtu:
            frame = frame[:4] + self.stale.popleft()
        if self.random.random() >= self.share:
            self._at(0.0, frame)
            return
        fault = self.random.choice(self.faults)
        self.done[fault] += 1
        getattr(self, "_" + fault.replace(" ", "_"))(frame)

    def _at(
        self, delay: float, data: bytes, hand_over: Callable[[bytes], None] | None = None
    ) -> None:
        loop = asyncio.get_running_loop()
        when = max(loop.time() + delay, self.jammed_until)

        def send() -> None:
            # The client may have changed since.
            (hand_over or self.to_client)(data)

        if when <= loop.time():
            send()
        else:
            loop.call_at(when, send)

    def _delay(self) -> float:
        if self.random.random() < 0.7:
            return self.random.uniform(0.0, 3 * self.timeout)
        return self.random.uniform(self.timeout, self.latest)

    def _part(self, frame: bytes) -> bytes:
        return frame[: self.random.randrange(1, len(frame))]

    def _late(self, frame: bytes) -> None:
        self._at(self._delay(), frame)

    def _late_in_order(self, frame: bytes) -> None:
        """Everything after it waits as well."""
        self.jammed_until = asyncio.get_running_loop().time() + self._delay()
        self._at(0.0, frame)

    def _cut(self, frame: bytes) -> None:
        self._at(0.0, self._part(frame))

    def _hold(self, how: str, frame: bytes) -> None:
        held = (how, frame)
        self.held.append(held)

        def give_up() -> None:
            if held in self.held:
                self.held.remove(held)
                self.to_client(frame)

        asyncio.get_running_loop().call_later(HELD, give_up)

    def _join(self, frame: bytes) -> None:
        self._hold("join", frame)

    def _swap(self, frame: bytes) -> None:
        self._hold("swap", frame)

    def _late_then_cut(self, frame: bytes) -> None:
        self._hold("late then cut", frame)

    def _release(self, frame: bytes) -> None:
        how, before = self.held.pop(0)
        if how == "join":
            self._at(0.0, before + frame)
        elif how == "swap":
            self._at(0.0, frame)
            self._at(self.random.choice((0.0, GAP, self.timeout / 2)), before)
        elif self.random.random() < 0.5:
            self._at(0.0, before)
            self._at(0.0, self._part(frame))
        else:
            # The other way round they join to a frame of the right head and length.
            self._at(0.0, self._part(frame) + before)

    def _cut_then_copy(self, frame: bytes) -> None:
        part = self._part(frame)
        if self.random.random() < 0.5:
            self._at(0.0, part + frame)
        else:
            self._at(0.0, part)
            self._at(GAP, frame)

    def _copy(self, frame: bytes) -> None:
        """Twice; at most ``COPY_REQUESTS`` later where a reply does not name its request."""
        asked = self.requests

        def hand_over(copy: bytes) -> None:
            if self.rtu and self.requests > asked + COPY_REQUESTS:
                self.done["copy left out"] += 1
            else:
                self.to_client(copy)

        self._at(0.0, frame)
        self._at(self.random.uniform(0.0, self.copy_within), frame, hand_over)

    def _split(self, frame: bytes) -> None:
        part = self._part(frame)
        self._at(0.0, part)
        self._at(GAP, frame[len(part) :])

    def _lost(self, _frame: bytes) -> None:
        pass

    def _noise(self) -> bytes:
        return self.random.randbytes(self.random.randint(1, 12))

    def _noise_before(self, frame: bytes) -> None:
        self._at(0.0, self._noise() + frame)

    def _noise_behind(self, frame: bytes) -> None:
        self._at(0.0, frame + self._noise())

    def _damaged(self, frame: bytes) -> None:
        data = bytearray(frame)
        data[self.random.randrange(len(data))] ^= 1 << self.random.randrange(8)
        self._at(0.0, bytes(data))

    def _retag(self, frame: bytes) -> None:
        """Too late for its request; the gateway takes it for the answer to the next one."""
        asyncio.get_running_loop().call_later(
            1.5 * self.timeout, lambda: self.stale.append(frame[4:])
        )


async def over_tcp(line: FaultyLine, port: int) -> None:
    """Serve one client after the other over one connection to the server."""
    from_server, to_server = await asyncio.open_connection("127.0.0.1", port)

    async def client(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        def send(data: bytes) -> None:
            if not writer.is_closing():
                writer.write(data)

        line.to_client = send
        try:
            while True:
                head = await reader.readexactly(6)
                to_server.write(head + await reader.readexactly(struct.unpack(">H", head[4:])[0]))
        except (asyncio.IncompleteReadError, ConnectionError):
            writer.close()

    server = await asyncio.start_server(client, "127.0.0.1", 0)
    print(server.sockets[0].getsockname()[1], flush=True)
    while True:
        head = await from_server.readexactly(6)
        line.reply(head + await from_server.readexactly(struct.unpack(">H", head[4:])[0]))


async def over_serial(line: FaultyLine) -> None:
    """Two pseudo-terminals with the line between them."""
    masters, slaves = zip(*(os.openpty() for _ in range(2)), strict=True)
    for slave in slaves:
        tty.setraw(slave)
    server, client = masters
    pending = {server: b"", client: b""}
    line.to_client = lambda data: os.write(client, data)

    def from_client() -> None:
        pending[client] += os.read(client, 4096)
        while (size := request_size(pending[client], rtu=True)) and len(pending[client]) >= size:
            frame, pending[client] = pending[client][:size], pending[client][size:]
            assert frame[-2:] == crc(frame[:-2]), "the client sends whole requests"
            line.requests += 1
            os.write(server, frame)

    def from_server() -> None:
        pending[server] += os.read(server, 4096)
        while (size := reply_size(pending[server], rtu=True)) and len(pending[server]) >= size:
            frame, pending[server] = pending[server][:size], pending[server][size:]
            assert frame[-2:] == crc(frame[:-2]), "the server sends whole replies"
            line.reply(frame)

    loop = asyncio.get_running_loop()
    loop.add_reader(client, from_client)
    loop.add_reader(server, from_server)
    print(os.ttyname(slaves[0]), os.ttyname(slaves[1]), flush=True)
    await asyncio.Event().wait()


async def main() -> None:
    """Run until the input ends."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", choices=("tcp", "rtu"))
    parser.add_argument("port", type=int, nargs="?", default=0)
    parser.add_argument("--seed", default="1")
    parser.add_argument("--share", type=float, default=0.1, help="of replies that go wrong")
    parser.add_argument("--timeout", type=float, default=0.03, help="the client's, s")
    parser.add_argument("--latest", type=float, default=0.3, help="longest delay, s")
    parser.add_argument("--copy-within", type=float, default=0.0, help="of a second copy, s")
    parser.add_argument("--without", nargs="*", default=())
    options = parser.parse_args()
    line = FaultyLine(options)
    task = asyncio.create_task(over_serial(line) if line.rtu else over_tcp(line, options.port))
    ended = asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
    done, _ = await asyncio.wait({task, ended}, return_when=asyncio.FIRST_COMPLETED)
    if task in done:
        task.result()
    print(json.dumps(line.done), flush=True)
    os._exit(0)


if __name__ == "__main__":
    asyncio.run(main())
