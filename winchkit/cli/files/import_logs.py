"""``winchkit import``: recordings of other programs to runs, with a mapping for the next time."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from winchkit.cli.core.command import Command
from winchkit.cli.core.messages import is_quiet, note, suggest_next
from winchkit.cli.core.options import TABLE, device_option, output_option
from winchkit.cli.core.output import echo_json, is_json, json_flag
from winchkit.cli.core.quantity_type import Quantity, naming
from winchkit.cli.core.terminal import progress_bar
from winchkit.cli.files.import_dialogue import asked
from winchkit.cli.files.import_runs import (
    RunMetadata,
    identity,
    inspected,
    runs_of,
    targets_in,
    targets_of,
    write_runs,
)
from winchkit.cli.files.import_table import shortened
from winchkit.errors import Fault, FileError, RunError, UsageError, one_line

if TYPE_CHECKING:
    from winchkit.runs.importing.answers import Answers
    from winchkit.runs.importing.assignment import Guess
    from winchkit.runs.importing.table import Table
    from winchkit.schema.mapping import ImportMapping

_MAPPING = "mapping.toml"
_CELL_ALONE = (
    "no column is the motor angle or velocity: a run of a load cell alone, for `winchkit cell "
    "diagnose --run`; import the file together with the one that has the angle, or name it by "
    '--column "motor_angle=COLUMN [deg]", for a run of a winch'
)
_ANGLES = {"motor_angle", "position"}
_NO_ANGLE = (
    "no column is the motor angle or velocity, without which there is no run: name it by --column "
    '"motor_angle=COLUMN [deg]", or import the file together with the one that has it'
)


class _Written(Quantity):
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
    cls=Command,
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
    "'motor_torque=u*35.1', '-Iq [A]' with the other sign, 'tau_a-tau_b' of several columns, "
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
    type=Quantity("mass", example="10 kg"),
    help="Mass on the cable, e.g. '10 kg': one for all runs, or one for each FILE in order.",
)
@device_option
@click.option("--join", is_flag=True, help="Join all FILEs to one run.")
@click.option(
    "--lag",
    metavar="TIME",
    type=Quantity("time", example="-0.02 s", signed=True),
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
    from winchkit.runs.importing.streams import streams_of

    masses = _masses(load_masses, len(files))
    tables = _tables(files, devices)
    guesses, declared = _guesses(tables, mapping, _answers(options), asking=_may_ask(yes))
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
        _warn(guesses)
    if output is None:
        if is_json():
            echo_json(report)
        return
    is_open = any(guess.questions for guess in guesses)
    if is_open or (is_new and not _is_accepted(guesses, yes)):
        if is_json():
            echo_json(report)
        raise UsageError(_unanswered(guesses))
    mapping_file = declared or _mapping_of(files, guesses)
    targets = targets_in(files, Path(output), overwrite=overwrite, is_joined=join)
    with progress_bar() as progress:
        progress("converting", None)
        results, joints = runs_of(
            files,
            [streams_of(guess) for guess in guesses],
            RunMetadata(guesses, mapping_file, masses),
            is_joined=join,
            lag=_lag(lag),
        )
        report["joints"], report["mapping_id"] = joints, identity(mapping_file)
        targets = targets_of(results, targets, overwrite=overwrite)
        report["sanity"] = inspected([run for _, run in results])
    for joint in joints:
        note(f"{joint.path}: {joint.text}")
    told: dict[str, list[str]] = {}
    for finding in report["sanity"]:
        told.setdefault(f"{finding['channel']}: {finding['text']}", []).append(finding["run"])
    for text, names in told.items():
        click.echo(f"{shortened(list(dict.fromkeys(names)))}: {text}", err=True)
    report["runs"] = write_runs(results, targets, Path(output))
    if is_new or save_mapping:
        report["mapping"] = _saved(mapping_file, save_mapping or str(Path(output) / _MAPPING))
    if is_json():
        echo_json(report)
    suggest_next("check", [str(entry["path"]) for entry in report["runs"]])


def _warn(guesses: Sequence[Guess]) -> None:
    """Notes on what was read, without the table; what several files have, once."""
    found: dict[str, list[str]] = {}
    for guess in guesses:
        for text in (*guess.table.notes, *guess.notes):
            found.setdefault(text, []).append(one_line(guess.table.path))
    for text, paths in found.items():
        click.echo(f"{shortened(paths)}: {text} (warning)", err=True)


def _may_ask(yes: bool) -> bool:
    """Whether somebody can answer: a terminal, and no request for silence."""
    return not yes and not is_json() and sys.stdin.isatty() and sys.stderr.isatty()


def _answers(options: Mapping[str, Any]) -> Answers:
    """Answers of the command line in SI; raises UsageError."""
    from winchkit.runs.importing.answers import (
        CONSTANTS,
        Answers,
        read_column,
        read_constant,
        read_modulo,
    )

    constants: dict[str, Any] = {
        key: read_constant(key, str(options[key])) for key in CONSTANTS if options[key] is not None
    }
    try:
        columns = tuple(read_column(text) for text in options["columns"])
    except UsageError as error:
        raise UsageError(f"--column: {error}") from None
    pairs = [(item.channel, item.source, item.file) for item in columns if item.source]
    for pair in dict.fromkeys(pairs):
        channel, source, _ = pair
        if pairs.count(pair) > 1:
            raise UsageError(f"--column: {channel}={source} is given twice; give it once")
    own = Answers(
        columns=columns,
        body=options["body"],
        orientation=options["orientation"] or "",
        axis=options["axis"],
        motion=options["motion"] or "",
        kind=options["kind"] or "",
        unsigned=tuple(options["unsigned"]),
        signed=tuple(options["signed"]),
        modulo=tuple(map(read_modulo, options["modulo"])),
    )
    return replace(own, **constants)


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


def _tables(files: Sequence[str], devices: Sequence[str]) -> list[Table]:
    """Columns of every file, those of traces of CAN frames by their devices; all faults at once."""
    from winchkit.can_trace import trace_advice
    from winchkit.cli.files.import_trace import read_trace_table
    from winchkit.runs.importing.formats.source import read_table

    faults: list[Fault] = []
    tables = []
    for file in files:
        is_trace = bool(devices) and bool(trace_advice(Path(file)))
        try:
            tables.append(read_trace_table(file, devices) if is_trace else read_table(file))
        except FileError as error:
            faults += error.faults
    if faults:
        raise RunError(faults)
    if devices and not any(table.layout.startswith("trace of CAN frames") for table in tables):
        raise UsageError("--device is of traces of CAN frames, and no FILE is one")
    return tables


def _guesses(
    tables: Sequence[Table], mapping: str | None, answers: Answers, *, asking: bool
) -> tuple[list[Guess], ImportMapping | None]:
    """Assignments of every file; all faults of all files at once."""
    from winchkit.runs.importing.answers import answers_of
    from winchkit.runs.importing.guess import guess_columns
    from winchkit.runs.importing.mapping import guess_by
    from winchkit.schema.read import read_mapping

    declared = None if mapping is None else read_mapping(mapping)
    faults: list[Fault] = []
    timed = [] if declared else _with_own_times(tables, answers)
    guesses = []
    for table in tables:
        own = answers_of(table, tables, answers)
        own = replace(own, sample_rate=None) if any(t is table for t in timed) else own
        try:
            guess = guess_by(table, declared) if declared else guess_columns(table, own)
        except FileError as error:
            faults += error.faults
            continue
        if asking and declared is None:
            guess, told = asked(guess, own)
            columns = (*answers.columns, *told.columns[len(own.columns) :])
            rate = told.sample_rate or answers.sample_rate
            answers = replace(told, columns=columns, sample_rate=rate)
        guesses.append(guess)
    if faults:
        raise RunError(faults)
    if declared is None and not answers.motion and _have(guesses, {"motor_angle"}):
        # A length and a force beside a file with the motor angle are those of its cable.
        rotary = replace(answers, motion="rotary")
        guesses = [
            guess_columns(guess.file, answers_of(guess.file, tables, rotary))
            if _have([guess], {"position"})
            else guess
            for guess in guesses
        ]
    named = {
        "--unsigned": answers.unsigned,
        "--signed": answers.signed,
        "--modulo": [name for name, _ in answers.modulo],
    }
    for option, name in [(option, name) for option, names in named.items() for name in names]:
        if not any(guess.file.column(name) for guess in guesses):
            has = ", ".join(repr(c.source) for guess in guesses for c in guess.file.columns)
            raise UsageError(f"{option}: there is no column '{name}'; there are {has}")
    if declared is None and _lack_angle(guesses):
        text = _CELL_ALONE if _have(guesses, {"tension", "load"}) else _NO_ANGLE
        guesses = [replace(guess, notes=(*guess.notes, text)) for guess in guesses]
    return guesses, declared


def _with_own_times(tables: Sequence[Table], answers: Answers) -> list[Table]:
    """Files with times beside others that have none, of which a sample rate is."""
    from winchkit.runs.importing.answers import answers_of
    from winchkit.runs.importing.guess import guess_columns

    if not answers.sample_rate or len(tables) < 2:
        return []
    without_rate = replace(answers, sample_rate=None)
    own = [guess_columns(table, answers_of(table, tables, without_rate)) for table in tables]
    timed = [table for table, guess in zip(tables, own, strict=True) if _have([guess], {"time"})]
    return timed if len(timed) < len(tables) else []


def _is_accepted(guesses: Sequence[Guess], yes: bool) -> bool:
    if yes or (all(guess.is_certain for guess in guesses) and not _are_integrated(guesses)):
        return True
    if not _may_ask(yes):
        return False
    return click.confirm("Import as shown?", default=True, abort=True, err=True)


def _are_integrated(guesses: Sequence[Guess]) -> bool:
    """Whether the motor angle is the integral of a velocity: no file has an angle."""
    return _have(guesses, {"motor_velocity", "velocity"}) and not _have(guesses, _ANGLES)


def _lack_angle(guesses: Sequence[Guess]) -> bool:
    """Whether channels of a run were found in the files, and none that may be the motor angle."""
    needed = (*_ANGLES, "motor_velocity", "velocity")
    asked = " ".join(o for guess in guesses for q in guess.questions for o in q.options)
    is_found = any(item.channel not in {"", "time"} for guess in guesses for item in guess.used)
    is_body = "--body" in asked
    is_asked = any(f"{name}=" in asked for name in needed)
    return (is_found or is_body) and not is_asked and not _have(guesses, set(needed))


def _have(guesses: Sequence[Guess], channels: set[str]) -> bool:
    """Whether a file has one of some channels."""
    return any(
        item.channel.rpartition(".")[2] in channels for guess in guesses for item in guess.used
    )


def _unanswered(guesses: Sequence[Guess]) -> str:
    """Message on what is not known, with the options that answer; what several files ask, once."""
    asking: dict[str, list[str]] = {}
    for guess in guesses:
        texts = [f"{q.text}: {' or '.join(q.options)}" for q in guess.questions] or [
            f"'{item.source}' as {item.channel} [{item.unit}] is {item.confidence} ({item.reason})"
            for item in guess.used
            if item.confidence in {"derived", "assumed"}
        ]
        for text in texts:
            asking.setdefault(text, []).append(one_line(guess.table.path))
    lines = [f"  {shortened(paths)}: {text}" for text, paths in asking.items()]
    if any(_NO_ANGLE in guess.notes for guess in guesses):
        lines.append(f"  {_NO_ANGLE}")
    if any(guess.questions for guess in guesses):
        return "\n".join(["not known, and no terminal to ask; give", *lines])
    if _are_integrated(guesses):
        lines.append("  no column has the motor angle: it is the integral of motor_velocity from 0")
    accept = 'accept the guess by --yes, or correct it by --column "CHANNEL=COLUMN [UNIT]":'
    return "\n".join([accept, *lines])


def _mapping_of(files: Sequence[str], guesses: Sequence[Guess]) -> ImportMapping:
    from winchkit.runs.importing.mapping import mapping_of

    pairs = [(Path(file).stem, guess) for file, guess in zip(files, guesses, strict=True)]
    return mapping_of("mapping", pairs)


def _saved(mapping: ImportMapping, path: str) -> str:
    from winchkit.runs.importing.mapping import write_mapping

    write_mapping(mapping, Path(path))
    note(f"mapping: {path}")
    return path
