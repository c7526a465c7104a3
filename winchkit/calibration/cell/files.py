"""Files of load cell calibrations and tares, and tables of points that were measured elsewhere."""

from __future__ import annotations

import dataclasses
import json
import math
import statistics
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from winchkit.arguments import path_of
from winchkit.calibration.cell.creep import creep_shape, creep_within
from winchkit.calibration.cell.fit import FigureOfMerit
from winchkit.errors import Fault, FileError, RunError, suggest
from winchkit.regular_file import read_whole
from winchkit.runs.files import write_whole
from winchkit.runs.importing.formats.cells import number as read_number
from winchkit.runs.importing.formats.dialect import (
    decode,
    doubt_of_commas,
    find_dialect,
    split_line,
)
from winchkit.runs.importing.formats.stamps import read_stamps
from winchkit.runs.importing.units.known import BRIDGE, COUNTS
from winchkit.runs.importing.units.spelling import read_unit, split_unit
from winchkit.schema.calibration import CalibrationPoint, CellCalibration, HostTare, TareBook
from winchkit.units import GRAVITY, format_quantity

_DIGITS = 9
"""Significant digits: 1 mN in 1 MN is below the resolution of every indicator, so that reading back
changes nothing."""
_LARGEST = 10_000_000
"""Bytes of a file of points: some hundred thousand readings."""
_RAW = (COUNTS, BRIDGE, "voltage")
"""Dimensions of readings in a unit of their own."""
_COLUMNS = ("load", "indicated", "std", "going", "series", "time")


def calibration_toml(calibration: CellCalibration) -> str:
    """Text of a calibration file."""
    lines = [
        "schema = 1",
        'kind = "calibration"',
        f"name = {json.dumps(calibration.name)}",
        f"date = {calibration.date.isoformat()}",
        f"device = {json.dumps(calibration.device)}",
        f"serial_number = {json.dumps(calibration.serial_number)}",
    ]
    if calibration.temperature is not None:
        lines.append(f"temperature = {_quantity(calibration.temperature, 'degC')}")
    lines += [
        f'direction = "{calibration.direction}"',
        f"low = {_quantity(calibration.low, 'N')}",
        f"high = {_quantity(calibration.high, 'N')}",
        f'unit = "{calibration.unit}"',
        "# true force in N = c0 + c1 x + c2 x^2, x the indicated gross value in this unit",
        f"coefficients = [{', '.join(f'{c:.{_DIGITS}g}' for c in calibration.coefficients)}]",
        f"residual_std = {_quantity(calibration.residual_std, 'N')}",
    ]
    for key in ("nonlinearity", "hysteresis", "zero_return", "repeatability"):
        value = getattr(calibration, key)
        if math.isfinite(value):
            lines.append(f"{key} = {value:.3g}             # of the span")
    for point in calibration.point:
        lines += ["", *_point(point, calibration.unit)]
    return "\n".join(lines) + "\n"


def tares_toml(book: TareBook) -> str:
    """Text of a bench's tare file."""
    lines = ["schema = 1", 'kind = "tares"', f"name = {json.dumps(book.name)}"]
    for name, tare in book.tare.items():
        unit = "m" if name.endswith(".length") else "N"
        lines += ["", f"[tare.{json.dumps(name)}]", *_tare(tare, unit)]
    return "\n".join(lines) + "\n"


def write_text(path: str | Path, text: str) -> Path:
    """Write a file atomically; raises FileError."""
    target = Path(path)
    write_whole(target, text.encode())
    return target


@dataclass(frozen=True)
class PointFile:
    """Points of a calibration, and the unit of their readings."""

    points: tuple[CalibrationPoint, ...]
    unit: str = "N"
    creep_shape: tuple[float, ...] = ()
    """Change of each point by a creep of the whole load, N; empty without times."""
    creep: FigureOfMerit | None = None
    """Between 1 and 30 minutes, as a share of the change of load; None without times."""


def read_points(path: str | Path) -> PointFile:
    """Read points of a calibration from a text file.

    Parameters
    ----------
    path
        File with the columns ``load`` in any unit of force or mass and ``indicated`` (or
        ``reading``) in such a unit or in counts, mV/V or V (counts without a unit); optional
        ``std``, ``going`` (up, down), ``series`` (1, 2, …) and ``time`` (with a unit, or stamps).
        Without ``going`` the direction follows from the order of the loads. Separator, decimal sign
        and encoding follow from the content.

    Returns
    -------
    PointFile
        In the order of the file. Readings that follow each other at one load are one point: their
        mean with its standard deviation.

    Raises
    ------
    FileError
        With every fault and its line.
    """
    data = read_whole(path_of(path), "file of points", _LARGEST)
    try:
        lines, _ = decode(data, str(path))
    except RunError as error:
        raise FileError(error.faults) from None
    dialect = find_dialect(lines)
    if dialect is not None and (doubt := doubt_of_commas(lines, dialect)):
        raise FileError(Fault(doubt, str(path)))
    delimiter, decimal = (",", ".") if dialect is None else (dialect.delimiter, dialect.decimal)
    rows = [
        (number, split_line(line, delimiter))
        for number, line in enumerate(lines, start=1)
        if line.strip() and not line.startswith("#")
    ]
    if not rows:
        raise FileError(Fault("is empty; it needs the columns load [kg], indicated [N]", str(path)))
    if all(not row[-1] for _, row in rows):
        rows = [(number, row[:-1]) for number, row in rows]
    columns, unit = _columns(rows[0][1], str(path), rows[0][0])
    faults: list[Fault] = []
    points: list[CalibrationPoint] = []
    times: list[float] = []
    for number, row in rows[1:]:
        try:
            points.append(_read_point(row, columns, points, decimal))
            times += [_read_time(row, columns, times, decimal)] if "time" in columns else []
        except (ValueError, IndexError) as error:
            faults.append(Fault(f"cannot be read: {error}", str(path), number))
    if faults:
        raise FileError(faults)
    stretches = _stretches(points) if "std" not in columns else [[k] for k in range(len(points))]
    found = points if "std" in columns else [_averaged(points, own) for own in stretches]
    if not times:
        return PointFile(tuple(found), unit)
    shape = creep_shape(points, times)
    means = tuple(float(np.mean(shape[own])) for own in stretches)
    return PointFile(tuple(found), unit, means, creep_within(points, shape, stretches))


def _stretches(points: Sequence[CalibrationPoint]) -> list[list[int]]:
    """Rows that follow each other at one load."""
    keys = [(point.load, point.series, point.going) for point in points]
    return [list(rows) for _, rows in groupby(range(len(points)), keys.__getitem__)]


def _averaged(points: Sequence[CalibrationPoint], rows: Sequence[int]) -> CalibrationPoint:
    """One point in place of several at one load."""
    values = [points[row].indicated for row in rows]
    std = statistics.stdev(values) / math.sqrt(len(rows)) if len(rows) > 1 else 0.0
    return dataclasses.replace(points[rows[0]], indicated=statistics.fmean(values), std=std)


def _columns(header: list[str], path: str, line: int) -> tuple[dict[str, tuple[int, float]], str]:
    """Index and SI value of the unit of each column; the unit of the readings."""
    found: dict[str, tuple[int, float]] = {}
    unit = "N"
    for place, title in enumerate(header):
        name, written = split_unit(title)
        name = name.lower()
        key = "indicated" if name == "reading" else name
        if key not in _COLUMNS:
            shape = "; the first line names them, e.g. load [kg],reading [counts], and each other "
            text = f"unknown column '{key}'; known are {', '.join(_COLUMNS)}"
            text += suggest(key, list(_COLUMNS)) or f"{shape}line is one reading"
            raise FileError(Fault(text, path, line))
        factor = 1.0
        if key in ("load", "indicated", "std"):
            known = read_unit(written)
            if known is not None and known.dimension in ("force", "mass"):
                factor = known.factor * (GRAVITY if known.dimension == "mass" else 1.0)
            elif key != "load" and (not written or (known and known.dimension in _RAW)):
                unit = (written or "counts") if key == "indicated" else unit
            else:
                given = f"the unknown unit '{written}'" if written else "no unit"
                message = f"column '{title.strip()}' has {given}; write {name} [N], [kg], [lb]"
                message += "" if key == "load" else ", [counts], [mV/V]"
                raise FileError(Fault(f"{message} or another unit of force or mass", path, line))
        if key == "time" and written:
            known = read_unit(written)
            if known is None or known.dimension != "time":
                raise FileError(
                    Fault(f"column '{title.strip()}' is in no unit of time", path, line)
                )
            factor = known.factor
        elif key == "time":
            factor = math.nan
        found[key] = (place, factor)
    missing = [key for key in ("load", "indicated") if key not in found]
    if missing:
        raise FileError(Fault(f"lacks the column {' and '.join(missing)}", path, line))
    return found, unit


def _read_time(
    row: list[str], columns: dict[str, tuple[int, float]], before: Sequence[float], decimal: str
) -> float:
    """Seconds of a number with a unit, or of a stamp; raises ValueError where they do not rise."""
    place, factor = columns["time"]
    text = row[place]
    number = float(read_stamps([text]).values[0]) if math.isnan(factor) else math.nan
    if not math.isnan(factor) and (value := read_number(text, decimal)) is not None:
        number = value * factor
    if not math.isfinite(number):
        raise ValueError(f"time '{text}' is neither a stamp nor a number with a unit, time [s]")
    if before and number <= before[-1]:
        raise ValueError(f"time '{text}' is not after that of the reading before")
    return number


def _read_point(
    row: list[str],
    columns: dict[str, tuple[int, float]],
    before: list[CalibrationPoint],
    decimal: str,
) -> CalibrationPoint:
    def number(key: str) -> float:
        place, factor = columns[key]
        value = read_number(row[place], decimal)
        if value is None or not math.isfinite(value):
            raise ValueError(f"{key} '{row[place]}' is no number")
        return value * factor

    load = number("load")
    series = int(row[columns["series"][0]]) if "series" in columns else 1
    going: Any = "up"
    if "going" in columns:
        going = row[columns["going"][0]].strip()
        if going not in ("up", "down"):
            raise ValueError(f"'{going}' is neither up nor down")
    elif before and before[-1].series == series:
        last = before[-1]
        going = (
            last.going if load == last.load else ("up" if abs(load) > abs(last.load) else "down")
        )
    std = number("std") if "std" in columns else 0.0
    return CalibrationPoint(load, number("indicated"), std, going, series)


def _point(point: CalibrationPoint, unit: str) -> Iterator[str]:
    yield "[[point]]"
    for field in dataclasses.fields(point):
        value = getattr(point, field.name)
        is_force = field.name == "load" or (unit == "N" and isinstance(value, float))
        text = f"{value:.{_DIGITS}g}" if isinstance(value, float) else json.dumps(value)
        yield f"{field.name} = " + (_quantity(value, "N") if is_force else text)


def _tare(tare: HostTare, unit: str) -> Iterator[str]:
    yield f"value = {_quantity(tare.value, unit)}"
    yield f"std = {_quantity(tare.std, unit)}"
    if isinstance(tare.taken, datetime):
        yield f"taken = {tare.taken.isoformat(timespec='seconds')}"


def _quantity(value: float, unit: str) -> str:
    return json.dumps(format_quantity(value, unit, _DIGITS))
