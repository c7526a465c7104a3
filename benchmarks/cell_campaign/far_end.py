"""A device that answers at once, for `cell_links.py`: ``far_end.py tcp`` or ``far_end.py rtu``.

Knows function 3 only and nothing of winchkit. Prints its port.
"""

from __future__ import annotations

import asyncio
import os
import sys
import tty

REGISTERS = [1 << 11, 0, 12345, 0, 12345, 0, 0, 0]


def crc(frame: bytes) -> bytes:
    """CRC-16/MODBUS."""
    register = 0xFFFF
    for byte in frame:
        register ^= byte
        for _ in range(8):
            register = register >> 1 ^ (0xA001 if register & 1 else 0)
    return register.to_bytes(2, "little")


def answer(unit: int, count: int) -> bytes:
    """Unit and PDU."""
    words = (REGISTERS * 2)[:count]
    return bytes((unit, 3, 2 * count)) + b"".join(word.to_bytes(2, "big") for word in words)


ANSWERS = {count: answer(1, count) for count in range(1, 16)}
FRAMES = {count: body + crc(body) for count, body in ANSWERS.items()}


async def serve_tcp(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Answer until the other side goes."""
    while query := await reader.read(512):
        body = ANSWERS[int.from_bytes(query[10:12], "big")]
        writer.write(query[:4] + len(body).to_bytes(2, "big") + body)


async def tcp() -> None:
    """Serve on a free port."""
    server = await asyncio.start_server(serve_tcp, "127.0.0.1", 0)
    print(server.sockets[0].getsockname()[1], flush=True)
    await server.serve_forever()


def rtu() -> None:
    """Serve at a pseudo-terminal."""
    master, slave = os.openpty()
    tty.setraw(slave)
    print(os.ttyname(slave), flush=True)
    pending = b""
    while True:
        pending += os.read(master, 512)
        while len(pending) >= 8:
            os.write(master, FRAMES[int.from_bytes(pending[4:6], "big")])
            pending = pending[8:]


if __name__ == "__main__":
    if sys.argv[1:] == ["tcp"]:
        asyncio.run(tcp())
    else:
        rtu()
