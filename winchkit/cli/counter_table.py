"""What was counted, as a table: one row per instrument."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from winchkit.cli.core.terminal import cell

if TYPE_CHECKING:
    from rich.table import Table

__all__ = ["HEADS", "counter_rows", "counter_table"]

HEADS: dict[str, tuple[str, str]] = {
    "rate": ("Hz", "rate in Hz"),
    "readings": ("read", "readings"),
    "drops": ("drop", "drops"),
    "duplicates": ("dup", "duplicates"),
    "crc": ("CRC", "CRC errors"),
    "timeouts": ("t/o", "timeouts"),
    "late": ("late", "late replies"),
    "resynchronised": ("sync", "resynchronised bytes"),
    "reconnects": ("recon", "reconnects"),
    "latency": ("p50/p99/max ms", "latency p50/p99/max in ms"),
}
"""Short head and full words by counter."""
_LOG = "log"


def counter_rows(counters: Mapping[str, Mapping[str, Any]]) -> list[list[str]]:
    """A row of texts per instrument, in the order of :data:`HEADS` after the name."""
    return [
        [name, *(_text(key, counted.get(key)) for key in HEADS)]
        for name, counted in counters.items()
        if name != _LOG
    ]


def counter_table(counters: Mapping[str, Mapping[str, Any]]) -> Table:
    """All of them, with the log itself below."""
    from rich.table import Table

    log = counters.get(_LOG, {})
    table = Table(
        box=None, caption=", ".join(f"{key} {value}" for key, value in log.items()) or None
    )
    table.add_column("instrument")
    for head, _ in HEADS.values():
        table.add_column(head, justify="right", no_wrap=True)
    for row in counter_rows(counters):
        table.add_row(*map(cell, row))
    return table


def _text(key: str, value: Any) -> str:
    if key == "latency":
        times = (value or {}).values()
        return "/".join(_number(item, 1e3) for item in times) if times else "—"
    if key == "rate":
        return _number(value, 1.0)
    return "—" if value is None else str(value)


def _number(value: float | None, factor: float) -> str:
    return "—" if value is None or math.isnan(value) else f"{value * factor:.3g}"
