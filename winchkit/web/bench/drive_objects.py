"""Objects of a winch's drive, and the frames of the CAN buses in words, for the Bench view."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from winchkit.bench.cells.instruments import device_of
from winchkit.bench.control.snapshot import Phase
from winchkit.bench.drives.node_access import declared_drive, drive_at
from winchkit.drivers.can.tools.config import (
    Config,
    described,
    named_setting,
    one_setting,
    write_config,
)
from winchkit.drivers.can.tools.decode import KnownNode, decode, known_node
from winchkit.drivers.can.tools.info import DriveInfo, read_info
from winchkit.drivers.can.tools.scan import identity_of
from winchkit.errors import UsageError
from winchkit.schema.bench import BenchSpec

_LAST = 60
"""Of the last frames that are shown."""


class FrameWords:
    """Says what frames mean, by the device files of the bench."""

    def __init__(self, spec: BenchSpec) -> None:
        self._nodes: dict[str, dict[int, KnownNode]] = {}
        for name, winch in spec.winch.items():
            servo = winch.servo
            node = servo.node or 1
            known = known_node(name, device_of(spec, servo), node)
            self._nodes.setdefault(servo.bus, {})[node] = known

    def table(self, frames: Mapping[str, Any]) -> dict[str, list[dict[str, Any]]]:
        """Rows for the newest frame of each identifier with ``count``, and for the last frames."""
        newest = [
            {"count": count, **self._row(bus, *frame)}
            for bus, found in frames.items()
            for count, *frame in sorted(found["newest"], key=lambda item: int(item[2]))
        ]
        last = sorted(
            (frame[0], bus, frame) for bus, found in frames.items() for frame in found["last"]
        )
        return {
            "newest": newest,
            "last": [self._row(bus, *frame) for _, bus, frame in last[-_LAST:]][::-1],
        }

    def _row(self, bus: str, time: float, identifier: int, data: str) -> dict[str, Any]:
        said = decode(identifier, bytes.fromhex(data), self._nodes.get(bus, {}))
        return {
            "bus": bus,
            "identifier": identifier,
            "kind": said.kind,
            "words": said.text,
            "data": data,
            "time": time,
        }


def drive_objects(spec: BenchSpec, status: Mapping[str, Any], winch: str) -> dict[str, Any]:
    """What ``winchkit info`` shows of a drive: groups of rows of object, meaning and value.

    Raises UsageError for an unknown winch, and where it is not disabled.
    """
    _require_disabled(spec, status, [winch])
    with drive_at(spec, winch) as node:
        return {"winch": winch, "groups": _groups(node.node, read_info(node.objects))}


def _groups(node: int, info: DriveInfo) -> list[dict[str, Any]]:
    register = info.error_register
    own = [
        ("1008h", "name", " ".join(filter(None, (info.name, info.hardware, info.software)))),
        ("1018h", "identity", str(info.identity)),
        ("1001h", "error register", "–" if register is None else f"{register:02X}h"),
        ("6041h", "state", info.state),
        ("6061h", "mode", info.mode),
        ("6502h", "modes", ", ".join(info.modes) or "–"),
    ]
    errors = [("1003h", words, f"{code:04X}h") for code, words in info.errors]
    groups: dict[str, list[tuple[str, str, Any]]] = {f"node {node}": own, "errors": errors}
    for group, entries in info.noted.items():
        groups[group] = [
            (
                f"{item.index:04X}h" + (f":{item.sub}" if item.sub else ""),
                f"{item.what}{item.meaning and ': '}{item.meaning}",
                item.value,
            )
            for item in entries
            if item.value is not None
        ]
    return [{"name": name, "rows": rows} for name, rows in groups.items() if rows]


def drive_settings(spec: BenchSpec, winch: str) -> list[dict[str, Any]]:
    """Settings of a winch's drive that can be written, by its EDS; the drive is not asked."""
    return [asdict(item) for item in described(declared_drive(spec, winch).dictionary)]


def read_setting(
    spec: BenchSpec, status: Mapping[str, Any], winch: str, name: str
) -> float | int | str | None:
    """Value of a setting such as ``6091h:1``; None where the drive has no such object.

    Raises UsageError for an unknown winch or setting, and where the winch is not disabled.
    """
    _require_disabled(spec, status, [winch])
    with drive_at(spec, winch) as node:
        return node.objects.value(named_setting(node.objects.dictionary, name))


def write_setting(
    spec: BenchSpec, status: Mapping[str, Any], winch: str, name: str, text: str
) -> dict[str, Any]:
    """Write a setting of a drive (whole numbers also as ``0x1F``), and read it back.

    Raises UsageError for an unknown setting, a value that does not fit it, and where a winch is not
    disabled; NotPermitted where another program owns the bench, or uses it; DeviceRefused for what
    the drive does not take.
    """
    _require_disabled(spec, status, list(spec.winch))
    dictionary = declared_drive(spec, winch).dictionary
    values = one_setting(dictionary, name, text)
    with drive_at(spec, winch, writes=True) as node:
        changed = write_config(Config(identity_of(node.objects.port), values), node.objects)
        value = node.objects.value(named_setting(dictionary, name))
    before = changed[0].drive if changed else value
    return {"object": name, "value": value, "before": before}


def _require_disabled(spec: BenchSpec, status: Mapping[str, Any], winches: Sequence[str]) -> None:
    for winch in winches:
        if winch not in spec.winch:
            raise UsageError(f"there is no winch '{winch}'; there are {', '.join(spec.winch)}")
        phase = status.get("winch", {}).get(winch, {}).get("phase", "unknown")
        if phase != Phase.DISABLED.value:
            raise UsageError(
                f"winch {winch} is {phase}; objects are read and written where it is disabled"
            )
