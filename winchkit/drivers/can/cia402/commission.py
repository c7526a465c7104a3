"""Commissioning of a CiA 402 drive: from power-on to operational, disabled and supervised."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from winchkit.drivers.can.canopen.nmt import HeartbeatConsumer, NmtCommand, NmtState
from winchkit.drivers.can.canopen.node import SdoNode
from winchkit.drivers.can.canopen.pdo import PdoCodec
from winchkit.drivers.can.canopen.pdo_parameters import INVALID, codecs, set_up
from winchkit.drivers.can.cia402.limits import DriveLimits, LimitsAtShaft, set_limits
from winchkit.drivers.can.cia402.modes import MODES, change_mode, supported_modes
from winchkit.drivers.can.cia402.option_codes import OptionCode, merged, set_options
from winchkit.drivers.can.cia402.profile_parameters import keeps_zero, set_profile, set_quick_stop
from winchkit.drivers.can.cia402.standstill import PolledStandstill
from winchkit.drivers.can.cia402.state_machine import QUICK_STOP, DriveState, state_of
from winchkit.drivers.can.cia402.units import CountScale, read_scale
from winchkit.drivers.can.host_loss.proof import HostLoss, Proof
from winchkit.drivers.can.host_loss.watch import HostWatch
from winchkit.drivers.clock import Clock
from winchkit.errors import DeviceRefused, NoReply, NotPermitted
from winchkit.schema.devices.servo import OptionSpec, ServoSpec

_SYNC, _EMCY = 0x080, 0x080
_PRODUCES = 1 << 30
"""Of 1005h: the device sends SYNC itself."""
_IDENTIFIER = 0x1FFFFFFF
"""Bits 0 to 28 of 1005h and 1014h (CiA 301): CAN-ID, with those of extended frames."""


def set_communication(node: SdoNode) -> tuple[str, ...]:
    """Configure a drive as SYNC consumer and EMCY producer by the predefined connection set.

    Returns what was changed, in words. A drive may lack both objects, or keep them constant.
    Raises NotPermitted where it goes on sending SYNC or listens to another identifier, NoReply.
    """
    return (*_sync(node), *_emergency(node))


def _sync(node: SdoNode) -> tuple[str, ...]:
    kept = node.read_if_there(0x1005)
    if kept is None or kept & (_PRODUCES | _IDENTIFIER) == _SYNC:
        return ()
    place, produces = node.place(0x1005), bool(kept & _PRODUCES)
    role = "the drive produces SYNC" if produces else "the drive consumes SYNC with another COB-ID"
    try:
        if produces:
            # CiA 301: the identifier does not change while SYNC is produced.
            node.write(0x1005, 0, kept & ~_PRODUCES)
        if kept & _IDENTIFIER != _SYNC:
            node.write(0x1005, 0, _SYNC)
        now = node.read(0x1005)
    except DeviceRefused:
        now = kept
    if now & (_PRODUCES | _IDENTIFIER) != _SYNC:
        raise NotPermitted(
            f"{place} is {kept:X}h: {role} and does not accept 80h; no cyclic mode works with two "
            "producers of SYNC or another COB-ID; set it in the drive"
        )
    return (f"{place} was {kept:X}h: {role}; it is 80h now, until the drive restarts",)


def _emergency(node: SdoNode) -> tuple[str, ...]:
    kept = node.read_if_there(0x1014)
    wanted = _EMCY + node.node
    if kept is None or kept & (INVALID | _IDENTIFIER) == wanted:
        return ()
    place = node.place(0x1014)
    try:
        node.write(0x1014, 0, kept | INVALID)
        node.write(0x1014, 0, wanted | INVALID)
        node.write(0x1014, 0, wanted)
        now = node.read(0x1014)
    except DeviceRefused:
        now = kept
    if now & (INVALID | _IDENTIFIER) != wanted:
        return (f"{place} is {kept:X}h and cannot be set to {wanted:X}h: its EMCY is not received",)
    return (f"{place} was {kept:X}h, EMCY was not received; it is {wanted:X}h now",)


_EXPONENTS = (-3, -4, -5, -6, -2)
"""Of ten in 60C2h:2, ms first as most drives accept it; beside them 0.1 ms, 0.01 ms, µs and 10 ms.
"""
_LARGEST = 255
"""60C2h:1 is an UNSIGNED8."""
_EXACT = 1e-6
"""Relative: decimals of a bench file are not exact in binary (1e-16), and a cycle of 1 s is not
1e-6 off."""


def set_cycle(node: SdoNode, cycle: float) -> float | None:
    """Make 60C2h equal to ``cycle`` (s); returns what the drive keeps, None without a 60C2h.

    A drive may take only some of the exponents by which the same period can be written; that which
    it has is tried first, as it may be read-only. Raises
    NotPermitted when it takes none of them, NoReply.
    """
    kept = _kept(node)
    if kept is None or abs(kept - cycle) <= _EXACT * cycle:
        return kept
    refusals = []
    present = node.read(0x60C2, 2)
    for exponent, value in sorted(_ways(cycle), key=lambda way: way[0] != present):
        try:
            if exponent != node.read(0x60C2, 2):
                node.write_verified(0x60C2, 2, exponent)
            node.write_verified(0x60C2, 1, value)
        except DeviceRefused as error:
            refusals.append(str(error))
            continue
        return _kept(node)
    kept = _kept(node)
    reason = refusals[-1] if refusals else "a whole number of µs, of 0.1 ms up to 25.5 ms, or of ms"
    raise NotPermitted(
        f"{node.place(0x60C2, 1)} cannot hold a cycle of {cycle * 1e3:g} ms, the drive keeps "
        f"{(kept or 0) * 1e3:g} ms: {reason}; set another `cycle` in the bench file"
    )


def _ways(cycle: float) -> Iterator[tuple[int, int]]:
    for exponent in _EXPONENTS:
        value = cycle / 10.0**exponent
        if 1 <= round(value) <= _LARGEST and abs(value - round(value)) <= _EXACT * value:
            yield exponent, round(value)


def _kept(node: SdoNode) -> float | None:
    value, exponent = node.read_if_there(0x60C2, 1), node.read_if_there(0x60C2, 2)
    if value is None or exponent is None:
        return None
    return float(value * 10.0**exponent)


_STOP_TIME = 3.0
"""s: three times the quick stop from 1 m/s with 1 m/s² (rule of thumb); tenfold, a drive that does
not stop would be reported after half a minute."""
_POLL = 0.01
"""s: a tenth of the time in which a drive changes its state."""
_MISSED_BEATS = 2.5
"""Two lost heartbeats are tolerated, and half a period of jitter."""


@dataclass(frozen=True)
class WatchSpec:
    """Supervision, limits and option codes that commissioning sets up."""

    host: int
    """Node id of the host."""
    heartbeat: float
    """Period of the host's heartbeat and the drive's, s."""
    cycle: float
    """SYNC period, s."""
    brake: bool
    """Whether a holding brake lets the drive lose torque without dropping the load."""

    acceleration: float = 0.0
    """Of the motor, that a profile mode may use, rad/s^2; 0 leaves the drive's own."""
    quick_stop: float = 0.0
    """Of the motor in a quick stop, rad/s^2 (6085h); 0 leaves the drive's own."""
    quick_stop_declared: bool = True
    """Whether a drive that does not take it is refused; else its own ramp is a note."""
    prove: bool = True
    """Whether every commissioning proves that the drive notices a withheld heartbeat."""
    limits: LimitsAtShaft = field(default_factory=LimitsAtShaft)
    """Written to the drive and read back."""
    speed: float = 0.0
    """Greatest of the motor, rad/s: how far it can turn while it is not heard; 0: not known."""
    response: float = 0.0
    """Longest lag of the motor's speed, s, with which 6064h and 606Ch are compared; 0: not."""
    late: float = 0.0
    """What the motor turns from rest within that, rad."""
    play: float = 0.0
    """Of the motor at rest, from one process to the next, rad."""
    options: OptionSpec = field(default_factory=OptionSpec)
    """Option codes that count before those of the device file."""
    hardware: str = ""
    """What stops the winch when the host dies, where no object of the drive does; else empty."""
    seen_stopping: bool = False
    """Whether the commissioning record says that the enabled drive stopped on a silent host."""
    stops_on_nmt: bool = False
    """Whether the commissioning record says that it leaves operation enabled on NMT stopped."""

    @property
    def timeout(self) -> float:
        """After this long without a life sign the other side counts as lost, s: 2.5 beats."""
        return _MISSED_BEATS * self.heartbeat


@dataclass(frozen=True)
class Commissioned:
    """Set-up of a drive as read back."""

    mode: str
    modes: tuple[str, ...]
    """All that it has."""
    scale: CountScale
    tpdo: tuple[PdoCodec, ...]
    rpdo: tuple[PdoCodec, ...]
    options: Mapping[str, OptionCode]
    """605Ah to 605Eh and 6007h as they are now, by the keys of a device file."""
    limits: DriveLimits
    """As read back."""
    cycle: float | None
    """60C2h, s; None where the drive has none."""
    on_error: int | None
    """1029h:1, what it does with its network state when the host is gone: 0 pre-operational,
    1 nothing, 2 stopped; None where it has no such object."""
    proof: Proof | None = None
    """Proof of the host-loss mechanism; None where it was not requested."""
    host_loss: HostLoss = field(default_factory=HostLoss)
    """Host-loss mechanism, and the known reaction of the enabled drive."""
    stops_on_nmt: bool = False
    """Whether it was seen to leave operation enabled on NMT stopped; False where unknown."""
    heartbeat: int | None = None
    """1017h, ms; None where it has none."""
    keeps_zero: bool = True
    """Whether a homing can give its position a zero: HM, 6098h and the home offset are there."""
    notes: tuple[str, ...] = ()
    """Findings and changes, for the user who opens the bench."""


def commission(
    node: SdoNode, servo: ServoSpec, watch: WatchSpec, clock: Clock, host: HostWatch
) -> Commissioned:
    """Set a drive that has booted up for cyclic motion and start it, disabled.

    Raises NoReply, DeviceRefused, and NotPermitted where the drive could not be moved safely.
    """
    _bring_to_rest(node, servo, clock)
    node.bus.nmt(NmtCommand.ENTER_PRE_OPERATIONAL, node.node)
    notes = set_communication(node)
    mode = servo.motion_mode
    modes = supported_modes(node, servo, mode)
    watches = None if watch.hardware else servo.host_loss
    options = set_options(node, merged(servo.options, watch.options), watch.brake, watches)
    scale = read_scale(node, servo)
    tpdo, rpdo = codecs(node, servo.tpdo), codecs(node, servo.rpdo)
    set_up(node, "tpdo", tpdo)
    set_up(node, "rpdo", rpdo)
    cycle = set_cycle(node, watch.cycle)
    host.set_up()
    on_error = _set_error_behaviour(node)
    limits = set_limits(node, scale, watch.limits)
    notes = (*notes, *_set_quick_stop(node, servo, scale, watch))
    change_mode(node, mode, clock)
    if watch.acceleration and not MODES[mode].cyclic:
        # The drive's own ramps must not come in the way of those that the host makes.
        set_profile(node, servo, scale, acceleration=watch.acceleration)
    node.require_alone()
    node.bus.nmt(NmtCommand.START, node.node)
    loss = host.reaction(None, options, seen=watch.seen_stopping)
    stops = watch.stops_on_nmt
    return Commissioned(
        *(mode, modes, scale, tpdo, rpdo, options, limits, cycle, on_error),
        host_loss=loss,
        stops_on_nmt=stops,
        heartbeat=node.read_if_there(0x1017),
        keeps_zero="HM" in modes and keeps_zero(node, servo),
        notes=notes,
    )


def _set_quick_stop(
    node: SdoNode, servo: ServoSpec, scale: CountScale, watch: WatchSpec
) -> tuple[str, ...]:
    """Write 6085h and read it back; a note where a drive keeps an undeclared ramp."""
    if not watch.quick_stop:
        return ()
    try:
        set_quick_stop(node, servo, scale, watch.quick_stop)
    except (NotPermitted, DeviceRefused) as error:
        if watch.quick_stop_declared:
            raise
        return (f"{error}; until then its quick stops are what the drive makes of them",)
    return ()


def await_booted(
    node: SdoNode, boot_time: float, clock: Clock, heartbeat: HeartbeatConsumer | None = None
) -> None:
    """Ask for the device type until the drive has booted; raises NoReply.

    A drive that somebody else has stopped by NMT answers no SDO: it is made pre-operational, which
    enables nothing.
    """
    deadline = clock.now() + boot_time
    while True:
        try:
            node.probe(0x1000)
        except NoReply as error:
            if clock.now() >= deadline:
                if heartbeat is not None and heartbeat.state == NmtState.STOPPED:
                    raise NoReply(
                        f"{node.place(0x1000)}: the drive is NMT stopped and does not leave this "
                        "state on the command pre-operational; look for another NMT master, or "
                        "switch the drive off and on"
                    ) from error
                raise
            node.bus.nmt(NmtCommand.ENTER_PRE_OPERATIONAL, node.node)
        else:
            return


def _set_error_behaviour(node: SdoNode) -> int | None:
    """Have the drive leave operational when the host is gone; returns its 1029h:1, None without."""
    kept = node.read_if_there(0x1029, 1)
    if kept == 1 and node.writes(0x1029, 1):
        node.write(0x1029, 1, 0)
        kept = node.read(0x1029, 1)
    return kept


def _bring_to_rest(node: SdoNode, servo: ServoSpec, clock: Clock) -> None:
    """Stop a drive that another master has left enabled."""
    deadline = clock.now() + _STOP_TIME
    standstill: PolledStandstill | None = None
    while True:
        state = state_of(node.read(0x6041))
        if state not in (DriveState.OPERATION_ENABLED, DriveState.QUICK_STOP_ACTIVE):
            return
        node.write(0x6040, 0, QUICK_STOP)
        standstill = standstill or PolledStandstill(node, servo, clock)
        if standstill.poll() and state is DriveState.QUICK_STOP_ACTIVE:
            return
        if clock.now() > deadline:
            raise NotPermitted(
                f"{node.place(0x6041)}: still {state} {_STOP_TIME:g} s after a quick stop; "
                "use the emergency stop and look at the drive"
            )
        clock.sleep(_POLL)
