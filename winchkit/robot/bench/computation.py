"""Computations for a bench in motion, at once or in a process of their own.

A plan takes some 50 ms of Python, a fit seconds to minutes. In the process of the control loop they
hold the interpreter lock and a processor at the priority of the bench: with real-time settings they
delay the loop and every other program, the simulator of a served robot included.
:class:`ComputationProcess` computes them in a second interpreter with ordinary priority.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any, Protocol, Self, TypeVar

from winchkit.errors import WinchkitError

T = TypeVar("T")
_POLL = 0.02
"""Between two looks at the bench while a result is awaited, s."""
_END = 2.0
"""Given to the process to end by itself, s."""


class Computation(Protocol):
    """Where functions without side effects are computed."""

    def __call__(
        self, meanwhile: Callable[[], None], function: Callable[..., T], /, *arguments: Any
    ) -> T:
        """Result of ``function(*arguments)``, or what it raises; ``meanwhile`` is called again and
        again until then, and ends the wait by what it raises."""


def at_once(meanwhile: Callable[[], None], function: Callable[..., T], /, *arguments: Any) -> T:
    """Compute in the thread of the caller."""
    meanwhile()
    return function(*arguments)


class ComputationProcess:
    """Another Python process that computes; a context manager.

    Functions are those of a module, arguments and results are pickled. The process ends with the
    ``with`` block, and with this process however that ends. A script that starts one needs
    ``if __name__ == "__main__":``, as every program that uses :mod:`multiprocessing`.
    """

    def __init__(self) -> None:
        """Start it; it takes a second before the first result."""
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(
            target=_serve, args=(theirs,), name="computation", daemon=True
        )
        self._process.start()
        theirs.close()

    def __call__(
        self, meanwhile: Callable[[], None], function: Callable[..., T], /, *arguments: Any
    ) -> T:
        """Result of ``function(*arguments)``; raises what it or ``meanwhile`` raises, and
        WinchkitError where the process has ended."""
        try:
            self._pipe.send((function, arguments))
            while not self._pipe.poll(_POLL):
                meanwhile()
            result, error = self._pipe.recv()
        except (EOFError, BrokenPipeError, ConnectionResetError) as gone:
            self._process.join(_END)
            raise WinchkitError(
                f"the process that plans and fits has ended (exit {self._process.exitcode}); "
                "repeat the command, and look at the memory of this computer"
            ) from gone
        if error is not None:
            raise error
        found: T = result
        return found

    def close(self) -> None:
        """End the process; an unfinished computation is given up. Twice does no harm."""
        self._pipe.close()
        self._process.terminate()
        self._process.join(_END)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _serve(pipe: Connection) -> None:
    """Compute what the pipe asks for until its other end is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends it
    if hasattr(os, "sched_setscheduler"):
        # A parent with real-time priority has passed it on.
        with suppress(PermissionError):
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    with suppress(EOFError, BrokenPipeError, ConnectionResetError):
        while True:
            function, arguments = pipe.recv()
            result, failure = None, None
            try:
                result = function(*arguments)
            except Exception as error:  # noqa: BLE001 - raised in the process that asked
                failure = error
            pipe.send((result, failure))
