"""Reads a run from whichever format its name says."""

from __future__ import annotations

from pathlib import Path

from winchkit.errors import Fault, RunError
from winchkit.runs.csv_read import read_csv
from winchkit.runs.run import Run

__all__ = ["SUFFIXES", "read_run"]

SUFFIXES = (".csv", ".mcap")


def read_run(path: str | Path) -> Run:
    """Read a run from CSV or MCAP; raises RunError with every fault of the file."""
    suffix = Path(path).suffix.lower()
    if suffix == ".csv":
        return read_csv(path)
    if suffix == ".mcap":
        from winchkit.runs.mcap_read import read_mcap

        return read_mcap(path)
    message = f"'{suffix}' is no format of a run; use one of {', '.join(SUFFIXES)}"
    raise RunError(Fault(message, str(path)))
