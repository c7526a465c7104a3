"""Turns a wiring file into open buses, commissioned drives, polled sensors and a control loop."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from datetime import UTC, datetime

from winchkit import __version__, catalog
from winchkit.bench.controller import Controller
from winchkit.bench.loop import ControlLoop, WinchParts
from winchkit.bench.rope import RopeMap
from winchkit.bench.supervisor import Supervisor
from winchkit.drivers.can.axis import Cia402Axis
from winchkit.drivers.can.bus import CanBus
from winchkit.drivers.can.commission import WatchSpec
from winchkit.drivers.clock import Clock
from winchkit.drivers.modbus.instrument import Instrument
from winchkit.drivers.modbus.service import Line, SlowDevices
from winchkit.errors import ConnectionLost, Fault, FileError
from winchkit.schema.bench import BenchSpec, DeviceRef, WinchWiring
from winchkit.schema.device import DeviceSpec
from winchkit.schema.winch import WinchProfile

__all__ = ["READ_RATE", "Wired", "wire"]

READ_RATE = 100.0
"""Readings a second of every instrument, unless its own rate is lower."""
_STALE_BEATS = 2
"""Feedback may be this many heartbeats old: the bench file says how soon silence must count."""
_HEADROOM = 4.0
"""Of a drive's own ramps in a profile mode over those that the host makes."""
_ROLES = ("cell", "load", "length", "temperature")


@dataclass(frozen=True)
class Wired:
    """What is behind an open bench."""

    loop: ControlLoop
    axes: Mapping[str, Cia402Axis]
    sensors: Mapping[str, Mapping[str, Instrument]]
    command: Callable[[Instrument, str], None]
    metadata: Mapping[str, str]

    def disarm(self) -> None:
        """Tell the drives, at rest, not to mind that the host's heartbeat ends."""
        for axis in self.axes.values():
            with suppress(ConnectionLost):
                axis.disarm()


def wire(spec: BenchSpec, clock: Clock, stack: ExitStack) -> Wired:
    """Open everything; what is open is closed by ``stack``."""
    from winchkit.effects import line_of

    profiles = {name: _profile(spec, winch) for name, winch in spec.winch.items()}
    ropes = {name: RopeMap(line_of(profile)) for name, profile in profiles.items()}
    buses = _open_buses(spec, clock, stack)
    axes = {
        name: _axis(spec, winch, ropes[name], buses, clock) for name, winch in spec.winch.items()
    }
    sensors, lines = _instruments(spec, clock)
    slow = SlowDevices(lines, clock)
    stack.callback(slow.close)
    for axis in axes.values():
        axis.commission()
    winches = {
        name: WinchParts(
            axes[name],
            ropes[name],
            Controller(axes[name], ropes[name], winch.limits),
            sensors[name],
        )
        for name, winch in spec.winch.items()
    }
    stale = max(_STALE_BEATS * spec.bus[name].heartbeat for name in buses)
    supervisor = Supervisor({name: w.limits for name, w in spec.winch.items()}, stale)
    hosts = [(bus, spec.bus[name].node, spec.bus[name].heartbeat) for name, bus in buses.items()]
    loop = ControlLoop(hosts, winches, supervisor, clock, spec.cycle)
    return Wired(loop, axes, sensors, slow.command, _metadata(spec, profiles))


def _profile(spec: BenchSpec, winch: WinchWiring) -> WinchProfile:
    from winchkit.schema.read import read_winch

    return read_winch(catalog.find("profiles", winch.profile, spec.path or None))


def _device(spec: BenchSpec, ref: DeviceRef) -> DeviceSpec:
    from winchkit.schema.read import read_device

    return read_device(catalog.find("devices", ref.device, spec.path or None))


def _open_buses(spec: BenchSpec, clock: Clock, stack: ExitStack) -> dict[str, CanBus]:
    """Every CAN bus that a servo is on."""
    buses: dict[str, CanBus] = {}
    for name in dict.fromkeys(winch.servo.bus for winch in spec.winch.values()):
        if spec.bus[name].kind != "can":
            raise FileError(Fault(f"servos need a CAN bus; '{name}' is none", spec.path))
        buses[name] = CanBus(spec.bus[name], name, clock)
        stack.callback(buses[name].close)
    return buses


def _axis(
    spec: BenchSpec,
    winch: WinchWiring,
    rope: RopeMap,
    buses: Mapping[str, CanBus],
    clock: Clock,
) -> Cia402Axis:
    ref = winch.servo
    bus = spec.bus[ref.bus]
    if ref.node is None:
        raise FileError(Fault(f"servo '{ref.device}' needs its node number", spec.path))
    arm = abs(rope.line.arm(0.0))
    acceleration = _HEADROOM * winch.limits.acceleration / arm
    watch = WatchSpec(bus.node, bus.heartbeat, spec.cycle, winch.brake, acceleration)
    return Cia402Axis(buses[ref.bus], ref.node, _device(spec, ref), watch, clock)


def _instruments(
    spec: BenchSpec, clock: Clock
) -> tuple[dict[str, dict[str, Instrument]], list[Line]]:
    """Instruments by winch and role; two roles on one device share the instrument."""
    found: dict[tuple[str, int], Instrument] = {}
    sensors: dict[str, dict[str, Instrument]] = {name: {} for name in spec.winch}
    for name, winch in spec.winch.items():
        for role in _ROLES:
            ref: DeviceRef | None = getattr(winch, role)
            if ref is None:
                continue
            if not spec.bus[ref.bus].kind.startswith("modbus"):
                raise FileError(
                    Fault(
                        f"winch {name}: its {role} is on bus '{ref.bus}' of kind "
                        f"'{spec.bus[ref.bus].kind}'; use modbus-rtu or modbus-tcp",
                        spec.path,
                    )
                )
            key = (ref.bus, ref.unit or 1)
            if key not in found:
                label = f"{role} of winch {name} (bus '{key[0]}' unit {key[1]})"
                found[key] = Instrument(
                    label,
                    _device(spec, ref),
                    key[1],
                    clock,
                    rate=READ_RATE,
                    timeout=spec.bus[ref.bus].timeout,
                )
            sensors[name][role] = found[key]
    by_bus: dict[str, list[Instrument]] = {}
    for (bus, _), instrument in found.items():
        by_bus.setdefault(bus, []).append(instrument)
    lines = [Line(bus, spec.bus[bus], tuple(items)) for bus, items in by_bus.items()]
    return sensors, lines


def _metadata(spec: BenchSpec, profiles: Mapping[str, WinchProfile]) -> dict[str, str]:
    """What a log says about where it came from."""
    about = {
        "bench": spec.name,
        "recorded": datetime.now(UTC).isoformat(timespec="seconds"),
        "winchkit": __version__,
        "wiring": json.dumps(dataclasses.asdict(spec), default=str),
        "profile": ", ".join(item.name for item in profiles.values()),
        "declared": json.dumps(
            {name: dataclasses.asdict(item) for name, item in profiles.items()}, default=str
        ),
    }
    masses = {winch.load_mass for winch in spec.winch.values()}
    if len(spec.winch) == 1 and None not in masses:
        about["load_mass"] = f"{masses.pop():g} kg"
    return about
