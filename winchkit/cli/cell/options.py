"""Options and output that the commands of ``winchkit cell`` have in common."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from math import isnan
from typing import TYPE_CHECKING, Any

import click

from winchkit.cli.core.completion import complete_winch
from winchkit.cli.core.options import all_of, bench_option
from winchkit.cli.core.output import json_flag

if TYPE_CHECKING:
    from winchkit.bench.cells.tasks import BenchCells

_UNITS = {"cell": "N", "load": "N", "length": "m", "temperature": "degC"}


cell_options = all_of(
    click.argument("cell", required=False, shell_complete=complete_winch),
    bench_option,
    json_flag("Print the result as JSON."),
)


@contextmanager
def cells(bench: str, cell: str | None) -> Iterator[tuple[BenchCells, str]]:
    """The instruments of a bench, and the full name of the one that is meant."""
    from winchkit.bench.cells.desk import full_name
    from winchkit.bench.remote.cell_session import at_cells
    from winchkit.schema.read import read_bench

    name = full_name(read_bench(bench), cell)
    with at_cells(bench) as found:
        yield found, name


def unit_of(name: str) -> str:
    """SI unit of an instrument by its role."""
    return _UNITS[name.rpartition(".")[2]]


def shown(value: float, unit: str, digits: int = 5) -> str:
    """A value for people; ``unknown`` for NaN."""
    return "unknown" if isnan(value) else f"{value:.{digits}g} {unit}".rstrip()


def host_tare_note(result: dict[str, Any], unit: str) -> list[str]:
    """That the host's tare is still taken off, where a device has zeroed or tared itself."""
    tare = result["host_tare"]
    if not tare:
        return []
    return [
        f"  the host's own tare of {shown(tare, unit)} is still taken off; "
        "`winchkit cell tare --clear` takes it away"
    ]
