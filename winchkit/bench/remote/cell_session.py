"""Where a command finds a bench's instruments, and their log: at the owner, else opened here."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from winchkit.bench.cells.desk import CellDesk
from winchkit.bench.cells.instruments import can_buses, instruments
from winchkit.bench.cells.tasks import BenchCells, do
from winchkit.bench.recording.provenance import origin
from winchkit.bench.recording.recorder import OwnedLog, Recorder, counters_of
from winchkit.bench.remote.client import attach as attach_to_owner
from winchkit.bench.remote.handover import own
from winchkit.bench.remote.identity import client_name
from winchkit.bench.remote.session import attach, serves
from winchkit.drivers.clock import Clock, MonotonicClock
from winchkit.drivers.reading import Sensor
from winchkit.drivers.slow import SlowDevices
from winchkit.errors import UsageError
from winchkit.runs.recording.rotation import Rotation
from winchkit.schema.bench import BenchSpec


class CellStation(OwnedLog):
    """Operations of a station that a log needs, on the instruments of a bench."""

    def __init__(self, desk: CellDesk) -> None:
        """Take open instruments."""
        self._desk = desk

    def start_log(self, path: str, rotate: str | None = None, replace: bool = False) -> None:
        """Begin a log; as that of a bench, with a source for each instrument and no drives."""
        for name in self._desk.sensors:
            self._desk.first_reading(name)
        about = {"bench": self._desk.spec.name, "cells": json.dumps(list(self._desk.spec.cells))}
        self._recorder = Recorder(
            path,
            self._sensors,
            self._desk.clock,
            {**about, **origin(self._desk.spec)},
            rotation=None if rotate is None else Rotation.parse(rotate),
            replace=replace,
            has_drives=False,
        )

    def status(self) -> dict[str, Any]:
        """The counts; there is no cycle of a control loop."""
        return {"cycle": 0, "counters": self.counters()}

    def counters(self) -> dict[str, dict[str, Any]]:
        """Counts so far, by instrument (``A.cell``) and of the log itself."""
        return counters_of(self._sensors) if self._recorder is None else self._recorder.counters()

    @property
    def _sensors(self) -> dict[str, dict[str, Sensor]]:
        found: dict[str, dict[str, Sensor]] = {}
        for name, sensor in self._desk.sensors.items():
            winch, _, role = name.rpartition(".")
            found.setdefault(winch, {})[role] = sensor
        return found


@contextmanager
def at_cell_station(spec: BenchSpec) -> Iterator[CellStation]:
    """The instruments of a bench without winches, owned and opened here; raises NotPermitted."""
    if not spec.cells:
        raise UsageError(f"bench '{spec.name}' has winches; attach to it")
    with own_cells(spec, "log") as desk:
        station = CellStation(desk)
        try:
            yield station
        finally:
            station.end_log()


@contextmanager
def at_cells(bench_file: str | Path) -> Iterator[BenchCells]:
    """The instruments of a bench, by its owner or as its owner; raises NotPermitted."""
    from winchkit.schema.read import read_bench

    spec = read_bench(bench_file)
    remote = attach_to_owner(spec)
    if remote is not None and not serves(remote, spec):
        remote = attach(bench_file)
    if remote is not None:
        with remote:
            yield BenchCells(spec, remote.cell)
        return
    with own_cells(spec, "cell") as desk:
        yield BenchCells(spec, partial(do, desk))


@contextmanager
def own_cells(spec: BenchSpec, client: str) -> Iterator[CellDesk]:
    """The instruments of a bench, opened here as its owner; raises NotPermitted."""
    with ExitStack() as stack:
        stack.callback(own(spec, client_name(client)).close)
        yield _opened(spec, MonotonicClock(), stack)


def _opened(spec: BenchSpec, clock: Clock, stack: ExitStack) -> CellDesk:
    """Instruments with their lines, closed by ``stack``; no drive needs to be there."""
    buses = {}
    for name in can_buses(spec):
        from winchkit.drivers.can.bus.bus import CanBus

        buses[name] = CanBus(spec.bus[name], name, clock)
        stack.callback(buses[name].close)
    sensors, lines = instruments(spec, clock, buses)
    slow = SlowDevices(lines, clock)
    stack.callback(slow.close)
    return CellDesk(spec, clock, lines, slow, sensors)
