"""Runs: recordings of named channels with units and metadata, read from and written to files."""

from winchkit.runs.read import read_run
from winchkit.runs.run import Channel, Run
from winchkit.runs.writer import RunWriter, open_writer, write_csv, write_mcap, write_run

__all__ = [
    "Channel",
    "Run",
    "RunWriter",
    "open_writer",
    "read_run",
    "write_csv",
    "write_mcap",
    "write_run",
]
