"""Which frames a bench file puts on each of its CAN buses, and how often."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

from winchkit.bench.cells.instruments import device_of
from winchkit.drivers.can.bus.load import FrameKind, Load, load_of
from winchkit.drivers.can.canopen.node import read_dictionary
from winchkit.drivers.can.canopen.pdo import parse_object
from winchkit.drivers.can.cia402.modes import MODES
from winchkit.errors import Fault, FileError
from winchkit.schema.bench import BenchSpec, WinchWiring
from winchkit.schema.devices.servo import PdoSpec

_COMMANDS = {(0x6040, 0), (0x6060, 0), (0x60B1, 0), (0x60B2, 0)}
"""Control word, mode and offsets: an RPDO with one of them, or the mode's target, is sent."""


def loads(spec: BenchSpec) -> dict[str, Load]:
    """Worst-case load of every CAN bus, by name; raises FileError."""
    found = {}
    read = cache(read_dictionary)
    for name, bus in spec.bus.items():
        if bus.kind != "can":
            continue
        winches = {key: one for key, one in spec.winch.items() if one.servo.bus == name}
        frames = [frame for key, one in winches.items() for frame in _frames(spec, key, one, read)]
        beats = dict.fromkeys(("host", *winches), bus.heartbeat)
        found[name] = load_of(bus.bitrate, spec.cycle, frames, beats)
    return found


def _frames(
    spec: BenchSpec, name: str, winch: WinchWiring, read: Callable[[Path, int], Any]
) -> Iterator[FrameKind]:
    """PDOs of one drive: all that it sends, and those of the host that carry commands."""
    device = device_of(spec, winch.servo)
    if device.servo is None:
        raise FileError(Fault(f"winch {name}: '{winch.servo.device}' is no servo", spec.path))
    servo = device.servo
    dictionary = read(Path(device.path).parent / servo.eds, 1)
    for pdo in servo.tpdo:
        size = _size(dictionary, pdo, device.path)
        yield _sent_by_drive(f"{name} TPDO {pdo.number}", size, pdo)
    live = _COMMANDS | {MODES[servo.motion_mode].target}
    for pdo in servo.rpdo:
        if live & {parse_object(text) for text in pdo.objects}:
            size = _size(dictionary, pdo, device.path)
            yield FrameKind(f"{name} RPDO {pdo.number}", size, every=1)


def _sent_by_drive(name: str, size: int, pdo: PdoSpec) -> FrameKind:
    """Worst case: events come as often as the inhibit time lets them, else with every SYNC."""
    if pdo.by_event and pdo.inhibit_time:
        return FrameKind(name, size, period=pdo.inhibit_time)
    return FrameKind(name, size, every=1 if pdo.by_event else max(1, pdo.transmission))


def _size(dictionary: Any, pdo: PdoSpec, path: str) -> int:
    """Data bytes of a PDO."""
    bits = 0
    for text in pdo.objects:
        variable = dictionary.get_variable(*parse_object(text))
        if variable is None:
            raise FileError(Fault(f"{text} is not in its EDS", path, key=f"PDO {pdo.number}"))
        bits += len(variable)
    return (bits + 7) // 8
