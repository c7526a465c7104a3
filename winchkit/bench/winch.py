"""Motions of one winch; every call is synchronous and may come from any thread."""

from __future__ import annotations

import math

from winchkit.bench.cells.device_tare import await_device_tare
from winchkit.bench.cells.tares import host_tare
from winchkit.bench.control.homing_motion import HomingRequest
from winchkit.bench.control.motion import DEAD_MAN, Jog, MotionSource, Move, StartGate, Trim
from winchkit.bench.control.snapshot import Trip
from winchkit.bench.control.supervisor import direction_of
from winchkit.bench.control.tension_control import (
    TensionControl,
    TensionSetting,
    greatest_stiffness,
)
from winchkit.bench.direction import no_positional, paid_out
from winchkit.bench.winch_status import WinchStatus
from winchkit.errors import NotPermitted, UsageError
from winchkit.units import parse

__all__ = ["Winch"]

_POLL = 0.01
"""s: two or more cycles at the usual 4 ms."""
_TARE_TIME = 2.0
"""s: a cell of 10 Hz gives 20 readings, whose mean has a quarter of their noise."""


class Winch(WinchStatus):
    """A winch of an open bench: ``bench.winch["A"]``."""

    def jog(
        self,
        *unnamed: object,
        pay_out: float | None = None,
        wind_in: float | None = None,
        duration: float | None = None,
        hold: float = DEAD_MAN,
    ) -> None:
        """Move the cable at a speed (m/s, positive), out or in, for ``hold`` seconds.

        Call it again within that time to keep going; without another call it ramps to rest and
        disables. With ``duration`` it does so itself for that many seconds and returns at rest.
        Raises TypeError for a speed without a name, UsageError, NotPermitted, LimitTripped,
        DriveFault.

        Parameters
        ----------
        pay_out, wind_in : float
            Cable speed, m/s, positive; exactly one is given.
        duration : float, optional
            Time of the jog, s.
        hold : float
            Time of motion without another call, s, at most 1.
        """
        no_positional("jog", "m/s", unnamed)
        winding_speed = -paid_out("jog", pay_out, wind_in)
        if duration is None:
            self.keep_jogging(winding_speed, hold)
            return
        clock = self._bench.clock
        end = clock.now() + duration
        self.keep_jogging(winding_speed, hold, held=False)
        mine = self._jog
        while mine is self._jog and self.moving and (left := end - clock.now()) > 0:
            self.permit(direction_of(winding_speed))
            if mine is not None:
                mine.refresh(winding_speed, clock.now() + min(hold, left))
            clock.sleep(min(hold / 4, left))
        self.wait()

    def keep_jogging(
        self, winding_speed: float, hold: float = DEAD_MAN, *, held: bool = True
    ) -> None:
        """Begin or refresh a jog at a winding speed (m/s, positive winds in), zero ends it.

        What stations and ``on_cycle`` callbacks call; for a person :meth:`jog` names the
        direction. Raises as that does. ``held``: the call is one of those that go on while
        somebody holds on, and has to cease for a moment after a stop.

        Parameters
        ----------
        winding_speed : float
            m/s, positive winds in.
        hold : float
            Time of motion without another call, s, at most 1.
        held : bool
            Whether the call is one of a series.
        """
        if not math.isfinite(winding_speed) or not 0 < hold <= 1:
            raise UsageError(f"a jog at {winding_speed} m/s held for {hold} s cannot be meant")
        limit = self.wiring.limits.speed
        if abs(winding_speed) > limit:
            raise UsageError(
                f"winch {self.name}: {abs(winding_speed):g} m/s exceeds limits.speed "
                f"{limit:g} m/s; jog slower"
            )
        self._refresh(winding_speed, hold, held=held)

    def move_to(
        self,
        length: float,
        speed: float | None = None,
        acceleration: float | None = None,
        *,
        wait: bool = True,
        hold: bool = False,
    ) -> None:
        """Move to a cable length (m) on an S-curve, limits of the winch unless lower ones given.

        With ``hold`` the drive stays enabled there until ``stop``. Raises NotPermitted,
        LimitTripped, DriveFault.

        Parameters
        ----------
        length : float
            Cable length, m.
        speed, acceleration : float, optional
            m/s and m/s²; by default the limits of the winch.
        wait : bool
            Return when the winch stands still.
        hold : bool
            Keep the drive enabled at the end.
        """
        self.begin(self.planned(length, speed, acceleration, hold=hold))
        if wait:
            self.wait()

    def move_by(
        self,
        *unnamed: object,
        pay_out: float | None = None,
        wind_in: float | None = None,
        speed: float | None = None,
        wait: bool = True,
        hold: bool = False,
    ) -> None:
        """Pay out or wind in a length (m, positive) of cable; else as :meth:`move_to`.

        Raises TypeError for a length without a name, UsageError unless exactly one is given.

        Parameters
        ----------
        pay_out, wind_in : float
            Length, m, positive; exactly one is given.
        speed : float, optional
            m/s; by default the limit of the winch.
        wait : bool
            Return when the winch stands still.
        hold : bool
            Keep the drive enabled at the end.
        """
        no_positional("move_by", "m", unnamed)
        change = paid_out("move_by", pay_out, wind_in)
        self.move_to(self.cable_length + change, speed, wait=wait, hold=hold)

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
        """Keep the tension at the platform end, for ``hold`` seconds.

        Call it again within that time to go on; without another call the winch ramps to rest and
        disables. With ``duration`` it does so itself for that many seconds and returns at rest.
        Where the travel is used up for 0.5 s the bench trips. Without a valid reading it rests.

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
            Time without another call, s, at most 1.

        Raises
        ------
        UsageError
            For numbers that cannot be meant.
        NotPermitted
            Without a load cell, or beyond its limits.
        """
        wanted = tension if isinstance(tension, float | int) else parse(tension, "force")
        clock = self._bench.clock
        self._keep_tension(wanted, travel, speed, stiffness, hold)
        if duration is None:
            return
        mine, end = self._tension, clock.now() + duration
        while self._tension is mine and self.moving and (left := end - clock.now()) > 0:
            self.raise_trouble()
            if mine is not None:
                mine.refresh(clock.now() + min(hold, left))
            clock.sleep(min(hold / 4, left))
        self.wait()

    def _keep_tension(
        self, tension: float, travel: float, speed: float, stiffness: float | None, hold: float
    ) -> None:
        """Begin the control of the tension, or refresh it."""
        numbers = (tension, travel, speed, 1.0 if stiffness is None else stiffness)
        if not all(0 < number < math.inf for number in numbers) or not 0 < hold <= 1:
            raise UsageError(
                f"winch {self.name}: a tension of {tension} N with {travel} m of travel at {speed} "
                f"m/s held for {hold} s cannot be meant; all are above zero"
            )
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
        self.permit(direction_of(tension - here.load_tension), held=True)
        self.require_length()
        expires = self._bench.clock.now() + hold
        with self._bench.commanders.claimed(self.name):
            control = self._tension
            known = self._controller.source in (control, None) and self.moving
            if control is None or not known or control.setting.tension != tension:
                bound = greatest_stiffness(self._parts.cable_spec, here.cable_length, stiffness)
                setting = TensionSetting(
                    tension,
                    travel,
                    min(speed, limits.speed),
                    bound,
                    cell.max_age + limits.response_time,
                    cell.max_age,
                )
                control = TensionControl(
                    self._parts.cable, limits, setting, self.tension_reading, self.trip_tension
                )
                self._jog, self._tension = None, control
                control.refresh(expires)
                self._controller.begin(control)
            else:
                control.refresh(expires)

    def trip_tension(self, words: str) -> None:
        """Latch a trip of the control of the tension.

        Parameters
        ----------
        words : str
            Why.
        """
        trip = Trip("tension control", self.name, words, latches=True)
        self._bench.loop.supervisor.latch(trip)

    def home(
        self, method: int | None = None, *, at: float | None = None, speed: float | None = None
    ) -> None:
        """Let the drive find its zero by a method of 6098h, searching at ``speed`` (m/s).

        ``at`` is the cable length (m) at that zero; without a method it is the present one, and
        nothing moves. Raises UsageError, NotPermitted, DeviceRefused, DriveFault, LimitTripped.

        Parameters
        ----------
        method : int, optional
            Homing method of CiA 402 (6098h).
        at : float, optional
            Cable length, m.
        speed : float, optional
            Speed of the search, m/s.
        """
        for _ in self._bench.homing(self.name, HomingRequest(method, at, speed)):
            self._bench.clock.sleep(_POLL)

    def stop(self, *, wait: bool = True) -> None:
        """Ramp to rest, then disable. Always allowed.

        The bench's other winches stop with it, unless its ``stop_together`` is false.

        Parameters
        ----------
        wait : bool
            Return when it is disabled and stands still.
        """
        self._bench.stop_with(self.name, wait=wait)

    def wait(self) -> None:
        """Return when the motion is done.

        Raises LimitTripped or DriveFault for what has stopped it, MotionError where somebody did.
        """
        while self.moving:
            self.raise_trouble()
            self._bench.clock.sleep(_POLL)
        self.raise_end()
        source = self._controller.source
        if source is None or not source.holds:
            self._bench.wait_at_rest((self.name,))

    def planned(
        self,
        length: float,
        speed: float | None = None,
        acceleration: float | None = None,
        *,
        hold: bool = False,
    ) -> Move:
        """The move that ``move_to`` would make; nothing begins. Raises as that does.

        Parameters
        ----------
        length : float
            Cable length, m.
        speed, acceleration : float, optional
            m/s and m/s²; by default the limits of the winch.
        hold : bool
            Keep the drive enabled at the end.

        Returns
        -------
        Move
            The move, for :meth:`begin`.
        """
        self.require_length()
        cable = self._parts.cable
        move = Move(
            cable,
            self.wiring.limits,
            length,
            speed=speed,
            acceleration=acceleration,
            holds=hold,
            trim=Trim(cable, length, self.wiring.limits) if cable.yields else None,
        )
        here = self.snapshot
        self._bench.axes[self.name].permit_angle(cable.motor_angle(length))
        self.permit(direction_of(here.cable_length - length))
        move.prepare(here.motor_angle)
        return move

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
            self._jog = self._tension = None
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
        self._jog = self._tension = None
        self._controller.run_down()

    def tare(self) -> float:
        """Tare the load cell at rest; returns the tension that it then reads, N.

        By its own volatile command where it has one, else the host subtracts what hangs there
        (:func:`~winchkit.bench.cells.tares.host_tare`). Its EEPROM is not touched. Raises
        NotPermitted, DeviceRefused.
        """
        cell = self.sensors.get("cell")
        if cell is None:
            raise NotPermitted(f"winch {self.name} has no load cell to tare; wire one as `cell`")
        self.require_rest()
        cells, name = self._bench.cells, f"{self.name}.cell"
        writes_eeprom = cells.device(name).commands.get("tare")
        if writes_eeprom is None or writes_eeprom:
            return float(host_tare(cells, name, _TARE_TIME)["after"])
        cells.command(name, "tare")
        return await_device_tare(self._bench.clock, self.name, cell)

    def _permits_unhomed(self, winding_speed: float) -> bool:
        """Whether a held jog may be this fast while the cable length is not known."""
        return abs(winding_speed) <= self.wiring.limits.speed_unhomed

    def _refresh(self, winding_speed: float, hold: float, *, held: bool) -> None:
        self.permit(direction_of(winding_speed), held=held)
        if winding_speed and not (held and self._permits_unhomed(winding_speed)):
            self.require_length()
        expires = self._bench.clock.now() + hold
        with self._bench.commanders.claimed(self.name):
            jog = self._jog
            if jog is None or not self.moving or self._controller.source not in (jog, None):
                limits = self.wiring.limits
                known = self.snapshot.length_known
                jog = self._jog = Jog(self._parts.cable, limits if known else limits.without_length)
                self._tension = None
                jog.refresh(winding_speed, expires)
                if winding_speed != 0:
                    self._controller.begin(jog)
            else:
                jog.refresh(winding_speed, expires)
