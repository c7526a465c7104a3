"""The operations of a bench that move its winches, or stop them."""

from __future__ import annotations

from collections.abc import Generator, Mapping
from dataclasses import asdict
from typing import Any

from winchkit.bench.control.dead_man import DEAD_MAN, LIFE_SIGN, DeadMan, remaining
from winchkit.bench.direction import no_positional, paid_out
from winchkit.bench.remote.operation import BaseStation, operation
from winchkit.errors import MotionError, UsageError


class MotionStation(BaseStation):
    """Motions and stops of a bench, ordered at a station."""

    _homing: Generator[None] | None = None
    _led: DeadMan
    """Permission of the homing to go on to its next motion."""

    @operation(begins=True)
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
        hold = hold if since is None else remaining(hold, self.clock.now() - since)
        with self._acting():
            self._bench.named(winch).jog(*unnamed, pay_out=pay_out, wind_in=wind_in, hold=hold)

    @operation(begins=True)
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
        with self._acting():
            for item in self._chosen(winch):
                item.refresh(*unnamed, pay_out=pay_out, wind_in=wind_in, hold=hold)

    @operation()
    def release(self, winch: str | None) -> None:
        """End a jog or a held tension by a ramp now, instead of when its ``hold`` is over.

        Parameters
        ----------
        winch : str or None
            Winch, "all", as of a platform that is held, or None for the only one.
        """
        with self._acting():
            for item in self._chosen(winch):
                item.release()

    @operation(begins=True)
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
        if since is not None:
            remaining(LIFE_SIGN, self.clock.now() - since)
        change = paid_out("step", pay_out, wind_in)
        chosen = self._bench.named(winch)
        with self._acting():
            chosen.move_to(chosen.cable_length + change, speed, wait=False)

    @operation(begins=True)
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
        no_positional("move", "m", unnamed)
        if (to is None) == (pay_out is None and wind_in is None):
            raise UsageError(
                "a move goes either to a cable length or by a change of it; give to=, pay_out= or "
                "wind_in="
            )
        change = paid_out("move", pay_out, wind_in) if to is None else 0.0
        lengths = {
            item.name: item.cable_length + change if to is None else to
            for item in self._chosen(winch)
        }
        with self._acting():
            self._bench.move_together(lengths, speed, acceleration, wait=False)

    @operation(begins=True)
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
        platform = self._bench.robot
        goal = platform.moved(change, relative=relative)
        with self._acting():
            platform.move(goal, speed, acceleration, wait=False)

    @operation()
    def pose(self) -> dict[str, float]:
        """Pose of the platform by the motor angles: x, y, z (m), roll, pitch, yaw (rad)."""
        return self._bench.robot.coordinates()

    @operation(begins=True)
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
        with self._acting():
            self._bench.named(winch).hold_tension(tension, hold=hold, **bounds)

    @operation(begins=True)
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
        platform = self._bench.robot
        goal = None if pose is None else platform.moved(pose, relative=False)
        with self._acting():
            platform.hold(preload=preload, pose=goal, hold=hold, **bounds)

    @operation()
    def platform_held(self) -> dict[str, Any]:
        """Set-point and measured values of what the platform holds, or held last.

        Returns
        -------
        dict
            By cable ``force`` and ``measured``, N, and ``missing``, of the forces that balance each
            other; ``position_error``, m, and ``rotation_error``, rad. None for what is not held.
        """
        return asdict(self._bench.robot.held())

    @operation()
    def take_over(self, winch: str | None) -> None:
        """Command a winch that another client commands; its motion ends by a ramp.

        Parameters
        ----------
        winch : str or None
            Winch, "all", or None for the only one.
        """
        with self._acting():
            for item in self._chosen(winch):
                self._bench.commanders.take_over(item.name)

    @operation()
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
        chosen = self._chosen(winch)
        with self._acting():
            for item in chosen:
                self._bench.commanders.raise_taken(item.name)
            if any(item.moving for item in chosen):
                return True
            for item in chosen:
                item.wait()
        return False

    @operation(begins=True)
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
        from winchkit.bench.control.homing_motion import HomingRequest

        asked = HomingRequest(method, at, speed)
        with self._acting():
            self._homing = self._bench.homing(self._bench.named(winch).name, asked)
            next(self._homing, None)
        self._led = DeadMan(self.clock.now() + LIFE_SIGN)

    @operation()
    def homing(self) -> bool:
        """Whether the homing is under way, and lead it on; raises what ended it."""
        if self._homing is None:
            return False
        with self._acting():
            try:
                self._led.refresh(now := self.clock.now(), now + LIFE_SIGN)
            except MotionError:
                homing, self._homing = self._homing, None
                homing.close()
                raise
            for _ in self._homing:
                # It may have waited for the drive.
                self._led = DeadMan(self.clock.now() + LIFE_SIGN)
                return True
        self._homing = None
        return False

    @operation()
    def stop(self) -> None:
        """Quick-stop every winch; returns at rest."""
        with self._acting():
            self._bench.stop_now()

    @operation()
    def reset(self) -> list[str]:
        """Clear trips and faults; returns what was cleared, in words."""
        with self._acting():
            return self._bench.reset()
