"""Runs: recordings of named channels with units and metadata.

``formats`` reads and writes files, ``recording`` writes logs of a bench while they grow, ``sanity``
tests channels before any analysis, ``importing`` reads recordings of other programs.
"""

from winchkit.runs.read import read_run
from winchkit.runs.run import Channel, Run
from winchkit.runs.run_writer import RunWriter
from winchkit.runs.writer import open_writer, write_run

__all__ = [
    "Channel",
    "Run",
    "RunWriter",
    "open_writer",
    "read_run",
    "write_run",
]
