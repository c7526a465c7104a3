"""Dates and times of day as texts, and numbers that count from an epoch, as seconds.

Absolute times are seconds since 1970-01-01 UTC; a stamp without a zone is taken as UTC.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta, timezone

import numpy as np

from winchkit.arrays import Array
from winchkit.schema.mapping import EXCEL

_CLOCK = (
    r"(?P<hour>\d{1,2}):(?P<minute>\d{2})(?::(?P<second>\d{2})(?:[.,:](?P<fraction>\d{1,12}))?)?"
    r"\s*(?P<half>[AaPp]\.?[Mm]\.?)?"
)
_DAY = (
    r"(?:(?P<year>\d{4})[-/.](?P<month>\d{1,2})[-/.](?P<day>\d{1,2})"
    r"|(?P<first>\d{1,2})(?P<mark>[./-])(?P<second_part>\d{1,2})[./-](?P<last>\d{4}|\d{2}))"
)
_ZONE = r"\s*(?P<zone>Z|UTC|GMT|[+-]\d{2}:?\d{2})?"
_PATTERNS = (
    re.compile(rf"{_DAY}[T\s,;_]+{_CLOCK}{_ZONE}"),
    re.compile(rf"{_CLOCK}{_ZONE}"),
    re.compile(r"(?P<minute>\d{1,3}):(?P<second>\d{2})[.,](?P<fraction>\d{1,12})"),
    re.compile(_DAY),
)
_NAMED = re.compile(r"[A-Za-z]{3,9}\.?,?\s+")


@dataclass(frozen=True)
class Epoch:
    """A way of counting time, by the numbers that only it has."""

    unit: str
    least: float
    most: float
    """Range of the numbers."""
    name: str = "1970"
    offset: float = 0.0
    """Of its zero, s since 1970."""
    is_assumed: bool = False
    """Whether numbers in the range may be of another clock."""


_EPOCHS = (
    Epoch("s", 3e8, 3.7e9),
    Epoch("s", 3.7e9, 4.3e9, "1904 (LabVIEW)", -2_082_844_800.0, is_assumed=True),
    Epoch("ms", 3e11, 4e12),
    Epoch("us", 3e14, 4e15),
    Epoch("100ns", 1.2e17, 1.6e17, "1601 (FILETIME of Windows)", -11_644_473_600.0, True),
    Epoch("ns", 3e17, 6.2e17),
    Epoch("100ns", 6.2e17, 6.6e17, "the year 1 (ticks of .NET)", -62_135_596_800.0, True),
    Epoch("ns", 6.6e17, 4e18),
)
"""Numbers of 1979 to 2087 since 1970; 2021 to 2040 since 1904, 1981 to 2108 since 1601, 1965 to
2092 since the year 1; other counters and clocks are smaller. Nanoseconds of 1989 and 1990 are taken
as ticks: no logger has both."""
_DAYS = {EXCEL: (30_000, 60_000), "d": (719_000, 770_000)}
"""Days since 1899-12-30 (1982 to 2064), and since the year 0 (datenum of MATLAB, 1968 to 2108)."""
_DATENUM = Epoch("d", *_DAYS["d"], "the year 0 (datenum)", -719_529 * 86_400.0, is_assumed=True)


@dataclass(frozen=True)
class Stamps:
    """Times of a column of text."""

    values: Array
    """Seconds: since 1970 where there is a date, since midnight for times of day; NaN."""
    wrong: tuple[int, ...]
    """Rows that are no stamp."""
    has_date: bool
    has_clock: bool


def is_stamp(cell: str) -> bool:
    """Whether a cell is a date, a time of day or both."""
    return _match(cell) is not None


def read_stamps(cells: Sequence[str]) -> Stamps:
    """Read a column of stamps.

    Days 3/4/2026 are day/month where any first number exceeds 12, else month/day; 3.4.2026 is
    day.month. Times of day that go back by more than 12 h start the next day.
    """
    found = [_match(cell) for cell in cells]
    day_first = any(int(m["first"]) > 12 for m in found if m and _group(m, "first"))
    values = np.full(len(cells), np.nan)
    wrong = []
    has_date = has_clock = False
    for row, (cell, match) in enumerate(zip(cells, found, strict=True)):
        if match is None:
            if cell.strip():
                wrong.append(row)
            continue
        try:
            values[row] = _seconds(match, day_first=day_first)
        except (ValueError, OverflowError):
            wrong.append(row)
            continue
        has_date |= bool(_group(match, "year") or _group(match, "first"))
        has_clock |= bool(_group(match, "minute"))
    if has_clock and not has_date:
        values = _over_midnight(values)
    return Stamps(values, tuple(wrong), has_date, has_clock)


def epoch_of(values: Array) -> Epoch | None:
    """Epoch from which a column (n,) counts; None for another clock, or days of a spreadsheet.

    Days are recognised where the numbers have fractions finer than 0.01 days.
    """
    finite = values[np.isfinite(values)]
    if not len(finite):
        return None
    low, high = float(finite.min()), float(finite.max())
    found = next((item for item in _EPOCHS if item.least <= low and high <= item.most), None)
    return found or (_DATENUM if _are_days(finite, "d") else None)


def epoch_unit(values: Array) -> str | None:
    """Unit in which a column (n,) counts from an epoch: ``s``, ``ms``, ``excel`` and so on."""
    epoch = epoch_of(values)
    if epoch is not None:
        return epoch.unit
    return EXCEL if _are_days(values[np.isfinite(values)], EXCEL) else None


def _are_days(finite: Array, unit: str) -> bool:
    least, most = _DAYS[unit]
    steps = np.abs(np.diff(finite))
    is_fine = len(steps) > 0 and 0 < float(np.median(steps)) < 0.01
    return is_fine and bool(np.all((least <= finite) & (finite <= most)) and np.ptp(finite) < 1.0)


def _match(cell: str) -> re.Match[str] | None:
    text = cell.strip().strip('"').strip()
    text = _NAMED.sub("", text, count=1) if text[:1].isalpha() else text
    return next((m for pattern in _PATTERNS if (m := pattern.fullmatch(text))), None)


def _group(match: re.Match[str], name: str) -> str:
    return match.groupdict().get(name) or ""


def _seconds(match: re.Match[str], *, day_first: bool) -> float:
    clock = 0.0
    if _group(match, "minute") and not _group(match, "hour"):
        seconds = float(f"{match['second']}.{match['fraction']}")
        return 60.0 * int(match["minute"]) + seconds
    if hour := _group(match, "hour"):
        hours = int(hour)
        if half := _group(match, "half").lower():
            hours = hours % 12 + (12 if half.startswith("p") else 0)
        if hours > 24 or int(match["minute"]) > 59 or int(_group(match, "second") or 0) > 60:
            raise ValueError
        fraction = _group(match, "fraction")
        clock = hours * 3600 + int(match["minute"]) * 60 + int(_group(match, "second") or 0)
        clock += int(fraction) / 10 ** len(fraction) if fraction else 0.0
    day = _day(match, day_first=day_first)
    if day is None:
        return clock
    start = datetime(day.year, day.month, day.day, tzinfo=_zone(_group(match, "zone")))
    return start.timestamp() + clock


def _day(match: re.Match[str], *, day_first: bool) -> date | None:
    if year := _group(match, "year"):
        return date(int(year), int(match["month"]), int(match["day"]))
    if first := _group(match, "first"):
        last = int(match["last"])
        last += 2000 if last < 100 else 0
        one, two = int(first), int(match["second_part"])
        is_day_first = day_first or match["mark"] == "."
        return date(last, two, one) if is_day_first else date(last, one, two)
    return None


def _zone(text: str) -> timezone:
    if not text or text[0] not in "+-":
        return UTC
    hours, minutes = int(text[1:3]), int(text[-2:])
    offset = timedelta(hours=hours, minutes=minutes)
    return timezone(-offset if text[0] == "-" else offset)


def _over_midnight(values: Array) -> Array:
    """Times of day with 24 h added after each return to the start of a day."""
    finite = np.flatnonzero(np.isfinite(values))
    if len(finite) < 2:
        return values
    days = np.concatenate(([0], np.cumsum(np.diff(values[finite]) < -43_200)))
    shifted = values.copy()
    shifted[finite] += 86_400.0 * days
    return shifted
