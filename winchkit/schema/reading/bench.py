"""Reader of benches, real and simulated, with checks that winches, buses and devices match."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from winchkit.errors import suggest
from winchkit.schema.bench import BenchSpec, BusSpec, CellWiring, latch_path
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.profiles.robot import RobotProfile
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.reading.lines import Key
from winchkit.schema.reading.parts import FileReading
from winchkit.schema.reading.source import spelled
from winchkit.schema.reading.tables import marker_at
from winchkit.schema.robot_bench import RobotWiring
from winchkit.schema.sim_platform import PlatformTruth
from winchkit.schema.simbench import (
    FaultSpec,
    HiddenSpec,
    NoiseSpec,
    SimBench,
    WinchTruth,
    dotted_keys,
)
from winchkit.units import GRAVITY

ROLES = ("servo", "cell", "load", "length", "temperature")
_OF_DRIVE, _INSTRUMENTS = {"profile", "servo", "limits"}, set(ROLES[1:])
_MEASURED = {"cell": "force", "load": "force", "length": "length", "temperature": "temperature"}
"""What an instrument of each role measures."""
DeviceReader = Callable[[str | Path], DeviceSpec]
RobotReader = Callable[[str | Path], RobotProfile]
_FITTING = {
    "servo": ("can",),
    "modbus": ("modbus-rtu", "modbus-tcp"),
    "stream": ("serial",),
    "process": ("can",),
}
"""Kinds of buses by the kind of a device."""


def bench(
    reading: FileReading, tree: dict[str, Any], read_device: DeviceReader, read_robot: RobotReader
) -> BenchSpec | None:
    """Read a bench and check its references."""
    for key in tree.keys() & {"path", "latch_file", "cells"}:
        reading.fault((key,), "unknown key")
    _check_references(reading, tree, read_device)
    tree = _with_cells(reading, tree)
    path = reading.source.path
    named = {"name": reading.stem, **tree, "path": path, "latch_file": latch_path(path)}
    spec = reading.table(BenchSpec, named)
    if spec is None:
        return None
    for index, file in enumerate(spec.effect_files):
        if not file.is_file():
            at: Key = ("effects", index)
            reading.fault(at, f"no such file of effects: {file}; paths start at this file's folder")
    if not (spec.winch or spec.cells):
        reading.fault(("winch",), "a bench has at least one winch, in a table [winch.NAME]")
    if spec.cells and spec.robot is not None:
        reading.fault(("robot",), "its winches have no profile, servo and limits")
    _check_deviations(reading, spec)
    if spec.robot is not None:
        _check_robot(reading, spec, spec.robot, read_robot)
    return spec


def _with_cells(reading: FileReading, tree: dict[str, Any]) -> dict[str, Any]:
    """The tree with its winches as cells, where none of them has a drive."""
    winches = tree.get("winch")
    if not isinstance(winches, dict) or not winches:
        return tree
    if any(not isinstance(one, dict) or not _OF_DRIVE.isdisjoint(one) for one in winches.values()):
        return tree
    cells = {
        name: reading.table(CellWiring, winch, ("winch", name)) for name, winch in winches.items()
    }
    for name, winch in winches.items():
        if _INSTRUMENTS.isdisjoint(winch):
            message = (
                "has neither an instrument (cell, load, length, temperature) nor a drive (profile, "
                "servo, limits)"
            )
            reading.fault(("winch", name), message)
    known = {name: cell for name, cell in cells.items() if cell is not None}
    return {**tree, "winch": {}, "cells": known}


def _check_deviations(reading: FileReading, spec: BenchSpec) -> None:
    """Whose answers do not name their request is the only device on its bus."""
    for name, bus in spec.bus.items():
        units = {
            ref.unit or 1
            for winch in (*spec.winch.values(), *spec.cells.values())
            for role in ROLES
            if (ref := getattr(winch, role, None)) is not None and ref.bus == name
        }
        if bus.deviations and len(units) > 1:
            listed = ", ".join(map(str, sorted(units)))
            message = f"need a device that is alone on its bus; this one has the units {listed}"
            reading.fault(("bus", name, "deviations"), message)


def _check_robot(
    reading: FileReading, spec: BenchSpec, robot: RobotWiring, read_robot: RobotReader
) -> None:
    """Each line of the robot is a winch of the bench, within the winch's limits."""
    if not spec.stop_together:
        message = "is false; the winches of a robot stop together, or cables go slack or break"
        reading.fault(("stop_together",), message)
    at: Key = ("robot", "profile")
    profile = reading.declared("profiles", robot.profile, at, read_robot)
    if profile is None:
        return
    for line in profile.line:
        if line.name not in spec.winch:
            near = suggest(line.name, list(spec.winch))
            message = f"line {line.name} of robot '{profile.name}' is no winch of this bench{near}"
            reading.fault(at, message)
            continue
        limits, (low, high) = spec.winch[line.name].limits, robot.tension
        upper, slack = limits.tension_high, limits.tension_slack
        if upper is not None and high > upper:
            message = f"{high:g} N is above tension_high of winch {line.name}, {upper:g} N"
            reading.fault(("robot", "tension"), message)
        if slack is not None and low < slack:
            message = f"{low:g} N is below tension_slack of winch {line.name}, {slack:g} N"
            reading.fault(("robot", "tension"), message)


def sim_bench(
    reading: FileReading, tree: dict[str, Any], read_device: DeviceReader, read_robot: RobotReader
) -> SimBench | None:
    """Read a simulated bench: a bench, its true values, hidden effects, noise and faults."""
    tree = dict(tree)
    noise = reading.table(NoiseSpec, tree.pop("noise", {}), ("noise",))
    faults = tuple(_numbered(reading, FaultSpec, tree.pop("fault", []), ("fault",)))
    platform = None
    if "platform" in tree:
        platform = reading.table(PlatformTruth, tree.pop("platform"), ("platform",))
        if "robot" not in tree:
            reading.fault(("platform",), "is that of a robot; a table [robot] is missing")
    truths = {}
    winches = tree.get("winch")
    if isinstance(winches, dict):
        tree["winch"] = dict(winches)
        for name, winch in winches.items():
            if isinstance(winch, dict):
                tree["winch"][name] = wiring = dict(winch)
                truth = wiring.pop("truth", {})
                truths[name] = _truth(reading, name, truth, wiring.pop("hidden", []))
    wired = bench(reading, tree, read_device, read_robot)
    if wired is None or noise is None or None in truths.values():
        return None
    known = {name: truth for name, truth in truths.items() if truth is not None}
    # A simulation ends with its process, and its trips too.
    wired = replace(wired, latch_file="")
    return SimBench(wired.name, wired, known, noise, faults, wired.description, platform)


def _truth(reading: FileReading, name: str, raw: object, hidden: object) -> WinchTruth | None:
    at: Key = ("winch", name, "truth")
    if not isinstance(raw, dict):
        reading.fault(at, f"expected a table, not {raw!r}")
        return None
    own = {key: raw[key] for key in ("load_mass", "temperature", "temperature_drift") if key in raw}
    overrides = dict(dotted_keys({key: value for key, value in raw.items() if key not in own}))
    for key, value in overrides.items():
        _check_override(reading, at, key, value)
    pieces = tuple(_numbered(reading, HiddenSpec, hidden, ("winch", name, "hidden")))
    return reading.table(WinchTruth, {**own, "overrides": overrides, "hidden": pieces}, at)


def _check_override(reading: FileReading, at: Key, key: str, value: object) -> None:
    words: Key = tuple(int(word) if word.isdecimal() else word for word in key.split("."))
    marker = marker_at(WinchProfile, words)
    place: Key = (*at, key) if (*at, key) in reading.source.lines else (*at, *key.split("."))
    if marker is None:
        message = "is not a number of a winch profile; write such as drum.winding_radius"
        reading.fault(place, message)
        return
    try:
        marker.read(value)
    except ValueError as error:
        reading.fault(place, str(error))


def _numbered(
    reading: FileReading, kind: type[HiddenSpec] | type[FaultSpec], raw: object, at: Key
) -> Iterator[Any]:
    """Read ``[[hidden]]`` or ``[[fault]]`` tables; their further keys are numbers."""
    if not isinstance(raw, list) or not all(isinstance(item, dict) for item in raw):
        reading.fault(at, f"expected tables, each opened by [[{'.'.join(map(str, at))}]]")
        return
    own = set(kind.__dataclass_fields__) - {"numbers"}
    for index, item in enumerate(raw):
        known = {key: value for key, value in item.items() if key in own}
        numbers = {key: value for key, value in item.items() if key not in own}
        piece = reading.table(kind, {**known, "numbers": numbers}, (*at, index))
        if piece is not None:
            yield piece


def _check_references(
    reading: FileReading, tree: dict[str, Any], read_device: DeviceReader
) -> None:
    """Profiles and devices exist, buses exist and fit, no two devices share an address."""
    winches, buses = tree.get("winch"), tree.get("bus")
    known = buses if isinstance(buses, dict) else {}
    taken: dict[tuple[str, str, int], str] = {
        (name, "node", bus.get("node", BusSpec.node)): f"the host (bus.{name}.node)"
        for name, bus in known.items()
        if isinstance(bus, dict) and bus.get("kind") == "can"
    }
    for name, winch in winches.items() if isinstance(winches, dict) else ():
        if not isinstance(winch, dict):
            continue
        at: Key = ("winch", name)
        reading.shipped("profiles", winch.get("profile"), (*at, "profile"))
        for role in ROLES:
            if isinstance(raw := winch.get(role), dict):
                place: Key = (*at, role)
                _check_device(reading, raw, known, place, read_device)
                _check_address(reading, raw, place, taken)


def _check_address(
    reading: FileReading, raw: dict[str, Any], at: Key, taken: dict[tuple[str, str, int], str]
) -> None:
    for key in ("node", "unit"):
        bus, address = raw.get("bus"), raw.get(key)
        if not isinstance(bus, str) or not isinstance(address, int):
            continue
        user = taken.setdefault((bus, key, address), spelled(at))
        if user != spelled(at):
            reading.fault((*at, key), f"{address} on this bus is taken by {user}")


def _check_device(
    reading: FileReading,
    raw: dict[str, Any],
    buses: dict[str, Any],
    at: Key,
    read_device: DeviceReader,
) -> None:
    bus = raw.get("bus")
    if isinstance(bus, str) and bus not in buses:
        known = ", ".join(buses) or "none"
        near = suggest(bus, list(buses))
        reading.fault((*at, "bus"), f"there is no [bus.{bus}]; buses are {known}{near}")
    device = reading.declared("devices", raw.get("device"), (*at, "device"), read_device)
    if device is None:
        return
    servo = device.servo is not None
    if servo != (at[-1] == "servo"):
        what = "a servo drive" if servo else "an instrument"
        reading.fault((*at, "device"), f"'{device.name}' is {what}, which does not fit here")
        return
    _check_measured(reading, device, at)
    fitting = _FITTING[device.kind]
    address, other = ("node", "unit") if fitting == ("can",) else ("unit", "node")
    if "encoder" in raw and not servo:
        reading.fault((*at, "encoder"), f"'{device.name}' has no encoder; it is of a servo")
    if address not in raw and _is_addressed(device):
        reading.fault((*at, address), f"missing; '{device.name}' is reached by its {address}")
    if other in raw:
        reading.fault((*at, other), f"'{device.name}' has no {other}; it is reached by {address}")
    wired = buses.get(str(bus))
    kind = wired.get("kind") if isinstance(wired, dict) else None
    if kind is not None and kind not in fitting:
        message = f"[bus.{bus}] is of kind {kind}; '{device.name}' needs {' or '.join(fitting)}"
        reading.fault((*at, "bus"), message)


def _check_measured(reading: FileReading, device: DeviceSpec, at: Key) -> None:
    """An instrument measures what its role needs; bare counts of a cell have a calibration."""
    wanted, found = _MEASURED.get(str(at[-1])), device.dimension
    if wanted is None or found in (None, wanted) or (wanted, found) == ("force", "ratio"):
        return
    message = (
        f"'{device.name}' measures {found} ('{device.unit}'); "
        f"as {at[-1]} it has to measure {wanted}"
    )
    if (wanted, found) == ("force", "mass"):
        message += f': in its device file write unit = "N" and a scale {GRAVITY} N per kg'
    reading.fault((*at, "device"), message)


def _is_addressed(device: DeviceSpec) -> bool:
    """Whether a device needs an address; a single one on a serial line does not."""
    return device.stream is None or "{address" in device.stream.poll
