"""``winchkit cell diagnose``: findings on a cell from a few seconds of readings."""

from __future__ import annotations

import dataclasses
import math
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import click

from winchkit.cli.cell.options import cells, shown, unit_of
from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.completion import complete_winch
from winchkit.cli.core.options import TABLE, bench_by_default, bench_file_option, duration_option
from winchkit.cli.core.output import json_flag, tell
from winchkit.cli.core.quantity_type import QuantityType
from winchkit.errors import UsageError, one_line
from winchkit.quantity_text import with_std

if TYPE_CHECKING:
    from winchkit.calibration.cell.health import Health
    from winchkit.calibration.cell.recordings import CellFindings
    from winchkit.drivers.reading import InstrumentReading

_MEANINGS = {
    "mismatch": "status and value contradict each other; check order, type and scale of the "
    "value in the device file",
    "overload": "beyond the cell's or the converter's range; take the load off, check the wires",
    "underload": "below the cell's or the converter's range; check the wires",
    "fault": "the device reports a fault of its own; check cell and cable",
    "stale": "the device says that it has no new value",
    "ambiguous": "it may be the late reply to an earlier request; check the line and longest_reply",
    "frozen": "the counts stand still while they should not; switch the amplifier off and on",
}


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit cell diagnose",
        "winchkit cell diagnose A --for 2s --json",
        "winchkit cell diagnose --run cell.csv",
    ),
)
@click.argument("cell", required=False, shell_complete=complete_winch)
@bench_file_option("Bench file; not needed with --run.  [default: the only one of this folder]")
@click.option(
    "--run",
    metavar="FILE",
    type=TABLE,
    help="Examine a recording in place of readings: a run, a log, or a file of another program.",
)
@click.option(
    "-c", "--column", metavar="COLUMN", help="Column of the cell in FILE, by its name or number."
)
@click.option(
    "--sample-rate",
    "rate",
    metavar="RATE",
    type=QuantityType("frequency", example="80 Hz"),
    help="Rate of the rows of a FILE without times, e.g. '80 Hz'.",
)
@duration_option("Duration of the readings.", default="10 s")
@json_flag("Print the result as JSON.")
@click.pass_context
def command(
    context: click.Context,
    cell: str | None,
    bench: str | None,
    run: str | None,
    column: str | None,
    rate: str | None,
    duration: str,
) -> None:
    """Watch CELL and report rate, noise, drift, frozen or repeated counts, hum and creep.

    Leave the load alone, or change it once: then creep is reported as well. Exit 1 where something
    is wrong with the readings themselves. With --run these are the readings of a recording, which
    needs no motion, no bench and no calibration; spikes and an influence of the temperature are
    reported too, in the unit of the file.
    """
    if run is not None:
        if bench is not None and context.get_parameter_source("bench") is not _ENVIRONMENT:
            raise click.UsageError("'--run' reads a file, so '--bench' has no place there.")
        _examine_recording(run, column or cell, rate)
        return
    for option, given in (("column", column), ("sample-rate", rate)):
        if given is not None:
            raise click.UsageError(f"'--{option}' is of '--run FILE'.")
    if cell is not None and Path(cell).is_file():
        raise UsageError(f"'{cell}' is a file, not a cell of a bench: --run '{cell}' examines it")
    bench = bench_by_default(context, _parameter(context, "bench"), bench)
    assert bench is not None, "else UsageError"
    from winchkit.bench.cells.calls import samples_of_readings
    from winchkit.bench.cells.tasks import readings_of
    from winchkit.calibration.cell.health import examine, is_wrong
    from winchkit.cli.core.quantities import quantity

    seconds = quantity(duration, "time")
    with cells(bench, cell) as (found, name):
        watched = found.do("watch", name, seconds)
    readings, counters = readings_of(watched), watched["counters"]
    unit = unit_of(name)
    flags = _flags(readings)
    if sum(item.quality.usable for item in readings) < len(readings) / 2:
        _tell_unusable(name, len(readings), flags, counters)
    health = examine(samples_of_readings(readings))
    record = {"cell": name, "unit": unit, **dataclasses.asdict(health)}
    lines = [
        f"{name}, {seconds:g} s:",
        *(f"  {line}" for line in _lines(health, unit)),
        "  counters: " + ", ".join(f"{k} {v}" for k, v in counters.items()),
        *(f"  ! {remark}" for remark in health.remarks),
    ]
    tell({**record, "flags": flags, "counters": counters}, lines)
    if is_wrong(health):
        click.get_current_context().exit(1)


_ENVIRONMENT = click.core.ParameterSource.ENVIRONMENT


def _parameter(context: click.Context, name: str) -> click.Parameter:
    return next(item for item in context.command.params if item.name == name)


def _examine_recording(run: str, column: str | None, rate: str | None) -> None:
    """Report on every cell of a file; exit with 1 where its readings are wrong."""
    from winchkit.calibration.cell.health import is_wrong
    from winchkit.calibration.cell.recordings import recorded_cell_health
    from winchkit.cli.core.quantities import optional

    found = recorded_cell_health(run, column, optional(rate, "frequency"))
    lines = (line for one in found for line in _lines_of_recorded(one, run))
    tell({"run": run, "cells": [dataclasses.asdict(one) for one in found]}, lines)
    if any(one.spikes or is_wrong(one.health) for one in found):
        click.get_current_context().exit(1)


def _lines_of_recorded(one: CellFindings, run: str) -> Iterator[str]:
    unit = f" in {one.unit}" if one.unit else ""
    yield one_line(f"{one.name}{unit}, {run}:")
    yield from (f"  {line}" for line in _lines(one.health, one.unit))
    if math.isfinite(one.temperature_slope):
        slope = with_std(one.temperature_slope, one.temperature_slope_std, "1")
        yield f"  over the temperature: {slope} {one.unit} per degree of its column"
    yield from (f"  ! {remark}" for remark in one.remarks)


def _flags(readings: list[InstrumentReading]) -> dict[str, int]:
    """How many readings carry each flag."""
    found: Counter[str] = Counter()
    for reading in readings:
        found.update(flag.name.lower() for flag in reading.quality if flag.name)
    return dict(found.most_common())


def _tell_unusable(
    name: str, count: int, flags: dict[str, int], counters: dict[str, int]
) -> NoReturn:
    """Say why there is nothing to examine, and end with 1."""
    listed = ", ".join(f"{flag} {number}" for flag, number in flags.items())
    lines = [f"{name}: most of {count} readings are no measurements: {listed}"]
    lines += [f"  ! {flag}: {_MEANINGS[flag]}" for flag in flags if flag in _MEANINGS]
    tell({"cell": name, "readings": count, "flags": flags, "counters": counters}, lines)
    click.get_current_context().exit(1)


def _lines(health: Health, unit: str) -> list[str]:
    """Klipper's order: how many, how fast, how good; then what is in them."""
    lines = [
        f"readings {health.readings} ({health.rate:.1f} /s, longest gap "
        f"{health.longest_gap * 1e3:.0f} ms)",
        f"usable {health.usable}, saturated {health.saturated}",
        f"counts: {health.unique} different, {health.duplicates:.1%} repeat the one before, "
        f"longest standstill {health.longest_still:.2f} s",
        f"gross value: {shown(health.low, unit)} to {shown(health.high, unit)}, "
        f"mean {shown(health.mean, unit)}",
        f"noise: {shown(health.noise, unit, 3)} rms"
        + (f" ({health.noise_counts:.2g} counts)" if math.isfinite(health.noise_counts) else ""),
        f"drift: {with_std(health.drift * 60, health.drift_std * 60, '1')} {unit} a minute",
    ]
    for hum in health.hum:
        found = (
            "cannot be measured at this rate"
            if math.isnan(hum.amplitude)
            else f"{with_std(hum.amplitude, hum.std, '1')} {unit}"
            + ("" if hum.there else " (within the noise)")
        )
        lines.append(f"hum at {hum.frequency:g} Hz: {found}")
    if health.creep is None:
        lines.append("creep: no change of load was seen")
    else:
        creep = health.creep
        lines.append(
            f"creep after a change of {shown(creep.step, unit)}: {creep.change:+.3g} ± "
            f"{creep.std:.2g} {unit} between 1 and 30 minutes, from {creep.since:.0f} s"
        )
    return lines
