"""Executes a motion programme and logs one run per repeat and load."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from winchkit.arguments import require_type
from winchkit.bench.bench import Bench
from winchkit.bench.recording.recorder import Recorder
from winchkit.bench.winch import Winch
from winchkit.errors import RunError, UsageError
from winchkit.schema.programme import Programme, ProgrammeStep

Ask = Callable[[ProgrammeStep], None]
"""Asks the operator to do something; returns when it is done, raises when it is refused."""
Progress = Callable[[int, int, ProgrammeStep], None]
"""Called with the repeat, the step's number and the step before it is executed."""

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
    check: Callable[[], None] = lambda: None,
    replace: bool = False,
) -> list[Path]:
    """Run every step of every repeat of a motion programme.

    Parameters
    ----------
    bench : Bench
        An open bench.
    programme : Programme
        The motion programme.
    folder : str or Path
        Of the files.
    ask : callable
        Asks the operator a question of the programme.
    suffix : str
        Format, ``.csv`` or ``.mcap``.
    progress : callable, optional
        Called with repeat, number of the step, and step.
    check : callable, optional
        Called before each motion and every 20 ms of a hold; what it raises ends the programme.
    replace : bool
        Write over earlier runs of a programme of this name.

    Returns
    -------
    list of Path
        Files written, in order.

    Raises
    ------
    UsageError
        Before any motion, where runs of this name exist and are not to be replaced.
    NotPermitted, LimitTripped, DriveFault
        Before any motion and any file, for what forbids every motion.
    MotionError
        Whatever stops a motion; rows logged until then are kept. A reset and a new command are the
        caller's.

    Notes
    -----
    A programme with repeats begins where they end: the winches move there first, unlogged. Files
    are ``<programme>-<load>kg-<repeat>.csv``, without the load where none is known. A question
    about a load that this programme has hung already is not asked again. At a question the winches
    are disabled.
    """
    require_type(programme, Programme, "programme")
    if not replace and (held := earlier_runs(programme, folder, suffix)):
        earlier = f"{held[0]} holds an earlier run of '{programme.name}'"
        raise UsageError(f"{earlier}; name another folder, or replace=True")
    bench.require_motion()
    execution = _Execution(
        bench, programme, Path(folder), ask, suffix, check=check, replace=replace
    )
    execution.folder.mkdir(parents=True, exist_ok=True)
    numbered = list(enumerate(programme.step, start=1))
    try:
        for repeat in range(1, programme.repeat + 1):
            for part in _parts(numbered):
                execution.run(repeat, part, progress)
    finally:
        execution.abandon()
    return execution.written


def earlier_runs(programme: Programme, folder: str | Path, suffix: str = ".csv") -> list[Path]:
    """Files in a folder that runs of a programme of this name may be written over."""
    named = re.compile(re.escape(programme.name) + r"(-[\d.e+-]+kg)?-\d+[a-z]?" + re.escape(suffix))
    found = (path for path in Path(folder).glob(f"*{suffix}") if named.fullmatch(path.name))
    return sorted(found)


def _parts(steps: list[tuple[int, ProgrammeStep]]) -> list[list[tuple[int, ProgrammeStep]]]:
    """Steps cut where a question follows a motion; one about what is known is left out."""
    parts: list[list[tuple[int, ProgrammeStep]]] = []
    hanging: float | None = None
    warm: float | None = None
    for number, step in steps:
        if step.ask is not None:
            if not step.asks_beyond(hanging, warm):
                continue
            hanging = hanging if step.load_mass is None else step.load_mass
            warm = warm if step.temperature is None else step.temperature
        if not parts or (step.ask is not None and parts[-1][-1][1].ask is None):
            parts.append([])
        parts[-1].append((number, step))
    return parts


class _Execution:
    """State of a programme under way."""

    def __init__(
        self,
        bench: Bench,
        programme: Programme,
        folder: Path,
        ask: Ask,
        suffix: str,
        *,
        check: Callable[[], None],
        replace: bool,
    ) -> None:
        self.folder, self._check = folder, check
        self.written: list[Path] = []
        self._replace, self._stops = replace, bench.stops
        self._bench, self._programme, self._ask, self._suffix = bench, programme, ask, suffix
        self._recorder: Recorder | None = None
        self._approached = False
        asks = any(step.load_mass is not None for step in programme.step)
        # What hangs there now is known only once it was asked for: another programme may have
        # left another load than the wiring declares.
        self._hanging = None if asks else _declared_load(bench)
        self._warm: float | None = None

    def run(self, repeat: int, part: list[tuple[int, ProgrammeStep]], progress: Progress) -> None:
        """Ask what there is to ask, then log the motions."""
        for number, step in part:
            if step.ask is None:
                self.approach()
            progress(repeat, number, step)
            self.execute(repeat, step)
        self.end_run()

    def execute(self, repeat: int, step: ProgrammeStep) -> None:
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
        recorder = self._recorder
        if recorder is not None:
            self._hold(_LEAD)
            self._bench.stop()
            self.abandon()
            if recorder.rows == 0:
                raise RunError(
                    f"{recorder.path}: no reading came during the run; check the sensors"
                )

    def abandon(self) -> None:
        """Keep what was logged, whatever happened."""
        recorder, self._recorder = self._recorder, None
        if recorder is not None:
            recorder.close()
            self.written.append(recorder.path)

    def _question(self, step: ProgrammeStep) -> None:
        if not step.asks_beyond(self._hanging, self._warm):
            return
        self.end_run()
        self._bench.stop()
        self._ask(step)
        if step.load_mass is not None:
            self._hanging = step.load_mass
        if step.temperature is not None:
            self._warm = step.temperature

    def approach(self) -> None:
        """Move to the end of a repeat, unlogged, so that the first one starts there too."""
        if self._approached or self._programme.repeat == 1:
            return
        places = {
            name: way for name in self._bench.winch if (way := self._programme.approach(name))
        }
        for place in range(max(map(len, places.values()), default=0)):
            lengths = {name: way[min(place, len(way) - 1)] for name, way in places.items()}
            self._require_going()
            self._bench.move_together(lengths, self._fastest(), hold=True)
        self._approached = True

    def _fastest(self) -> float | None:
        """Of the programme's speeds: no faster than what is to come."""
        return max((step.speed for step in self._programme.step if step.speed), default=None)

    def _log(self, repeat: int) -> None:
        if self._recorder is not None:
            return
        name, about = self._programme.name, {"programme": self._programme.name}
        if self._hanging is not None:
            name = f"{name}-{self._hanging:g}kg"
            about["load_mass"] = f"{self._hanging:g} kg"
        about["repeat"] = str(repeat)
        path = self._free(f"{name}-{repeat}")
        self._recorder = self._bench.log(path, about, replace=self._replace)
        self._hold(_LEAD)

    def _free(self, name: str) -> Path:
        """Path of a run; a letter more where this programme has written one of that name."""
        for letter in ("", *"bcdefghijklmnopqrstuvwxyz"):
            path = self.folder / f"{name}{letter}{self._suffix}"
            if path not in self.written:
                return path
        raise UsageError(f"more than 26 runs would be named {name}; split the programme")

    def _require_going(self) -> None:
        """Raise what has stopped the bench, or ends the programme."""
        self._bench.raise_stop(self._stops)
        self._check()

    def _hold(self, duration: float) -> None:
        """Wait where it is, watching for whatever stops the bench."""
        clock = self._bench.clock
        end = clock.now() + duration
        while (left := end - clock.now()) > 0:
            self._require_going()
            clock.sleep(min(0.02, left))

    def _move(self, step: ProgrammeStep) -> None:
        """Move one winch or, started in one cycle and lasting equally long, all of them."""
        chosen = self._winches(step.winch)
        lengths = {name: self._target(step, winch) for name, winch in chosen.items()}
        self._require_going()
        self._bench.move_together(lengths, step.speed, step.acceleration, hold=True)

    def _target(self, step: ProgrammeStep, winch: Winch) -> float:
        length = winch.cable_length + step.by if step.by is not None else step.to
        if length is None:
            raise UsageError(f"a step of '{self._programme.name}' has nothing to do")
        return length

    def _winches(self, name: str) -> dict[str, Winch]:
        if name == "all":
            return self._bench.winch
        return {name: self._bench.named(name)}


def _declared_load(bench: Bench) -> float | None:
    """The load that the bench file declares, when it is one for all winches."""
    masses = {winch.wiring.load_mass for winch in bench.winch.values()}
    return masses.pop() if len(masses) == 1 else None
