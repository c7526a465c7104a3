"""Frames of the CAN buses in words, for the Bench view."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from winchkit.bench.cells.instruments import device_of
from winchkit.drivers.can.tools.decode import KnownNode, decode, known_node
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
