"""Brings a CiA 402 drive from power-on to operational, disabled, checked and watched over."""

from __future__ import annotations

from dataclasses import dataclass

from winchkit.drivers.can.cia402 import QUICK_STOP, State, state_of
from winchkit.drivers.can.node import SdoNode
from winchkit.drivers.can.pdo import PdoCodec
from winchkit.drivers.can.pdo_setup import codecs, set_up
from winchkit.drivers.can.scale import Scale, read_scale
from winchkit.drivers.clock import Clock
from winchkit.errors import NoReply, NotPermitted
from winchkit.schema.device import ServoSpec

__all__ = ["MODES", "Commissioned", "WatchSpec", "commission"]

MODES: dict[str, tuple[int, int]] = {
    "PP": (1, 0),
    "PV": (3, 2),
    "PT": (4, 3),
    "HM": (6, 5),
    "IP": (7, 6),
    "CSP": (8, 7),
    "CSV": (9, 8),
    "CST": (10, 9),
}
"""Value of 6060h and bit of 6502h by mode."""

_START, _PRE_OPERATIONAL = 0x01, 0x80
_MODE_TIME = 0.5
_STOP_TIME = 3.0
_POLL = 0.01
_MISSED_BEATS = 4
_MEANING = {0x605A: "quick stop", 0x605B: "shutdown", 0x605C: "disable operation", 0x605E: "fault"}


@dataclass(frozen=True)
class WatchSpec:
    """Who watches whom, and how often."""

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

    @property
    def timeout(self) -> float:
        """After this long without a heartbeat the other side counts as lost, s."""
        return _MISSED_BEATS * self.heartbeat


@dataclass(frozen=True)
class Commissioned:
    """What the drive said and agreed to."""

    mode: str
    scale: Scale
    tpdo: tuple[PdoCodec, ...]
    rpdo: tuple[PdoCodec, ...]
    options: dict[int, int | None]
    """605Ah to 605Eh and 6007h as read; None where the drive has no such object."""


def commission(node: SdoNode, servo: ServoSpec, watch: WatchSpec, clock: Clock) -> Commissioned:
    """Set a drive up for cyclic motion and start it, disabled.

    Raises NoReply, DeviceRefused, and NotPermitted where the drive could not be moved safely.
    """
    _wait_for(node, servo.boot_time, clock)
    _bring_to_rest(node, clock)
    node.bus.nmt(_PRE_OPERATIONAL, node.node)
    options = _check_options(node, watch.brake)
    mode = _supported_mode(node, servo)
    scale = read_scale(node, servo)
    tpdo, rpdo = codecs(node, servo.tpdo), codecs(node, servo.rpdo)
    set_up(node, "tpdo", tpdo)
    set_up(node, "rpdo", rpdo)
    _set_cycle(node, watch.cycle)
    _set_heartbeats(node, watch)
    _set_targets(node)
    _set_profile(node, mode, round(watch.acceleration / scale.velocity))
    _set_mode(node, mode, clock)
    node.bus.nmt(_START, node.node)
    return Commissioned(mode, scale, tpdo, rpdo, options)


def _wait_for(node: SdoNode, boot_time: float, clock: Clock) -> None:
    """Ask for the device type until the drive has booted."""
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


def _check_options(node: SdoNode, brake: bool) -> dict[int, int | None]:
    """Read what the drive does when it stops; refuse what would drop the load."""
    codes = (0x605A, 0x605B, 0x605C, 0x605D, 0x605E, 0x6007)
    options = {index: node.read_if_there(index) for index in codes}
    lost = options[0x6007]
    if not lost:
        raise NotPermitted(
            f"{node.place(0x6007)} is {lost}: the drive would go on moving when the host dies; "
            "set it to 3 (quick stop) or 1 (fault)"
        )
    if brake:
        return options
    for index, meaning in _MEANING.items():
        if options[index] == 0:
            raise NotPermitted(
                f"{node.place(index)} is 0: on {meaning} the motor coasts and a hanging load "
                "falls; set a ramp, or declare `brake = true` where a brake holds the load"
            )
    if lost == 2:
        raise NotPermitted(
            f"{node.place(0x6007)} is 2: without the host the motor coasts and a hanging load "
            "falls; set it to 3 (quick stop), or declare `brake = true` where a brake holds it"
        )
    return options


def _supported_mode(node: SdoNode, servo: ServoSpec) -> str:
    mode = servo.motion_mode
    supported = node.read_if_there(0x6502)
    there: tuple[str, ...] = servo.modes
    if supported is not None:
        there = tuple(name for name, (_, bit) in MODES.items() if supported & 1 << bit)
    if mode not in there:
        raise NotPermitted(
            f"{node.place(0x6502)}: the drive has no mode {mode}; it has "
            f"{', '.join(there) or 'none'}; set motion_mode in the device file"
        )
    return mode


def _set_cycle(node: SdoNode, cycle: float) -> None:
    """Make 60C2h equal to the SYNC period."""
    if node.read_if_there(0x60C2, 1) is None:
        return
    for exponent in (-3, -4, -5):
        value = cycle / 10**exponent
        if 1 <= round(value) <= 255 and abs(value - round(value)) < 1e-6 * value:
            node.write_verified(0x60C2, 2, exponent)
            node.write_verified(0x60C2, 1, round(value))
            return
    raise NotPermitted(
        f"{node.place(0x60C2, 1)} cannot hold a cycle of {cycle * 1e3:g} ms; "
        "use a whole number of 0.1 ms up to 25.5 ms, or of ms up to 255 ms"
    )


def _set_heartbeats(node: SdoNode, watch: WatchSpec) -> None:
    """Let the drive watch the host (1016h) and tell the host that it lives (1017h)."""
    node.write_verified(0x1016, 1, watch.host << 16 | round(watch.timeout * 1e3))
    node.write_verified(0x1017, 0, round(watch.heartbeat * 1e3))


def _set_targets(node: SdoNode) -> None:
    """Zero speed and the actual position, before any mode can act on them."""
    node.write(0x60FF, 0, 0)
    if node.read_if_there(0x607A) is not None:
        node.write(0x607A, 0, node.read(0x6064))


def _set_profile(node: SdoNode, mode: str, counts: int) -> None:
    """Keep the drive's own ramps out of the way of those that the host makes."""
    if mode == "PV" and counts:
        for index in (0x6083, 0x6084):
            node.write_verified(index, 0, counts)


def _set_mode(node: SdoNode, mode: str, clock: Clock) -> None:
    number = MODES[mode][0]
    node.write(0x6060, 0, number)
    deadline = clock.now() + _MODE_TIME
    while (shown := node.read(0x6061)) != number:
        if clock.now() > deadline:
            raise NotPermitted(
                f"{node.place(0x6061)} shows mode {shown} {_MODE_TIME:g} s after {mode} "
                f"({number}) was asked for; the drive does not take this mode now"
            )
        clock.sleep(_POLL)
