"""A station at a bench that another process owns."""

from __future__ import annotations

import socket
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self

from winchkit.bench.control.dead_man import DEAD_MAN
from winchkit.bench.direction import no_positional
from winchkit.bench.ownership import connect_to_owner
from winchkit.bench.remote.identity import client_name
from winchkit.bench.remote.requests import OwnerGone, Requests
from winchkit.drivers.clock import Clock, MonotonicClock
from winchkit.schema.bench import BenchSpec

if TYPE_CHECKING:
    from winchkit.drivers.can.tools.scan import Found

_ANSWER_TIME = 10.0
"""s: longer than the longest answer without a motion, a reset of several drives (some seconds)."""
_CELL_TIME = 20.0
"""Longer than any command to an instrument with the readings before and after it, s."""


def attach(
    spec: BenchSpec,
    patience: float = _ANSWER_TIME,
    *,
    name: str = "",
    observer: bool = False,
) -> RemoteStation | None:
    """A station at the bench's owner; None when no process owns it.

    ``patience`` (s) is how long it waits for an answer, ``name`` what others see of this client;
    an ``observer`` never keeps another program from owning the bench. Raises ConnectionLost when
    the owner does not take it.
    """
    connection = connect_to_owner(spec)
    if connection is None:
        return None
    return RemoteStation(connection, patience, name=name, observer=observer)


class RemoteStation:
    """Calls the owner for everything; its errors are raised here. A context manager.

    Each call is a sign of life. A move, step or homing that was ordered here ends by a ramp where
    none is made for :data:`~winchkit.bench.control.dead_man.LIFE_SIGN` (0.5 s): poll ``moving``.
    """

    def __init__(
        self,
        connection: socket.socket,
        patience: float = _ANSWER_TIME,
        *,
        name: str = "",
        observer: bool = False,
    ) -> None:
        """Take a place at the owner; raises ConnectionLost where it accepts no client."""
        self._requests = Requests(connection, patience)
        try:
            reply = self._requests.call("introduce", name or client_name(), observer)
        except BaseException:
            self._requests.hang_up()
            raise
        self.owner = str(reply["owner"])
        """Name of the process that owns the bench."""
        self.lends = bool(reply["lends"])
        """Whether the owner is a bench process, which ends with its last client."""
        self.digest = str(reply["digest"])
        """Of the files that the owner opened the bench with."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def hand_over(self) -> str:
        """Ask the owner to end for this client's sake; raises NotPermitted where it does not."""
        return str(self._requests.call("hand_over"))

    def take_over(self, winch: str | None) -> None:
        """Command a winch that another client commands.

        Parameters
        ----------
        winch : str or None
            Winch, "all", or None for the only one.
        """
        self._requests.call("take_over", winch)

    @property
    def clock(self) -> Clock:
        """Steady clock of this computer, which the bench process has too."""
        return MonotonicClock()

    def names(self) -> list[str]:
        """Winches there are."""
        return [str(name) for name in self._requests.call("names")]

    def status(self) -> dict[str, Any]:
        """Newest snapshot as JSON has it."""
        return dict(self._requests.call("status"))

    def jog(
        self,
        winch: str | None,
        *unnamed: object,
        pay_out: float | None = None,
        wind_in: float | None = None,
        hold: float = DEAD_MAN,
        since: float | None = None,
    ) -> None:
        """Begin to move the cable at a speed (m/s, positive), out or in, for ``hold`` seconds.

        :meth:`refresh` within that time keeps it going; one that is under way is not started again.

        Raises UsageError unless exactly one is given, by its name.

        Parameters
        ----------
        winch : str or None
            Winch; None for the only one.
        pay_out, wind_in : float
            Cable speed, m/s, positive; exactly one is given.
        hold : float
            Time of motion without a refresh, s, at most 1.
        since : float, optional
            When the operator was seen to ask for it, s on :attr:`clock`; by default now. The time
            of motion counts from then.
        """
        no_positional("jog", "m/s", unnamed)
        self._requests.call("jog", winch, since=since, pay_out=pay_out, wind_in=wind_in, hold=hold)

    def refresh(
        self,
        winch: str | None,
        *unnamed: object,
        pay_out: float | None = None,
        wind_in: float | None = None,
        hold: float = DEAD_MAN,
    ) -> None:
        """Keep a jog or a held tension going for ``hold`` seconds more, a jog at another speed too.

        Raises MotionError where it has ended, which a refresh never begins again: its time was
        over (this process was suspended, or too slow), or somebody stopped it.

        Parameters
        ----------
        winch : str or None
            Winch; None for the only one.
        pay_out, wind_in : float, optional
            Another speed of a jog, m/s, positive; at most one is given.
        hold : float
            Time of motion without another refresh, s, at most 1.
        """
        no_positional("refresh", "m/s", unnamed)
        self._requests.call("refresh", winch, pay_out=pay_out, wind_in=wind_in, hold=hold)

    def release(self, winch: str | None) -> None:
        """End a jog or a held tension by a ramp now, instead of when its ``hold`` is over.

        Parameters
        ----------
        winch : str or None
            Winch; None for the only one.
        """
        self._requests.call("release", winch)

    def step(
        self,
        winch: str | None,
        *unnamed: object,
        pay_out: float | None = None,
        wind_in: float | None = None,
        speed: float | None = None,
        since: float | None = None,
    ) -> None:
        """Start to pay out or wind in a length (m, positive) of cable.

        Raises UsageError unless exactly one is given, by its name.

        Parameters
        ----------
        winch : str or None
            Winch; None for the only one.
        pay_out, wind_in : float
            Length, m, positive; exactly one is given.
        speed : float, optional
            m/s; by default the limit of the winch.
        since : float, optional
            When the operator was seen to ask for it, s on :attr:`clock`; by default now.
        """
        no_positional("step", "m", unnamed)
        self._requests.call(
            "step", winch, since=since, pay_out=pay_out, wind_in=wind_in, speed=speed
        )

    def move(
        self,
        winch: str | None,
        *unnamed: object,
        to: float | None = None,
        pay_out: float | None = None,
        wind_in: float | None = None,
        speed: float | None = None,
        acceleration: float | None = None,
    ) -> None:
        """Start a move to a cable length, or by a length (m, positive) paid out or wound in.

        Raises UsageError unless exactly one is given, by its name.

        Parameters
        ----------
        winch : str or None
            Winch, "all", or None for the only one.
        to : float, optional
            Cable length, m.
        pay_out, wind_in : float
            Length, m, positive; exactly one of the three is given.
        speed, acceleration : float, optional
            m/s and m/s²; by default the limits of the winch.
        """
        no_positional("move", "m", unnamed)
        self._requests.call(
            "move",
            winch,
            to=to,
            pay_out=pay_out,
            wind_in=wind_in,
            speed=speed,
            acceleration=acceleration,
        )

    def move_pose(
        self,
        change: Mapping[str, float],
        relative: bool,
        speed: float | None = None,
        acceleration: float | None = None,
    ) -> None:
        """Start to move the platform of the robot on a line.

        Parameters
        ----------
        change : mapping of str to float
            Some of x, y, z (m), roll, pitch, yaw (rad); the others keep their values.
        relative : bool
            Whether they are added to those of the present pose.
        speed, acceleration : float, optional
            m/s and m/s²; by default the limits of the bench's ``[robot]``.
        """
        self._requests.call("move_pose", dict(change), relative, speed, acceleration)

    def pose(self) -> dict[str, float]:
        """Pose of the platform by the motor angles: x, y, z (m), roll, pitch, yaw (rad)."""
        return dict(self._requests.call("pose"))

    def hold_tension(
        self, winch: str | None, tension: float, hold: float, bounds: Mapping[str, float]
    ) -> None:
        """Begin to keep the tension of a winch for ``hold`` seconds; :meth:`refresh` goes on.

        Parameters
        ----------
        winch : str or None
            Winch; None for the only one.
        tension : float
            At the platform end, N.
        hold : float
            Time without a refresh, s, at most 1.
        bounds : mapping of str to float
            ``travel`` of cable either way, m, largest ``speed``, m/s, and upper bound of the
            ``stiffness``, N/m, as of ``Winch.hold_tension``; each may be left out.
        """
        self._requests.call("hold_tension", winch, tension, hold=hold, bounds=dict(bounds))

    def upload(self, winch: str | None, index: int, sub: int) -> bytes | None:
        """Bytes of an object of a drive.

        Parameters
        ----------
        winch : str or None
            Winch; None for the only one.
        index, sub : int
            Object of the drive.

        Returns
        -------
        bytes or None
            Its value, little-endian; None for an object that the drive lacks.
        """
        found = self._requests.call("read_object", winch, index, sub)
        return None if found is None else bytes.fromhex(found)

    def scan(self) -> list[Found]:
        """Who is on the buses."""
        from winchkit.drivers.can.canopen.identity import Identity
        from winchkit.drivers.can.tools.scan import Found

        return [
            Found(**{**item, "identity": Identity(**item["identity"])})
            for item in self._requests.call("scanned")
        ]

    def moving(self, winch: str | None) -> bool:
        """Whether a motion is under way.

        Parameters
        ----------
        winch : str or None
            Winch, "all", or None for the only one.

        Returns
        -------
        bool
            Whether a motion is under way; raises what stopped it.
        """
        return bool(self._requests.call("moving", winch))

    def home(
        self, winch: str | None, method: int | None, at: float | None, speed: float | None
    ) -> None:
        """Start to home a winch.

        Parameters
        ----------
        winch : str or None
            Winch; None for the only one.
        method : int or None
            Homing method of CiA 402 (6098h); None moves nothing.
        at : float or None
            Cable length at the zero, m.
        speed : float or None
            Speed of the search, m/s.
        """
        self._requests.call("home", winch, method, at, speed)

    def homing(self) -> bool:
        """Whether the homing is under way."""
        return bool(self._requests.call("homing"))

    def stop(self) -> None:
        """Quick-stop every winch."""
        self._requests.call("stop")

    def reset(self) -> list[str]:
        """Clear trips and faults; returns what was cleared, in words."""
        return [str(item) for item in self._requests.call("reset")]

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
        return float(self._requests.call("tare", winch))

    def start_log(self, path: str, rotate: str | None = None, replace: bool = False) -> None:
        """Log to a file in the owner's process.

        Parameters
        ----------
        path : str
            File, absolute.
        rotate : str, optional
            Size or duration of a part.
        replace : bool
            Remove an earlier log of that name.
        """
        self._requests.call("start_log", path, rotate, replace)

    def log_rows(self) -> int:
        """Rows written so far."""
        return int(self._requests.call("log_rows"))

    def end_log(self) -> int:
        """Finish the log."""
        return int(self._requests.call("end_log"))

    def counters(self) -> dict[str, dict[str, Any]]:
        """Counts by instrument, and of the log."""
        return dict(self._requests.call("counters"))

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
        found = self._requests.call("trip_history")
        return None if found is None else dict(found)

    def frames(self) -> dict[str, dict[str, Any]]:
        """Frames of each CAN bus by name, collected from the first call on while it is called.

        Returns
        -------
        dict of str to dict
            ``newest``: number, time (s), identifier and bytes in hexadecimal of each identifier's
            newest frame; ``last``: time, identifier and bytes of the last 200 frames.
        """
        return dict(self._requests.call("frames"))

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
        self._requests.call("start_programme", path, folder, suffix, replace)

    def programme(self) -> dict[str, Any] | None:
        """Where this station's programme is; None where it started none.

        Returns
        -------
        dict or None
            As of ``winchkit.bench.remote.programme_run.ProgrammeRun.state``.
        """
        found = self._requests.call("programme")
        return None if found is None else dict(found)

    def answer_programme(self) -> None:
        """Answer the programme's request as done; raises UsageError where there is no request."""
        self._requests.call("answer_programme")

    def end_programme(self) -> None:
        """End this station's programme by a ramp; returns at rest."""
        self._requests.call("end_programme")

    def cell(self, task: str, name: str, *arguments: Any) -> dict[str, Any]:
        """Something with an instrument, e.g. "zero"; ``arguments`` are times (s), or words.

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
        watched = sum(item for item in arguments if isinstance(item, float))
        patience = _CELL_TIME + 3 * watched
        return dict(self._requests.call("cell", task, name, *arguments, patience=patience))

    def close(self) -> None:
        """Leave; returns when what was started here has ended and stands still.

        Raises MotionError where it does not come to rest. Twice does no harm.
        """
        try:
            if not self._requests.gone:
                self._requests.call("leave")
        except OwnerGone:
            pass  # it stops everything when it ends
        finally:
            self._requests.hang_up()


class RemoteCells:
    """The instruments of a bench that another process owns."""

    def __init__(self, spec: BenchSpec, station: RemoteStation) -> None:
        self.spec, self._station = spec, station

    def do(self, task: str, name: str, *arguments: Any) -> dict[str, Any]:
        """One of :data:`~winchkit.bench.cells.tasks.TASKS`, done by the owner."""
        return self._station.cell(task, name, *arguments)
