"""A trace of CAN frames with the meaning of every frame, by the devices of its nodes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from winchkit.arguments import path_of, require_types
from winchkit.can_trace import TraceFrame, read_trace
from winchkit.drivers.can.tools.decode import DecodedFrame
from winchkit.drivers.can.tools.trace_decoder import (
    Description,
    TraceDecoder,
    TracedNode,
    read_description,
)
from winchkit.errors import UsageError

_NODES = range(1, 128)


@dataclass(frozen=True)
class DecodedTrace:
    """Frames of a trace in words.

    Attributes
    ----------
    path : str
        The file.
    layout : str
        Its format.
    frames : tuple of (TraceFrame, DecodedFrame)
        Each frame with its meaning, in the order of the file.
    nodes : mapping of (str, int) to TracedNode
        Nodes by bus and number, with what the trace shows of their objects.
    notes : tuple of str
        What was left out, and what contradicts the descriptions of the devices.
    """

    path: str
    layout: str
    frames: tuple[tuple[TraceFrame, DecodedFrame], ...]
    nodes: Mapping[tuple[str, int], TracedNode]
    notes: tuple[str, ...]


def decode_trace(path: str | Path, devices: Sequence[str] = ()) -> DecodedTrace:
    """Decode a trace of CAN frames.

    Parameters
    ----------
    path : str or Path
        Trace of candump, PCAN (TRC), Vector (ASC, BLF), or a CSV table of frames.
    devices : sequence of str
        EDS, DCF or device file of all nodes (a path, or the name of one that comes with winchkit),
        or of one node as ``"5=cell.eds"``.

    Returns
    -------
    DecodedTrace
        All data frames in words.

    Raises
    ------
    FileError
        Where the trace or a device cannot be read, or a device is on no CAN bus.
    UsageError
        For two devices of one node.
    """
    file = path_of(path)
    require_types(devices, str, "devices")
    default, by_node = _descriptions(devices)
    trace = read_trace(file)
    decoders = {
        bus: TraceDecoder(default, by_node)
        for bus in dict.fromkeys(frame.bus for frame in trace.frames)
    }
    frames = tuple((frame, decoders[frame.bus].decode(frame)) for frame in trace.frames)
    nodes = {
        (bus, number): node
        for bus, decoder in decoders.items()
        for number, node in decoder.all_nodes.items()
    }
    notes = [*trace.notes, *(note for node in nodes.values() for note in node.notes())]
    return DecodedTrace(trace.path, trace.layout, frames, nodes, tuple(dict.fromkeys(notes)))


def _descriptions(devices: Sequence[str]) -> tuple[Description | None, dict[int, Description]]:
    default, by_node = None, {}
    for text in devices:
        head, equals, tail = text.partition("=")
        if not (equals and head.isdecimal()):
            if default is not None:
                raise UsageError(f"'{text}' is a second device for all nodes; write NODE={text}")
            default = read_description(text)
            continue
        node = int(head)
        if node not in _NODES or node in by_node:
            what = "is given twice" if node in by_node else "is no node number (1 to 127)"
            raise UsageError(f"device '{text}': {node} {what}")
        by_node[node] = read_description(tail)
    return default, by_node
