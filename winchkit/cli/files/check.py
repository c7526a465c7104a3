"""``winchkit check``: read files of any kind and say everything that is wrong with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, get_args

import click

from winchkit import wings
from winchkit.arguments import require_type, require_types
from winchkit.catalog import Kind, find, names
from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.options import TABLE, effects_option
from winchkit.cli.core.output import echo_json, is_json, json_flag
from winchkit.cli.core.terminal import progress_bar
from winchkit.errors import Fault, FileError, one_line
from winchkit.schema.eds.eds import SUFFIXES

if TYPE_CHECKING:
    from winchkit.schema.bench import BenchSpec

RUNS = (".csv", ".mcap")
_XML = ".xml"
"""Of device descriptions of CiA 311, and of others that their reader refuses, with what to do."""


@dataclass(frozen=True)
class Verdict:
    """Result of the check of one file."""

    path: str
    kind: str
    """Kind of declaration or ``run``; empty where the file does not get so far."""
    name: str = ""
    summary: str = ""
    faults: tuple[Fault, ...] = ()
    warnings: tuple[Fault, ...] = ()
    details: tuple[str, ...] = ()
    """What is worth knowing before the file is used."""
    drive: object = None
    """Of an EDS or DCF: what it says of the drive."""

    @property
    def ok(self) -> bool:
        """Whether the file can be used."""
        return not self.faults


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit check better.toml bench.toml demo-*.csv",
        "winchkit check - < better.toml",
        "winchkit check --computer",
    ),
)
@click.argument("files", nargs=-1, metavar="FILE...", type=TABLE)
@effects_option
@click.option("--computer", is_flag=True, help="Check this computer: real-time settings.")
@json_flag("Print the verdicts as JSON.")
@click.pass_context
def command(
    ctx: click.Context,
    files: tuple[str, ...],
    effects: Sequence[str],
    *,
    computer: bool,
) -> None:
    """Check files of any kind: profiles, benches, programmes, devices (.toml), runs (.csv, .mcap).

    Of a drive's EDS, DCF, XDD or XDC it reports what matters for winchkit; of a device file and
    of a bench whether the drives do it by their EDS, and how each notices a dead host. Every
    fault of a file is reported with its line. Exits with 3 when a file has one. ``--computer``
    reports what this computer permits a control loop (docs/realtime.md).
    """
    if not files and not computer:
        raise click.UsageError("Missing argument 'FILE...'; or --computer.", ctx)
    verdicts = []
    with progress_bar() as progress:
        for index, file in enumerate(files):
            progress(f"checking {file}", index / len(files))
            verdicts.append(check(file, effects))
    lines = _about_computer() if computer else ()
    for verdict in verdicts:
        for warning in verdict.warnings:
            click.echo(f"{warning} (warning)", err=True)
    if is_json():
        extra = {"computer": lines} if computer else {}
        echo_json({"schema": 1, "files": [_entry(verdict) for verdict in verdicts], **extra})
    else:
        for line in lines:
            click.echo(line)
        for verdict in verdicts:
            _show(verdict)
    ctx.exit(0 if all(verdict.ok for verdict in verdicts) else FileError.exit_code)


def check(file: str | Path, effect_files: Sequence[str | Path] = ()) -> Verdict:
    """Read a file of any kind and list its faults.

    Parameters
    ----------
    file : str or Path
        Declaration (.toml, or the name of a shipped one), run (.csv, .mcap), EDS, DCF, XDD or XDC.
    effect_files : sequence of str or Path
        Python files with effects of your own that a profile has.

    Returns
    -------
    Verdict
        Kind, name, faults and warnings; ``ok`` where the file can be used.
    """
    require_type(file, (str, Path), "file")
    require_types(effect_files, (str, Path), "effect_files")
    file = _of_name(str(file))
    suffix = Path(file).suffix.lower()
    try:
        if suffix in RUNS:
            return _run(file)
        if suffix in (*SUFFIXES, _XML):
            return _eds(file)
        if suffix == ".toml" or not Path(file).is_file():
            return _declaration(file, [str(each) for each in effect_files])
        known = ", ".join((".toml", *SUFFIXES, *RUNS))
        from winchkit.can_trace import trace_advice

        message = trace_advice(Path(file)) or f"'{suffix}' is none of {known}"
        return Verdict(file, "", faults=(Fault(message, file),))
    except FileError as error:
        return Verdict(file, "", faults=error.faults)


def _of_name(file: str) -> str:
    """Path of a shipped declaration by its name; without one the text itself."""
    if not Path(file).exists():
        for kind in get_args(Kind):
            if file in names(kind):
                return str(find(kind, file))
    return file


def _about_computer() -> tuple[str, ...]:
    """Everything that the control loop asks of this computer, a line each."""
    from winchkit.bench.control.computer import survey

    return tuple(f"{'ok' if item.granted else 'no'}  {item}" for item in survey())


def _run(file: str) -> Verdict:
    from winchkit.runs import read_run
    from winchkit.runs.info import summary_of
    from winchkit.runs.sanity.ground import ON_GROUND
    from winchkit.runs.sanity.inspection import inspect_run
    from winchkit.runs.sanity.saturation import SATURATED

    run = read_run(file)
    told = [
        f"{found.channel}: {found.text}"
        for found in inspect_run(run).findings
        if found.code in (ON_GROUND, SATURATED)
    ]
    notes = tuple(Fault(note, file) for note in (*run.notes, *told))
    return Verdict(file, "run", run.name, summary_of(run).text, warnings=notes)


def _eds(file: str) -> Verdict:
    from winchkit.cli.files.check_declaration import describe_eds, lines_of

    drive, warnings = describe_eds(Path(file))
    name = " ".join(filter(None, (drive.maker, drive.product)))
    kind = Path(file).suffix.lower()[1:]
    return Verdict(
        file,
        kind,
        name,
        str(drive.identity),
        warnings=warnings,
        details=tuple(lines_of(drive)),
        drive=drive,
    )


def _declaration(file: str, effects: Sequence[str]) -> Verdict:
    from winchkit.cli.files.check_declaration import (
        bench_of,
        effect_faults_and_warnings,
        refusals,
        report_of,
        stroke_of,
        warnings_of_drums,
    )
    from winchkit.schema.read import load

    declaration = load(file)
    bench = bench_of(declaration.value)
    drives = report_of(declaration.value)
    of_wing = declaration.value if bench is None else bench.robot
    by_wing = wings.call("check", of_wing)
    robot_faults, robot_warnings = ((), ()) if by_wing is None else by_wing(file, bench or of_wing)
    effect_faults, effect_warnings = effect_faults_and_warnings(file, declaration.value, effects)
    faults = (*effect_faults, *drives.faults, *robot_faults)
    warnings = (
        *declaration.warnings,
        *effect_warnings,
        *_doubts(file, bench),
        *warnings_of_drums(file, declaration.value),
        *drives.warnings,
        *robot_warnings,
    )
    return Verdict(
        file,
        declaration.kind,
        declaration.value.name,
        stroke_of(declaration.value),
        faults,
        warnings,
        details=(*drives.details, *(() if bench is None else refusals(bench))),
    )


def _doubts(file: str, bench: BenchSpec | None) -> list[Fault]:
    """Limits of a bench that are possible and rarely meant."""
    from winchkit.schema.bench_warnings import bench_warnings
    from winchkit.schema.reading.source import open_source

    if bench is None or not (found := list(bench_warnings(bench))):
        return []
    source = open_source(file)
    return [source.fault(key, message) for key, message in found]


def _show(verdict: Verdict) -> None:
    for fault in verdict.faults:
        click.echo(str(fault), err=True)
    if verdict.ok:
        called = f"{verdict.kind} '{one_line(verdict.name)}'" + (
            f", {verdict.summary}" if verdict.summary else ""
        )
        click.echo(f"{one_line(verdict.path)}: ok ({called})")
        for line in verdict.details:
            click.echo(f"  {line}")


def _entry(verdict: Verdict) -> dict[str, object]:
    return {
        "path": verdict.path,
        "ok": verdict.ok,
        "kind": verdict.kind or None,
        "name": verdict.name or None,
        "faults": verdict.faults,
        "warnings": verdict.warnings,
        "details": verdict.details,
        "drive": verdict.drive,
    }
