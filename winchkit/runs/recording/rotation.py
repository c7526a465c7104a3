"""Rotation of logs: size or duration of parts, and their names."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from winchkit.errors import UsageError
from winchkit.units import UNITS, parse

_BYTES = {"kB": 1e3, "MB": 1e6, "GB": 1e9}
_LIMIT = re.compile(r"\s*([0-9.]+)\s*([A-Za-z]+)\s*")
_SMALLEST, _SHORTEST = 10e3, 1.0
"""Bytes and s of a part: below, a log would consist of headers."""


@dataclass(frozen=True)
class Rotation:
    """Size (bytes) or duration (s) at which a part ends."""

    size: float = float("inf")
    duration: float = float("inf")

    @classmethod
    def parse(cls, text: str) -> Self:
        """Read ``100MB`` or ``10 min``; raises UsageError."""
        found = _LIMIT.fullmatch(text)
        number, unit = found.groups() if found else ("", "")
        if unit in _BYTES:
            size = parse(f"{number} m", "length") * _BYTES[unit]
            if size < _SMALLEST:
                raise UsageError(f"parts of '{text}' are too small; the minimum is 10 kB")
            return cls(size=size)
        if unit in UNITS["time"]:
            duration = parse(f"{number} {unit}", "time")
            if duration < _SHORTEST:
                raise UsageError(f"parts of '{text}' are too short; the minimum is 1 s")
            return cls(duration=duration)
        raise UsageError(f"'{text}' is not a size of a part; write e.g. 100MB or 10min")

    def due(self, size: float, duration: float) -> bool:
        """Whether a part of this size and duration has to end."""
        return size >= self.size or duration >= self.duration


def part_path(path: Path, number: int) -> Path:
    """``lift.mcap`` becomes ``lift.001.mcap``."""
    return path.with_suffix(f".{number:03d}{path.suffix}")


def parts_beside(path: Path) -> list[Path]:
    """The parts ``lift.001.mcap``, ``lift.002.mcap`` … of ``lift.mcap``, in order."""
    pattern = re.compile(re.escape(path.stem) + r"\.(\d{3,})" + re.escape(path.suffix))
    found = [(pattern.fullmatch(item.name), item) for item in path.parent.glob(f"*{path.suffix}")]
    return [item for match, item in sorted((int(m[1]), p) for m, p in found if m)]
