"""``winchkit calibrate``: a robot's geometry and winches from poses of which anything was seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from winchkit.cli.core.command import Example
from winchkit.cli.core.completion import complete_effect, complete_sim_bench
from winchkit.cli.core.messages import detail, note, suggest_next
from winchkit.cli.core.options import (
    PROFILE,
    RUN,
    bench_file_option,
    output_option,
    quantity_option,
    replace_option,
)
from winchkit.cli.core.output import echo_json, is_json, json_flag
from winchkit.cli.core.terminal import progress_bar
from winchkit.cli.model.options import (
    ManyValues,
    figures_option,
    html_option,
    page_title,
    read_all,
    write_figures,
    write_page,
)
from winchkit.errors import UsageError, suggest
from winchkit.robot.cli.pose_series import PoseSeries, pose_names

if TYPE_CHECKING:
    from winchkit.arguments import ProgressCallback
    from winchkit.robot.calibration.calibrate import Calibrated
    from winchkit.robot.calibration.options import Options
    from winchkit.robot.calibration.pose_design import NextPose

_NOISE_DIMENSIONS = {
    "closure": "length",
    "position": "length",
    "rotation": "angle",
    "swivel": "angle",
    "cable_length": "length",
    "balance": "force",
}


@click.command(
    cls=ManyValues,
    examples=(
        "winchkit calibrate cabtive poses.csv -o calibrated.toml",
        "winchkit calibrate cabtive poses.csv --validate more.csv --next 5 -o calibrated.toml",
        Example(
            "winchkit calibrate cabtive --sim cabtive-robot -o calibrated.toml",
            "takes minutes; a test executes it with fewer poses",
        ),
        Example(
            "winchkit calibrate cabtive -b robot.toml --poses 60 -o calibrated.toml",
            "needs a bench with a robot",
        ),
    ),
)
@click.argument("robot", type=PROFILE)
@click.argument("runs", nargs=-1, metavar="[RUN...]", type=RUN)
@bench_file_option("Let this bench drive to the poses and measure them.")
@click.option(
    "--sim",
    metavar="NAME",
    shell_complete=complete_sim_bench,
    help="Let this simulated robot do so, in simulated time.",
)
@click.option(
    "--poses",
    type=click.IntRange(10),
    default=60,
    show_default=True,
    help="Number of poses to drive to.",
)
@click.option(
    "--held-out",
    type=click.IntRange(1),
    default=20,
    show_default=True,
    help="Number of poses for validation only.",
)
@quantity_option("--box", of="length", default="75 mm", help="Half width of the volume about home.")
@quantity_option("--turn", of="angle", default="7.5 deg", help="Largest rotation from home.")
@quantity_option(
    "--accuracy", of="length", example="1 mm", help="Add poses until the error is below this."
)
@click.option(
    "--validate",
    "validate",
    multiple=True,
    metavar="RUN...",
    type=RUN,
    help="Run for validation only; without it every tenth pose.",
)
@output_option("Profile to write.", "NEW.toml", required=True)
@replace_option
@click.option(
    "--effect",
    "effects",
    multiple=True,
    metavar="NAME",
    shell_complete=complete_effect,
    help="Fit this effect too.",
)
@click.option(
    "--noise", "noise", multiple=True, metavar="KIND=VALUE",
    help="A known standard deviation, e.g. position='0.02 mm'; else estimated.",
)  # fmt: skip
@quantity_option(
    "--middle-force", of="force", example="80 N", help="Cable force kept near, where not measured."
)
@click.option(
    "--next", "following", type=click.IntRange(0), default=0, help="Number of poses to propose."
)
@click.option("--fit-report", is_flag=True, help="Print the report of the fit too.")
@json_flag("Print the answer as JSON.")
@html_option
@figures_option
def command(
    robot: str,
    runs: Sequence[str],
    bench: str | None,
    sim: str | None,
    poses: int,
    held_out: int,
    box: str,
    turn: str,
    accuracy: str | None,
    validate: Sequence[str],
    output: str,
    replace: bool,
    effects: Sequence[str],
    noise: Sequence[str],
    middle_force: str | None,
    following: int,
    fit_report: bool,
    html: str | None,
    figures: str | None,
) -> None:
    """Calibrate the robot of profile ROBOT on the poses of RUNs and write the better profile.

    A row of a run is a pose: motor angles of all lines, and whatever else was measured there, in
    any mix: position, rotation or some of its angles, swivel angles, cable lengths. The poses
    themselves are always found beside the parameters. Exit status 1, and no file, where the
    held-out error is larger than that of ROBOT.

    With --bench there are no RUNs: the bench moves its robot to random poses about home, waits for
    rest, averages the tracker and the load cells, fits, and judges other poses. Ctrl-C stops it.
    With --sim a simulated robot does the same on a simulated clock, as fast as this computer can.
    """
    from winchkit.catalog import find
    from winchkit.cli.core.quantities import optional, quantity
    from winchkit.profile_edit.document import refuse_other
    from winchkit.robot.calibration.options import Options
    from winchkit.robot.calibration.pose_design import next_poses

    source = find("profiles", robot)
    refuse_other(source, Path(output), replace)
    options = Options(tuple(effects), _noise(noise), optional(middle_force, "force"))
    if bool(runs) + bool(bench) + bool(sim) != 1:
        raise UsageError(
            "give the RUNs to fit, or --bench to drive to poses and measure them, or --sim for a "
            "simulated robot"
        )
    with progress_bar() as progress:
        if not runs:
            from winchkit.robot.bench.self_calibration import PoseVolume

            volume = PoseVolume(quantity(box, "length"), quantity(turn, "angle"))
            wanted = optional(accuracy, "length")
            series = PoseSeries(
                robot, Path(output), poses, held_out, volume, options, wanted, progress
            )
            found = (series.on_bench(bench) if bench else series.simulated(str(sim))).calibrated
            runs = [str(pose_names(Path(output))["fit"])]
        else:
            found = _calibrated(source, runs, validate, options, progress)
        progress("proposing poses", None)
        ahead = next_poses(found, following) if following else []
    if len(ahead) < following:
        click.echo(f"only {len(ahead)} of {following} poses can be held by the cables", err=True)
    if not found.refusal:
        _write(source, found, Path(output), runs, replace)
    _tell(found, ahead)
    if fit_report and not is_json():
        click.echo(f"\n{found.fit_report()}")
    if html:
        from winchkit.robot.report.calibration import calibration_html

        title = page_title(found.equations.robot.profile.name, runs)
        write_page(html, calibration_html(found, ahead, title, _source(robot, runs), output))
    if figures:
        from winchkit.robot.report.calibration import calibration_figures

        write_figures(figures, calibration_figures(found, _source(robot, runs)))
    if found.refusal:
        click.echo(f"winchkit: {found.refusal}", err=True)
        click.get_current_context().exit(1)
    suggest_next("diagnose", runs, "-p", output)


def _source(robot: str, runs: Sequence[str]) -> str:
    """Profile, runs and version, as the figures name them."""
    from importlib.metadata import version

    names = ", ".join(Path(run).name for run in runs)
    return f"profile {robot}; {names}; winchkit {version('winchkit')}"


def _calibrated(
    source: Path,
    runs: Sequence[str],
    validate: Sequence[str],
    options: Options,
    progress: ProgressCallback,
) -> Calibrated:
    """Fit all rows where others validate, else nine of ten."""
    from winchkit.robot.calibration.calibrate import calibrate
    from winchkit.robot.files.poses import read_poses
    from winchkit.robot.geometry.robot import robot_of
    from winchkit.schema.read import read_robot

    profile = read_robot(source)
    measured = read_poses(read_all(runs), profile)
    held = read_poses(read_all(validate), profile) if validate else None
    progress("fitting", None)
    return calibrate(robot_of(profile), measured, held, options, lambda step, _: detail(step))


def _tell(found: Calibrated, ahead: Sequence[NextPose]) -> None:
    from winchkit.robot.calibration.results import calibration_json, calibration_text

    if not is_json():
        click.echo(calibration_text(found, ahead))
        return
    for warning in found.warnings:
        click.echo(f"{warning} (warning)", err=True)
    echo_json(calibration_json(found, ahead))


def _noise(given: Sequence[str]) -> Mapping[str, float]:
    """``position=0.02 mm`` as SI by kind."""
    from winchkit.cli.core.quantities import check_typed, quantity

    out = {}
    for text in given:
        kind, equals, value = text.partition("=")
        kind = kind.strip()
        if not equals or kind not in _NOISE_DIMENSIONS:
            known = list(_NOISE_DIMENSIONS)
            raise UsageError(
                f"--noise '{text}': write KIND=VALUE with one of {', '.join(known)}"
                + ("" if kind in known else suggest(kind, known))
            )
        check_typed(f"--noise {kind}", value, _NOISE_DIMENSIONS[kind])
        out[kind] = quantity(value, _NOISE_DIMENSIONS[kind])
        if not out[kind] > 0:
            raise UsageError(f"--noise '{text}': a standard deviation is above zero")
    return out


def _write(source: Path, found: Calibrated, out: Path, runs: Sequence[str], replace: bool) -> None:
    from datetime import UTC, datetime

    from winchkit.robot.calibration.profile import Provenance, write_calibrated

    today = datetime.now(UTC).date()
    where = Provenance([Path(run).name for run in runs], today)
    write_calibrated(source, found, out, where, replace=replace)
    note(f"written: {out}")
