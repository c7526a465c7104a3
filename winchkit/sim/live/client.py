"""Client of a simulated bench in another process.

``winchkit sim serve`` writes ``BENCH.toml.sim`` beside ``BENCH.toml``, with the host and port at
which it takes lines such as ``load A 32 kg``. Without this file the bench is not simulated.
"""

from __future__ import annotations

import socket
from pathlib import Path

from winchkit.errors import ConnectionLost, DeviceRefused
from winchkit.schema.programme import ProgrammeStep

REFUSED = "refused: "
"""Start of the reply to a line that could not be executed."""
_TIMEOUT = 5.0
"""s: a simulation answers between two steps, within some tenths under load."""


def address_file(bench_file: str | Path) -> Path:
    """File with the address of the simulation of a bench file."""
    path = Path(bench_file)
    return path.with_name(path.name + ".sim")


def is_simulated(bench_file: str | Path) -> bool:
    """Whether ``sim serve`` wrote this bench file and is running."""
    return address_file(bench_file).is_file()


def send(bench_file: str | Path, line: str) -> str:
    """Send a line and return the reply; ConnectionLost, or DeviceRefused with the reason."""
    where = address_file(bench_file)
    try:
        host, _, port = where.read_text(encoding="utf-8").strip().partition(":")
        with socket.create_connection((host, int(port)), _TIMEOUT) as connection:
            connection.sendall(line.encode() + b"\n")
            reply = connection.makefile(encoding="utf-8").readline().strip()
    except (OSError, ValueError) as error:
        raise ConnectionLost(
            f"{where}: the simulation does not answer: {error}; start 'winchkit sim serve' again"
        ) from error
    if reply.startswith(REFUSED):
        raise DeviceRefused(f"the simulation refused '{line}': {reply.removeprefix(REFUSED)}")
    return reply


def answer(bench_file: str | Path, step: ProgrammeStep) -> bool:
    """Execute an operator request of a programme, where the bench is simulated.

    ``step``: a step with ``ask``; its ``load_mass`` and ``temperature`` are set. Returns: True
    where the request was executed, False for a real bench or another request. Raises
    ConnectionLost, DeviceRefused as of :func:`send`.
    """
    told = step.load_mass is not None or step.temperature is not None
    if not told or not is_simulated(bench_file):
        return False
    if step.load_mass is not None:
        send(bench_file, f"load {step.winch} {step.load_mass!r} kg")
    if step.temperature is not None:
        send(bench_file, f"warm {step.winch} {step.temperature!r} degC")
    return True
