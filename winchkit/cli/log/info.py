"""``winchkit log info`` and ``recover``: the content of a log, and what is whole of one cut off."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import click

from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.messages import suggest_next
from winchkit.cli.core.options import RUN, output_option
from winchkit.cli.core.output import json_flag, tell
from winchkit.cli.core.standard_input import is_standard_input
from winchkit.cli.core.terminal import progress_bar
from winchkit.errors import UsageError, one_line

if TYPE_CHECKING:
    from winchkit.runs.info import LogInfo, SourceInfo

_SHOWN = 100
"""Characters of a metadata value that are shown; ``--json`` has all."""


@click.command(
    cls=ToolCommand,
    examples=("winchkit log info lift.mcap", "winchkit log info demo-10kg-1.csv --json"),
)
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=RUN)
@json_flag("Print everything as JSON.")
def command(files: tuple[str, ...]) -> None:
    """Summarise FILE: channels, rates, gaps, duration, counters, and whether it was closed.

    Several files are the parts of one log; so is FILE itself where only its parts exist.
    """
    from winchkit.runs.info import info_of
    from winchkit.runs.read import read_log

    with progress_bar() as progress:
        progress(f"reading {files[0]}", None)
        info = info_of(read_log(files))
    tell(vars(info), map(one_line, _lines(info)))


def _lines(info: LogInfo) -> list[str]:
    from winchkit.cli.core.terminal import HEADS, counter_rows

    closed = {True: "closed", False: "not closed", None: "CSV, which has no end mark"}[info.closed]
    started = f"started {info.begun}, " if info.begun else ""
    lines = [f"{info.path}: {started}{info.duration:.6g} s, {closed}"]
    lines += [f"  {note}" for note in info.notes]
    lines += [f"  {_source(item)}" for item in info.sources]
    lines += [f"  trip: {text}" for text in info.events]
    lines += [f"  tare of {text}" for text in info.tares]
    lines += [f"  commander of {text}" for text in info.commanders]
    for name, *cells in counter_rows(info.counters):
        counted = zip(HEADS.values(), cells, strict=True)
        lines.append(f"  {name}: " + ", ".join(f"{words} {cell}" for (_, words), cell in counted))
    lines += [f"  {key}: {_short(value)}" for key, value in info.metadata.items()]
    return lines


def _source(item: SourceInfo) -> str:
    from winchkit.runs.sanity.finding import counted

    parts = [f"{item.samples} samples"]
    if not math.isnan(item.rate):
        parts.append(f"{item.rate:.4g} Hz")
    longest = f" up to {item.longest_gap:.3g} s" if item.gaps else ""
    parts.append(f"{counted(item.gaps, 'gap')}{longest}")
    if item.missing:
        parts.append("NaN: " + ", ".join(f"{name} {n}" for name, n in item.missing.items()))
    if item.flagged:
        parts.append(f"{item.flagged} flagged")
    return f"{item.topic}: {', '.join(item.channels)}: {', '.join(parts)}"


def _short(text: str) -> str:
    shown = one_line(text)
    return shown if len(shown) <= _SHOWN else f"{shown[:_SHOWN]}…"


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit log recover cut.mcap",
        "winchkit log recover cut.mcap -o whole.mcap --json",
    ),
)
@click.argument("file", metavar="FILE", type=RUN)
@output_option("Where to; without it FILE with .recovered in its name.", "OUT")
@click.option("--replace", is_flag=True, help="Write over a file of that name.")
@json_flag("Print the result as JSON.")
def recover(*, file: str, output: str | None, replace: bool) -> None:
    """Save everything whole of FILE (.mcap or .csv), which stays as it is.

    Several logs that were joined in FILE are saved to a file each.
    """
    from winchkit.runs.recover import recover as save_whole

    if output is None and is_standard_input(file):
        raise UsageError("FILE -: the log from standard input is saved to a file with -o")
    found = save_whole(file, output, replace=replace)
    kind = "messages" if found.output.lower().endswith(".mcap") else "rows"
    logs = (found, *found.further)
    whole = "; the log was whole" if len(logs) > 1 else "; the file was whole"
    lines = (
        f"{one.output}: {one.kept} {kind} saved, {one.dropped_pieces} damaged pieces and "
        f"{one.dropped_bytes} bytes at the end left out" + (whole if one.was_whole else "")
        for one in logs
    )
    tell({"file": file, **vars(found)}, lines)
    suggest_next("log", "info", found.output)
