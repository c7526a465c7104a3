"""Lines that a live simulated bench executes, typed or sent by another process."""

from __future__ import annotations

import socketserver
import threading
from collections.abc import Callable
from pathlib import Path

from winchkit.errors import FileError, UsageError, WinchkitError, suggest
from winchkit.regular_file import file_errors
from winchkit.schema.programme import ALL
from winchkit.sim.live.bench import LiveBench
from winchkit.sim.live.client import REFUSED, address_file
from winchkit.units import parse

HELP = """\
load WINCH MASS     attach another load, e.g. load A 32 kg (WINCH may be all)
warm WINCH TEMP     set the temperature of cable and machine, e.g. warm A 35 degC
fault TARGET KIND   inject a fault into a device, e.g. fault A.cell silence
recover TARGET      end its lasting faults, e.g. recover A.cell
status              print the true state
quit                end the simulation"""


def obey(live: LiveBench, line: str) -> str:
    """Execute a line and return the reply; raises UsageError, NotPermitted."""
    word, _, rest = line.strip().partition(" ")
    first, _, more = rest.strip().partition(" ")
    if word == "load":
        mass = parse(more, "mass")
        for name in live.winches if first == ALL else [first]:
            live.hang(name, mass)
        return f"{more} on {first}"
    if word == "warm":
        temperature = parse(more, "temperature")
        for name in live.winches if first == ALL else [first]:
            live.warm(name, temperature)
        return f"{more} on {first}"
    if word == "fault":
        live.inject(first, more.strip())
        return f"{first}: {more.strip()}"
    if word == "recover":
        live.inject(first, "recover")
        return f"{first}: recovered"
    if word == "status":
        return _status(live)
    known = ["load", "warm", "fault", "recover", "status", "quit"]
    raise UsageError(f"unknown line '{word}'; use {', '.join(known)}{suggest(word, known)}")


def _status(live: LiveBench) -> str:
    with live.up_to_date():
        winches = [
            f"{name}: {winch.plant.cable_length:.4f} m, {winch.plant.tension:.1f} N, "
            f"{winch.plant.motor_velocity:.3f} rad/s, "
            f"{winch.plant.load_mass:g} kg, {winch.drive.state.name.lower().replace('_', ' ')}"
            for name, winch in live.winches.items()
        ]
        if live.robot is not None:
            x, y, z = live.robot.platform.position.tolist()
            winches.append(f"platform: x {x:.4f} m, y {y:.4f} m, z {z:.4f} m")
    return "; ".join([*winches, f"{live.overruns} late ticks, worst {live.worst_lateness:.3f} s"])


class ControlServer:
    """Takes lines on a loopback port within a ``with`` block.

    Its address is written to ``BENCH.toml.sim`` beside the bench file, where
    :mod:`winchkit.sim.live.client` reads it. ``quit`` calls ``on_quit``.
    """

    def __init__(self, live: LiveBench, bench_file: Path, on_quit: Callable[[], None]) -> None:
        self._file = address_file(bench_file)

        class Lines(socketserver.StreamRequestHandler):
            def handle(self) -> None:
                for raw in self.rfile:
                    line = raw.decode("utf-8", "replace").strip()
                    self.wfile.write((_reply(live, line, on_quit) + "\n").encode())

        self._server = socketserver.ThreadingTCPServer(("127.0.0.1", 0), Lines)
        self._server.daemon_threads = True
        self._thread = threading.Thread(
            target=self._server.serve_forever, args=(0.05,), name="sim-control", daemon=True
        )

    def __enter__(self) -> ControlServer:
        host, port = self._server.server_address[:2]
        try:
            with file_errors(self._file):
                self._file.write_text(f"{host!s}:{port}\n", encoding="utf-8")
        except FileError:
            self._server.server_close()
            raise
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._file.unlink(missing_ok=True)
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()


def _reply(live: LiveBench, line: str, on_quit: Callable[[], None]) -> str:
    if line == "quit":
        on_quit()
        return "ending"
    try:
        return obey(live, line)
    except WinchkitError as error:
        return REFUSED + str(error)
