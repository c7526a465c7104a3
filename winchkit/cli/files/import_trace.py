"""Table of the channels in a trace of CAN frames, for ``winchkit import FILE --device D``."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from winchkit.errors import Fault, NotPermitted, RunError

if TYPE_CHECKING:
    from winchkit.can_trace import TraceFrame
    from winchkit.drivers.can.tools.trace_decoder import TracedNode
    from winchkit.runs.importing.table import ColumnTable, FileColumn

_DRIVE = {
    "6064h": ("motor_angle", "rad", "angle"),
    "606Ch": ("motor_velocity", "rad/s", "velocity"),
    "6077h": ("motor_torque", "N m", "torque"),
}
"""Channel and unit of an object, and the scale of a drive's device file that converts it."""
_RAW = (("6064h", "counts", 1.0), ("6077h", "%", 0.1))
"""Units by CiA 402 alone: positions in increments, torques in per mille of the rated one."""
_COUNTER = "6064h"
"""Object with an INTEGER32, which wraps."""
_KINDS = ("TPDO", "SDO")
"""Frames with values that a device has measured."""

Samples = list[tuple[float, float]]


def read_trace_table(path: str, devices: Sequence[str]) -> ColumnTable:
    """Values that the devices of a trace sent, a group of columns for each PDO.

    Those of a drive with a device file are in SI, by the units that the trace shows or else those
    of the device file; others are in the device's units, a torque in % of the rated one (CiA 402
    has per mille). Raises FileError, RunError.
    """
    from winchkit.drivers.can.tools.decode import named
    from winchkit.drivers.can.tools.decoded_trace import decode_trace
    from winchkit.runs.importing.table import ColumnTable, named_apart

    trace = decode_trace(path, devices)
    found: dict[tuple[str, int, str], list[tuple[TraceFrame, dict[str, float]]]] = {}
    for frame, words in trace.frames:
        if words.kind in _KINDS and words.values:
            what = words.kind if words.kind == "SDO" else f"PDO {frame.identifier:03X}h"
            found.setdefault((frame.bus, words.node, what), []).append((frame, dict(words.values)))
    notes = list(trace.notes)
    if not found:
        advice = "" if devices else "; name the device by --device"
        text = "; ".join(["has no values of a known PDO or SDO object" + advice, *notes])
        raise RunError(Fault(text, path))
    if any(math.isnan(rows[0][0].time) for rows in found.values()):
        text = "has no times, without which there is no run; record it by candump -L"
        raise RunError(Fault(text, path))
    columns: list[FileColumn] = []
    scaled = {key: _scaled(path, one, notes) for key, one in trace.nodes.items()}
    buses = list(dict.fromkeys(bus for bus, _, _ in found))
    if len(buses) > 1:
        text = f"has values of the buses {', '.join(buses)}; split it by bus and join the runs"
        raise RunError(Fault(text, path))
    is_alone = len({node for _, node, _ in found}) < 2
    for (bus, node, what), rows in found.items():
        label = f"node {node}"
        dictionary = trace.nodes[bus, node].known.dictionary
        names = {name: named(name, dictionary) for _, values in rows for name in values}
        known = {name: (text, "", 1.0) for name, text in names.items()} | scaled[bus, node]
        if not is_alone:
            # Channels of several nodes are those of winches with the nodes' numbers.
            known = {name: (f"{label} {one[0]}", one[1], one[2]) for name, one in known.items()}
        columns += _columns(f"{label} {what}", rows, known)
    layout = f"trace of CAN frames ({trace.layout})"
    return ColumnTable(path, layout, named_apart(columns), notes=tuple(dict.fromkeys(notes)))


def _scaled(path: str, one: TracedNode, notes: list[str]) -> dict[str, tuple[str, str, float]]:
    """Name, unit and factor of the objects of a node whose meaning is known."""
    from winchkit.drivers.can.tools.decode import named

    try:
        scale = one.scale()
    except NotPermitted as error:
        raise RunError(Fault(f"{one.known.name}: {error}", path)) from None
    found = {
        name: (named(name, one.known.dictionary), unit, factor)
        for name, unit, factor in _RAW
        if one.known.dictionary is not None
    }
    if scale is not None:
        if not any((0x608F, sub) in one.seen for sub in (1, 2)):
            notes.append(
                f"{one.known.name}: increments of a turn and units are those of the device file, "
                "since the trace does not show 608Fh"
            )
        found = {
            name: (channel, unit, float(getattr(scale, key)))
            for name, (channel, unit, key) in _DRIVE.items()
        }
    if (value := one.process_value()) is not None:
        name, unit, factor = value
        found[name] = ("load" if unit == "kg" else "tension", unit, factor)
    return found


def _columns(
    group: str,
    rows: Sequence[tuple[TraceFrame, dict[str, float]]],
    known: dict[str, tuple[str, str, float]],
) -> Iterator[FileColumn]:
    """Time and values of one PDO, or of one object that is read by SDO."""
    import numpy as np

    from winchkit.runs.importing.table import FileColumn

    names = dict.fromkeys(name for _, values in rows for name in values)
    parts = [names] if "SDO" not in group else [[name] for name in names]
    for part in parts:
        own = [(frame.time, values) for frame, values in rows if not values.keys().isdisjoint(part)]
        place = group if len(parts) == 1 else f"{group} {next(iter(part))}"
        times = np.array([time for time, _ in own])
        yield FileColumn("time", times, "s", (place,), group=place)
        for name in part:
            channel, unit, factor = known[name]
            numbers = np.array([values.get(name, math.nan) for _, values in own], dtype=np.float64)
            modulus = abs(factor) * 2**32 if name == _COUNTER else math.inf
            yield FileColumn(channel, factor * numbers, unit, group=place, modulus=modulus)
