"""An open bench: who may move its winches, its motions and its stops."""

from __future__ import annotations

import threading
from collections.abc import Callable, Collection, Generator, Iterable, Iterator, Mapping
from contextlib import ExitStack
from typing import TYPE_CHECKING, Protocol

from winchkit.bench.cells.desk import CellDesk
from winchkit.bench.commissioning.record import require_commissioned, trust_record
from winchkit.bench.common_move import begin_together, wait_together
from winchkit.bench.connection import BenchConnection
from winchkit.bench.control.dead_man import LIFE_SIGN
from winchkit.bench.control.homing_motion import HomingRequest
from winchkit.bench.control.realtime import Request
from winchkit.bench.control.snapshot import Direction, Trip
from winchkit.bench.drives.set_up_progress import Tell, to_stderr
from winchkit.bench.homing import homing
from winchkit.bench.lifecycle import await_cycles, await_rest, reset
from winchkit.bench.ownership import Ownership, unless_stopped
from winchkit.bench.remote.commander import Commanders, LifeSigns, NotCommander, NotReleased
from winchkit.bench.remote.handover import own
from winchkit.bench.remote.identity import Client, client_name
from winchkit.bench.robot import no_robot
from winchkit.bench.winch import Winch
from winchkit.drivers.clock import Clock
from winchkit.errors import ConnectionLost, DriveFault, LimitTripped, MotionError, NotPermitted
from winchkit.schema.bench import BenchSpec

if TYPE_CHECKING:
    from winchkit.robot.bench.platform import Platform


class Stations(Protocol):
    """The server through which other processes take part in a bench."""

    may_hand_over: bool
    """Whether the owner gives the bench to a program that wants to own it, while all its clients
    are observers."""
    handed_to: str
    """Name of the program to which the bench is given; empty while there is none."""

    @property
    def clients(self) -> tuple[Client, ...]:
        """Who is connected."""

    def close_door(self) -> bool:
        """Accept no further client unless one is connected; returns whether it is so."""

    def close(self) -> None:
        """Disconnect every client."""


class Bench(BenchConnection):
    """An open bench; this process owns it until it is closed.

    Made by :func:`winchkit.open_bench`. ``bench.winch["A"]`` is one of its winches.

    Parameters
    ----------
    spec
        What the bench file declares.
    clock
        Clock of the control loop.
    name
        What other clients see of this program.
    ownership
        Held already by the caller; by default it is taken.
    serve
        Starts the server through which other processes take part.
    realtime
        Real-time settings: False, ``"try"`` or True.
    commissioning
        Whether the opening thread, and no other, may move it without a commissioning record.
    tell
        Takes lines on a set-up of drives that takes long; by default standard error.
    """

    def __init__(
        self,
        spec: BenchSpec,
        clock: Clock,
        name: str = "",
        ownership: Ownership | None = None,
        *,
        serve: Callable[[Bench], Stations],
        realtime: Request = False,
        commissioning: bool = False,
        tell: Tell = to_stderr,
    ) -> None:
        """Open it; raises every error of opening, with nothing left open."""
        with unless_stopped(spec) as check:
            super().__init__(
                spec,
                clock,
                ownership or own(spec, name or client_name()),
                separate=bool(realtime),
                tell=tell,
            )
            self.not_commissioned = ""
            """Why nothing may move before it is commissioned; empty where it is."""
            self._commissioner = threading.get_ident() if commissioning else None
            with self._stack:
                self._look_at_record()
                self.winch: dict[str, Winch] = {
                    name: Winch(
                        self, name, spec.winch[name], parts, dict(self._wired.sensors[name])
                    )
                    for name, parts in self.loop.winches.items()
                }
                self._platform = self._robot_platform()
                self.commanders = Commanders(
                    self.loop.winches,
                    clock,
                    Client(name or client_name()),
                    lambda winch: self.winch[winch].run_down(),
                )
                """Who commands each winch."""
                self.stopped_by = ""
                """Who gave the last quick stop."""
                self.stops: int = 0
                """Quick stops that were given."""
                self.cells = self._cell_desk()
                """Its instruments by name, for commands and whoever looks at them one by one."""
                self.loop.on_jog = self._jog_from_callback
                self.loop.callbacks.append(LifeSigns(self._going_on, self._end_silent))
                self._start(realtime)
                self.stations = serve(self)
                """Where other processes take part."""
                check()
                self._stack = self._stack.pop_all()

    def _cell_desk(self) -> CellDesk:
        wired, permit = self._wired, self._require_rest
        return CellDesk(
            self.spec, self.clock, wired.lines, wired.slow, wired.sensors, permit=permit
        )

    def _robot_platform(self) -> Platform | None:
        robot = self._wired.robot
        return None if robot is None else robot.platform(self, self.winch)

    @property
    def robot(self) -> Platform:
        """The platform that the winches move; raises UsageError for a bench without ``[robot]``."""
        if self._platform is None:
            raise no_robot(self.spec)
        return self._platform

    def stop(self, *, wait: bool = True) -> None:
        """Ramp every winch to rest, then disable. Always allowed.

        Parameters
        ----------
        wait : bool
            Return when the winches are disabled and stand still.
        """
        self._run_down(self.winch, wait=wait)

    def stop_with(self, name: str, *, wait: bool = True) -> None:
        """Ramp this winch to rest, and with it all others unless ``stop_together`` is false.

        Parameters
        ----------
        name : str
            Winch.
        wait : bool
            Return when the winches are disabled and stand still.
        """
        self._run_down(self.winch if self.spec.stop_together else (name,), wait=wait)

    def stop_commanded(self, names: Collection[str], *, wait: bool = True) -> None:
        """Ramp these winches to rest for the client that commands them.

        The others stop with them unless ``stop_together`` is false, or another client commands
        them.

        Parameters
        ----------
        names : collection of str
            Winches of the client.
        wait : bool
            Return when the winches are disabled and stand still.
        """
        held = self.commanders.holder
        others = [name for name in self.winch if held(name) is None or name in names]
        self._run_down(others if self.spec.stop_together else names, wait=wait)

    def stop_now(self, *, wait: bool = True) -> None:
        """Quick-stop every winch; what is held is ended, and nothing refreshes it any more.

        An ``on_cycle`` function may call it, and returns at once.

        Parameters
        ----------
        wait : bool
            Return when the winches are disabled and stand still.
        """
        self._note_stop(self.winch)
        self.stopped_by, self.stops = self.commanders.actor.name, self.stops + 1
        with self.loop.ordering:
            for parts in self.loop.winches.values():
                parts.controller.stop()
        if wait and not self.loop.asks_here:
            self.wait_at_rest(self.winch)

    def move_together(
        self,
        lengths: Mapping[str, float],
        speed: float | None = None,
        acceleration: float | None = None,
        *,
        wait: bool = True,
        hold: bool = False,
    ) -> None:
        """Move several winches to cable lengths (m by name), as one motion.

        They start in the same control cycle, once every drive is enabled, and the shorter moves
        are stretched to last as long as the longest. Else as :meth:`Winch.move_to`.

        Parameters
        ----------
        lengths : mapping of str to float
            Cable length by winch, m.
        speed, acceleration : float, optional
            Of the longest move, m/s and m/s²; by default the limits of the winches.
        wait : bool
            Return when all stand still.
        hold : bool
            Keep the drives enabled at the end.
        """
        if wait:
            self.loop.require_other_thread("move_together")
        targets = {self.named(name): length for name, length in lengths.items()}
        begin_together(self.loop, targets, speed, acceleration, hold=hold)
        if wait:
            wait_together(self.loop, tuple(targets), self.clock)

    def reset(self) -> list[str]:
        """Clear trips and drive faults; drives that lost their set-up are commissioned again.

        A bus that went down is opened again. Nothing is enabled by any of it, and a motion
        under way is ended by a ramp. Returns what was cleared, in words. Raises LimitTripped naming
        what still forbids any motion, with the latch as it was, NotPermitted, ConnectionLost.
        """
        self.loop.require_other_thread("reset")
        ended = [
            f"winch {name}: a motion under way" for name in self.winch if self.winch[name].moving
        ]
        self._run_down(self.winch, wait=False)
        try:
            cleared = ended + reset(self._wired, self.spec, self.clock)
        finally:
            # A bus that was opened again has a new receive thread.
            self.realtime.cover(self._urgent_threads(), self._wired.companions)
        self._look_at_record()
        return cleared

    def close(self) -> None:
        """Stop every winch in a controlled way and let the buses go. Twice does no harm."""
        self.loop.require_other_thread("close")
        with self._stack:
            self.stations.close()
            if self.loop.alive:
                # A function that still asks for motion is no longer heard.
                self.loop.on_jog = lambda _name, _speed: None
                self._come_to_rest()
                self.loop.close_positions()
                self._wired.disarm()
            self._close_logs()
        self._stack = ExitStack()

    def permit(self, winch: str, direction: Direction) -> None:
        """Raise what forbids this motion to who asks now; returns when it is allowed.

        Parameters
        ----------
        winch : str
            Winch that is to move.
        direction : Direction
            Of the motion.
        """
        if not direction:
            self.commanders.require(winch)
            return
        self.permit_at_rest(winch)
        for trip in self.snapshot.blocked:
            if trip.winch == winch and trip.blocks & direction:
                raise NotPermitted(str(trip))

    def permit_at_rest(self, winch: str) -> None:
        """Raise what forbids to enable a drive even where the cable is not to move (homing here).

        Conditions that forbid one direction, as of length and tension, do not.

        Parameters
        ----------
        winch : str
            Winch.
        """
        self.commanders.require(winch)
        self._require_commissioned()
        self.raise_trouble()
        for trip in self.snapshot.blocked:
            if trip.blocks is Direction.BOTH:
                raise NotPermitted(str(trip))

    def permit_tension(self, winch: str) -> None:
        """Raise NotPermitted for more cables of a robot than its platform leaves free.

        Parameters
        ----------
        winch : str
            Winch that is to control its tension.
        """
        if self._platform is not None:
            self._platform.permit_tension(winch)

    def require_motion(self) -> None:
        """Raise what forbids every motion: no valid commissioning record, a trip, an ended loop.

        A programme calls it before it writes a file.
        """
        self._require_commissioned()
        self.raise_trouble()

    def _look_at_record(self) -> None:
        """Compare the commissioning record with the files, and with the drives as they are now."""
        trust_record(self.spec, self.axes)
        try:
            require_commissioned(self.spec, self.axes)
        except NotPermitted as error:
            self.not_commissioned = str(error)
        else:
            self.not_commissioned = ""

    def _require_commissioned(self) -> None:
        if self._commissioner is not None:
            if threading.get_ident() != self._commissioner:
                raise NotPermitted(f"bench '{self.spec.name}' is being commissioned by another")
        elif self.not_commissioned:
            raise NotPermitted(self.not_commissioned)

    def raise_trouble(self) -> None:
        """Raise what has stopped the bench, if anything has."""
        if self.loop.failure is not None:
            raise self.loop.failure
        if not self.loop.alive:
            raise ConnectionLost("the control loop has ended; open the bench again")
        tripped = self.snapshot.tripped
        if tripped:
            words = "; ".join(map(str, tripped))
            kind = DriveFault if tripped[0].kind == "fault" else LimitTripped
            raise kind(
                f"{words} (latched: all winches were stopped; reset to go on, e.g. with "
                "`winchkit reset`)"
            )

    def raise_stop(self, stops: int) -> None:
        """Raise what has stopped the bench, a quick stop after the first ``stops`` included.

        A programme calls it before each motion and while it holds: a quick stop that comes while
        nothing moves ends no motion.

        Parameters
        ----------
        stops : int
            Value of :attr:`stops` at the beginning of the programme.
        """
        self.raise_trouble()
        if self.stops != stops:
            raise MotionError(f"{self.stopped_by} stopped the bench between two motions")

    def wait_at_rest(self, names: Iterable[str]) -> None:
        """Return when these winches are disabled and stand still; raises MotionError if not.

        Parameters
        ----------
        names : iterable of str
            Winches.
        """
        await_rest(self.loop, names, self.clock)

    def homing(self, winch: str, request: HomingRequest) -> Generator[None]:
        """Home a winch, yielding while there is something to wait for; closing it early stops it.

        Raises UsageError, NotPermitted, DeviceRefused for a method that the drive lacks, DriveFault
        where the homing fails, LimitTripped.

        Parameters
        ----------
        winch : str
            Winch.
        request : HomingRequest
            Method, length and speed.

        Returns
        -------
        generator
            Yields until the homing has ended.
        """
        return homing(self, self.winch[winch], request)

    def named(self, name: str | None) -> Winch:
        """A winch by name, or the only one; raises UsageError.

        Parameters
        ----------
        name : str or None
            Winch; None for the only one.

        Returns
        -------
        Winch
            The winch.
        """
        return self.winch[self.spec.winch_named(name)]

    def _run_down(self, names: Iterable[str], *, wait: bool) -> None:
        if wait:
            self.loop.require_other_thread("stop")
        self._note_stop(names)
        with self.loop.ordering:
            for name in names:
                self.winch[name].run_down()
        if wait:
            self.wait_at_rest(names)

    def _note_stop(self, names: Iterable[str]) -> None:
        """Keep who stops these winches, for the error of their clients."""
        for name in names:
            self.winch[name].stopped_by = self.commanders.actor.name

    def _require_rest(self, instrument: str) -> None:
        """Raise NotPermitted while the winch of an instrument (``A.cell``) is enabled."""
        self.winch[instrument.rpartition(".")[0]].require_rest()

    def _jog_from_callback(self, name: str, winding_speed: float) -> None:
        try:
            self.named(name).follow(winding_speed)
        except (NotReleased, NotCommander):
            pass  # it goes on asking for what was stopped: nothing moves before it ceases to
        except MotionError:
            if not self.snapshot.tripped:
                raise

    def _going_on(self) -> Iterator[tuple[str, Client]]:
        """Winches whose motion goes on by itself, with the client that commands each."""
        for name, winch in self.winch.items():
            client = self.commanders.holder(name)
            if client is not None and winch.goes_on:
                yield name, client

    def _end_silent(self, client: Client, names: Collection[str], reason: str) -> None:
        """Ramp the winches of a client without a life sign; every client gets the reason."""
        with self.commanders.acting(
            Client(f"the dead-man ({client.name} was silent for {LIFE_SIGN:g} s)")
        ):
            self.stop_commanded(names, wait=False)
        self.loop.warn(Trip("client", ", ".join(names), reason, Direction.NONE))

    def _come_to_rest(self) -> None:
        """Ramp down; a winch that does not come to rest gets a quick stop."""
        try:
            self.stop()
        except MotionError:
            self.stop_now(wait=False)
            await_cycles(self.loop, self.clock, 50)
