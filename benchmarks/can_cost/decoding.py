"""What it costs to take a TPDO in: ours, canopen's PdoMap and its BaseNode402, side by side."""

from __future__ import annotations

import struct
from collections.abc import Callable
from time import thread_time_ns
from typing import Any

import canopen
from canopen.profiles.p402 import BaseNode402

from winchkit import catalog
from winchkit.drivers.can.canopen.pdo import MappedObject, PdoCodec
from winchkit.drivers.can.cia402.feedback import Gathering
from winchkit.drivers.can.cia402.units import CountScale
from winchkit.schema.devices.servo import PdoSpec

NODE = 1
MAPPED = (
    (1, ((0x6041, 16, False), (0x6064, 32, True), (0x6061, 8, True))),
    (2, ((0x606C, 32, True), (0x6077, 16, True), (0x603F, 16, False))),
)
FRAMES = (
    struct.pack("<Hib", 0x1637, 123_456, 9),
    struct.pack("<ihH", -2048, 137, 0),
)
Round = Callable[[int], None]


def ours() -> dict[str, Round]:
    """A drive's answer of two frames: decoded alone, and made into feedback in SI."""
    codecs = []
    for number, objects in MAPPED:
        spec = PdoSpec(number, tuple(f"0x{index:04X}" for index, _, _ in objects))
        codecs.append(PdoCodec(spec, [MappedObject(i, 0, b, s) for i, b, s in objects]))
    gathering = Gathering(codecs, CountScale(1e-4, 1e-4, 2e-3), 0.004)
    receive = [gathering.receiver(codec) for codec in codecs]
    decode = [codec.decode for codec in codecs]

    def decoded(count: int) -> None:
        first, second = decode
        for _ in range(count):
            first(FRAMES[0])
            second(FRAMES[1])

    def feedback(count: int) -> None:
        first, second = receive
        for sync in range(count):
            gathering.begin(sync, 1.0)
            first(FRAMES[0], 1.001)
            second(FRAMES[1], 1.001)

    return {"decoded": decoded, "feedback": feedback}


def _canopen_maps(node: Any) -> list[Any]:
    maps = []
    for number, objects in MAPPED:
        pdo = node.tpdo[number]
        pdo.clear()
        for index, bits, _ in objects:
            pdo.add_variable(index, 0, bits)
        pdo.cob_id = 0x80 + 0x100 * number + NODE
        maps.append(pdo)
    return maps


def canopens() -> dict[str, Round]:
    """The same two frames through canopen, with the values decoded, and through BaseNode402."""
    eds = str(catalog.find("devices", "generic-cia402").parent / "generic-cia402.eds")
    plain = canopen.RemoteNode(NODE, eds)
    first, second = _canopen_maps(plain)
    data = [bytearray(frame) for frame in FRAMES]

    def pdo_map(count: int) -> None:
        for _ in range(count):
            first.on_message(first.cob_id, data[0], 1.0)
            _ = first[0].raw, first[1].raw, first[2].raw
            second.on_message(second.cob_id, data[1], 1.0)
            _ = second[0].raw, second[1].raw, second[2].raw

    node = BaseNode402(NODE, eds)
    watched = _canopen_maps(node)
    for pdo in watched:
        pdo.add_callback(node.on_TPDOs_update_callback)

    def base_node(count: int) -> None:
        for _ in range(count):
            for pdo, frame in zip(watched, data, strict=True):
                pdo.on_message(pdo.cob_id, frame, 1.0)
            _ = node.statusword

    node.tpdo_values[0x6041] = 0x1637
    return {"pdo_map": pdo_map, "base_node_402": base_node}


def cost_of_decoding(count: int = 60, rounds: int = 400) -> dict[str, float]:
    """Microseconds of processor time a frame, and the ratios.

    Each is the least decile of many short rounds that take turns, as that of a cycle: on a computer
    that does other things as well, what a round took longer was not its own. It is not the least
    of all, since the processor clock of a virtual machine stands still in some of them.
    """
    ways = ours() | canopens()
    for way in ways.values():
        way(10 * count)
    spent: dict[str, list[int]] = {name: [] for name in ways}
    for _ in range(rounds):
        for name, way in ways.items():
            start = thread_time_ns()
            way(count)
            spent[name].append(thread_time_ns() - start)
    cost = {
        name: sorted(took)[rounds // 10] / count / len(FRAMES) / 1e3 for name, took in spent.items()
    }
    return {
        **{f"{name}_us": value for name, value in cost.items()},
        "pdo_map_over_decoded": cost["pdo_map"] / cost["decoded"],
        "pdo_map_over_feedback": cost["pdo_map"] / cost["feedback"],
        "base_node_402_over_feedback": cost["base_node_402"] / cost["feedback"],
    }
