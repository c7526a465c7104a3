"""Opens a bench by its bench file: ``with open_bench("bench.toml") as bench``."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from winchkit.arguments import path_of
from winchkit.bench.bench import Bench
from winchkit.bench.control.realtime import Request
from winchkit.bench.remote.server import StationServer
from winchkit.drivers.clock import Clock, MonotonicClock
from winchkit.schema.bench import BenchSpec
from winchkit.schema.read import read_bench


def open_bench(
    bench: str | Path | BenchSpec,
    clock: Clock | None = None,
    effect_files: Iterable[str | Path] = (),
    *,
    name: str = "",
    realtime: Request = False,
) -> Bench:
    """Open a bench: buses, drives commissioned and disabled, instruments polled.

    Use it in a ``with`` block: leaving it, by any exception, stops the winches. A bench process
    whose clients are all observers (``monitor``, ``log``) hands the bench over.

    Parameters
    ----------
    bench
        A bench file, or what it declares.
    clock
        The computer's monotonic clock by default; a ``SimulatedClock`` for simulated time.
    effect_files
        Python files with effects of your own that its profiles have, besides those that the bench
        file names.
    name
        What other clients see of this program; its file and process by default.
    realtime
        ``"try"`` takes what this computer permits of real-time settings for the whole process
        until the bench is closed, ``True`` demands them; ``bench.realtime`` says what was granted.
        By default the garbage collector leaves out the objects that exist at the opening, and
        nothing else of the process is changed.

    Returns
    -------
    Bench
        The open bench; this process owns it until it is closed.

    Raises
    ------
    FileError
        A file of the bench is missing or wrong.
    ConnectionLost
        A bus or a device does not answer (NoReply, DeviceRefused).
    NotPermitted
        Another program owns the bench, or real-time settings are demanded and refused.
    """
    spec = bench if isinstance(bench, BenchSpec) else read_bench(path_of(bench, "bench"))
    spec.require_winches()
    return Bench(
        spec.with_effects(effect_files),
        clock or MonotonicClock(),
        name,
        serve=StationServer,
        realtime=realtime,
    )
