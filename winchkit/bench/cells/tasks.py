"""Requests to an instrument by name, in this process or in the one that owns the bench."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

from winchkit.bench.cells.desk import CellDesk, full_name, indicated
from winchkit.bench.cells.report import about, counters_told, rate_report
from winchkit.bench.cells.tares import by_device, clear_tare, host_tare, restore_tares, tares_now
from winchkit.drivers.reading import InstrumentReading, Quality
from winchkit.errors import UsageError
from winchkit.schema.bench import BenchSpec


@dataclass(frozen=True)
class BenchCells:
    """The instruments of a bench, here or at its owner."""

    spec: BenchSpec
    do: Callable[..., dict[str, Any]]
    """Carries out one of TASKS for an instrument by its full name; raises what that raises."""


def do(desk: CellDesk, task: str, name: str, *arguments: Any) -> dict[str, Any]:
    """Carry out a task; its result is plain data for JSON. Raises UsageError if unknown."""
    if task not in TASKS:
        raise UsageError(f"no task '{task}' for an instrument; there are {', '.join(TASKS)}")
    return TASKS[task](desk, full_name(desk.spec, name), *arguments)


def readings_of(reply: Mapping[str, Any]) -> list[InstrumentReading]:
    """Readings in a reply of the task "watch"."""
    return [
        InstrumentReading(**{**row, "quality": Quality(row["quality"])})
        for row in reply["readings"]
    ]


def _identify(desk: CellDesk, name: str) -> dict[str, Any]:
    """Its device file, and what the device says of itself."""
    return {"device": desk.device(name).name, "identity": desk.identify(name)}


def _watch(desk: CellDesk, name: str, duration: float) -> dict[str, Any]:
    """Readings of the next ``duration`` s, and the counts of that time."""
    before = counters_told(desk.sensors[name].counters)
    readings = desk.readings(name, duration)
    after = counters_told(desk.sensors[name].counters)
    rows = [{**asdict(item), "quality": item.quality.value} for item in readings]
    return {"readings": rows, "counters": {key: after[key] - before[key] for key in after}}


def _indicated(desk: CellDesk, name: str, wait: float, duration: float) -> dict[str, Any]:
    """The mean of what the device itself shows, after a while."""
    desk.clock.sleep(wait)
    return asdict(indicated(desk.readings(name, duration), desk.publisher(name).scale))


def _store(desk: CellDesk, name: str, command: str) -> dict[str, Any]:
    """A command that writes its EEPROM."""
    desk.permit(name)
    desk.store(name, command)
    return {}


TASKS: Mapping[str, Callable[..., dict[str, Any]]] = {
    "about": about,
    "clear device tare": partial(by_device, command="gross"),
    "clear tare": clear_tare,
    "device tare": partial(by_device, command="tare"),
    "host tare": host_tare,
    "identify": _identify,
    "indicated": _indicated,
    "rate": rate_report,
    "restore tares": restore_tares,
    "store": _store,
    "tares": tares_now,
    "watch": _watch,
    "zero": partial(by_device, command="zero"),
}
"""Each takes a desk, the full name of an instrument and numbers in SI, or what "tares" gave."""
