"""The operations of a bench: one table, from which client and server are derived.

An operation has its signature, its description and what the owner's process does here, those that
move the winches in ``motion_operations``. What only that needs is imported when it is done.
"""

# mypy: disable-error-code="empty-body"

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from winchkit.bench.control.snapshot import to_dict
from winchkit.bench.remote.motion_operations import MotionStation
from winchkit.bench.remote.operation import operation
from winchkit.errors import UsageError

if TYPE_CHECKING:
    from winchkit.bench.recording.recorder import Recorder
    from winchkit.bench.remote.programme_run import ProgrammeRun
    from winchkit.drivers.can.bus.frame_tap import SeenFrame
    from winchkit.drivers.reading import Sensor


class Station(MotionStation):
    """An operator's place at a bench: its motions, state, logs, programmes and devices."""

    _recorder: Recorder | None = None
    _programme: ProgrammeRun | None = None

    @operation()
    def names(self) -> list[str]:
        """Winches there are."""
        return list(self._bench.winch)

    @operation()
    def status(self) -> dict[str, Any]:
        """Newest snapshot and the health of the CAN buses, as JSON has them."""
        buses = {name: asdict(item) for name, item in self._bench.bus_health.items()}
        for item in buses.values():
            item["state"] = item["state"].value
        return {
            **to_dict(self._bench.snapshot),
            "cycle_time": {
                "period": self._bench.loop.cycle,
                "counts": list(self._bench.loop.cycle_counts),
            },
            "bus": buses,
            "tare": {
                name: _tare(winch.sensors["cell"])
                for name, winch in self._bench.winch.items()
                if "cell" in winch.sensors
            },
            "realtime": [asdict(item) for item in self._bench.realtime.items],
            "not_commissioned": self._bench.not_commissioned,
            "owner": self._bench.commanders.owner.name,
            "clients": [client.name for client in self._bench.stations.clients],
        }

    @operation()
    def tare(self, winch: str | None) -> float:
        """Tare a load cell.

        Parameters
        ----------
        winch : str or None
            Winch; None for the only one.

        Returns
        -------
        float
            Tension after it, N.
        """
        return self._bench.named(winch).tare()

    @operation()
    def start_log(self, path: str, rotate: str | None = None, replace: bool = False) -> None:
        """Log to a file in the owner's process.

        Parameters
        ----------
        path : str
            File, absolute.
        rotate : str, optional
            Size or duration of a part, such as ``100MB``.
        replace : bool
            Remove an earlier log of that name.
        """
        self.end_log()
        self._recorder = self._bench.log(path, rotate=rotate, replace=replace)

    @operation()
    def log_rows(self) -> int:
        """Rows written so far."""

    @operation()
    def end_log(self) -> int:
        """Finish the log; returns its rows."""

    @operation()
    def counters(self) -> dict[str, dict[str, Any]]:
        """Counts by instrument (``A.cell``), and for the log of this station."""
        from winchkit.bench.recording.recorder import counters_of

        if self._recorder is not None:
            return self._recorder.counters()
        return counters_of({name: winch.sensors for name, winch in self._bench.winch.items()})

    @operation()
    def trip_history(self) -> dict[str, Any] | None:
        """The cycles around the trip that is not reset yet; None without one.

        Returns
        -------
        dict or None
            ``at``: time of the trip, s; ``tripped`` and ``blocked``: message and forbidden
            direction of each; ``time``: of the cycles, s from the trip; ``winch``: motor
            angle, velocity and torque, tension, load, length of its instrument, cable length and
            speed of the drive, and commanded speed by winch, SI; ``events``: time and words.
        """
        return self._bench.trip_history.to_dict(self._bench.snapshot)

    @operation()
    def frames(self) -> dict[str, dict[str, Any]]:
        """Frames of each CAN bus by name, collected from the first call on while it is called.

        Returns
        -------
        dict of str to dict
            ``newest``: number, time (s), identifier and bytes in hexadecimal of each identifier's
            newest frame; ``last``: time, identifier and bytes of the last 200 frames.
        """
        return {
            name: {
                "newest": [[count, *_frame(item)] for count, item in tap.newest],
                "last": [_frame(item) for item in tap.last],
            }
            for name, tap in self._bench.frames().items()
        }

    @operation(begins=True)
    def start_programme(
        self, path: str, folder: str, suffix: str = ".csv", replace: bool = False
    ) -> None:
        """Execute a motion programme in the owner's process; it ends where no call comes for 0.5 s.

        Parameters
        ----------
        path : str
            Programme file, absolute.
        folder : str
            Of the runs, absolute.
        suffix : str
            Format, ``.csv`` or ``.mcap``.
        replace : bool
            Write over earlier runs of a programme of this name.
        """
        from winchkit.bench.remote.programme_run import ProgrammeRun

        if self._programme is not None and not self._programme.ended:
            raise UsageError("a programme of this client is under way; end it first")
        self._programme = ProgrammeRun(
            self._bench, self.client, path, folder, suffix, replace=replace
        )

    @operation()
    def programme(self) -> dict[str, Any] | None:
        """Where this station's programme is; None where it started none.

        Returns
        -------
        dict or None
            As of ``winchkit.bench.remote.programme_run.ProgrammeRun.state``.
        """
        return None if self._programme is None else self._programme.state()

    @operation(begins=True)
    def answer_programme(self) -> None:
        """Answer the programme's request as done; raises UsageError where there is no request."""
        if self._programme is None:
            raise UsageError("no programme is under way")
        self._programme.answer()

    @operation()
    def end_programme(self) -> None:
        """End this station's programme by a ramp; returns at rest."""
        if self._programme is not None:
            self._programme.end()

    @operation()
    def read_object(self, winch: str | None, index: int, sub: int) -> str | None:
        """Bytes of an object of a winch's drive.

        Parameters
        ----------
        winch : str or None
            Winch; None for the only one.
        index, sub : int
            Object of the drive.

        Returns
        -------
        str or None
            Its bytes, little-endian, in hexadecimal; None for an object that the drive lacks.
        """
        name = self._bench.named(winch).name
        data = self._bench.axes[name].objects.upload_if_there(index, sub)
        return None if data is None else data.hex()

    @operation()
    def scanned(self) -> list[dict[str, Any]]:
        """Who is on the buses, as JSON has it."""
        return [asdict(item) for item in self._bench.scan()]

    @operation()
    def cell(self, task: str, name: str, *arguments: Any) -> dict[str, Any]:
        """Something with an instrument, e.g. "zero"; ``arguments`` are times (s), or words.

        Raises what the task raises, and NotPermitted where it would change a moving winch's
        tension.

        Parameters
        ----------
        task : str
            One of ``winchkit.bench.cells.tasks.TASKS``.
        name : str
            Instrument, e.g. ``A.cell``.
        *arguments
            Of the task.

        Returns
        -------
        dict
            Result of the task, as JSON has it.
        """
        from winchkit.bench.cells.tasks import do

        return do(self._bench.cells, task, name, *arguments)


def _tare(cell: Sensor) -> float | None:
    """Gross less net value, by the device and the host together, N; None without a measurement."""
    reading = cell.latest
    if reading is None or not reading.quality.usable:
        return None
    return reading.gross - reading.value


def _frame(frame: SeenFrame) -> list[Any]:
    """Time, identifier and bytes in hexadecimal."""
    return [round(frame.time, 4), frame.identifier, frame.data.hex()]
