"""Stops a bench that no process owns, on its buses themselves; never energises anything."""

from __future__ import annotations

from contextlib import ExitStack, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

from winchkit.arguments import require_type
from winchkit.bench.ownership import mark_stop
from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.cia402.sdo_stop import SdoStop
from winchkit.drivers.can.cia402.state_machine import POWERED, QUICK_STOP, DriveState, state_of
from winchkit.drivers.clock import Clock, MonotonicClock
from winchkit.errors import ConnectionLost, WinchkitError
from winchkit.schema.bench import BenchSpec, WinchWiring

if TYPE_CHECKING:
    from winchkit.drivers.can.canopen.node import SdoNode
    from winchkit.schema.devices.servo import ServoSpec

_STOP_TIME = 5.0
"""s: five times the quick stop from 1 m/s with 1 m/s²; then the operator has to use the emergency
stop."""
_POLL = 0.02
"""s: each look is two SDO requests (2 ms at 1 Mbit/s) per drive."""
_INSIST = 0.2
"""For drives that have not taken the first command, s: ten further ones."""


@dataclass(frozen=True)
class Stopped:
    """How a stop ended for one winch."""

    winch: str
    confirmed: bool
    """Whether the drive itself says that it stands still or is disabled."""
    message: str


def stop_on_bus(spec: BenchSpec, clock: Clock | None = None) -> list[Stopped]:
    """Quick-stop every drive of a bench file and wait until each confirms.

    All drives get 6040h = 02h first, from frames that need no EDS, whatever the others do; only
    then each is asked. An opening of the bench that is under way ends without motion.

    Parameters
    ----------
    spec : BenchSpec
        Contents of the bench file.
    clock : Clock, optional
        By default that of the computer.

    Returns
    -------
    list of Stopped
        Per drive whether it confirmed; one whose bus does not open has not.
    """
    require_type(spec, BenchSpec, "spec")
    spec.require_winches()
    clock = clock or MonotonicClock()
    mark_stop(spec)
    with ExitStack() as stack:
        buses: dict[str, CanBus] = {}
        stops: dict[str, SdoStop] = {}
        problems: dict[str, WinchkitError] = {}
        for name in dict.fromkeys(winch.servo.bus for winch in spec.winch.values()):
            wired = {key: one for key, one in spec.winch.items() if one.servo.bus == name}
            try:
                bus = buses[name] = CanBus(spec.bus[name], name, clock)
            except ConnectionLost as error:
                problems |= dict.fromkeys(wired, error)
                continue
            stack.callback(bus.close)
            for key, winch in wired.items():
                stops[key] = SdoStop(bus, winch.servo.node or 1)
                _send(stops[key], key, problems)
        _insist(stops, problems, clock)
        # Those that have answered come first: a dead one takes the time-out of its request.
        order = sorted(spec.winch, key=lambda name: name not in stops or not stops[name].taken)
        for stop in stops.values():
            stop.end()
        found = {name: _confirmed(spec, name, buses, problems, clock) for name in order}
        return [found[name] for name in spec.winch]


def _send(stop: SdoStop, winch: str, problems: dict[str, WinchkitError]) -> None:
    """Send the next frame of a stop; a bus that takes none is a problem of this winch."""
    try:
        stop.send()
    except ConnectionLost as error:
        problems[winch] = error


def _insist(stops: dict[str, SdoStop], problems: dict[str, WinchkitError], clock: Clock) -> None:
    """Repeat the command to drives that have not taken it, for a while."""
    end = clock.now() + _INSIST
    while waiting := [name for name, stop in stops.items() if not stop.taken]:
        if clock.now() > end:
            return
        clock.sleep(_POLL)
        for name in waiting:
            if not stops[name].taken:
                _send(stops[name], name, problems)


def _confirmed(
    spec: BenchSpec,
    name: str,
    buses: dict[str, CanBus],
    problems: dict[str, WinchkitError],
    clock: Clock,
) -> Stopped:
    """Whether a drive confirms; what keeps it from being asked is reported for this winch alone."""
    problem, winch = problems.get(name), spec.winch[name]
    if winch.servo.bus not in buses:
        return Stopped(name, False, str(problem))
    try:
        node, servo = _node(spec, winch, buses)
        return _confirm(name, node, servo, clock)
    except WinchkitError as error:
        return Stopped(name, False, str(problem or error))


def _node(
    spec: BenchSpec, winch: WinchWiring, buses: dict[str, CanBus]
) -> tuple[SdoNode, ServoSpec]:
    from winchkit.bench.cells.instruments import device_of, eds_of
    from winchkit.drivers.can.canopen.node import SdoNode

    ref = winch.servo
    device = device_of(spec, ref)
    assert device.servo is not None, "the reader has checked it"
    return SdoNode(buses[ref.bus], ref.node or 1, eds_of(device)), device.servo


def _confirm(winch: str, node: SdoNode, servo: ServoSpec, clock: Clock) -> Stopped:
    """Ask until the drive is disabled or stands still in quick stop."""
    from winchkit.drivers.can.cia402.standstill import PolledStandstill

    deadline = clock.now() + _STOP_TIME
    state = DriveState.UNKNOWN
    standstill: PolledStandstill | None = None
    while clock.now() < deadline:
        state = state_of(node.read(0x6041))
        standstill = standstill or PolledStandstill(node, servo, clock)
        at_rest = standstill.poll() and state is DriveState.QUICK_STOP_ACTIVE
        if at_rest or (state not in POWERED and state is not DriveState.UNKNOWN):
            return Stopped(winch, True, f"{state}, at rest" if at_rest else str(state))
        if state is DriveState.OPERATION_ENABLED:
            with suppress(ConnectionLost):  # the next read says what is wrong
                node.write(0x6040, 0, QUICK_STOP)
        clock.sleep(_POLL)
    return Stopped(winch, False, f"still {state} after {_STOP_TIME:g} s")
