"""Executes a motion programme and logs one run per repeat and load."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from winchkit.bench.bench import Bench
from winchkit.bench.recorder import Recorder
from winchkit.bench.winch import Winch
from winchkit.errors import RunError, UsageError
from winchkit.schema.programme import Programme, Step

__all__ = ["Ask", "Progress", "run_programme"]

Ask = Callable[[Step], None]
"""Asks the operator to do something; returns when it is done, raises when it is refused."""
Progress = Callable[[int, int, Step], None]
"""Told the repeat, the step's number and the step before it is executed."""

_LEAD = 0.1
"""Logged at rest before the first and after the last motion of a run, s."""


def run_programme(
    bench: Bench,
    programme: Programme,
    folder: str | Path,
    ask: Ask,
    *,
    suffix: str = ".csv",
    progress: Progress = lambda _repeat, _number, _step: None,
) -> list[Path]:
    """Run every step of every repeat; returns the files written, in order.

    Files are ``<programme>-<load>kg-<repeat>.csv``, without the load where none is known. A
    question about a load that already hangs there is not asked again. At a question the winches
    are disabled. Raises whatever stops a motion; what was logged until then is kept.
    """
    execution = _Execution(bench, programme, Path(folder), ask, suffix)
    execution.folder.mkdir(parents=True, exist_ok=True)
    try:
        for repeat in range(1, programme.repeat + 1):
            for number, step in enumerate(programme.step, start=1):
                progress(repeat, number, step)
                execution.execute(repeat, step)
            execution.end_run()
    finally:
        execution.abandon()
    return execution.written


class _Execution:
    """State of a programme under way."""

    def __init__(
        self, bench: Bench, programme: Programme, folder: Path, ask: Ask, suffix: str
    ) -> None:
        self.folder = folder
        self.written: list[Path] = []
        self._bench, self._programme, self._ask, self._suffix = bench, programme, ask, suffix
        self._recorder: Recorder | None = None
        self._hanging = _declared_load(bench)

    def execute(self, repeat: int, step: Step) -> None:
        """One step; a motion starts the log of its run where none is open."""
        if step.ask is not None:
            self._question(step)
            return
        self._log(repeat)
        if step.hold is not None:
            self._hold(step.hold)
        else:
            self._move(step)

    def end_run(self) -> None:
        """Disable the winches and finish the file."""
        if self._recorder is not None:
            self._hold(_LEAD)
            self._bench.stop()
            self._finish()

    def abandon(self) -> None:
        """Keep what was logged, whatever happened."""
        if self._recorder is not None:
            self._finish()

    def _question(self, step: Step) -> None:
        if step.load_mass is not None and step.load_mass == self._hanging:
            return
        self.end_run()
        self._bench.stop()
        self._ask(step)
        if step.load_mass is not None:
            self._hanging = step.load_mass

    def _log(self, repeat: int) -> None:
        if self._recorder is not None:
            return
        name, about = self._programme.name, {"programme": self._programme.name}
        if self._hanging is not None:
            name = f"{name}-{self._hanging:g}kg"
            about["load_mass"] = f"{self._hanging:g} kg"
        about["repeat"] = str(repeat)
        self._recorder = self._bench.log(self.folder / f"{name}-{repeat}{self._suffix}", about)
        self._hold(_LEAD)

    def _finish(self) -> None:
        recorder, self._recorder = self._recorder, None
        if recorder is None:
            return
        recorder.close()
        self.written.append(recorder.path)
        if recorder.rows == 0:
            raise RunError(f"{recorder.path}: no reading came during the run; check the sensors")

    def _hold(self, duration: float) -> None:
        """Wait where it is, watching for whatever stops the bench."""
        clock = self._bench.clock
        end = clock.now() + duration
        while (left := end - clock.now()) > 0:
            self._bench.raise_trouble()
            clock.sleep(min(0.02, left))

    def _move(self, step: Step) -> None:
        chosen = self._winches(step.winch)
        for winch in chosen:
            length = winch.cable_length + step.by if step.by is not None else step.to
            if length is None:
                raise UsageError(f"a step of '{self._programme.name}' has nothing to do")
            winch.move_to(length, step.speed, step.acceleration, wait=False, hold=True)
        for winch in chosen:
            winch.wait()

    def _winches(self, name: str) -> list[Winch]:
        return list(self._bench.winch.values()) if name == "all" else [self._bench.named(name)]


def _declared_load(bench: Bench) -> float | None:
    """The load that the wiring file declares, when it is one for all winches."""
    masses = {winch.wiring.load_mass for winch in bench.winch.values()}
    return masses.pop() if len(masses) == 1 else None
