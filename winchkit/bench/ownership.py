"""One process owns a bench: a lock that dies with its holder, and where to find the owner.

A stop leaves a mark, since an owner that still opens the bench cannot be found.
"""

from __future__ import annotations

import hashlib
import json
import os
import socket
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path

from winchkit import catalog
from winchkit.errors import ConnectionLost, MotionError, NotPermitted, WinchkitError
from winchkit.schema.bench import BenchSpec

_CONNECT_TIME = 2.0
"""s: an owner accepts at once; one under load within some tenths."""
_LOOK = 0.01
"""s, between two looks whether an owner has ended; short against the stop that waits for it."""


def digest_of(spec: BenchSpec) -> str:
    """SHA-1 of the bench file and of every file that it names; a missing one counts as empty."""
    absolute = replace(spec, path=os.path.abspath(spec.path), latch_file="")
    digest = hashlib.sha1(repr(absolute).encode(), usedforsecurity=False)
    for file in dict.fromkeys(_files_of(spec)):
        digest.update(b"\0")
        with suppress(OSError):
            digest.update(file.read_bytes())
    return digest.hexdigest()


def _files_of(spec: BenchSpec) -> Iterator[Path]:
    """Files that a bench file names, in its order; names that are not found are left out."""
    beside = spec.path or None
    for winch in spec.winch.values():
        with suppress(WinchkitError):
            yield catalog.find("profiles", winch.profile, beside)
        for ref in (winch.servo, winch.cell, winch.load, winch.length, winch.temperature):
            if ref is None:
                continue
            with suppress(WinchkitError):
                device = catalog.find("devices", ref.device, beside)
                yield device
                if ref is winch.servo:
                    yield from _eds_of(device)
            if ref.calibration is not None:
                yield Path(spec.path).parent / ref.calibration
    yield from spec.effect_files


def _eds_of(device: Path) -> tuple[Path, ...]:
    """EDS of a servo's device file; raises FileError for one that cannot be read."""
    from winchkit.schema.read import read_device

    servo = read_device(device).servo
    return () if servo is None else (device.parent / servo.eds,)


def log_path(spec: BenchSpec) -> Path:
    """Where a bench process writes what it has to say."""
    return _folder() / f"{_key(spec)}.log"


def owner_process(spec: BenchSpec) -> int | None:
    """Number of the process that opened the bench last; it may have ended since."""
    try:
        return int(_owner_file(spec).read_text().splitlines()[0])
    except (OSError, ValueError, IndexError):
        return None


def mark_stop(spec: BenchSpec) -> None:
    """Have every opening of the bench that is under way end; before its owner is looked for.

    The owner looks for the mark after it can be found: one of the two sees the other.
    """
    with suppress(OSError, NotPermitted):  # nothing keeps the stop from the drives
        _stop_file(spec).write_text(f"{os.getpid()} {time.monotonic_ns()}")


@contextmanager
def unless_stopped(
    spec: BenchSpec, doing: str = "opened: nothing was moved; give the command again"
) -> Iterator[Callable[[], None]]:
    """Yield a check that raises MotionError where a stop has come since; errors are that one, too.

    Whoever opens a bench calls it last, when the next stop would find it. ``doing`` says what was
    done to the bench, and what became of it.
    """
    before = _stops(spec)

    def check() -> None:
        if _stops(spec) != before:
            raise MotionError(f"a stop came while bench '{spec.name}' was being {doing}")

    try:
        yield check
    except WinchkitError:
        check()
        raise


def _stops(spec: BenchSpec) -> str:
    """What the last stop has left."""
    try:
        return _stop_file(spec).read_text()
    except OSError:
        return ""


def _stop_file(spec: BenchSpec) -> Path:
    return _folder() / f"{_key(spec)}.stop"


def _lock_file(spec: BenchSpec) -> Path:
    return _folder() / f"{_key(spec)}.lock"


def _owner_file(spec: BenchSpec) -> Path:
    return _folder() / f"{_key(spec)}.owner"


def _folder() -> Path:
    """A folder of this user's own for locks and sockets."""
    user = os.getuid() if hasattr(os, "getuid") else os.environ.get("USERNAME", "user")
    folder = Path(tempfile.gettempdir()) / f"winchkit-{user}"
    folder.mkdir(mode=0o700, exist_ok=True)
    if hasattr(os, "getuid") and folder.stat().st_uid != os.getuid():
        raise NotPermitted(f"{folder} belongs to another user; remove it or set TMPDIR")
    return folder


def _key(spec: BenchSpec) -> str:
    """The same for every file that names the same CAN buses."""
    buses = sorted(
        f"{bus.interface}/{bus.channel}/{bus.port}"
        + (f"/{os.getpid()}" if bus.interface == "virtual" else "")
        for bus in spec.bus.values()
        if bus.kind == "can"
    )
    return hashlib.sha1("|".join(buses).encode(), usedforsecurity=False).hexdigest()[:16]


def owner_name(spec: BenchSpec) -> str:
    """What the owner of the bench calls itself."""
    try:
        number, _, name = _owner_file(spec).read_text().partition("\n")
    except OSError:
        return "another process"
    return name or f"process {number}"


def _lock(descriptor: int) -> bool:
    """Take the lock if it is free; the system lets it go when the process ends."""
    try:
        if sys.platform == "win32":
            import msvcrt

            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


class Ownership:
    """Holds a bench's lock until closed."""

    def __init__(self, spec: BenchSpec, name: str = "") -> None:
        """Own it as ``name``; raise NotPermitted, naming the owner, when another one does."""
        self._descriptor = os.open(_lock_file(spec), os.O_RDWR | os.O_CREAT, 0o600)
        if not _lock(self._descriptor):
            os.close(self._descriptor)
            raise NotPermitted(
                f"bench '{spec.name}' is owned by {owner_name(spec)}; one process owns a bench, "
                "use `winchkit stop`, `monitor`, `log` beside it or end it first"
            )
        _owner_file(spec).write_text(f"{os.getpid()}\n{name}")

    def close(self) -> None:
        """Let it go."""
        os.close(self._descriptor)


def await_end(spec: BenchSpec, within: float) -> None:
    """Return when no process owns the bench, after ``within`` (s) in any case."""
    end = time.monotonic() + within
    descriptor = os.open(_lock_file(spec), os.O_RDWR | os.O_CREAT, 0o600)
    try:
        while not _lock(descriptor) and time.monotonic() < end:
            time.sleep(_LOOK)
    finally:
        os.close(descriptor)


def listen(spec: BenchSpec) -> tuple[socket.socket, Path]:
    """A listening socket for the owner, and the file by which others find it.

    Raises NotPermitted where there can be none.
    """
    if hasattr(socket, "AF_UNIX"):
        path = _folder() / f"{_key(spec)}.sock"
        path.unlink(missing_ok=True)
        server = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            server.bind(str(path))
        except OSError as error:
            server.close()
            raise NotPermitted(
                f"{path}: cannot be opened for other commands: {error}; "
                "set TMPDIR to a folder with a short name that can be written"
            ) from error
    else:
        path = _folder() / f"{_key(spec)}.port"
        server = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        server.bind(("127.0.0.1", 0))
        path.write_text(json.dumps(server.getsockname()[1]))
    server.listen()
    return server, path


def connect_to_owner(spec: BenchSpec) -> socket.socket | None:
    """A connection to the process that owns the bench; None without one."""
    if hasattr(socket, "AF_UNIX"):
        client = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        address: str | tuple[str, int] = str(_folder() / f"{_key(spec)}.sock")
    else:
        path = _folder() / f"{_key(spec)}.port"
        if not path.is_file():
            return None
        client = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        address = ("127.0.0.1", int(path.read_text()))
    client.settimeout(_CONNECT_TIME)
    try:
        client.connect(address)
    except (FileNotFoundError, ConnectionRefusedError):
        client.close()
        return None
    except OSError as error:
        client.close()
        raise ConnectionLost(f"bench '{spec.name}': its owner does not answer: {error}") from error
    return client
