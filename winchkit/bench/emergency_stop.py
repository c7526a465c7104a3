"""Stops a bench that no process owns, on its buses themselves; never energises anything."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from winchkit import catalog
from winchkit.arguments import require_type
from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.canopen.node import SdoNode
from winchkit.drivers.can.cia402.standstill import PolledStandstill
from winchkit.drivers.can.cia402.state_machine import QUICK_STOP, State, state_of
from winchkit.drivers.clock import Clock, MonotonicClock
from winchkit.errors import ConnectionLost, WinchkitError
from winchkit.schema.bench import BenchSpec, WinchWiring
from winchkit.schema.devices.servo import ServoSpec

__all__ = ["Stopped", "stop_on_bus"]

_STOP_TIME = 5.0
"""s: five times the quick stop from 1 m/s with 1 m/s²; then the operator has to use the emergency
stop."""
_POLL = 0.02
"""s: each look is two SDO requests (2 ms at 1 Mbit/s) per drive."""
_MOVING = (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE, State.FAULT_REACTION_ACTIVE)


@dataclass(frozen=True)
class Stopped:
    """How a stop ended for one winch."""

    winch: str
    confirmed: bool
    """Whether the drive itself says that it stands still or is disabled."""
    message: str


def stop_on_bus(spec: BenchSpec, clock: Clock | None = None) -> list[Stopped]:
    """Quick-stop every drive of a bench file and wait until each confirms.

    All drives get the command before any is waited for.

    Parameters
    ----------
    spec : BenchSpec
        Contents of the bench file.
    clock : Clock, optional
        By default that of the computer.

    Returns
    -------
    list of Stopped
        Per drive whether it confirmed.

    Raises
    ------
    ConnectionLost
        Where a bus does not open.
    """
    require_type(spec, BenchSpec, "spec")
    clock = clock or MonotonicClock()
    with ExitStack() as stack:
        buses = {}
        for name in dict.fromkeys(winch.servo.bus for winch in spec.winch.values()):
            buses[name] = CanBus(spec.bus[name], name, clock)
            stack.callback(buses[name].close)
        nodes = {name: _node(spec, winch, buses) for name, winch in spec.winch.items()}
        problems = {name: _tell(node) for name, (node, _) in nodes.items()}
        return [
            _confirm(name, node, servo, problems[name], clock)
            for name, (node, servo) in nodes.items()
        ]


def _node(
    spec: BenchSpec, winch: WinchWiring, buses: dict[str, CanBus]
) -> tuple[SdoNode, ServoSpec]:
    from winchkit.schema.read import read_device

    ref = winch.servo
    device = read_device(catalog.find("devices", ref.device, spec.path or None))
    assert device.servo is not None, "the reader has checked it"
    eds = Path(device.path).parent / device.servo.eds
    return SdoNode(buses[ref.bus], ref.node or 1, eds), device.servo


def _tell(node: SdoNode) -> WinchkitError | None:
    try:
        node.write(0x6040, 0, QUICK_STOP)
    except ConnectionLost as error:
        return error
    return None


def _confirm(
    winch: str, node: SdoNode, servo: ServoSpec, problem: WinchkitError | None, clock: Clock
) -> Stopped:
    """Ask until the drive is disabled or stands still in quick stop."""
    deadline = clock.now() + _STOP_TIME
    state, standstill = State.UNKNOWN, None
    while clock.now() < deadline:
        try:
            state = state_of(node.read(0x6041))
            standstill = standstill or PolledStandstill(node, servo, clock)
            at_rest = standstill.poll() and state is State.QUICK_STOP_ACTIVE
        except ConnectionLost as error:
            return Stopped(winch, False, str(problem or error))
        if at_rest or (state not in _MOVING and state is not State.UNKNOWN):
            return Stopped(winch, True, f"{state}, at rest" if at_rest else str(state))
        if state is State.OPERATION_ENABLED:
            _tell(node)
        clock.sleep(_POLL)
    return Stopped(winch, False, f"still {state} after {_STOP_TIME:g} s")
