"""A station in the process that owns the bench."""

from __future__ import annotations

from winchkit.bench.bench import Bench
from winchkit.bench.recording.recorder import OwnedLog
from winchkit.bench.remote.identity import Client, client_name
from winchkit.bench.remote.operations import Station


class LocalStation(OwnedLog, Station):
    """A station in the process that owns the bench."""

    def __init__(self, bench: Bench, client: Client | None = None) -> None:
        """A place for ``client``; without one for an unnamed station of this process."""
        self.client = client or Client(client_name("station"))
        self._bench = bench

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
