"""Where a command works: at the owner of the bench, at a bench process, or as its owner."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from winchkit.arguments import path_of
from winchkit.bench.drives.set_up_progress import tell_hardware, to_stderr
from winchkit.bench.ownership import digest_of, unless_stopped
from winchkit.bench.remote.client import RemoteStation
from winchkit.bench.remote.client import attach as attach_to_owner
from winchkit.bench.remote.identity import Client, client_name
from winchkit.bench.remote.process import can_spawn, spawn
from winchkit.bench.remote.requests import OwnerGone
from winchkit.errors import ConnectionLost, MotionError, NotPermitted, UsageError, WinchkitError
from winchkit.schema.bench import BenchSpec

if TYPE_CHECKING:
    from winchkit.bench.remote.operations import Station


_TIMEOUT = 15.0
"""For an owner that opens, closes or hands over the bench, s."""
_POLL = 0.05
"""s: not noticed by an operator."""


def attach(
    bench: str | Path,
    effect_files: Sequence[str | Path] = (),
    *,
    name: str = "",
    observer: bool = False,
) -> RemoteStation:
    """Take part in a bench that another process owns; start a bench process where there is none.

    Use it in a ``with`` block: leaving it stops what was started here.

    Parameters
    ----------
    bench
        A bench file.
    effect_files
        Python files with effects of your own that its profiles have.
    name
        What other clients see of this program; its file and process by default.
    observer
        Whether it orders no motion; an observer never keeps another program from owning the bench.

    Returns
    -------
    RemoteStation
        The operations of the commands: ``jog``, ``move``, ``stop``, ``status`` …

    Raises
    ------
    FileError
        A file of the bench is missing or wrong.
    ConnectionLost
        A bus, a device or the owner of the bench does not answer.
    NotPermitted
        The bench is on the interface ``virtual``, and this process does not own it.
    """
    from winchkit.schema.read import read_bench

    spec = read_bench(bench)
    files = [str(file) for file in effect_files]
    station = _attached(spec, files, name or client_name(), observer=observer)
    if station is None:
        raise NotPermitted(
            f"bench '{spec.name}' has no owner, and no process can be started for it (a bus "
            "of the interface 'virtual' is within one process); own it with open_bench"
        )
    return station


@contextmanager
def at_station(
    bench: str | Path | BenchSpec,
    effects: Sequence[str] = (),
    *,
    client: str = "",
    observer: bool = False,
) -> Iterator[Station]:
    """A station at the bench for a command: attached, or owning it where no bench process can.

    ``effects`` are files with effects of the user's own, ``client`` is the command's name. Raises
    FileError, ConnectionLost, NotPermitted, UsageError for effects that come too late.
    """
    from winchkit.schema.read import read_bench

    spec = bench if isinstance(bench, BenchSpec) else read_bench(path_of(bench, "bench"))
    name = client_name(client or None)
    remote = _attached(spec, effects, name, observer=observer)
    if remote is not None:
        # The process that opened it may have no terminal.
        tell_hardware(spec)
        with remote:
            yield remote
        return
    from winchkit.bench.open import open_bench
    from winchkit.bench.remote.station import LocalStation

    with open_bench(spec, effect_files=effects, name=name, realtime="try") as opened:
        station = LocalStation(opened, Client(name, observer=observer))
        try:
            yield station
        finally:
            station.close()


def _attached(
    spec: BenchSpec, effects: Sequence[str], name: str, *, observer: bool
) -> RemoteStation | None:
    """A station at the owner, starting a bench process where there is none; None where none can be.

    Raises MotionError where a stop came meanwhile, but for those who only look on.
    """
    spec.require_winches()
    with unless_stopped(spec) as check:
        station = _sought(spec, effects, name, observer=observer)
        if station is not None and not observer:
            try:
                check()
            except MotionError:
                station.close()
                raise
        return station


def _sought(
    spec: BenchSpec, effects: Sequence[str], name: str, *, observer: bool
) -> RemoteStation | None:
    """Seek the owner, or start a bench process.

    Two commands that come at once start two processes; one of them owns the bench, and both
    commands attach to it.
    """
    deadline = time.monotonic() + _TIMEOUT
    while True:
        late = time.monotonic() > deadline
        problem: WinchkitError | None
        station, problem = _owner(spec, name, observer=observer)
        if station is not None and serves(station, spec, effects, observer=observer):
            return station
        if station is None and problem is None:
            if not can_spawn(spec):
                return None
            try:
                problem = spawn(spec, effects)
            except OSError:
                return None
            if problem is not None:
                raise problem
        if late:
            raise problem or ConnectionLost(
                f"bench '{spec.name}': its owner has accepted no client for {_TIMEOUT:g} s"
            )
        time.sleep(_POLL)


def _owner(
    spec: BenchSpec, name: str, *, observer: bool
) -> tuple[RemoteStation | None, ConnectionLost | None]:
    """A station at whoever owns the bench, or why its owner accepts no client."""
    try:
        return attach_to_owner(spec, name=name, observer=observer), None
    except ConnectionLost as error:
        return None, error


def serves(
    station: RemoteStation,
    spec: BenchSpec,
    effects: Sequence[str] = (),
    *,
    observer: bool = False,
) -> bool:
    """Whether the owner has the bench as it is asked for; else it was asked to end, or it raises.

    A bench process that opened the bench before its files were changed is started anew, but for an
    observer, to whom it is reported.
    """
    changed = station.lends and station.digest != digest_of(spec)
    if changed and observer and not effects:
        to_stderr(
            f"bench '{spec.name}' was opened by {station.owner} with other files than these: what "
            "is shown and logged is by those; the next command that moves a winch opens it anew"
        )
        return True
    if not changed and not effects:
        return True
    wanted = digest_of(spec.with_effects(effects))
    if station.lends and station.digest == wanted:
        return True
    try:
        if not station.lends:
            raise UsageError(
                f"the bench is owned by {station.owner}, with its own effects; leave --effects out"
            )
        station.hand_over()
    except NotPermitted as error:
        raise NotPermitted(f"the bench was opened with other files than these; {error}") from None
    finally:
        station.close()
    return False


_GRACE = 0.5
"""For a program that takes the bench over, before a bench process is started, s."""
_Result = TypeVar("_Result")


def watch(
    bench_file: str | Path,
    client: str,
    use: Callable[[Station], _Result],
    lost: Callable[[str], None],
    effects: Sequence[str] = (),
) -> _Result:
    """Call ``use`` with a station that only looks on, and again with a new one after each loss.

    ``lost`` is called with a text when an owner has gone. Returns what ``use`` returns. Raises the
    errors of ``at_station`` where the bench cannot be reached any more.
    """
    while True:
        try:
            with at_station(bench_file, effects, client=client, observer=True) as station:
                return use(station)
        except OwnerGone as error:
            lost(f"{error}; connecting again")
            time.sleep(_GRACE)
