"""What an operator can do with a bench, the same in the owner's process and from outside it."""

from __future__ import annotations

from typing import Any, Protocol

from winchkit.bench.bench import Bench
from winchkit.bench.recorder import Recorder
from winchkit.bench.snapshot import to_dict

__all__ = ["LocalStation", "Station"]


class Station(Protocol):
    """An operator's place at a bench. Closing it ends what it has started."""

    def names(self) -> list[str]:
        """Winches there are."""

    def status(self) -> dict[str, Any]:
        """Newest snapshot as JSON has it."""

    def jog(self, winch: str | None, speed: float, hold: float) -> None:
        """Keep moving for ``hold`` seconds (rope speed, m/s, positive winds in)."""

    def step(self, winch: str | None, change: float, speed: float | None) -> None:
        """Start to change the cable length by ``change`` (m)."""

    def moving(self, winch: str | None) -> bool:
        """Whether a motion is under way; raises what stopped it."""

    def stop(self) -> None:
        """Quick-stop every winch; returns at rest."""

    def reset(self) -> None:
        """Clear trips and faults."""

    def tare(self, winch: str | None) -> float:
        """Tare a load cell; returns the tension after it, N."""

    def start_log(self, path: str) -> None:
        """Log to a file in the owner's process."""

    def log_rows(self) -> int:
        """Rows written so far."""

    def end_log(self) -> int:
        """Finish the log; returns its rows."""

    def close(self) -> None:
        """Stop what was started here, finish the log."""


class LocalStation:
    """A station in the process that owns the bench."""

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self._recorder: Recorder | None = None
        self._started: set[str] = set()

    def names(self) -> list[str]:
        """Winches there are."""
        return list(self._bench.winch)

    def status(self) -> dict[str, Any]:
        """Newest snapshot as JSON has it."""
        return to_dict(self._bench.snapshot)

    def jog(self, winch: str | None, speed: float, hold: float) -> None:
        """Keep moving for ``hold`` seconds."""
        chosen = self._bench.named(winch)
        self._started.add(chosen.name)
        chosen.jog(speed, hold=hold)

    def step(self, winch: str | None, change: float, speed: float | None) -> None:
        """Start to change the cable length."""
        chosen = self._bench.named(winch)
        self._started.add(chosen.name)
        chosen.move_by(change, speed, wait=False)

    def moving(self, winch: str | None) -> bool:
        """Whether a motion is under way."""
        chosen = self._bench.named(winch)
        if chosen.moving:
            return True
        chosen.wait()
        return False

    def stop(self) -> None:
        """Quick-stop every winch."""
        self._bench.stop_now()

    def reset(self) -> None:
        """Clear trips and faults."""
        self._bench.reset()

    def tare(self, winch: str | None) -> float:
        """Tare a load cell."""
        return self._bench.named(winch).tare()

    def start_log(self, path: str) -> None:
        """Start a log, ending the one before."""
        self.end_log()
        self._recorder = self._bench.log(path)

    def log_rows(self) -> int:
        """Rows written so far; raises what has ended the writing."""
        if self._recorder is None:
            return 0
        self._recorder.check()
        return self._recorder.rows

    def end_log(self) -> int:
        """Finish the log."""
        recorder, self._recorder = self._recorder, None
        if recorder is None:
            return 0
        recorder.close()
        return recorder.rows

    def close(self) -> None:
        """Ramp down what this station set in motion, finish its log."""
        for name in self._started:
            if self._bench.winch[name].moving:
                self._bench.winch[name].stop(wait=False)
        self.end_log()
