"""Runs of imported recordings: their joints and pieces, their files, and their findings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from winchkit.cli.core.messages import note
from winchkit.cli.core.output import is_json
from winchkit.errors import Fault, FileError, RunError, UsageError, one_line

if TYPE_CHECKING:
    from winchkit.runs.importing.assignment import Guess
    from winchkit.runs.importing.clocks.joint import Joint
    from winchkit.runs.importing.streams import Streams
    from winchkit.runs.run import Run
    from winchkit.schema.mapping import ImportMapping


def identity(mapping: ImportMapping) -> str:
    """Identity of a mapping, in the metadata of its runs."""
    from winchkit.runs.importing.mapping import mapping_id

    return mapping_id(mapping)


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


@dataclass(frozen=True)
class RunMetadata:
    """What the metadata of the runs are made of."""

    guesses: Sequence[Guess]
    mapping: ImportMapping
    masses: Sequence[str | None]

    def of(self, indices: Sequence[int]) -> dict[str, str]:
        """Metadata of the run of one file, or of several that were joined."""
        from winchkit.runs.importing.runs import metadata_of

        more = {"imported_mapping": identity(self.mapping)}
        merged: dict[str, str] = {}
        for index in indices:
            for key, value in metadata_of(self.guesses[index], more).items():
                if key in {"imported_from", "imported_format"} and key in merged:
                    merged[key] += f" + {value}"
                else:
                    merged.setdefault(key, value)
        if (mass := self.masses[indices[0]]) is not None:
            merged["load_mass"] = mass
        return merged


def runs_of(
    files: Sequence[str],
    parts: Sequence[Streams],
    metadata: RunMetadata,
    *,
    is_joined: bool,
    lag: float | None,
) -> tuple[list[tuple[int, Run]], tuple[Joint, ...]]:
    """Runs with the index of their file; files without a motor angle are joined to the one with."""
    from winchkit.runs.importing.clocks.joint import joined
    from winchkit.runs.importing.runs import has_angle, with_angle

    if not any(has_angle(part) for part in parts):
        parts = [with_angle(part) for part in parts]
    angles = [index for index, part in enumerate(parts) if has_angle(part)]
    others = [index for index in range(len(parts)) if index not in angles]
    if others and angles and (len(angles) == 1 or is_joined):
        is_joined = True
    elif others and angles and len(parts) > 1 and not is_joined:
        names = ", ".join(files[index] for index in others)
        raise UsageError(
            f"{names}: no motor angle; import each with the one file that it belongs to, by --join"
        )
    if not is_joined or len(parts) == 1:
        faults: list[Fault] = []
        results = []
        for index, part in enumerate(parts):
            try:
                results += [(index, run) for run in _pieces(part, metadata.of([index]))]
            except RunError as error:
                faults += error.faults
        if faults:
            raise RunError(faults)
        return results, ()
    order = [*angles[:1], *(index for index in range(len(parts)) if index not in angles[:1])]
    whole, joints = joined([parts[index] for index in order], lag)
    texts = metadata.of(order)
    texts["joined"] = "; ".join(joint.text.replace(":", " ") for joint in joints)
    return [(order[0], run) for run in _pieces(whole, texts)], joints


def _pieces(streams: Streams, metadata: Mapping[str, str]) -> list[Run]:
    """The run of a file, or those before and after every jump of its motor angle."""
    from winchkit.runs.importing.pieces import jumps_of, pieces_of
    from winchkit.runs.importing.runs import run_of

    jumps = jumps_of(streams)
    for jump in jumps:
        text = f"{jump.text}; the pieces before and after it are runs of their own"
        click.echo(f"{one_line(streams.path)}: {text} (warning)", err=True)
    pieces = pieces_of(streams, jumps)
    if len(pieces) == 1:
        return [run_of(pieces[0], metadata)]
    return [
        run_of(piece, {**metadata, "piece": f"{number} of {len(pieces)}"})
        for number, piece in enumerate(pieces, start=1)
    ]


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

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(Fault(f"cannot be made: {error.strerror}", str(folder))) from None
    entries = []
    for (_, run), target in zip(results, targets, strict=True):
        write_run(run, target)
        summary = summary_of(run)
        for remark in run.notes:
            click.echo(f"{run.path}: {remark} (warning)", err=True)
        note(f"{target}: {summary.text}")
        if not is_json():
            click.echo(str(target))
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
    return entries
