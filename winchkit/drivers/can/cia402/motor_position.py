"""Position of a motor over many turns of its counter and over power cycles, and its standstill.

6064h of an absolute encoder is the same after a power cycle. That of an incremental one begins
anew, which nothing in the count shows where it begins at the value that it had. A power cycle shows
in the objects that the set-up wrote: they are volatile, and have their defaults again.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from winchkit.drivers.can.canopen.node import SdoNode, object_name
from winchkit.drivers.can.canopen.pdo import Key
from winchkit.drivers.can.cia402.commission import Commissioned, WatchSpec
from winchkit.drivers.can.cia402.feedback import AxisFeedback, counter_range
from winchkit.drivers.can.cia402.position_agreement import PositionAgreement
from winchkit.drivers.can.cia402.position_counter import PositionCounter
from winchkit.drivers.can.cia402.standstill import Standstill
from winchkit.errors import DeviceRefused
from winchkit.schema.devices.servo import ServoSpec

_POSITION, _HEARTBEAT, _SERIAL = (0x6064, 0), (0x1017, 0), (0x1018, 4)
_POLARITY, _REVERSED = (0x607E, 0), 0x80
"""607Eh, and its bit that reverses positions (CiA 402-2)."""
_SAME = 1e-9
"""Relative difference of one unit, from which a change is counted: rounding is 1e-16."""
_MAPPING, _RECORD = 0x1A00, 0x1800
"""Of TPDO 1: its mapping and its communication record."""
_RESTARTED = "the drive has restarted, and the count of its incremental encoder began anew"


@dataclass(frozen=True)
class KeptPosition:
    """A drive's position as a later process finds it in the record."""

    count: int
    """6064h as the drive showed it."""
    offset: int = 0
    """Whole ranges of the counter that were crossed, in counts."""
    zero: int = 0
    """Of a drive that keeps none itself, in counts: position less count and offset."""
    doubt: str = ""
    """Why the position was not known, in words; empty where it was."""
    closed: bool = False
    """Whether the drive was disabled, at rest; else a process was about to move it."""
    serial: int = 0
    """1018h:4; 0 where the drive has none."""
    objects: Mapping[Key, int] = field(default_factory=dict)
    """Volatile objects as the set-up had written them."""
    unit: float = 0.0
    """Of a count, rad; negative where 607Eh reverses it."""
    trim: float = 0.0
    """Of it, what corrections of the cable force have turned, rad."""


@dataclass(frozen=True)
class _ShownByDrive:
    """What a drive shows before anything is written to it."""

    count: int
    serial: int
    """0 where it has none."""
    restarted: str
    """Evidence that it was switched off since the set-up before, in words."""
    sense: int
    """-1 where 607Eh reverses its count, else 1."""


class MotorPosition:
    """One axis's; it outlives every commissioning, so that crossings of the counter's end count.

    The one place where it is decided whether the motor angle is known: :attr:`doubt`.
    """

    def __init__(self, servo: ServoSpec, watch: WatchSpec) -> None:
        """Take the drive's encoder, and what the bench says of the motor's motion."""
        self._wraps, self._watch = servo.position_wraps, watch
        self._incremental = servo.encoder == "incremental"
        self.agreement = PositionAgreement()
        """Of its 6064h with 606Ch."""
        self.trim = 0.0
        """Angle that corrections of the cable force have turned since the last homing, rad."""
        self.counter: PositionCounter | None = None
        """Of its 6064h; None before it is commissioned."""
        self._standstill: Standstill | None = None
        self._boot_ups = 0
        self._angle = math.nan
        self._unit = 0.0
        """Of a count, rad, negative where 607Eh reverses it; 0 before it is commissioned."""
        self._kept: KeptPosition | None = None
        self._serial = 0
        self._objects: Mapping[Key, int] = {}
        self._found: _ShownByDrive | None = None
        self._zero: str | None = None
        """Doubt of the zero that the drive has set since it homes; None where it has set none."""

    @property
    def doubt(self) -> str:
        """Why the position is not known, in words; empty where it is."""
        return "" if self.counter is None else self.counter.doubt

    @property
    def mark(self) -> tuple[int, int, str, bool]:
        """What of the record changes besides the count: ranges, zero, doubt, no homing runs."""
        counter = self.counter
        if counter is None:
            return 0, 0, "", False
        return counter.offset, counter.zero, counter.doubt, counter.settled

    @property
    def jump(self) -> str:
        """Change of 6064h that no motion explains, in words; empty without one."""
        counter = self.counter
        if counter is None or not counter.jump:
            return ""
        turns = counter.jump * self._angle / math.tau
        return f"6064h changed by {turns:.2f} turns of the motor from one answer to the next"

    @property
    def disagreement(self) -> str:
        """Change of 6064h that 606Ch contradicts, in words; empty without one."""
        found = self.agreement.found
        return "" if found is None else str(found)

    def forget_jump(self) -> None:
        """A reset has shown it; the position stays unknown."""
        self.agreement.forget()
        if self.counter is not None:
            self.counter.jump = 0.0

    def lose(self, doubt: str) -> None:
        """The position is not known, until a homing; one that is under way decides itself."""
        if self.counter is not None and self.counter.settled:
            self.counter.lose(doubt)

    def recall(self, kept: KeptPosition | None) -> None:
        """Take what the record says, before the first commissioning; None without one."""
        self._kept = kept
        self.trim = 0.0 if kept is None else kept.trim

    def keep(self, *, closed: bool) -> KeptPosition | None:
        """The position for the record; None before the first feedback."""
        counter = self.counter
        if counter is None or not math.isfinite(counter.last):
            return None
        closed = closed and counter.settled
        last = int(counter.last)
        return KeptPosition(
            *(last, counter.offset, counter.zero, counter.doubt),
            closed=closed,
            serial=self._serial,
            objects=self._objects,
            unit=self._unit,
            trim=self.trim,
        )

    def look(self, node: SdoNode) -> None:
        """Look for signs of a power cycle; before the set-up writes anything."""
        before = self._objects
        if self.counter is None:
            before = {} if self._kept is None else self._kept.objects
        restarted = _evidence(node, before) if before else ""
        serial = node.read_if_there(*_SERIAL) or 0
        reverses = (node.read_if_there(*_POLARITY) or 0) & _REVERSED
        sense = -1 if reverses else 1
        self._found = _ShownByDrive(node.read(*_POSITION), serial, restarted, sense)

    def begin(self, drive: Commissioned, boot_ups: int) -> PositionCounter:
        """The counter of a drive that has been set up; a boot-up has reset it."""
        counter, found = self.counter, self._found
        assert found is not None, "the axis has looked before the set-up"
        booted = boot_ups != self._boot_ups
        unit = found.sense * drive.scale.angle
        if counter is None:
            low, high = self._wraps or counter_range(drive.tpdo)
            counter = PositionCounter(low, high, self._watch.speed / drive.scale.angle)
            self._resume(counter, found, drive, booted=booted)
        elif changed := _changed_unit(self._unit, unit):
            counter.restart(changed)
        elif booted or found.restarted:
            evidence = _RESTARTED if booted else found.restarted
            counter.restart(evidence if self._incremental else "")
        self._angle, self._unit = drive.scale.angle, unit
        self.counter, self._boot_ups = counter, boot_ups
        self._serial, self._objects = found.serial, dict(_written(drive))
        self._standstill = Standstill(drive.scale)
        self.agreement = PositionAgreement(
            drive.scale.angle,
            drive.scale.velocity,
            self._watch.response,
            self._watch.late,
            self._watch.speed,
            cycle=self._watch.cycle,
        )
        return counter

    def at_rest(self, seen: AxisFeedback | None) -> bool:
        """Whether the newest feedback says that the motor stands still."""
        if seen is None or self._standstill is None:
            return False
        return self._standstill.take(seen.time, seen.angle, seen.velocity)

    def note_zero(self, doubt: str = "") -> None:
        """A homing has set the drive's zero; ``doubt`` says why the position is not known yet.

        The status word does not say it later: some drives clear bits 10 and 12 when disabled.
        """
        self._zero, self.trim = doubt, 0.0

    def define(self, angle: float) -> None:
        """Let the motor at rest have an angle (rad), by a zero that is kept in the record."""
        if self.counter is not None:
            self.trim = 0.0
            self.agreement.suspend()
            self.counter.define(round(angle / self._angle))
            self.agreement.resume()

    def changed_mode(self, before: str, mode: str) -> None:
        """While it homes, the drive's count jumps to the new zero: it is taken as it is."""
        if self.counter is None or before == mode:
            return
        if mode == "HM":
            self._zero = None
            self.counter.suspend()
            self.agreement.suspend()
        elif before == "HM":
            self.counter.resume(self._zero)
            self.agreement.resume()

    def after_boot_up(self) -> str:
        """Why the position is not known once a boot-up message has come; empty where it is."""
        return self.doubt or (_RESTARTED if self._incremental else "")

    def _resume(
        self, counter: PositionCounter, found: _ShownByDrive, drive: Commissioned, *, booted: bool
    ) -> None:
        """Go on from the record where the drive's counter has gone on since.

        Without it the count of an absolute encoder is the position, unless it had left its range,
        or its zero is in the record.
        """
        kept = self._kept
        if kept is not None and kept.serial != found.serial:
            counter.doubt = (
                f"it is another drive: its serial number (1018h:4) is {found.serial} and was "
                f"{kept.serial}"
            )
            return
        changed = _changed_unit(kept.unit, found.sense * drive.scale.angle) if kept else ""
        if changed:
            counter.doubt = changed
            return
        counter.zero = 0 if kept is None else kept.zero
        doubt = self._break(kept, found, counter.span, drive.scale.angle, booted=booted)
        if kept is not None and (kept.doubt or not doubt):
            counter.offset, counter.doubt = kept.offset, kept.doubt
        elif self._incremental or (kept is None and not drive.keeps_zero):
            counter.doubt = doubt
        elif kept is not None and kept.offset:
            counter.doubt = f"6064h had wrapped in an earlier process, and {doubt}"

    def _break(
        self,
        kept: KeptPosition | None,
        found: _ShownByDrive,
        span: int,
        unit: float,
        *,
        booted: bool,
    ) -> str:
        """Why the counter may not have gone on since the record, in words; empty where it has."""
        if kept is None:
            return "there is no record of where it stood, or of its zero"
        if booted:
            return _RESTARTED
        if found.restarted:
            return found.restarted
        if not kept.closed:
            return "the process that moved it last ended without closing its record"
        moved = (found.count - kept.count + span // 2) % span - span // 2
        if abs(moved * unit) > self._watch.play:
            return (
                f"6064h is {found.count} and was {kept.count} when it was closed: the drive was "
                "switched off, set, or turned since"
            )
        return ""


def _changed_unit(was: float, now: float) -> str:
    """That a count has another size or sense than when the zero was found, in words."""
    if not was or math.isclose(was, now, rel_tol=_SAME):
        return ""
    turn, before = (
        f"{math.tau / abs(unit):.10g}{' (reversed by 607Eh)' if unit < 0 else ''}"
        for unit in (now, was)
    )
    return (
        f"a motor turn is {turn} counts of 6064h and was {before} when it was homed: its device "
        "file was changed, or 607Eh, 608Fh, 6091h or 6092h of the drive"
    )


def _written(drive: Commissioned) -> Iterator[tuple[Key, int]]:
    """Volatile objects that the set-up has written and verified."""
    if drive.heartbeat is not None:
        yield _HEARTBEAT, drive.heartbeat
    for codec in drive.tpdo:
        mapping, record = (first + codec.spec.number - 1 for first in (_MAPPING, _RECORD))
        yield (record, 2), codec.spec.transmission
        yield (mapping, 0), len(codec.objects)
        for position, item in enumerate(codec.objects, start=1):
            yield (mapping, position), item.entry


def _evidence(node: SdoNode, written: Mapping[Key, int]) -> str:
    """Evidence that a drive was switched off since these objects were written, in words.

    One that has another value has its default again. Where all that was written is the default
    a power cycle would not show, and counts as one.
    """
    tells = False
    for (index, sub), value in written.items():
        try:
            now = node.read_if_there(index, sub)
        except DeviceRefused:
            now = None
        if now != value:
            shown = "absent" if now is None else f"{now:X}h"
            return (
                f"the drive was switched off since, or set up by another program: "
                f"{object_name(index, sub)} is {shown}, and {value:X}h was written"
            )
        tells = tells or _default(node, index, sub) not in (None, value)
    if tells:
        return ""
    return (
        "nothing in the drive would show that it was switched off: its TPDO mapping and 1017h are "
        "those after power-on"
    )


def _default(node: SdoNode, index: int, sub: int) -> int | None:
    """Value after power-on by the EDS, else by CiA 301; None where it is unknown."""
    variable = node.dictionary.get_variable(index, sub)
    default = None if variable is None else variable.default
    if isinstance(default, int):
        return default
    return 0 if (index, sub) == _HEARTBEAT else None
