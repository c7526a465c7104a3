"""Files of load cell calibrations and tares, and tables of points that were measured elsewhere."""

from __future__ import annotations

import csv
import dataclasses
import json
import math
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import Any

from winchkit.arguments import path_of
from winchkit.errors import Fault, FileError, UsageError
from winchkit.regular_file import regular
from winchkit.runs.files import write_whole
from winchkit.schema.calibration import CalibrationPoint, CellCalibration, HostTare, TareBook
from winchkit.units import GRAVITY, convert, format_quantity, suggest

__all__ = ["calibration_toml", "read_points", "tares_toml", "write_text"]

_DIGITS = 9
"""Significant digits: 1 mN in 1 MN is below the resolution of every indicator, so that reading back
changes nothing."""
_COLUMNS = ("load", "indicated", "std", "going", "series")


def calibration_toml(calibration: CellCalibration) -> str:
    """Text of a calibration file.

    Parameters
    ----------
    calibration : CellCalibration
        The calibration.

    Returns
    -------
    str
        TOML text.
    """
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
        "# true force = c0 + c1 x + c2 x^2, x the indicated gross value, both in N",
        f"coefficients = [{', '.join(f'{c:.{_DIGITS}g}' for c in calibration.coefficients)}]",
        f"residual_std = {_quantity(calibration.residual_std, 'N')}",
    ]
    for key in ("nonlinearity", "hysteresis", "repeatability"):
        value = getattr(calibration, key)
        if math.isfinite(value):
            lines.append(f"{key} = {value:.3g}             # of the span")
    for point in calibration.point:
        lines += ["", *_point(point)]
    return "\n".join(lines) + "\n"


def tares_toml(book: TareBook) -> str:
    """Text of a bench's tare file.

    Parameters
    ----------
    book : TareBook
        Tares of the host.

    Returns
    -------
    str
        TOML text.
    """
    lines = ["schema = 1", 'kind = "tares"', f"name = {json.dumps(book.name)}"]
    for name, tare in book.tare.items():
        unit = "m" if name.endswith(".length") else "N"
        lines += ["", f"[tare.{json.dumps(name)}]", *_tare(tare, unit)]
    return "\n".join(lines) + "\n"


def write_text(path: str | Path, text: str) -> Path:
    """Write a file atomically; raises FileError.

    Parameters
    ----------
    text : str
        Content.
    path : str or Path
        File, replaced atomically.

    Raises
    ------
    FileError
        Where the file cannot be written.
    """
    target = Path(path)
    write_whole(target, text.encode())
    return target


def read_points(path: str | Path) -> tuple[CalibrationPoint, ...]:
    """Read points of a calibration from a CSV file.

    Parameters
    ----------
    path
        File with the columns ``load [kg]`` or ``load [N]`` and ``indicated [N]`` (or ``reading``);
        optional ``std [N]``, ``going`` (up, down) and ``series`` (1, 2, …). Without ``going`` the
        direction follows from the order of the loads.

    Returns
    -------
    tuple of CalibrationPoint
        In the order of the file.

    Raises
    ------
    FileError
        With every fault and its line.
    """
    try:
        with open(path_of(path), newline="", encoding="utf-8-sig", opener=regular) as file:
            table = csv.reader(file)
            rows = [(table.line_num, row) for row in table if row and row[0][:1] != "#"]
    except FileNotFoundError:
        raise FileError(Fault("there is no such file", str(path))) from None
    except OSError as error:
        raise FileError(Fault(f"cannot be read: {error.strerror}", str(path))) from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise FileError(Fault(f"is no CSV text: {error}", str(path))) from None
    if not rows:
        raise FileError(Fault("is empty; it needs the columns load [kg], indicated [N]", str(path)))
    columns = _columns(rows[0][1], str(path))
    faults: list[Fault] = []
    points: list[CalibrationPoint] = []
    for number, row in rows[1:]:
        try:
            points.append(_read_point(row, columns, points))
        except (ValueError, IndexError) as error:
            faults.append(Fault(f"cannot be read: {error}", str(path), number))
    if faults:
        raise FileError(faults)
    return tuple(points)


def _columns(header: list[str], path: str) -> dict[str, tuple[int, str]]:
    """Index and unit of each column."""
    found: dict[str, tuple[int, str]] = {}
    for place, title in enumerate(header):
        name, _, unit = title.strip().partition("[")
        key = "indicated" if name.strip() == "reading" else name.strip()
        if key not in _COLUMNS:
            raise FileError(
                Fault(
                    f"unknown column '{key}'; known are {', '.join(_COLUMNS)}"
                    f"{suggest(key, list(_COLUMNS))}",
                    path,
                    1,
                )
            )
        found[key] = (place, unit.strip(" ]"))
    missing = [key for key in ("load", "indicated") if key not in found]
    if missing:
        raise FileError(Fault(f"lacks the column {' and '.join(missing)}", path, 1))
    for key in ("load", "indicated", "std"):
        if key in found:
            _force(1.0, found[key][1], path)
    return found


def _read_point(
    row: list[str], columns: dict[str, tuple[int, str]], before: list[CalibrationPoint]
) -> CalibrationPoint:
    def number(key: str) -> float:
        place, unit = columns[key]
        try:
            value = float(row[place])
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise ValueError(f"{key} '{row[place]}' is no number")
        return _force(value, unit, "")

    load = number("load")
    series = int(row[columns["series"][0]]) if "series" in columns else 1
    going: Any = "up"
    if "going" in columns:
        going = row[columns["going"][0]].strip()
        if going not in ("up", "down"):
            raise ValueError(f"'{going}' is neither up nor down")
    elif before and before[-1].series == series:
        last = before[-1]
        going = last.going if load == last.load else ("up" if load > last.load else "down")
    std = number("std") if "std" in columns else 0.0
    return CalibrationPoint(load, number("indicated"), std, going, series)


def _force(value: float, unit: str, path: str) -> float:
    if unit in ("kg", "g", "t"):
        return convert(value, unit, "mass") * GRAVITY
    try:
        return convert(value, unit, "force")
    except UsageError as error:
        raise FileError(Fault(f"{error} or kg", path, 1)) from None


def _point(point: CalibrationPoint) -> Iterator[str]:
    yield "[[point]]"
    for field in dataclasses.fields(point):
        value = getattr(point, field.name)
        yield f"{field.name} = " + (
            _quantity(value, "N") if isinstance(value, float) else json.dumps(value)
        )


def _tare(tare: HostTare, unit: str) -> Iterator[str]:
    yield f"value = {_quantity(tare.value, unit)}"
    yield f"std = {_quantity(tare.std, unit)}"
    if isinstance(tare.taken, datetime):
        yield f"taken = {tare.taken.isoformat(timespec='seconds')}"


def _quantity(value: float, unit: str) -> str:
    return json.dumps(format_quantity(value, unit, _DIGITS))
