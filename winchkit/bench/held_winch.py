"""What keeps a winch moving only as long as it is asked for: a jog, a held tension."""

from __future__ import annotations

import math

from winchkit.arguments import number, positive
from winchkit.bench.control.dead_man import DEAD_MAN, DeadMan
from winchkit.bench.control.motion import Held, Jog, MotionSource, StartGate
from winchkit.bench.control.snapshot import Direction, Trip
from winchkit.bench.control.supervisor import direction_of
from winchkit.bench.control.tension_control import (
    TensionControl,
    TensionSetting,
    greatest_stiffness,
)
from winchkit.bench.direction import no_positional, paid_out
from winchkit.bench.winch_status import WinchStatus
from winchkit.errors import MotionError, NotPermitted, UsageError
from winchkit.units import parse

LONGEST_HOLD = 1.0
"""s: a motion without its commander lasts no longer."""
POLL = 0.01
"""s: two or more cycles at the usual 4 ms."""


class HeldWinch(WinchStatus):
    """A winch with the motions that must be refreshed, and how each motion begins and ends."""

    def jog(
        self,
        *unnamed: object,
        pay_out: float | None = None,
        wind_in: float | None = None,
        duration: float | None = None,
        hold: float = DEAD_MAN,
    ) -> None:
        """Begin to move the cable at a speed (m/s, positive), out or in, for ``hold`` seconds.

        :meth:`refresh` within that time keeps it going; without one it ramps to rest and disables.
        With ``duration`` it does so itself for that many seconds and returns at rest. It is no
        refresh of a jog that is under way, which it refuses. Raises UsageError, NotPermitted,
        LimitTripped, DriveFault, MotionError.

        Parameters
        ----------
        pay_out, wind_in : float
            Cable speed, m/s, positive; exactly one is given.
        duration : float, optional
            Time of the jog, s.
        hold : float
            Time of motion without a refresh, s, at most 1.
        """
        no_positional("jog", "m/s", unnamed)
        winding_speed = -paid_out("jog", pay_out, wind_in)
        hold = positive("jog", "hold", hold, LONGEST_HOLD)
        if duration is None:
            self._begin_jog(winding_speed, hold)
            return
        duration = positive("jog", "duration", duration)
        self.require_waiting("jog(duration=...)")
        self._begin_jog(winding_speed, hold, duration)
        self._hold_for(duration, hold)

    def refresh(
        self,
        *unnamed: object,
        pay_out: float | None = None,
        wind_in: float | None = None,
        hold: float = DEAD_MAN,
    ) -> None:
        """Keep a jog or a held tension going for ``hold`` seconds more, a jog at another speed too.

        It must come before the time of the command, or of the refresh before it, is over: what has
        ended is never refreshed, and a new motion needs a new command. Raises MotionError where
        there is nothing to refresh, with what ended it, UsageError, NotPermitted, LimitTripped.

        Parameters
        ----------
        pay_out, wind_in : float, optional
            Another speed of a jog, m/s, positive; at most one is given.
        hold : float
            Time of motion without another refresh, s, at most 1.
        """
        no_positional("refresh", "m/s", unnamed)
        named = pay_out is not None or wind_in is not None
        winding_speed = -paid_out("refresh", pay_out, wind_in) if named else None
        self.extend(winding_speed, positive("refresh", "hold", hold, LONGEST_HOLD))

    def release(self) -> None:
        """End a jog or a held tension by a ramp now, instead of when its time is over."""
        self._bench.commanders.let_go(self.name)
        if self._held is not None and self.commanded_here:
            self._held.dead_man.end("it was released; give a new command")

    @property
    def held(self) -> bool:
        """Whether a jog or a held tension of the acting client is under way."""
        motion = self._held
        return (
            motion is not None
            and self.moving
            and self.commanded_here
            and motion.dead_man.live(self._bench.clock.now())
        )

    def extend(self, winding_speed: float | None, hold: float) -> None:
        """Refresh what is held; what stations and ``on_cycle`` callbacks call.

        Raises as :meth:`refresh` does, to which a person gives the direction.

        Parameters
        ----------
        winding_speed : float or None
            Of a jog, m/s, positive winds in; None for the one before.
        hold : float
            Time of motion without another refresh, s.
        """
        motion, now = self._held, self._bench.clock.now()
        self.raise_trouble()
        if motion is None or not self.commanded_here:
            raise MotionError(
                f"winch {self.name}: nothing is under way that could be refreshed"
                + (f"; {self.stopped_by} stopped it" if self.stopped_by else "; begin with jog")
            )
        if not self.moving:
            self.raise_end()
        if isinstance(motion, Jog):
            wanted = motion.requested if winding_speed is None else winding_speed
            self.require_speed(wanted)
            self.permit(direction_of(wanted))
            if not self._permits_unhomed(wanted):
                self.require_length()
            self._refresh(motion.dead_man, now, hold)
            motion.request(wanted)
            return
        direction = Direction.BOTH
        if isinstance(motion, TensionControl):
            direction = direction_of(motion.setting.tension - self.snapshot.load_tension)
        self.permit(direction)
        self._refresh(motion.dead_man, now, hold)

    def _refresh(self, dead_man: DeadMan, now: float, hold: float) -> None:
        """Extend a permission; raises MotionError naming the winch."""
        try:
            dead_man.refresh(now, now + hold)
        except MotionError as error:
            raise MotionError(f"winch {self.name}: {error}") from None

    def require_speed(self, winding_speed: float) -> None:
        """Raise UsageError for a winding speed that the winch may not have.

        Parameters
        ----------
        winding_speed : float
            m/s, positive winds in.
        """
        limit = self.wiring.limits.speed
        if not abs(number("jog", "winding speed", winding_speed)) <= limit:
            raise UsageError(
                f"winch {self.name}: {abs(winding_speed):g} m/s exceeds limits.speed "
                f"{limit:g} m/s; jog slower"
            )

    def follow(self, winding_speed: float) -> None:
        """Jog as long as an ``on_cycle`` function asks for it; raises as :meth:`jog` does.

        Parameters
        ----------
        winding_speed : float
            m/s, positive winds in; zero begins nothing.
        """
        self.require_speed(winding_speed)
        if winding_speed:
            self.require_length()
        if self.held:
            self.extend(winding_speed, DEAD_MAN)
        elif winding_speed:
            self._begin_jog(winding_speed, DEAD_MAN)

    def _begin_jog(self, winding_speed: float, hold: float, duration: float | None = None) -> None:
        """Begin a jog; one without a duration is held, and not started by repeats."""
        self.require_speed(winding_speed)
        if duration is None:
            self.require_new()
        self.permit(direction_of(winding_speed))
        if duration is not None or not self._permits_unhomed(winding_speed):
            self.require_length()
        expires = self._bench.clock.now() + (hold if duration is None else min(hold, duration))
        limits = self.wiring.limits
        known = limits if self.snapshot.length_known else limits.without_length
        self.begin(Jog(self._parts.cable, known, winding_speed, DeadMan(expires)))

    def require_new(self) -> None:
        """Raise where a held motion is asked for again instead of refreshed."""
        if self.held:
            raise MotionError(
                f"winch {self.name} is held by this client already; go on by refresh(), another "
                "speed included, or release() it first"
            )
        self._bench.commanders.press(self.name)

    def _hold_for(self, duration: float, hold: float) -> None:
        """Refresh the motion that was just started for a duration (s); returns at rest."""
        clock, mine = self._bench.clock, self._held
        end = clock.now() + duration
        while mine is self._held and self.moving and (left := end - clock.now()) > 0:
            self.extend(None, min(hold, left))
            clock.sleep(min(hold / 4, left))
        self.wait()

    def _permits_unhomed(self, winding_speed: float) -> bool:
        """Whether a held jog may be this fast while the cable length is not known."""
        return abs(winding_speed) <= self.wiring.limits.speed_unhomed

    def hold_tension(
        self,
        tension: float | str,
        *,
        duration: float | None = None,
        travel: float = 0.1,
        speed: float = 0.02,
        stiffness: float | None = None,
        hold: float = DEAD_MAN,
    ) -> None:
        """Begin to keep the tension at the platform end, for ``hold`` seconds.

        :meth:`refresh` within that time keeps it going; without one the winch ramps to rest and
        disables. With ``duration`` it does so itself for that many seconds and returns at rest.
        Where the travel is used up for 0.5 s the bench trips, and where the cable is slack for 0.2
        s (below ``tension_slack``, without one below half of the tension) although it was taut
        before, or was wound in by what the stiffness explains. Without a valid reading it rests.

        Parameters
        ----------
        tension : float or str
            N, or with its unit, ``"200 N"``.
        duration : float, optional
            s.
        travel : float
            Of cable from its place at the start, either way, m.
        speed : float
            Largest, m/s.
        stiffness : float, optional
            Upper bound of the stiffness of cable and structure, N/m; by default that of the
            profile's cable.
        hold : float
            Time without a refresh, s, at most 1.

        Raises
        ------
        UsageError
            For numbers that cannot be meant.
        NotPermitted
            Without a load cell, beyond its limits, or for more cables of a robot than its platform
            leaves free.
        """
        call = "hold_tension"
        force = parse(tension, "force") if isinstance(tension, str) else tension
        wanted = positive(call, "tension", force)
        hold = positive(call, "hold", hold, LONGEST_HOLD)
        if duration is not None:
            duration = positive(call, "duration", duration)
            self.require_waiting("hold_tension(duration=...)")
        self._begin_tension(
            wanted,
            positive(call, "travel", travel),
            positive(call, "speed", speed),
            None if stiffness is None else positive(call, "stiffness", stiffness),
            hold if duration is None else min(hold, duration),
        )
        if duration is not None:
            self._hold_for(duration, hold)

    def _begin_tension(
        self, tension: float, travel: float, speed: float, stiffness: float | None, hold: float
    ) -> None:
        """Begin the control of the tension."""
        cell = self.load_cell
        if cell is None:
            raise NotPermitted(f"winch {self.name} has no load cell, by which to hold a tension")
        limits = self.wiring.limits
        low, high = limits.tension_slack or 0.0, limits.tension_high or math.inf
        if not low < tension < high:
            raise NotPermitted(
                f"winch {self.name}: {tension:g} N is not between tension_slack, {low:g} N, and "
                f"tension_high, {high:g} N"
            )
        here = self.snapshot
        self.require_new()
        self.permit(direction_of(tension - here.load_tension))
        self.require_length()
        self._bench.permit_tension(self.name)
        bound = greatest_stiffness(self._parts.cable_spec, here.cable_length, stiffness)
        setting = TensionSetting(
            tension,
            travel,
            min(speed, limits.speed),
            bound,
            cell.max_age + limits.response_time,
            cell.max_age,
            tension / 2 if limits.tension_slack is None else limits.tension_slack,
        )
        dead_man = DeadMan(self._bench.clock.now() + hold)
        self.begin(
            TensionControl(
                self._parts.cable,
                limits,
                setting,
                self.tension_reading,
                self.trip_tension,
                dead_man=dead_man,
            )
        )

    def trip_tension(self, words: str) -> None:
        """Latch a trip of the control of the tension.

        Parameters
        ----------
        words : str
            Why.
        """
        trip = Trip("tension control", self.name, words, latches=True)
        self._bench.loop.supervisor.latch(trip)

    def begin(self, source: MotionSource, gate: StartGate | None = None) -> None:
        """Begin a planned motion; with a gate not before that opens.

        Parameters
        ----------
        source : MotionSource
            The motion, e.g. of :meth:`planned`.
        gate : StartGate, optional
            Common start with other winches.
        """
        with self._bench.commanders.claimed(self.name):
            held: object = source
            self._held = held if isinstance(held, Held) else None
            self.stopped_by = ""
            self._controller.begin(source, gate)

    def ready_for(self, move: MotionSource) -> bool:
        """Whether the drive is enabled and waits for nothing but this motion's gate.

        Parameters
        ----------
        move : MotionSource
            A motion that was started.

        Returns
        -------
        bool
            Whether it waits for its gate only.
        """
        return self._controller.ready_for(move)

    def run_down(self) -> None:
        """Order the ramp to rest, of this winch alone."""
        self._held = None
        self._controller.run_down()

    def wait(self) -> None:
        """Return when the motion is done.

        Raises LimitTripped or DriveFault for what has stopped it, MotionError where somebody did.
        """
        self.require_waiting("wait")
        while self.moving:
            self.raise_trouble()
            self._bench.clock.sleep(POLL)
        self.raise_end()
        source = self._controller.source
        if source is None or not source.holds:
            self._bench.wait_at_rest((self.name,))
