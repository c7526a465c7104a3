"""What the control of a winch needs of a drive."""

from __future__ import annotations

from typing import Protocol

from winchkit.drivers.can.canopen.nmt import HeartbeatConsumer
from winchkit.drivers.can.cia402.feedback import AxisFeedback
from winchkit.drivers.can.cia402.motor_position import KeptPosition
from winchkit.drivers.can.cia402.state_machine import DriveState, RequestedState


class AxisPort(Protocol):
    """Interface of an axis to the control loop, such as ``Cia402Axis``."""

    heartbeat: HeartbeatConsumer

    @property
    def feedback(self) -> AxisFeedback | None:
        """Newest feedback."""

    @property
    def at_rest(self) -> bool:
        """Whether the motor stands still."""

    @property
    def operational(self) -> bool:
        """Whether the drive is in NMT state operational."""

    @property
    def position_doubt(self) -> str:
        """Why the motor angle is not known, in words; empty where it is."""

    @property
    def position_mark(self) -> tuple[int, int, str, bool]:
        """What of the position's record changes besides the count; the same while it stays."""

    @property
    def mode_kept(self) -> bool:
        """Whether the mode display (6061h) is that of the commanded mode (6060h)."""

    @property
    def fault_text(self) -> str:
        """Fault of the drive in words."""

    @property
    def nmt_text(self) -> str:
        """NMT state of its heartbeat in words."""

    @property
    def position_mode(self) -> bool:
        """Whether its setpoints are positions and not speeds."""

    @property
    def moves_alone(self) -> bool:
        """Whether the drive generates the present motion itself (HM, PP)."""

    @property
    def position_jump(self) -> str:
        """Change of 6064h that no motion explains, in words; empty without one."""

    @property
    def position_disagreement(self) -> str:
        """Change of 6064h that 606Ch contradicts, in words; empty without one."""

    @property
    def alarms(self) -> tuple[int, ...]:
        """Emergency codes in force without a fault."""

    @property
    def alarm_text(self) -> str:
        """Emergency codes in force, in words."""

    @property
    def second_master(self) -> str:
        """The first command to it that was not sent here, in words; empty where none was."""

    @property
    def last_request_elsewhere(self) -> float:
        """Time of the last SDO request of another client to this drive, s."""

    @property
    def control_words_elsewhere(self) -> int:
        """SDO writes of 6040h by other clients so far."""

    @property
    def stops_on_nmt(self) -> bool:
        """Whether commissioning found that it leaves operation enabled on NMT stop."""

    @property
    def sdo_refused(self) -> bool:
        """Whether it aborted the present stop by SDO."""

    @property
    def sdo_state(self) -> DriveState | None:
        """Power state read by SDO since that stop began."""

    def keep_position(self, *, closed: bool) -> KeptPosition | None:
        """The position for the record, ``closed`` at rest; None before the first feedback."""

    def lose_position(self, doubt: str) -> None:
        """Take the position as unknown until the drive is homed, for a reason in words."""

    def stop_by_sdo(self) -> None:
        """Quick stop by SDO; without waiting."""

    def stop_by_nmt(self) -> None:
        """NMT stop."""

    def end_stop(self) -> None:
        """End the stop by SDO."""

    def emergency_stop(self, *, sdo: bool) -> None:
        """Send the prepared quick stop by RPDO, and by SDO where asked to."""

    def fall_silent(self) -> bool:
        """End the life signs that the drive watches; whether SYNC is one of them."""

    def begin_cycle(self, sync: int, now: float) -> None:
        """Note a SYNC."""

    def send(
        self,
        requested: RequestedState,
        *,
        velocity: float = 0.0,
        angle: float | None = None,
        start: bool = False,
    ) -> int:
        """Send a command; ``start`` lets the drive make a motion of its own."""
