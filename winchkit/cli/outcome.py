"""How a command ends: the one place where an error becomes a message and an exit code."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NoReturn

import click

from winchkit.errors import FileError, WinchkitError

__all__ = ["INTERNAL", "INTERRUPTED", "finish", "threads_abandoned"]

INTERRUPTED = 130
INTERNAL = 70
_DEBUG = "WINCHKIT_DEBUG"


def finish(call: Callable[[], object]) -> NoReturn:
    """Run a command and leave the process with its exit code.

    0 done, 1 the check failed, 2 usage, 3 bad file, 4 bus or device unreachable, 5 drive fault
    or limit, 130 interrupted, 70 a defect of winchkit itself.
    """
    try:
        result = call()
    except WinchkitError as error:
        _tell(str(error) if isinstance(error, FileError) else f"winchkit: {error}")
        sys.exit(error.exit_code)
    except click.ClickException as error:
        error.show()
        sys.exit(error.exit_code)
    except (click.Abort, KeyboardInterrupt) as error:
        interrupted = isinstance(error.__cause__ or error, KeyboardInterrupt)
        _tell("winchkit: interrupted" if interrupted else "winchkit: the input ended")
        sys.exit(INTERRUPTED if interrupted else 1)
    except Exception as error:
        if os.environ.get(_DEBUG):
            raise
        _tell(
            f"winchkit: internal error: {type(error).__name__}: {error} "
            f"(a defect of winchkit, please report it; {_DEBUG}=1 shows where)"
        )
        sys.exit(INTERNAL)
    sys.exit(result if type(result) is int else 0)


@contextmanager
def threads_abandoned() -> Iterator[None]:
    """Around what computes in threads and holds nothing open: Ctrl-C ends the process at once.

    Python would wait for the threads, for seconds.
    """
    try:
        yield
    except KeyboardInterrupt:
        _tell("winchkit: interrupted")
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(INTERRUPTED)


def _tell(message: str) -> None:
    click.echo(message, err=True)
