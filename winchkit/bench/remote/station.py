"""A station in the process that owns the bench."""

from __future__ import annotations

from typing import Any

from winchkit.bench.bench import Bench
from winchkit.bench.cells.tasks import do
from winchkit.bench.control.dead_man import LIFE_SIGN, DeadMan
from winchkit.bench.control.homing_motion import HomingRequest
from winchkit.bench.recording.recorder import OwnedLog, counters_of
from winchkit.bench.remote.identity import Client, client_name
from winchkit.bench.remote.operations import Station
from winchkit.bench.remote.programme_run import ProgrammeRun
from winchkit.errors import UsageError


class LocalStation(OwnedLog, Station):
    """A station in the process that owns the bench."""

    def __init__(self, bench: Bench, client: Client | None = None) -> None:
        """A place for ``client``; without one for an unnamed station of this process."""
        self.client = client or Client(client_name("station"))
        self._bench = bench

    def home(
        self, winch: str | None, method: int | None, at: float | None, speed: float | None
    ) -> None:
        asked = HomingRequest(method, at, speed)
        with self._acting():
            self._homing = self._bench.homing(self._bench.named(winch).name, asked)
            next(self._homing, None)
        self._led = DeadMan(self.clock.now() + LIFE_SIGN)

    def counters(self) -> dict[str, dict[str, Any]]:
        if self._recorder is not None:
            return self._recorder.counters()
        return counters_of({name: winch.sensors for name, winch in self._bench.winch.items()})

    def start_programme(
        self, path: str, folder: str, suffix: str = ".csv", replace: bool = False
    ) -> None:
        if self._programme is not None and not self._programme.ended:
            raise UsageError("a programme of this client is under way; end it first")
        self._programme = ProgrammeRun(
            self._bench, self.client, path, folder, suffix, replace=replace
        )

    def cell(self, task: str, name: str, *arguments: Any) -> dict[str, Any]:
        return do(self._bench.cells, task, name, *arguments)

    def begin_no_more(self) -> None:
        """Let this station's programme begin no further motion: the bench is closed."""
        if self._programme is not None:
            self._programme.begin_no_more()

    def close(self) -> None:
        """Ramp down what this station set in motion, finish its log; returns at rest.

        With it stop the winches without commander, unless ``stop_together`` is false.
        """
        commanders = self._bench.commanders
        moved = [name for name in commanders.held_by(self.client) if self._bench.winch[name].moving]
        try:
            self.end_programme()
            with self._acting():
                if self._homing is not None:
                    self._homing.close()
                if moved:
                    self._bench.stop_commanded(moved)
        finally:
            commanders.leave(self.client)
            self.end_log()
