"""A serial adapter that is pulled out and put back, and a cell that freezes, over a real port."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from served import Served
from waiting import until
from winchkit import catalog
from winchkit.drivers.clock import MonotonicClock
from winchkit.drivers.modbus.instrument import Instrument
from winchkit.drivers.modbus.line import ModbusLine
from winchkit.drivers.reading import Quality
from winchkit.drivers.slow import SlowDevices
from winchkit.errors import ConnectionLost
from winchkit.schema.bench import BusSpec
from winchkit.schema.read import read_device

pytestmark = pytest.mark.skipif(os.name != "posix", reason="pseudo-terminals")
CLOCK = MonotonicClock()


def cell(rate: float = 100.0) -> Instrument:
    spec = read_device(catalog.find("devices", "laumas-tlb"))
    return Instrument("cell", spec, 1, CLOCK, rate=rate, timeout=0.2)


def test_an_adapter_that_is_pulled_out_and_put_back_is_read_again(tmp_path: Path) -> None:
    port, instrument = tmp_path / "tty", cell()
    slow: SlowDevices | None = None
    try:
        with Served("laumas-tlb", serial=True) as first:
            port.symlink_to(first.line.port)
            bus = BusSpec("modbus-rtu", port=str(port), timeout=0.2)
            slow = SlowDevices([ModbusLine("cells", bus, (instrument,), CLOCK)])
            until(lambda: instrument.counters.readings > 5)
        port.unlink()
        until(lambda: instrument.problem is not None)
        assert isinstance(instrument.problem, ConnectionLost)
        count = instrument.counters.readings
        with Served("laumas-tlb", serial=True) as second:
            port.symlink_to(second.line.port)
            until(lambda: instrument.counters.readings > count + 5)
        assert instrument.counters.reconnects == 1
    finally:
        if slow is not None:
            slow.close()


def test_a_cell_that_freezes_is_flagged_and_is_no_number_any_more() -> None:
    """Noise of 30 counts until it hangs; then the counts stand still."""
    instrument = cell(300.0)
    with Served("laumas-tlb") as served:
        host, port = served.line.address
        bus = BusSpec("modbus-tcp", host=host, port=port, timeout=0.2)
        slow = SlowDevices([ModbusLine("cells", bus, (instrument,), CLOCK)])
        try:
            until(lambda: instrument.counters.readings > 900, within=60.0)
            assert instrument.latest.quality.usable
            served.cell.inject("frozen")
            until(lambda: Quality.FROZEN in instrument.latest.quality)  # type: ignore[union-attr]
            assert instrument.latest.value != instrument.latest.value
            served.cell.inject("recover")
            until(lambda: instrument.latest.quality.usable)  # type: ignore[union-attr]
        finally:
            slow.close()
