"""Motions of one winch; every call is synchronous and may come from any thread."""

from __future__ import annotations

from winchkit.arguments import number
from winchkit.bench.cells.tares import await_device_tare, host_tare
from winchkit.bench.control.homing_motion import HomingRequest
from winchkit.bench.control.motion import PlannedMove, Trim
from winchkit.bench.control.supervisor import direction_of
from winchkit.bench.direction import no_positional, paid_out
from winchkit.bench.held_winch import POLL, HeldWinch
from winchkit.errors import NotPermitted

_TARE_TIME = 2.0
"""s: a cell of 10 Hz gives 20 readings, whose mean has a quarter of their noise."""


class Winch(HeldWinch):
    """A winch of an open bench: ``bench.winch["A"]``."""

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
        if wait:
            self.require_waiting("move_to")
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

        Raises UsageError unless exactly one is given, by its name.

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
        self.require_waiting("home")
        for _ in self._bench.homing(self.name, HomingRequest(method, at, speed)):
            self._bench.clock.sleep(POLL)

    def stop(self, *, wait: bool = True) -> None:
        """Ramp to rest, then disable. Always allowed.

        The bench's other winches stop with it, unless its ``stop_together`` is false.

        Parameters
        ----------
        wait : bool
            Return when it is disabled and stands still.
        """
        self._bench.stop_with(self.name, wait=wait)

    def planned(
        self,
        length: float,
        speed: float | None = None,
        acceleration: float | None = None,
        *,
        hold: bool = False,
    ) -> PlannedMove:
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
        PlannedMove
            The move, for :meth:`begin`.
        """
        self.require_length()
        length = number("move_to", "length", length)
        speed = None if speed is None else number("move_to", "speed", speed)
        if acceleration is not None:
            acceleration = number("move_to", "acceleration", acceleration)
        cable = self._parts.cable
        move = PlannedMove(
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

    def tare(self) -> float:
        """Tare the load cell at rest; returns the tension that it then reads, N.

        By its own volatile command where it has one, else the host subtracts what hangs there
        (:func:`~winchkit.bench.cells.tares.host_tare`). Its EEPROM is not touched. Raises
        NotPermitted, DeviceRefused.
        """
        self.require_waiting("tare")
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
