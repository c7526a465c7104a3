"""Brings a CiA 402 drive from power-on to operational, disabled, checked and watched over."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from winchkit.drivers.can.cia402 import QUICK_STOP, State, state_of
from winchkit.drivers.can.cycle import set_cycle
from winchkit.drivers.can.limits import DriveLimits, LimitsAtShaft, set_limits
from winchkit.drivers.can.mode_change import change_mode, supported_modes
from winchkit.drivers.can.modes import MODES
from winchkit.drivers.can.node import SdoNode
from winchkit.drivers.can.options import OptionCode, merged, set_options
from winchkit.drivers.can.pdo import PdoCodec
from winchkit.drivers.can.pdo_setup import codecs, set_up
from winchkit.drivers.can.profile import set_profile
from winchkit.drivers.can.scale import Scale, read_scale
from winchkit.drivers.can.watchdog import Proof, set_error_behaviour, set_heartbeats
from winchkit.drivers.clock import Clock
from winchkit.errors import NoReply, NotPermitted
from winchkit.schema.device_servo import OptionSpec, ServoSpec

__all__ = ["Commissioned", "WatchSpec", "await_booted", "commission"]

_START, _PRE_OPERATIONAL = 0x01, 0x80
_STOP_TIME = 3.0
_POLL = 0.01
_MISSED_BEATS = 4


@dataclass(frozen=True)
class WatchSpec:
    """Who watches whom, how often, and what the drive itself has to keep to."""

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
    prove: bool = True
    """Whether every commissioning proves that the drive notices a withheld heartbeat."""
    limits: LimitsAtShaft = field(default_factory=LimitsAtShaft)
    """Written to the drive and read back."""
    options: OptionSpec = field(default_factory=OptionSpec)
    """Option codes that count before those of the device file."""

    @property
    def timeout(self) -> float:
        """After this long without a heartbeat the other side counts as lost, s."""
        return _MISSED_BEATS * self.heartbeat


@dataclass(frozen=True)
class Commissioned:
    """What the drive said and agreed to."""

    mode: str
    modes: tuple[str, ...]
    """All that it has."""
    scale: Scale
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
    """How it noticed a withheld heartbeat; None where that was not asked for."""


def commission(node: SdoNode, servo: ServoSpec, watch: WatchSpec, clock: Clock) -> Commissioned:
    """Set a drive that has booted up for cyclic motion and start it, disabled.

    Raises NoReply, DeviceRefused, and NotPermitted where the drive could not be moved safely.
    """
    _bring_to_rest(node, clock)
    node.bus.nmt(_PRE_OPERATIONAL, node.node)
    mode = servo.motion_mode
    modes = supported_modes(node, servo, mode)
    options = set_options(node, merged(servo.options, watch.options), watch.brake)
    scale = read_scale(node, servo)
    tpdo, rpdo = codecs(node, servo.tpdo), codecs(node, servo.rpdo)
    set_up(node, "tpdo", tpdo)
    set_up(node, "rpdo", rpdo)
    cycle = set_cycle(node, watch.cycle)
    set_heartbeats(node, watch.host, watch.timeout, watch.heartbeat)
    on_error = set_error_behaviour(node)
    limits = set_limits(node, scale, watch.limits)
    change_mode(node, mode, clock)
    if watch.acceleration and not MODES[mode].cyclic:
        # The drive's own ramps must not come in the way of those that the host makes.
        set_profile(node, servo, scale, acceleration=watch.acceleration)
    node.bus.nmt(_START, node.node)
    return Commissioned(mode, modes, scale, tpdo, rpdo, options, limits, cycle, on_error)


def await_booted(node: SdoNode, boot_time: float, clock: Clock) -> None:
    """Ask for the device type until the drive has booted; raises NoReply."""
    deadline = clock.now() + boot_time
    while True:
        try:
            node.read(0x1000)
        except NoReply:
            if clock.now() >= deadline:
                raise
        else:
            return


def _bring_to_rest(node: SdoNode, clock: Clock) -> None:
    """Stop a drive that another master has left enabled."""
    deadline = clock.now() + _STOP_TIME
    while True:
        state = state_of(node.read(0x6041))
        if state not in (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE):
            return
        moving = abs(node.read_if_there(0x606C) or 0)
        if state is State.QUICK_STOP_ACTIVE and not moving:
            return
        node.write(0x6040, 0, QUICK_STOP)
        if clock.now() > deadline:
            raise NotPermitted(
                f"{node.place(0x6041)}: still {state} {_STOP_TIME:g} s after a quick stop; "
                "use the emergency stop and look at the drive"
            )
        clock.sleep(_POLL)
