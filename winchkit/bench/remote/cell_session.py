"""Where a command finds a bench's instruments: at the owner, else opened here without any drive."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from winchkit.bench.cells.desk import CellDesk
from winchkit.bench.cells.instruments import can_buses, instruments
from winchkit.bench.cells.tasks import BenchCells, LocalCells
from winchkit.bench.remote.client import RemoteCells
from winchkit.bench.remote.client import attach as attach_to_owner
from winchkit.bench.remote.handover import own
from winchkit.bench.remote.identity import client_name
from winchkit.bench.remote.session import attach, serves
from winchkit.drivers.clock import Clock, MonotonicClock
from winchkit.drivers.slow import SlowDevices
from winchkit.schema.bench import BenchSpec


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
            yield RemoteCells(spec, remote)
        return
    with own_cells(spec, "cell") as desk:
        yield LocalCells(desk)


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
