"""One sequence of faults against one device file: what the driver made of it."""

from __future__ import annotations

import asyncio
import logging
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from math import nan
from random import Random

from cell_campaign.device import Device
from cell_campaign.line import FarEnd, run
from cell_campaign.warp import WarpClock, WarpLoop
from winchkit import catalog
from winchkit.drivers.counters import Counters
from winchkit.drivers.modbus.instrument import Instrument
from winchkit.drivers.modbus.line import ModbusLine
from winchkit.drivers.reading import InstrumentReading
from winchkit.schema.bench import BusSpec
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.read import read_device

FAULTS = (
    "late",
    "short",
    "wrong unit",
    "damaged",
    "garbage",
    "garbage behind",
    "cut off",
    "split",
    "twice",
    "echo",
    "only echo",
    "silence",
    "exception",
    "unplug",
    "overload",
    "nan",
)
TIMEOUT = 0.1
_RATE = 20.0
_SUBJECT, _BYSTANDER = 1, 2


@dataclass(frozen=True)
class Plan:
    """What is tried: the device file, the line, the faults and how often."""

    device: str
    rtu: bool
    seed: str
    faults: tuple[str, ...] = FAULTS
    share: float = 0.4
    seconds: float = 3.0
    swapped: bool = False
    """The device file has the words in the wrong order."""
    largest: int = 0
    """Counts that the device shows at most, where not 0."""


@dataclass
class Outcome:
    """What came of it."""

    plan: Plan
    readings: int = 0
    numbers: int = 0
    wrong: list[str] = field(default_factory=list)
    flags: Counter[str] = field(default_factory=Counter)
    faults: dict[str, int] = field(default_factory=dict)
    counters: Counters = field(default_factory=Counters)
    bystander: int = 0
    """Readings of the device beside it, which does nothing wrong."""
    longest_gap: float = 0.0
    """Between two readings of the device beside it, s."""
    problem: str = ""
    _last: float = nan


def modbus_devices() -> list[str]:
    """Every shipped device file with registers."""
    return [name for name in catalog.names("devices") if spec_of(name).modbus is not None]


@cache
def spec_of(name: str) -> DeviceSpec:
    """A shipped device file."""
    return read_device(catalog.find("devices", name))


def play(plan: Plan) -> Outcome:
    """Run one sequence in simulated time."""
    # The library describes every fault at length; here there are thousands.
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)
    loop = WarpLoop()
    try:
        return run(loop, _play(plan, loop))  # type: ignore[no-any-return]
    finally:
        loop.close()
        asyncio.set_event_loop(None)


async def _play(plan: Plan, loop: WarpLoop) -> Outcome:
    random, declared = Random(plan.seed), spec_of(plan.device)
    assert declared.modbus is not None
    devices = {
        unit: Device(declared.modbus, Random(f"{plan.seed}/{unit}"), largest=plan.largest)
        for unit in (_SUBJECT, _BYSTANDER)
    }
    faults = _fitting(plan, devices[_SUBJECT])

    def next_fault(unit: int) -> str:
        wrong = unit == _SUBJECT and faults and random.random() < plan.share
        return random.choice(faults) if wrong else ""

    end = FarEnd(loop, plan.rtu, devices, next_fault, random, TIMEOUT)
    await end.listen()
    clock = WarpClock(loop)
    read_as = _swapped(declared) if plan.swapped else declared
    instruments = tuple(
        Instrument(
            f"unit {unit}",
            read_as if unit == _SUBJECT else declared,
            unit,
            clock,
            rate=_RATE,
            timeout=TIMEOUT,
        )
        for unit in devices
    )
    outcome = Outcome(plan)
    for instrument in instruments:
        instrument.listeners.append(_judge(outcome, devices[instrument.unit], instrument.unit))
    bus = BusSpec(timeout=TIMEOUT, **end.address)
    line = ModbusLine("far", bus, instruments, clock)
    task = loop.create_task(line.serve())
    await asyncio.sleep(plan.seconds)
    line.close()
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)
    end.close()
    subject = instruments[0]
    outcome.counters, outcome.faults = subject.counters, end.done
    outcome.problem = str(subject.problem or "")
    return outcome


def _judge(outcome: Outcome, device: Device, unit: int):  # type: ignore[no-untyped-def]  # noqa: ANN202
    """Compare each reading with what the device showed between request and answer."""

    def judge(reading: InstrumentReading) -> None:
        if unit == _BYSTANDER:
            outcome.bystander += 1
            gap = reading.t_receive - outcome._last
            outcome.longest_gap = max(outcome.longest_gap, gap) if gap > 0 else 0.0
            outcome._last = reading.t_receive
        else:
            outcome.readings += 1
            outcome.flags.update(str(reading.quality).split(", "))
        if reading.value != reading.value:
            return
        outcome.numbers += unit == _SUBJECT
        shown = device.shown.get(reading.raw)
        if shown is None or not reading.t_request <= shown <= reading.t_receive:
            when = "never" if shown is None else f"at {shown:.4f}"
            outcome.wrong.append(
                f"unit {unit}: {reading.raw:g} between {reading.t_request:.4f} and "
                f"{reading.t_receive:.4f}, shown {when} ({reading.quality})"
            )

    return judge


def _fitting(plan: Plan, device: Device) -> Sequence[str]:
    """Faults that this device and line can have."""
    unfit = set()
    if not device.can_overload:
        unfit.add("overload")
    if not device.is_float:
        unfit.add("nan")
    if not plan.rtu:
        unfit |= {"echo", "only echo"}
    return [fault for fault in plan.faults if fault not in unfit]


def _swapped(device: DeviceSpec) -> DeviceSpec:
    """The same file with the words of its value the other way round."""
    other = {"ABCD": "CDAB", "CDAB": "ABCD", "BADC": "DCBA", "DCBA": "BADC"}
    assert device.modbus is not None
    fields = tuple(replace(item, order=other[item.order]) for item in device.modbus.field)
    return replace(device, modbus=replace(device.modbus, field=fields))
