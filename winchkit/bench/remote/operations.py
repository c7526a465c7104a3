"""The operations of a bench: one table, from which client and server are derived.

A station in the process of the bench's owner carries them out, one elsewhere requests them.
"""

# mypy: disable-error-code="empty-body"
# An operation has no body here: :func:`_operation` requests it.

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from functools import wraps
from typing import Any, TypeVar, cast

from winchkit.bench.control.dead_man import DEAD_MAN
from winchkit.drivers.clock import Clock

_Method = TypeVar("_Method", bound=Callable[..., Any])

OPERATIONS: dict[str, bool] = {}
"""Whether it begins or extends a motion, by operation; such a request is refused where it has been
on its way for too long."""


def _operation(*, begins: bool = False) -> Callable[[_Method], _Method]:
    """An operation, requested with all its arguments where a station does not define it."""

    def requested(method: _Method) -> _Method:
        name, signature = method.__name__, inspect.signature(method)
        OPERATIONS[name] = begins

        @wraps(method)
        def request(station: Station, *arguments: Any, **named: Any) -> Any:
            asked = signature.bind(station, *arguments, **named)
            asked.apply_defaults()
            return station._request(name, *asked.args[1:], **asked.kwargs)

        return cast(_Method, request)

    return requested


class Station:
    """An operator's place at a bench. Closing it ends what it has started."""

    def _request(self, operation: str, *arguments: Any, **named: Any) -> Any:
        raise NotImplementedError(operation)

    @property
    def clock(self) -> Clock:
        """Clock of the bench, on which a client waits."""

    @_operation()
    def names(self) -> list[str]:
        """Winches there are."""

    @_operation()
    def status(self) -> dict[str, Any]:
        """Newest snapshot and the health of the CAN buses, as JSON has them."""

    @_operation(begins=True)
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

    @_operation(begins=True)
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
            Winch, "all", as of a platform that is held, or None for the only one.
        pay_out, wind_in : float, optional
            Another speed of a jog, m/s, positive; at most one is given.
        hold : float
            Time of motion without another refresh, s, at most 1.
        """

    @_operation()
    def release(self, winch: str | None) -> None:
        """End a jog or a held tension by a ramp now, instead of when its ``hold`` is over.

        Parameters
        ----------
        winch : str or None
            Winch, "all", as of a platform that is held, or None for the only one.
        """

    @_operation(begins=True)
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

    @_operation(begins=True)
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
            Winch, "all" to move all as one, or None for the only one.
        to : float, optional
            Cable length, m.
        pay_out, wind_in : float
            Length, m, positive; exactly one of the three is given.
        speed, acceleration : float, optional
            m/s and m/s²; by default the limits of the winch.
        """

    @_operation(begins=True)
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

    @_operation()
    def pose(self) -> dict[str, float]:
        """Pose of the platform by the motor angles: x, y, z (m), roll, pitch, yaw (rad)."""

    @_operation(begins=True)
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

    @_operation(begins=True)
    def hold_platform(
        self,
        preload: float | Mapping[str, float] | None,
        pose: Mapping[str, float] | None,
        hold: float,
        bounds: Mapping[str, float],
    ) -> None:
        """Begin to hold forces and pose of the robot's platform for ``hold`` seconds.

        ``refresh("all")`` goes on.

        Parameters
        ----------
        preload : float or mapping of str to float, optional
            As of ``bench.robot.hold``, N.
        pose : mapping of str to float, optional
            Some of x, y, z (m), roll, pitch, yaw (rad) to be held by the tracker; the others are
            those of the present pose.
        hold : float
            Time without a refresh, s, at most 1.
        bounds : mapping of str to float
            ``travel``, m, ``speed``, m/s, and ``axial_stiffness``, N, of the cables, as of
            ``bench.robot.hold``; each may be left out.
        """

    @_operation()
    def platform_held(self) -> dict[str, Any]:
        """Set-point and measured values of what the platform holds, or held last.

        Returns
        -------
        dict
            By cable ``force`` and ``measured``, N, and ``missing``, of the forces that balance each
            other; ``position_error``, m, and ``rotation_error``, rad. None for what is not held.
        """

    @_operation()
    def take_over(self, winch: str | None) -> None:
        """Command a winch that another client commands; its motion ends by a ramp.

        Parameters
        ----------
        winch : str or None
            Winch, "all", or None for the only one.
        """

    @_operation()
    def moving(self, winch: str | None) -> bool:
        """Whether a motion is under way.

        Parameters
        ----------
        winch : str or None
            Winch, "all", or None for the only one.

        Returns
        -------
        bool
            Whether a motion is under way; raises what stopped it, and who has taken it over.
        """

    @_operation(begins=True)
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

    @_operation()
    def homing(self) -> bool:
        """Whether the homing is under way, and lead it on; raises what ended it."""

    @_operation()
    def stop(self) -> None:
        """Quick-stop every winch; returns at rest."""

    @_operation()
    def reset(self) -> list[str]:
        """Clear trips and faults; returns what was cleared, in words."""

    @_operation()
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

    @_operation()
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

    @_operation()
    def log_rows(self) -> int:
        """Rows written so far."""

    @_operation()
    def end_log(self) -> int:
        """Finish the log; returns its rows."""

    @_operation()
    def counters(self) -> dict[str, dict[str, Any]]:
        """Counts by instrument (``A.cell``), and for the log of this station."""

    @_operation()
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

    @_operation()
    def frames(self) -> dict[str, dict[str, Any]]:
        """Frames of each CAN bus by name, collected from the first call on while it is called.

        Returns
        -------
        dict of str to dict
            ``newest``: number, time (s), identifier and bytes in hexadecimal of each identifier's
            newest frame; ``last``: time, identifier and bytes of the last 200 frames.
        """

    @_operation(begins=True)
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

    @_operation()
    def programme(self) -> dict[str, Any] | None:
        """Where this station's programme is; None where it started none.

        Returns
        -------
        dict or None
            As of ``winchkit.bench.remote.programme_run.ProgrammeRun.state``.
        """

    @_operation(begins=True)
    def answer_programme(self) -> None:
        """Answer the programme's request as done; raises UsageError where there is no request."""

    @_operation()
    def end_programme(self) -> None:
        """End this station's programme by a ramp; returns at rest."""

    @_operation()
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

    @_operation()
    def scanned(self) -> list[dict[str, Any]]:
        """Who is on the buses, as JSON has it."""

    @_operation()
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

    def close(self) -> None:
        """Stop what was started here, finish the log."""
