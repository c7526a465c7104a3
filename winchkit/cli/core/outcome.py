"""How a command ends: the one place where an error becomes a message and an exit code."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import NoReturn

import click

from winchkit.bench.remote.interruption import Interruption, interrupted_by_signals
from winchkit.cli.core.terminal import escaped_output
from winchkit.errors import Fault, FileError, WinchkitError

INTERRUPTED = 130
"""128 + SIGINT (2), the convention of shells."""
CLOSED = 129
"""128 + SIGHUP (1)."""
INTERNAL = 70
"""``EX_SOFTWARE`` of ``sysexits.h``: an error of winchkit itself."""
_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
"""Numbers of errors that have no file name when a stream is written: no space, a quota, a limit."""
_DEBUG = "WINCHKIT_DEBUG"


def finish(call: Callable[[], object]) -> NoReturn:
    """Run a command and leave the process with its exit code.

    0 done, 1 the check failed, 2 usage, 3 bad file, 4 bus or device unreachable, 5 drive fault
    or limit, 130 interrupted (143 by SIGTERM, 129 by SIGHUP or a closed terminal, in the same
    way), 70 a defect of winchkit itself.
    """
    with escaped_output(), interrupted_by_signals() as interruption:
        sys.exit(_run(call, interruption))


def _run(call: Callable[[], object], interruption: Interruption) -> int:
    """Run a command; returns its exit code."""
    try:
        result = call()
    except WinchkitError as error:
        _tell(str(error) if isinstance(error, FileError) else f"winchkit: {error}")
        return error.exit_code
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except (click.Abort, KeyboardInterrupt) as error:
        if not interruption.note(_interrupt(error)):
            _tell("winchkit: the input ended")
            return 1
    except Exception as error:
        # A terminal that was closed refuses what is still to be said; the stop is done then.
        if not interruption.note(_interrupt(error)):
            if os.environ.get(_DEBUG):
                raise
            return _failed(error)
    else:
        return result if type(result) is int else 0
    _tell(f"winchkit: {interruption.words}")
    return interruption.exit_code


def _failed(error: Exception) -> int:
    """Report what the operating system refused, else a defect of winchkit; gives the exit code."""
    if isinstance(error, OSError):
        place = error.filename if isinstance(error.filename, str) else ""
        if not place and error.errno == errno.EIO and any(_is_hung_up(fd) for fd in range(3)):
            _tell("winchkit: the terminal was closed")
            return CLOSED
        if place or error.errno in _FULL:
            fault = Fault(f"cannot be used: {error.strerror}", place or "standard output")
            _tell(str(FileError(fault)))
            return FileError.exit_code
    _tell(
        f"winchkit: internal error: {type(error).__name__}: {error} "
        f"(a defect of winchkit, please report it; {_DEBUG}=1 shows where)"
    )
    return INTERNAL


def _is_hung_up(stream: int) -> bool:
    """Whether a stream is a terminal that was closed, without a SIGHUP as under ``nohup``."""
    try:
        os.get_terminal_size(stream)
    except OSError as error:
        return error.errno == errno.EIO
    return False


def _interrupt(error: BaseException) -> BaseException | None:
    """The interrupt that an error came from, or during whose handling it came."""
    found: BaseException | None = error
    while found is not None and not isinstance(found, KeyboardInterrupt):
        found = found.__cause__ or found.__context__
    return found


@contextmanager
def threads_abandoned() -> Iterator[None]:
    """Around computations in threads: Ctrl-C ends the process at once, where Python would wait."""
    try:
        yield
    except KeyboardInterrupt as error:
        interruption = Interruption()
        interruption.note(error)
        _tell(f"winchkit: {interruption.words}")
        with suppress(OSError):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(interruption.exit_code)


def _tell(message: str) -> None:
    """Say it on stderr, where there still is one."""
    with suppress(OSError):
        click.echo(message, err=True)
