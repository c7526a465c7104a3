"""The commands of ``winchkit cell`` as functions, one call each.

No drive is opened: the instruments of a bench answer alone, or through the process that owns it.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from winchkit.bench.cells.desk import check_permanent, full_name
from winchkit.bench.cells.results import (
    CellExchange,
    CellInfo,
    CellRate,
    CellTare,
    CellTares,
    CellTiming,
    CellValue,
)
from winchkit.bench.cells.tasks import readings_of
from winchkit.bench.remote.cell_session import at_cells
from winchkit.calibration.cell.health import CellSamples, Health, examine, samples_of
from winchkit.drivers.counters import Latency
from winchkit.drivers.reading import InstrumentReading, Quality


def cell_info(bench: str | Path, cell: str | None = None) -> CellInfo:
    """Return device file, serial number, calibration, tare, and a reading of a load cell.

    Parameters
    ----------
    bench : str or Path
        Bench file.
    cell : str, optional
        Instrument, ``A.cell`` or a winch; by default the only one.

    Returns
    -------
    CellInfo
        What ``winchkit cell info --json`` prints.

    Raises
    ------
    FileError
        For an invalid bench file.
    NoReply, ConnectionLost
        Where the instrument does not answer.
    UsageError
        For an unknown instrument.
    """
    told = _done("about", bench, cell)
    parts = {"tare": CellTares, "reading": CellValue, "timing": CellTiming}
    made = {key: kind(**told[key]) for key, kind in parts.items()}
    lists = {key: tuple(told[key]) for key in ("coefficients", "remarks")}
    return CellInfo(**{**told, **made, **lists})


def cell_rate(bench: str | Path, cell: str | None = None, *, duration: float = 3.0) -> CellRate:
    """Measure the rate of a load cell, and what limits it.

    Parameters
    ----------
    bench, cell
        As of :func:`cell_info`, with its errors.
    duration : float
        Of the measurement, s.

    Returns
    -------
    CellRate
        What ``winchkit cell rate --json`` prints.
    """
    told = _done("rate", bench, cell, duration)
    cost, latency = told["exchange"], Latency(**told["latency"])
    exchange = CellExchange(**cost) if cost else None
    return CellRate(**{**told, "exchange": exchange, "latency": latency})


def cell_health(bench: str | Path, cell: str | None = None, *, duration: float = 10.0) -> Health:
    """Examine some seconds of readings: noise, drift, frozen counts, hum and creep.

    Parameters
    ----------
    bench, cell
        As of :func:`cell_info`, with its errors.
    duration : float
        Of the readings, s.

    Returns
    -------
    Health
        Figures of the readings.

    Raises
    ------
    RunError
        For fewer than 20 usable readings.
    """
    return examine(samples_of_readings(readings_of(_done("watch", bench, cell, duration))))


def cell_tare(
    bench: str | Path,
    cell: str | None = None,
    *,
    duration: float = 1.0,
    device: bool = False,
    clear: bool = False,
) -> CellTare:
    """Tare a load cell: subtract the mean of its present reading.

    Parameters
    ----------
    bench, cell
        As of :func:`cell_info`, with its errors.
    duration : float
        Over which the reading is averaged, s.
    device : bool
        Use the volatile tare of the device instead of the host's, which is kept beside the bench.
    clear : bool
        Remove the tare instead.

    Returns
    -------
    CellTare
        What ``winchkit cell tare --json`` prints.

    Raises
    ------
    NotPermitted
        Where the winch moves.
    """
    task = f"{'clear ' * clear}{'device tare' if device else 'tare' if clear else 'host tare'}"
    return CellTare(**_done(task, bench, cell, *() if task == "clear tare" else (duration,)))


def cell_zero(bench: str | Path, cell: str | None = None, *, duration: float = 1.0) -> CellTare:
    """Send a load cell's device its volatile zero command.

    Parameters
    ----------
    bench, cell, duration
        As of :func:`cell_tare`, with its errors.

    Returns
    -------
    CellTare
        What ``winchkit cell zero --json`` prints.
    """
    return CellTare(**_done("zero", bench, cell, duration))


def cell_store(bench: str | Path, command: str, cell: str | None = None) -> None:
    """Send a command that writes the device's EEPROM, which is limited in its number of writes.

    Parameters
    ----------
    bench, cell
        As of :func:`cell_info`, with its errors.
    command : str
        Name of a permanent command of the device file.
    """
    with at_cells(bench) as found:
        name = full_name(found.spec, cell)
        check_permanent(found.spec, name, command)
        found.do("store", name, command)


def _done(task: str, bench: str | Path, cell: str | None, *arguments: Any) -> dict[str, Any]:
    with at_cells(bench) as found:
        return found.do(task, full_name(found.spec, cell), *arguments)


def samples_of_readings(readings: Sequence[InstrumentReading]) -> CellSamples:
    """Readings as the examination of a cell takes them."""
    saturated = Quality.OVERLOAD | Quality.UNDERLOAD
    return samples_of(
        [
            (
                item.t_sample,
                item.raw,
                item.gross,
                item.quality.usable,
                bool(item.quality & saturated),
            )
            for item in readings
        ]
    )
