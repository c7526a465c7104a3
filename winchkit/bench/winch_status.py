"""Status of one winch: its newest values, whether it moves, and what forbids or ended a motion."""

from __future__ import annotations

import math

from winchkit.bench.control.cable import CableMap
from winchkit.bench.control.motion import Held
from winchkit.bench.control.snapshot import Direction, Phase, WinchSnapshot
from winchkit.bench.control.tension_control import TensionControl, TensionReading
from winchkit.bench.control.winch_state import WinchParts
from winchkit.bench.host import WinchHost
from winchkit.drivers.reading import Sensor
from winchkit.errors import DriveFault, MotionError, NotPermitted
from winchkit.schema.bench import WinchWiring


class WinchStatus:
    """Status of a winch of an open bench, and the conditions of its motions."""

    def __init__(
        self,
        bench: WinchHost,
        name: str,
        wiring: WinchWiring,
        parts: WinchParts,
        sensors: dict[str, Sensor],
    ) -> None:
        self.name = name
        self.wiring = wiring
        self.sensors = sensors
        """Instruments by role: cell, load, length, temperature."""
        self._bench, self._parts = bench, parts
        self._controller = parts.controller
        self._held: Held | None = None
        """The newest motion, where it is one that must be refreshed."""
        self.stopped_by = ""
        """Who ended the last motion before its end; empty without one."""

    @property
    def snapshot(self) -> WinchSnapshot:
        """Newest picture of this winch."""
        return self._bench.snapshot.winch[self.name]

    @property
    def cable_length(self) -> float:
        """Free length from the motor angle and the tension, by the profile and its effects, m."""
        return self.snapshot.cable_length

    @property
    def tension(self) -> float:
        """In the cable at the platform end, N; NaN without an instrument.

        The load's instrument shows it; else the cell's reading, less what the effects of the
        profile put between the two. The bare reading is ``snapshot.tension``.
        """
        return self.snapshot.load_tension

    @property
    def capacity(self) -> tuple[float, float]:
        """Least and greatest cable length that its drum can have paid out, m."""
        return self._parts.capacity

    @property
    def cable(self) -> CableMap:
        """Between its motor and its cable."""
        return self._parts.cable

    def length_at(self, motor_angle: float) -> float:
        """Cable length (m) at a motor angle (rad) under the present tension, by the profile.

        Parameters
        ----------
        motor_angle : float
            rad.

        Returns
        -------
        float
            Cable length, m.
        """
        return self._parts.cable.cable_length(motor_angle)

    def motor_angle_at(self, length: float) -> float:
        """Motor angle (rad) at a cable length (m) under the present tension, by the profile.

        Parameters
        ----------
        length : float
            Cable length, m.

        Returns
        -------
        float
            Motor angle, rad.
        """
        return self._parts.cable.motor_angle(length)

    @property
    def moving(self) -> bool:
        """Whether a motion is under way."""
        return not self._controller.done

    @property
    def goes_on(self) -> bool:
        """Whether a motion is under way that does not end by itself without a new command."""
        return self.moving and self._held is None

    @property
    def holds_tension(self) -> bool:
        """Whether its motion is the control of its cable's tension."""
        return self.moving and isinstance(self._held, TensionControl)

    @property
    def commanded_here(self) -> bool:
        """Whether the client for whom this thread acts commands it."""
        commanders = self._bench.commanders
        return commanders.holder(self.name) is commanders.actor

    @property
    def load_cell(self) -> Sensor | None:
        """By which the tension is controlled: the load's instrument, else the winch's cell."""
        return self.sensors.get("load") or self.sensors.get("cell")

    def tension_reading(self, now: float) -> TensionReading:
        """Tension at the platform end: the load's instrument, else the cell with its correction.

        Parameters
        ----------
        now : float
            s.

        Returns
        -------
        TensionReading
            Newest value with its age.
        """
        load, sensor = self.sensors.get("load"), self.load_cell
        newest = None if sensor is None else sensor.latest
        if newest is None:
            return TensionReading(math.nan, math.inf)
        correction = 0.0 if load is not None else self._parts.cable.correction
        return TensionReading(newest.value + correction, now - newest.t_receive)

    def permit(self, direction: Direction) -> None:
        """Raise what forbids a motion of this winch alone; its quick stop gets the declared ramp.

        Parameters
        ----------
        direction : Direction
            Of the motion.
        """
        self._bench.permit(self.name, direction)
        self._bench.axes[self.name].set_quick_stop()

    def permit_at_rest(self) -> None:
        """Raise what forbids to enable the drive where the cable is not to move."""
        self._bench.permit_at_rest(self.name)

    def require_rest(self) -> None:
        """Raise NotPermitted while the drive is enabled: no moment to change a cell's zero."""
        if self._controller.phase is not Phase.DISABLED:
            raise NotPermitted(
                f"winch {self.name} is {self._controller.phase.value}; stop it first"
            )

    def require_length(self) -> None:
        """Raise NotPermitted where the cable length is not known: no limit of it can be kept.

        What has stopped the bench comes first: no homing is permitted before its reset.
        """
        if not self.snapshot.length_known:
            self.raise_trouble()
            speed = self.wiring.limits.speed_unhomed
            jogs = (
                f"only a jog that is held is permitted, up to {speed:g} m/s (limits.unhomed)"
                if speed
                else 'limits.unhomed = "none" forbids jogs too'
            )
            raise NotPermitted(
                f"winch {self.name}: its cable length is not known: "
                f"{self._parts.axis.position_doubt}; home first: `winchkit home {self.name} --here "
                f"LENGTH` moves nothing; {jogs}"
            )

    def require_waiting(self, call: str) -> None:
        """Raise UsageError in an ``on_cycle`` function: the control loop waits for that.

        Parameters
        ----------
        call : str
            That would wait for the control loop.
        """
        self._bench.loop.require_other_thread(call)

    def raise_trouble(self) -> None:
        """Raise what has stopped the bench, or who has taken the winch over, if anybody has."""
        self._bench.raise_trouble()
        self._bench.commanders.raise_taken(self.name)

    def raise_end(self) -> None:
        """Raise what ended the last motion before its end, if anything did."""
        self.raise_trouble()
        if self._controller.failure:
            raise DriveFault(
                f"winch {self.name}: {self._controller.failure}; {self._parts.axis.fault_text}"
            )
        if self._controller.stopped and self._controller.reason:
            raise DriveFault(f"winch {self.name} was stopped with {self._controller.reason}")
        if self._controller.stopped:
            who = self.stopped_by or "the control loop"
            what = f"was stopped by {who} before its motion was finished"
            raise MotionError(f"winch {self.name} {what}")
