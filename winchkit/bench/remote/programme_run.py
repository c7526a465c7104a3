"""A motion programme that a client lets the owner's process execute, in a thread of its own."""

from __future__ import annotations

import logging
from contextlib import suppress
from pathlib import Path
from typing import Any

from winchkit import wings
from winchkit.bench.bench import Bench
from winchkit.bench.control.dead_man import LIFE_SIGN
from winchkit.bench.programme import earlier_runs, run_programme
from winchkit.bench.remote.identity import Client
from winchkit.drivers.scheduling import event_of, thread_of
from winchkit.errors import MotionError, NotPermitted, UsageError, WinchkitError
from winchkit.schema.programme import Programme, ProgrammeStep
from winchkit.schema.read import load
from winchkit.schema.robot_programme import RobotProgramme

_LOGGER = logging.getLogger(__name__)
_POLL = 0.02
"""Period in which a hold asks whether the programme goes on, s (winchkit.bench.programme)."""


class ProgrammeRun:
    """Executes a motion programme, or one of the bench's robot, for a client.

    The client commands every winch meanwhile. It must give a sign of life every
    :data:`~winchkit.bench.control.dead_man.LIFE_SIGN`, also during a hold; while a question waits
    for its answer the winches are disabled, and none is needed.

    ``suffix``: format, ``.csv`` or ``.mcap``. Raises FileError for a programme that cannot be read;
    UsageError for another kind of file, and where earlier runs would be lost; NotPermitted where
    another client commands a winch.
    """

    def __init__(
        self,
        bench: Bench,
        client: Client,
        path: str | Path,
        folder: str | Path,
        suffix: str = ".csv",
        *,
        replace: bool = False,
    ) -> None:
        declared = load(path).value
        if not isinstance(declared, Programme | RobotProgramme):
            raise UsageError(f"{path}: is no motion programme and no robot programme")
        if isinstance(declared, RobotProgramme):
            _ = bench.robot  # raises where the bench has none
        elif not replace and (held := earlier_runs(declared, folder, suffix)):
            raise UsageError(
                f"{held[0]} holds an earlier run of '{declared.name}'; name another folder"
            )
        self._bench, self._client, self._declared = bench, client, declared
        self._folder, self._suffix, self._replace = Path(folder), suffix, replace
        self._place = (0, 0)
        self._does = self._asks = self._error = ""
        self._files: list[Path] = []
        self._ended = self._leaving = False
        self._answered = event_of(bench.clock)
        with bench.commanders.acting(client):
            for winch in bench.winch:
                bench.commanders.claim(winch)
        self._thread = thread_of(bench.clock, self._run, "programme")
        self._thread.start()

    @property
    def ended(self) -> bool:
        """Whether nothing of it moves any more."""
        return self._ended

    def state(self) -> dict[str, Any]:
        """Where it is, as JSON has it.

        Returns: ``name``, ``repeats`` and ``steps`` (None for a robot's); ``repeat`` and ``step``
        under way, 0 before the first; ``does``: the step in words; ``asks``: a question that waits
        for :meth:`answer`, empty without one; ``ended``; ``error``: what ended it early; ``files``
        that were written.
        """
        declared = self._declared
        return {
            "name": declared.name,
            "repeats": declared.repeat,
            "steps": len(declared.step) if isinstance(declared, Programme) else None,
            "repeat": self._place[0],
            "step": self._place[1],
            "does": self._does,
            "asks": self._asks,
            "ended": self._ended,
            "error": self._error,
            "files": [str(path) for path in self._files],
        }

    def answer(self) -> None:
        """Answer the present request as done; raises UsageError where there is none."""
        if not self._asks:
            raise UsageError("the programme asks nothing now")
        self._answered.set()

    def begin_no_more(self) -> None:
        """End it with the motion under way; returns at once."""
        self._leaving = True
        self._answered.set()

    def end(self) -> None:
        """End it by a ramp; returns at rest."""
        self.begin_no_more()
        if not self._ended:
            with self._bench.commanders.acting(self._client), suppress(WinchkitError):
                self._bench.stop_commanded(list(self._bench.winch))
        self._thread.join()

    def _run(self) -> None:
        try:
            with self._bench.commanders.acting(self._client):
                try:
                    self._files = self._execute()
                finally:
                    with suppress(WinchkitError):
                        self._bench.stop_commanded(list(self._bench.winch))
        except WinchkitError as error:
            self._error = str(error)
        except Exception as error:
            _LOGGER.exception("a programme failed")
            self._error = f"internal error: {type(error).__name__}: {error}"
        finally:
            self._asks = ""
            self._ended = True

    def _execute(self) -> list[Path]:
        declared = self._declared
        if isinstance(declared, Programme):
            return run_programme(
                self._bench,
                declared,
                self._folder,
                self._ask,
                suffix=self._suffix,
                progress=self._at_step,
                check=self._require_going,
                replace=self._replace,
            )
        execute = wings.call("execute", declared)
        assert execute is not None, "its type names the wing"
        written: list[Path] = execute(
            self._bench,
            declared,
            self._folder,
            suffix=self._suffix,
            progress=self._at_motion,
            check=self._require_going,
            replace_files=self._replace,
        )
        return written

    def _at_step(self, repeat: int, number: int, step: ProgrammeStep) -> None:
        self._require_going()
        self._place, self._does = (repeat, number), step.words

    def _at_motion(self, repeat: int, number: int) -> None:
        self._require_going()
        self._place, self._does = (repeat, number), f"motion {number}" if repeat else "approach"

    def _require_going(self) -> None:
        """Raise MotionError where it is to end, or its client has fallen silent."""
        if self._leaving:
            raise MotionError("the programme was ended by its client")
        life = self._client.life
        if life is not None:
            life.pass_by(_POLL)
            if life.silence > LIFE_SIGN:
                raise NotPermitted(
                    f"{self._client.name} gave no sign of life for {LIFE_SIGN:g} s; its programme "
                    "was ended"
                )

    def _ask(self, step: ProgrammeStep) -> None:
        self._answered.clear()
        self._asks = step.ask or ""
        while not self._answered.wait(_POLL):
            self._bench.raise_trouble()
        self._asks = ""
        self._require_going()
