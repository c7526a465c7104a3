"""``winchkit check``: read files of any kind and say everything that is wrong with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from winchkit.cli.bench_option import effects_option
from winchkit.cli.output import echo_json
from winchkit.errors import Fault, FileError

if TYPE_CHECKING:
    from winchkit.schema.bench import BenchSpec
    from winchkit.schema.read import Declared
    from winchkit.schema.winch import WinchProfile

__all__ = ["command"]

RUNS = (".csv", ".mcap")


@dataclass(frozen=True)
class Verdict:
    """What a file turned out to be."""

    path: str
    kind: str
    """Kind of declaration or ``run``; empty where the file does not get so far."""
    name: str = ""
    summary: str = ""
    faults: tuple[Fault, ...] = ()
    warnings: tuple[Fault, ...] = ()

    @property
    def ok(self) -> bool:
        """Whether the file can be used."""
        return not self.faults


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@effects_option
@click.option("--json", "as_json", is_flag=True, help="Print the verdicts as JSON.")
@click.pass_context
def command(
    ctx: click.Context, files: tuple[str, ...], effects: Sequence[str], as_json: bool
) -> None:
    """Check files of any kind: profiles, benches, programmes, devices (.toml), runs (.csv, .mcap).

    Every fault of a file is told with its line. Exits with 3 when a file has one.
    """
    verdicts = [_verdict(file, effects) for file in files]
    for verdict in verdicts:
        for warning in verdict.warnings:
            click.echo(f"{warning} (warning)", err=True)
    if as_json:
        echo_json({"schema": 1, "files": [_entry(verdict) for verdict in verdicts]})
    else:
        for verdict in verdicts:
            _show(verdict)
    ctx.exit(0 if all(verdict.ok for verdict in verdicts) else FileError.exit_code)


def _verdict(file: str, effects: Sequence[str]) -> Verdict:
    try:
        suffix = Path(file).suffix.lower()
        if suffix in RUNS:
            return _run(file)
        if suffix == ".toml" or not Path(file).is_file():
            return _declaration(file, effects)
        known = ", ".join((".toml", *RUNS))
        return Verdict(file, "", faults=(Fault(f"'{suffix}' is none of {known}", file),))
    except FileError as error:
        return Verdict(file, "", faults=error.faults)


def _run(file: str) -> Verdict:
    from winchkit.runs import read_run
    from winchkit.runs.summary import summary_of

    run = read_run(file)
    notes = tuple(Fault(note, file) for note in run.notes)
    return Verdict(file, "run", run.name, summary_of(run).text, warnings=notes)


def _declaration(file: str, effects: Sequence[str]) -> Verdict:
    from winchkit.cli.check_drives import faults_and_warnings
    from winchkit.cli.check_drums import stroke_of, warnings_of_drums
    from winchkit.cli.check_robots import faults_and_warnings as of_robots
    from winchkit.schema.read import load

    declaration = load(file)
    drive_faults, drive_warnings = faults_and_warnings(declaration.value)
    robot_faults, robot_warnings = of_robots(file, declaration.value)
    effect_faults = dict.fromkeys(_effect_faults(declaration.value, effects))
    faults = (*effect_faults, *drive_faults, *robot_faults)
    warnings = (
        *declaration.warnings,
        *warnings_of_drums(file, declaration.value),
        *drive_warnings,
        *robot_warnings,
    )
    said = stroke_of(declaration.value)
    return Verdict(file, declaration.kind, declaration.value.name, said, faults, warnings)


def _profiles(value: Declared) -> list[WinchProfile]:
    """The winch profiles of a declaration; those that a bench names are read as well."""
    from winchkit.catalog import find
    from winchkit.schema.read import read_winch
    from winchkit.schema.robot import RobotProfile
    from winchkit.schema.winch import WinchProfile

    if isinstance(value, WinchProfile):
        return [value]
    if isinstance(value, RobotProfile):
        return [line.winch for line in value.line if isinstance(line.winch, WinchProfile)]
    bench = _bench(value)
    if bench is None:
        return []
    named = dict.fromkeys(wiring.profile for wiring in bench.winch.values())
    return [read_winch(find("profiles", name, beside=bench.path)) for name in named]


def _bench(value: Declared) -> BenchSpec | None:
    """The bench that a declaration is, if it is one."""
    from winchkit.schema.bench import BenchSpec
    from winchkit.schema.simbench import SimBench

    bench = value.bench if isinstance(value, SimBench) else value
    return bench if isinstance(bench, BenchSpec) else None


def _effect_faults(value: Declared, effects: Sequence[str]) -> list[Fault]:
    """What is wrong with the effects that profiles declare, a robot's own among them."""
    from winchkit.schema.robot import RobotProfile

    profiles, bench = _profiles(value), _bench(value)
    files: list[str | Path] = [*effects, *(bench.effect_files if bench is not None else ())]
    robot = value if isinstance(value, RobotProfile) and value.effect else None
    if not (files or robot or any(profile.effect for profile in profiles)):
        return []
    from winchkit.effects import check_profile, load_catalogue
    from winchkit.effects.bind_robot import check_robot

    catalogue = load_catalogue(files)
    faults = [fault for profile in profiles for fault in check_profile(profile, catalogue)]
    return faults if robot is None else [*faults, *check_robot(robot, catalogue)]


def _show(verdict: Verdict) -> None:
    for fault in verdict.faults:
        click.echo(str(fault), err=True)
    if verdict.ok:
        called = f"{verdict.kind} '{verdict.name}'" + (
            f", {verdict.summary}" if verdict.summary else ""
        )
        click.echo(f"{verdict.path}: ok ({called})")


def _entry(verdict: Verdict) -> dict[str, object]:
    return {
        "path": verdict.path,
        "ok": verdict.ok,
        "kind": verdict.kind or None,
        "name": verdict.name or None,
        "faults": verdict.faults,
        "warnings": verdict.warnings,
    }
