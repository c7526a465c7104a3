"""Drives in a process of their own, at the other end of a pair of sockets."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

_PRIORITY = 60
"""Above the bench's: a drive answers at its own time, whatever this computer does."""


class FarDrives:
    """The process, and what is asked of it line by line."""

    def __init__(self, nodes: range, cycle: float) -> None:
        here, there = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.end = here
        self._process = subprocess.Popen(
            [
                sys.executable,
                __file__,
                str(there.fileno()),
                str(nodes.start),
                str(nodes.stop),
                str(cycle),
            ],
            pass_fds=(there.fileno(),),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])},
        )
        there.close()
        self._ask("ready")

    def commissioned(self) -> None:
        """From now on answer frames alone."""
        self._ask("run")

    def report(self) -> tuple[int, int, bool]:
        """Frames received and sent, and whether every drive is enabled."""
        received, sent, enabled = self._ask("report").split()
        return int(received), int(sent), enabled == "1"

    def close(self) -> None:
        """End the process."""
        with suppress(OSError):
            self._ask("end")
        self._process.wait(timeout=5)

    def _ask(self, what: str) -> str:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(what + "\n")
        self._process.stdin.flush()
        return self._process.stdout.readline().strip()


def _serve(end: int, first: int, last: int, cycle: float) -> None:
    """Commissionable drives until the command to run, then drives of frames alone."""
    import threading

    from can_cost.drives import Commissionable, Drives
    from can_cost.wire import SocketWire
    from winchkit import catalog
    from winchkit.schema.read import read_device

    with suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    wire = SocketWire(socket.socket(fileno=end))
    nodes = range(first, last)
    served: Any = Commissionable(
        wire, read_device(catalog.find("devices", "generic-cia402")), nodes
    )
    over = threading.Event()

    def serve() -> None:
        while not over.is_set():
            served.serve(0.02)

    server = threading.Thread(target=serve)
    for line in sys.stdin:
        answer = ""
        if line.startswith("run"):
            served.close()
            served = Drives(wire, nodes, cycle)
            server.start()
        elif line.startswith("report"):
            answer = f"{served.received} {served.sent} {int(served.enabled)}"
        print(answer, flush=True)
        if line.startswith("end"):
            break
    over.set()
    if server.is_alive():
        server.join()
    wire.close()


if __name__ == "__main__":
    _serve(int(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4]))
