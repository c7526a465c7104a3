"""``winchkit import``: recordings of other programs to runs, with a mapping for the next time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.messages import is_quiet, note, suggest_next
from winchkit.cli.core.options import TABLE, device_option, output_option
from winchkit.cli.core.output import echo_json, is_json, json_flag
from winchkit.cli.core.quantity_type import QuantityType, naming
from winchkit.cli.core.standard_input import may_ask
from winchkit.cli.core.terminal import progress_bar
from winchkit.cli.files.import_table import asked, together
from winchkit.errors import FileError, RunError, UsageError, of_each
from winchkit.regular_file import file_errors

if TYPE_CHECKING:
    from winchkit.runs.importing.assignment import Guess
    from winchkit.runs.importing.table import ColumnTable
    from winchkit.runs.run import Run
    from winchkit.schema.mapping import ImportMapping


def targets_in(
    files: Sequence[str], folder: Path, *, overwrite: bool, is_joined: bool
) -> list[Path]:
    """File of each run; raises UsageError rather than write over a recording."""
    from winchkit.regular_file import refuse_existing

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
    from winchkit.regular_file import refuse_existing

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


_MAPPING = "mapping.toml"


class _Written(QuantityType):
    """A quantity as people write it, ``2,4 Nm``, in winchkit's spelling."""

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> str:
        """The text with a decimal point and the unit as winchkit spells it."""
        from winchkit.runs.importing.answers import as_ours

        try:
            text = as_ours(str(value), self.dimensions[0])
        except UsageError as error:
            raise UsageError(f"{naming(param)}: {error}") from None
        return super().convert(text, param, ctx)


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit import logger.csv",
        "winchkit import logger.csv -o runs -y --load-mass '10 kg'",
        "winchkit import logger.csv -o runs --mapping mapping.toml",
    ),
)
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=TABLE)
@output_option("Folder of the runs; without it, only look.", "DIR")
@click.option("-y", "--yes", is_flag=True, help="Accept the guess.")
@click.option(
    "--mapping", metavar="FILE", type=TABLE, help="Channels and units of an earlier import."
)
@click.option(
    "--save-mapping", metavar="FILE", help=f"Where to save them; by default DIR/{_MAPPING}."
)
@click.option(
    "-c",
    "--column",
    "columns",
    multiple=True,
    metavar="CHANNEL=COLUMN",
    help="Column of a channel, by name or number, e.g. 'motor_angle=Pos [deg]', "
    "'motor_torque=u*35.1', '-Iq [A]' with the other sign, '(tau_a-tau_b)/2' of several columns, "
    "'FILE:tension=2 [N]' of one file; nothing after = for none. May be given several times.",
)
@click.option(
    "--rated-torque",
    metavar="TORQUE",
    type=_Written("torque", example="2.4 N m"),
    help="Torque of 100 %, e.g. '2.4 N m'.",
)
@click.option(
    "--torque-constant",
    metavar="CONSTANT",
    type=_Written("torque constant", example="0.12 N m/A"),
    help="Torque constant of the motor, e.g. '0.12 N m/A'.",
)
@click.option("--counts-per-turn", type=float, metavar="N", help="Counts in a turn of the motor.")
@click.option(
    "--sensitivity", metavar="RATIO", help="Rated output of the load cell, e.g. '2 mV/V'."
)
@click.option(
    "--capacity",
    metavar="FORCE",
    type=_Written("force", example="500 N"),
    help="Rated load of the load cell, e.g. '500 N'.",
)
@click.option(
    "--sample-rate",
    metavar="RATE",
    type=_Written("frequency", example="1 kHz"),
    help="Rate of the rows, in place of times, e.g. '1 kHz'; of several files, of those that have "
    "none.",
)
@click.option(
    "--axis",
    metavar="COLUMN",
    help="Column that names the axis, where each row is of one axis; '' where it is not.",
)
@click.option(
    "--kind",
    metavar="COLUMN",
    help="Column that names the kind of each row, where rows have different quantities.",
)
@click.option(
    "--unsigned",
    multiple=True,
    metavar="COLUMN",
    help="Column that has no sign, where one seems to be lost; may be given several times.",
)
@click.option(
    "--signed",
    multiple=True,
    metavar="COLUMN",
    help="Column whose sign is lost: it is restored; may be given several times.",
)
@click.option(
    "--modulo",
    multiple=True,
    metavar="COLUMN=NUMBER",
    help="Number at which a column wraps, e.g. 'Position=65536'; 0 where it does not.",
)
@click.option(
    "--orientation",
    type=click.Choice(("vector", "angles", "xyz", "wxyz", "xyzw")),
    help="What rx, ry, rz are (rotation vector, angles of Rz Ry Rx, or of Rx Ry Rz), or the order "
    "of q0 to q3.",
)
@click.option(
    "--motion",
    type=click.Choice(("rotary", "linear")),
    help="Whether the axis has an angle and a torque, or a position and a force.",
)
@click.option("--body", metavar="NAME", help="Body or marker of a tracker's export.")
@click.option(
    "--load-mass",
    "load_masses",
    multiple=True,
    metavar="MASS",
    type=QuantityType("mass", example="10 kg"),
    help="Mass on the cable, e.g. '10 kg': one for all runs, or one for each FILE in order.",
)
@device_option
@click.option("--join", is_flag=True, help="Join all FILEs to one run.")
@click.option(
    "--lag",
    metavar="TIME",
    type=QuantityType("time", example="-0.02 s", signed=True),
    help="Clock of the first FILE less that of the others; '0 s': one clock.",
)
@click.option("--replace", "overwrite", is_flag=True, help="Write over earlier runs.")
@json_flag("Print columns, joints and runs as JSON.")
def command(
    *,
    files: tuple[str, ...],
    output: str | None,
    yes: bool,
    mapping: str | None,
    save_mapping: str | None,
    load_masses: tuple[str, ...],
    devices: tuple[str, ...],
    join: bool,
    lag: str | None,
    overwrite: bool,
    **options: Any,
) -> None:
    """Import recordings of other programs as runs in DIR, one for each FILE.

    Reads text (any delimiter and decimal sign), JSON, XLSX, MAT, HDF5, Parquet, NPY, NPZ, MCAP,
    MDF, TDMS and exports of trackers. Guesses columns and units, shows the guess, and asks what it
    cannot know; without a terminal it ends with 2 and names the options that answer. The mapping
    that it saves makes the next import silent. A FILE without a motor angle is joined to the one
    that has it, by its time stamps or by cross-correlation (docs/howto/logger.md).
    """
    from winchkit.cli.files.import_table import alike, entry_of, tables_text
    from winchkit.runs.importing.answers import read_answers
    from winchkit.runs.importing.mapping import mapping_id
    from winchkit.runs.importing.session import guesses_of, mapping_from, runs_of
    from winchkit.schema.read import read_mapping

    masses = _masses(load_masses, len(files))
    tables = _tables(files, devices)
    declared = None if mapping is None else read_mapping(mapping)
    ask = asked if may_ask() and not yes else None
    guesses = guesses_of(tables, read_answers(options), declared, ask)
    is_new = declared is None
    report: dict[str, Any] = {
        "schema": 1,
        "files": [entry_of(guess) for guess in guesses],
        "joints": [],
        "mapping": mapping,
        "mapping_id": None,
        "runs": [],
        "sanity": [],
    }
    shown = "\n\n".join(tables_text(group) for group in alike(guesses))
    if is_new and not is_json() and (output is None or not is_quiet()):
        click.echo(shown, err=output is not None)
    elif is_new and not is_json():
        notes = [(g.table.path, note) for g in guesses for note in (*g.table.notes, *g.notes)]
        _tell((path, f"{text} (warning)") for path, text in notes)
    if output is None:
        if is_json():
            echo_json(report)
        return
    target = Path(save_mapping or Path(output) / _MAPPING) if is_new or save_mapping else None
    is_open = any(guess.questions for guess in guesses)
    if is_open or (is_new and not _is_accepted(guesses, yes)):
        if is_json():
            echo_json(report)
        raise UsageError(_unanswered(guesses))
    mapping_file = declared or mapping_from(guesses)
    is_saved = target is not None and _is_saved(mapping_file, target)
    if target is not None and not is_saved and not overwrite:
        _refuse_to_replace(target)
    targets = targets_in(files, Path(output), overwrite=overwrite, is_joined=join)
    with progress_bar() as progress:
        progress("converting", None)
        found = runs_of(guesses, mapping_file, masses=masses, join=join, lag=_lag(lag))
        results, joints = found.runs, found.joints
        report["joints"], report["mapping_id"] = joints, mapping_id(mapping_file)
        targets = targets_of(results, targets, overwrite=overwrite)
        report["sanity"] = inspected([run for _, run in results])
    _tell((jump.path, f"{jump.message} (warning)") for jump in found.jumps)
    for joint in joints:
        note(f"{joint.path}: {joint.text}")
    _tell((item["run"], f"{item['channel']}: {item['text']}") for item in report["sanity"])
    report["runs"] = write_runs(results, targets, Path(output))
    if target is not None:
        report["mapping"] = str(target) if is_saved else _saved(mapping_file, target)
    if is_json():
        echo_json(report)
    suggest_next("check", [str(entry["path"]) for entry in report["runs"]])


def _tell(pairs: Iterable[tuple[str, str]]) -> None:
    """Texts on files, each different one once."""
    for line in together(pairs):
        click.echo(line, err=True)


def _masses(texts: Sequence[str], count: int) -> list[str | None]:
    from winchkit.cli.core.quantities import quantity

    for text in texts:
        if quantity(text, "mass") < 0:
            raise UsageError(f"--load-mass '{text}' is below 0")
    if len(texts) not in {0, 1, count}:
        raise UsageError(f"{len(texts)} --load-mass for {count} files; give one, or one for each")
    kept = [f"{quantity(text, 'mass'):.12g} kg" for text in texts]
    return [kept[0]] * count if len(kept) == 1 else [*kept] or [None] * count


def _lag(text: str | None) -> float | None:
    from winchkit.cli.core.quantities import quantity

    if text is None:
        return None
    negative = text.strip().startswith("-")
    value = quantity(text.strip().lstrip("-+"), "time")
    return -value if negative else value


def _tables(files: Sequence[str], devices: Sequence[str]) -> list[ColumnTable]:
    """Columns of every file, those of traces of CAN frames by their devices; all faults at once."""
    from winchkit.can_trace import trace_advice
    from winchkit.cli.files.import_trace import read_trace_table
    from winchkit.runs.importing.formats.source import read_table

    def read(file: str) -> ColumnTable:
        is_trace = bool(devices) and bool(trace_advice(Path(file)))
        return read_trace_table(file, devices) if is_trace else read_table(file)

    tables = of_each(read, files, RunError)
    if devices and not any(table.layout.startswith("trace of CAN frames") for table in tables):
        raise UsageError("--device is of traces of CAN frames, and no FILE is one")
    return tables


def _is_accepted(guesses: Sequence[Guess], yes: bool) -> bool:
    from winchkit.runs.importing.session import are_integrated

    if yes or (all(guess.is_certain for guess in guesses) and not are_integrated(guesses)):
        return True
    if not may_ask():
        return False
    return click.confirm("Import as shown?", default=True, abort=True, err=True)


def _unanswered(guesses: Sequence[Guess]) -> str:
    """Message on what is not known, with the options that answer; what several files ask, once."""
    from winchkit.runs.importing.session import NO_ANGLE, are_integrated

    asking: list[tuple[str, str]] = []
    for guess in guesses:
        texts = [f"{q.text}: {' or '.join(q.options)}" for q in guess.questions] or [
            f"'{item.source}' as {item.channel} [{item.unit}] is {item.confidence} ({item.reason})"
            for item in guess.used
            if item.confidence in {"derived", "assumed"}
        ]
        asking += [(guess.table.path, text) for text in texts]
    lines = [f"  {line}" for line in together(asking)]
    if any(NO_ANGLE in guess.notes for guess in guesses):
        lines.append(f"  {NO_ANGLE}")
    if any(guess.questions for guess in guesses):
        return "\n".join(["not known, and no terminal to ask; give", *lines])
    if are_integrated(guesses):
        lines.append("  no column has the motor angle: it is the integral of motor_velocity from 0")
    accept = 'accept the guess by --yes, or correct it by --column "CHANNEL=COLUMN [UNIT]":'
    return "\n".join([accept, *lines])


def _is_saved(mapping: ImportMapping, path: Path) -> bool:
    """Whether a file has all logs of a mapping, under any names."""
    from winchkit.schema.read import read_mapping

    try:
        there = read_mapping(path).log if path.is_file() else ()
    except (FileError, UsageError):
        return False
    known = [replace(log, name="") for log in there]
    return bool(there) and all(replace(log, name="") in known for log in mapping.log)


def _refuse_to_replace(path: Path) -> None:
    """Raise UsageError for a mapping of other columns, or another file, that is there."""
    if path.exists():
        raise UsageError(
            f"{path} exists already, with other columns or units; name another file by "
            "--save-mapping, or write over it by --replace"
        )


def _saved(mapping: ImportMapping, path: Path) -> str:
    from winchkit.runs.importing.mapping import write_mapping

    write_mapping(mapping, path)
    note(f"mapping: {path}")
    return str(path)
