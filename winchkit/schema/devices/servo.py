"""Contents of a device file of a CiA 402 servo drive."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from winchkit.schema.devices.drive_unit import DriveUnit
from winchkit.schema.host_loss import VendorWatchdog, unknown_mechanism
from winchkit.schema.quantity import Duration, Flag, Quantity, Whole, WholeNumber
from winchkit.schema.table import Rule, Table


@dataclass(frozen=True)
class QuirkSpec(Table):
    """Deviations of a drive from the standard, which the simulated drive reproduces."""

    quick_stop_codes: tuple[int, ...] = ()
    """Values that 605Ah takes; empty for 0 to 8. -1 is a quick stop that is ignored."""
    fault_reaction_codes: tuple[int, ...] = ()
    """Values that 605Eh takes; empty for 0 to 4."""
    toggles_bit_10: Flag = False
    """Status bit 10 changes with every SYNC in the cyclic modes."""
    needs_mode: Flag = False
    """Operation is not enabled while no mode is chosen (6061h is 0)."""
    needs_both_heartbeats: Flag = False
    """1016h is effective only while 1017h is set too."""
    stops_outside_operational: Flag = False
    """Leaving the NMT state Operational shuts the drive down."""
    ramps_are_times: Flag = False
    """6083h to 6085h and 609Ah are times from standstill to 3000 rpm, ms."""
    home_gets_offset: Flag = False
    """The home position is 607Ch after homing; in the standard 607Ch is the offset of zero."""
    brake_release: Duration = 0.0
    """From enabling until the brake is open and set-points are effective, s."""
    brake_apply: Duration = 0.0
    """Time for which the motor holds the load while the brake closes, s."""


Mode = Literal["PP", "PV", "PT", "HM", "IP", "CSP", "CSV", "CST"]
MotionMode = Literal["CSP", "CSV", "PV", "IP"]
Encoder = Literal["absolute", "incremental"]

_ON_REQUEST = (252, 253)
_RESERVED = range(241, 252)
_EVENT = (254, 255)
Count = Annotated[int, Whole(-(2**31), 2**32 - 1)]
"""Of a position counter."""
_I16 = Whole(-(2**15), 2**15 - 1)


@dataclass(frozen=True)
class PdoSpec(Table):
    """One PDO: its objects in order as ``index`` or ``index:sub``, e.g. ``0x6041`` ``0x6064``."""

    number: Annotated[int, Whole(1, 4)]
    """Within the predefined connection set; TPDO 1 has its communication record at 1800h."""
    objects: tuple[str, ...]
    """In the order in which the PDO carries them."""
    transmission: Annotated[int, Whole(0, 255)] = 1
    """CANopen transmission type: 1 every SYNC, n every n-th, 0 with a SYNC after a change, 254
    and 255 by events of the drive."""
    event_timer: Duration = 0.0
    """Of types 254 and 255: event timer, s; 0: sent only after a change."""
    inhibit_time: Duration = 0.0
    """Of types 254 and 255: inhibit time, s."""

    @property
    def every_sync(self) -> bool:
        """Whether it is sent with each SYNC."""
        return self.transmission == 1

    @property
    def by_event(self) -> bool:
        """Whether the drive sends it by its own events."""
        return self.transmission in _EVENT

    def rules(self) -> Iterator[Rule]:
        """Reserved transmission types, and timers without effect, are errors."""
        kind = self.transmission
        if kind in _RESERVED or kind in _ON_REQUEST:
            why = "is reserved" if kind in _RESERVED else "answers remote requests only"
            yield "transmission", f"{kind} {why}; use 1 to 240 (SYNC), 254 or 255 (events)"
        for key in ("event_timer", "inhibit_time"):
            if getattr(self, key) and not self.by_event:
                yield key, f"has no effect with transmission {kind}; it is for 254 and 255"


@dataclass(frozen=True)
class OptionSpec(Table):
    """Option codes for stops; a key that is left out keeps the drive's own value."""

    quick_stop: Annotated[int, _I16] | None = None
    """605Ah: 1 to 4 ramp, then switched off; 5 to 8 ramp and stay in quick stop; 0 coast."""
    shutdown: Annotated[int, _I16] | None = None
    """605Bh: 1 ramp, 0 coast."""
    disable_operation: Annotated[int, _I16] | None = None
    """605Ch: 1 ramp, 0 coast."""
    halt: Annotated[int, _I16] | None = None
    """605Dh: 1 to 4, ramp and stay enabled."""
    fault: Annotated[int, _I16] | None = None
    """605Eh: 1 to 4 ramp, 0 coast."""
    connection_lost: Annotated[int, _I16] | None = None
    """6007h: 1 fault, 2 disable voltage, 3 quick stop, 0 no action."""


@dataclass(frozen=True)
class ServoSpec(Table):
    """A CiA 402 drive."""

    eds: str
    """Name of the EDS file beside the device file."""
    modes: tuple[Mode, ...]
    """Modes of operation that it has: PP, PV, PT, HM, IP, CSP, CSV, CST."""
    motion_mode: MotionMode = "CSV"
    """Mode of operation in which the bench moves it."""
    increments_per_turn: WholeNumber = 65_536
    """Position units of one motor turn unless the drive's objects declare them."""
    home_offset: str = "0x607C"
    """Object of the home position, as ``index`` or ``index:sub``; a maker-specific one where the
    drive lacks 607Ch."""
    encoder: Encoder = "incremental"
    """Whether 6064h is the same after a power cycle (``absolute``), with the zero of a homing, or
    begins anew (``incremental``)."""
    position_wraps: tuple[Count, Count] | None = None
    """Lowest and highest count of 6064h before it wraps around, where that is not the range of 32
    bits."""
    position_unit: Annotated[str, DriveUnit("position")] | None = None
    """Of 6064h and 607Ah, with ``units = "file"``; by default ``turn / encoder``. A product such as
    ``0.1 deg``, where ``encoder`` is ``increments_per_turn``."""
    speed_unit: Annotated[str, DriveUnit("speed")] = "increments/s"
    """Of 606Ch, 60FFh, 6081h and, per second, of 6083h to 6085h, where 60A9h is missing. A product
    such as ``0.1 rpm``, ``0.1 counts/s``, ``counts / 65536 / 250 us`` or
    ``1875 rpm / 512 / encoder``: ``increments`` (or ``counts``) are units of 6064h, ``encoder`` is
    608Fh or ``increments_per_turn``."""
    units: Literal["drive", "file"] = "drive"
    """Source of units: the drive's 608Fh, 6091h, 6092h, 60A8h and 60A9h, or this file, for drives
    that do not use the values of these objects."""
    rated_torque: Annotated[float, Quantity("torque", 0.0, above=True)] = 1.0
    """N m; object 6076h has precedence."""
    tpdo: tuple[PdoSpec, ...] = ()
    """TPDOs of the drive: at least 6041h, 6064h and 606Ch, the first two with every SYNC."""
    rpdo: tuple[PdoSpec, ...] = ()
    """RPDOs of the drive: 6040h and the target of ``motion_mode``."""
    options: OptionSpec = field(default_factory=OptionSpec)
    """Written at commissioning and read back."""
    boot_time: Duration = 1.0
    """From power-on or NMT reset to the boot-up message at the latest, s."""
    quirks: QuirkSpec = field(default_factory=QuirkSpec)
    """Deviations from CiA 402."""
    host_loss: str = "heartbeat"
    """Mechanism by which it detects the loss of the host: ``heartbeat`` (1016h), ``guarding``
    (100Ch, 100Dh), ``rpdo-timeout`` (14xxh:05), ``sync-loss`` (1006h) or ``vendor:NAME``."""
    vendor_watchdog: Mapping[str, VendorWatchdog] = field(default_factory=dict)
    """Maker-specific watchdogs, by name."""

    def rules(self) -> Iterator[Rule]:
        """The mechanism of detecting a host loss is a known one; counts wrap upwards."""
        if self.position_wraps is not None and self.position_wraps[0] >= self.position_wraps[1]:
            yield "position_wraps", "the lowest count is not below the highest"
        if self.position_unit is not None and self.units != "file":
            yield (
                "position_unit",
                'needs units = "file": with units = "drive" the unit is that of 608Fh, 6091h, 6092h'
                " and 60A8h",
            )
        if wrong := unknown_mechanism(self.host_loss, tuple(self.vendor_watchdog)):
            yield "host_loss", wrong
