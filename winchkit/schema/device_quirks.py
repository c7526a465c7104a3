"""What a device file declares of the ways in which a drive departs from CiA 402."""

from __future__ import annotations

from dataclasses import dataclass

from winchkit.schema.quantity import Duration, Flag
from winchkit.schema.table import Table

__all__ = ["QuirkSpec"]


@dataclass(frozen=True)
class QuirkSpec(Table):
    """How a drive differs from the standard; what the simulated one then does too."""

    quick_stop_codes: tuple[int, ...] = ()
    """Values that 605Ah takes; empty for 0 to 8. -1 is a quick stop that is ignored."""
    fault_reaction_codes: tuple[int, ...] = ()
    """Values that 605Eh takes; empty for 0 to 4."""
    toggles_bit_10: Flag = False
    """Status bit 10 changes with every SYNC in the cyclic modes."""
    needs_mode: Flag = False
    """Operation is not enabled while no mode is chosen (6061h is 0)."""
    needs_both_heartbeats: Flag = False
    """1016h watches only while 1017h is set too."""
    stops_outside_operational: Flag = False
    """Leaving the NMT state Operational shuts the drive down."""
    ramps_are_times: Flag = False
    """6083h to 6085h and 609Ah are times from standstill to 3000 rpm, ms."""
    home_gets_offset: Flag = False
    """After homing the home has the position 607Ch; by the standard zero lies that far from it."""
    brake_release: Duration = 0.0
    """From enabling until the brake is open and set-points count, s."""
    brake_apply: Duration = 0.0
    """For which the motor holds the load while the brake closes, s."""
