"""The bench process: owns a bench for the commands that attach to it, and ends after the last.

``python -m winchkit.bench.remote.process BENCH [EFFECTS ...]``, started by :func:`spawn`. It runs
in a session of its own, without a terminal, and does nothing but the bench. Its last line on
stdout says whether the bench is open, or the error that kept it from opening; lines before it are
the progress of an opening that takes long.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, TextIO

from winchkit.bench.drives.set_up_progress import to_stderr
from winchkit.bench.ownership import log_path
from winchkit.bench.remote.handover import own_or_find
from winchkit.bench.remote.identity import client_name
from winchkit.bench.remote.interruption import interrupted_by_signals
from winchkit.errors import ConnectionLost, WinchkitError, class_name, error_of
from winchkit.schema.bench import BenchSpec

if TYPE_CHECKING:
    from winchkit.bench.bench import Bench

LINGER = 3.0
"""The process ends this long after its last client has left, s."""
_FIRST = 10.0
"""For the first client, which waits for the opening, s."""
_POLL = 0.02
"""s: the process ends that much later than it could."""
_DEFECT = "defect"
"""In the last line: an exception that is no error of winchkit's own."""
_PROGRESS = "progress"
"""In the lines before it."""


def can_spawn(spec: BenchSpec) -> bool:
    """Whether another process can reach the buses of this bench: those of ``virtual`` it cannot."""
    buses = [bus for bus in spec.bus.values() if bus.kind == "can"]
    return bool(sys.executable and spec.path) and all(b.interface != "virtual" for b in buses)


def spawn(spec: BenchSpec, effects: Sequence[str] = ()) -> WinchkitError | None:
    """Start a bench process and wait; returns why it could not open the bench. Raises OSError."""
    files = [os.path.abspath(file) for file in (spec.path, *effects)]
    command = [sys.executable, "-P", "-m", "winchkit.bench.remote.process", *files]
    with log_path(spec).open("ab") as said:
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=said,
            start_new_session=True,
            # In place of a session on Windows: Ctrl-C of the client's terminal does not reach it.
            creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
        )
    assert process.stdout is not None, "it is a pipe"
    with process.stdout as replies:
        line = replies.readline()
        while line and _PROGRESS in (reply := json.loads(line)):
            to_stderr(reply[_PROGRESS])
            line = replies.readline()
    if sys.platform != "win32":
        process.wait()  # it has left the bench to a process of its own; on Windows it is the bench
    return _error(spec, line)


def _error(spec: BenchSpec, line: bytes) -> WinchkitError | None:
    """The error in the last line of a bench process; None where it or another owns the bench."""
    if not line:
        message = f"the bench process ended without opening the bench; see {log_path(spec)}"
        return ConnectionLost(message)
    reply = json.loads(line)
    if _DEFECT in reply:
        message = (
            f"the bench process failed: {reply[_DEFECT]} (a defect of winchkit, please report it "
            f"with {log_path(spec)})"
        )
        return WinchkitError(message)
    if "error" in reply:
        return error_of(reply["error"], reply["message"])
    return None


def main() -> None:
    """Own the bench that the command line names until the last client has left."""
    bench_file, *effects = sys.argv[1:]
    _detach()
    # What it writes later goes nowhere but to its log: the client that waits has gone by then.
    report = os.fdopen(os.dup(sys.stdout.fileno()), "w")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    with interrupted_by_signals() as interruption:
        try:
            _own(bench_file, effects, report)
        except WinchkitError as error:
            _report(report, {"error": class_name(error), "message": str(error)})
            sys.stderr.write(f"{client_name('bench')}: {error}\n")
            sys.exit(error.exit_code)
        except KeyboardInterrupt:
            sys.stderr.write(f"{client_name('bench')}: {interruption.words}\n")
            sys.exit(interruption.exit_code)
        except Exception as error:
            _report(report, {_DEFECT: f"{type(error).__name__}: {error}"})
            raise  # its traceback is in the log


def _own(bench_file: str, effects: Sequence[str], report: TextIO) -> None:
    from winchkit.bench.bench import Bench
    from winchkit.bench.remote.server import StationServer
    from winchkit.drivers.clock import MonotonicClock
    from winchkit.schema.read import read_bench

    spec, name = read_bench(bench_file), client_name("bench process")
    ownership = own_or_find(spec, name)
    if ownership is None:
        _report(report, {"owned": True})
        return
    clock = MonotonicClock()
    spec = spec.with_effects(effects)

    def tell(line: str) -> None:
        to_stderr(line)
        _write(report, {_PROGRESS: line})

    with Bench(
        spec, clock, name, ownership, serve=StationServer, realtime="try", tell=tell
    ) as bench:
        bench.stations.may_hand_over = True
        _report(report, {"ok": True})
        _serve(bench)


def _serve(bench: Bench) -> None:
    """Wait until no client needs the bench any more; raises what ended the control loop."""
    left, timeout = time.monotonic(), _FIRST
    while not bench.stations.handed_to and bench.loop.alive:
        now = time.monotonic()
        if bench.stations.clients:
            left, timeout = now, LINGER
        elif now - left > timeout and bench.stations.close_door():
            return
        time.sleep(_POLL)


def _detach() -> None:
    """Leave the client's process tree, so that it has no child to wait for."""
    if hasattr(os, "fork") and os.fork():
        os._exit(0)


def _report(report: TextIO, reply: dict[str, object]) -> None:
    """Write the last line, once."""
    if report.closed:
        return
    with suppress(OSError), report:  # the client that waited may have gone
        _write(report, reply)


def _write(report: TextIO, reply: dict[str, object]) -> None:
    with suppress(OSError):
        report.write(json.dumps(reply) + "\n")
        report.flush()


if __name__ == "__main__":
    main()
