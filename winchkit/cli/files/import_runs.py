"""Runs of imported recordings: their joints and pieces, their files, and their findings."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from winchkit.cli.core.messages import note
from winchkit.cli.core.output import is_json
from winchkit.cli.files.import_table import together
from winchkit.errors import UsageError
from winchkit.regular_file import file_errors

if TYPE_CHECKING:
    from winchkit.runs.run import Run


def targets_in(
    files: Sequence[str], folder: Path, *, overwrite: bool, is_joined: bool
) -> list[Path]:
    """File of each run; raises UsageError rather than write over a recording."""
    from winchkit.runs.files import refuse_existing

    stems: list[str] = []
    for file in files:
        stem, number = Path(file).stem, 1
        while (name := stem if number == 1 else f"{stem}-{number}") in stems:
            number += 1
        stems.append(name)
    targets = [folder / f"{stem}.csv" for stem in (stems[:1] if is_joined else stems)]
    inputs = {Path(file).resolve() for file in files}
    for target in targets:
        if target.resolve() in inputs:
            raise UsageError(
                f"{target}: would replace the imported file; name another folder by -o"
            )
        refuse_existing(target, overwrite)
    return targets


def targets_of(
    results: Sequence[tuple[int, Run]], targets: Sequence[Path], *, overwrite: bool
) -> list[Path]:
    """File of each run; pieces of one recording have ``-piece1`` and so on behind its name."""
    from winchkit.runs.files import refuse_existing

    found = []
    for index, run in results:
        target = targets[index] if len(targets) > index else targets[0]
        if piece := run.metadata.get("piece", "").partition(" ")[0]:
            target = target.with_stem(f"{target.stem}-piece{piece}")
            refuse_existing(target, overwrite)
        found.append(target)
    return found


def inspected(runs: Sequence[Run]) -> list[dict[str, Any]]:
    """Findings on what came in; rows of poses without times have none."""
    from winchkit.runs.sanity.inspection import inspect_run

    timed = [run for run in runs if run.metadata.get("time") != "row number"]
    return [finding.to_json() for run in timed for finding in inspect_run(run).findings]


def write_runs(
    results: Sequence[tuple[int, Run]], targets: Sequence[Path], folder: Path
) -> list[dict[str, Any]]:
    """Write the runs; their paths to stdout, sizes and notes to stderr."""
    from winchkit.runs.info import summary_of
    from winchkit.runs.writer import write_run

    with file_errors(folder, "made"):
        folder.mkdir(parents=True, exist_ok=True)
    entries: list[dict[str, Any]] = []
    for (_, run), target in zip(results, targets, strict=True):
        write_run(run, target, replace=True)
        summary = summary_of(run)
        entries.append(
            {
                "path": target,
                "source": run.path,
                "summary": summary,
                "metadata": run.metadata,
                "channels": list(run),
                "notes": run.notes,
            }
        )
    notes = [(run.path, f"{remark} (warning)") for _, run in results for remark in run.notes]
    for line in together(notes):
        click.echo(line, err=True)
    for line in together((str(entry["path"]), entry["summary"].text) for entry in entries):
        note(line)
    for target in () if is_json() else targets:
        click.echo(str(target))
    return entries
