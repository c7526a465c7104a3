"""Frames on the buses of a simulated bench, kept and found by name."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping

from winchkit.catalog import find
from winchkit.errors import UsageError, suggest
from winchkit.schema.bench import BenchSpec
from winchkit.schema.read import read_device
from winchkit.sim.live.buses import BusWire, Carried
from winchkit.testing.frames import CarriedFrame, FrameNames

_KEPT = 200_000
"""Frames: half a minute of a full bus at 1 Mbit/s (7700 frames of eight bytes a second)."""


class WireRecording:
    """Listens to every wire of a bench from now on."""

    def __init__(self, spec: BenchSpec, wires: Mapping[str, BusWire]) -> None:
        self._names = {bus: FrameNames(spec.bus[bus].node) for bus in wires}
        self._carried: deque[tuple[str, Carried]] = deque(maxlen=_KEPT)
        for name, wiring in spec.winch.items():
            ref = wiring.servo
            device = read_device(find("devices", ref.device, beside=spec.path or None))
            assert ref.node is not None, "the simulation has checked it"
            self._names[ref.bus].add(name, ref.node, device)
        for bus, wire in wires.items():
            wire.taps.append(self._tap(bus))

    def identifiers(self, what: str | int) -> dict[str, frozenset[int]]:
        """Identifiers of named frames by bus, see :meth:`FrameNames.identifiers`; UsageError."""
        found = {bus: names.identifiers(what) for bus, names in self._names.items()}
        if not any(found.values()):
            known = sorted({name for names in self._names.values() for name in names.all})
            near = suggest(str(what), known)
            raise UsageError(f"no frame is named '{what}'; there are {', '.join(known)}{near}")
        return found

    def frames(self, what: str | int | None = None, since: float = 0.0) -> list[CarriedFrame]:
        """Frames in their order, by name where one is given, from a time (s) on."""
        wanted = None if what is None else self.identifiers(what)
        return [
            self._names[bus].frame(carried)
            for bus, carried in tuple(self._carried)
            if carried.time >= since and (wanted is None or carried.identifier in wanted[bus])
        ]

    def _tap(self, bus: str) -> Callable[[Carried], None]:
        return lambda carried: self._carried.append((bus, carried))
