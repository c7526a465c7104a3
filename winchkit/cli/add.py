"""``winchkit add``: fit an effect and write it into a copy of a profile."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from winchkit.cli.html_option import given_options, html_option, page_title, write_page
from winchkit.cli.output import echo_json
from winchkit.cli.runs_option import ManyValues, catalogue_of, model_options, read_runs

if TYPE_CHECKING:
    from winchkit.diagnosis.add import Addition
    from winchkit.effects.catalogue import Catalogue
    from winchkit.schema.robot import RobotProfile

__all__ = ["command", "write_addition"]


@click.command(cls=ManyValues)
@click.argument("effect")
@click.option("--fit", "runs", multiple=True, required=True, metavar="RUN...", help="Runs to fit.")
@click.option("-o", "--output", required=True, metavar="NEW.toml", help="Profile to write.")
@model_options
@html_option
def command(
    effect: str,
    runs: Sequence[str],
    output: str,
    profile: str,
    effect_files: Sequence[str],
    winch: str | None,
    band: float | None,
    as_json: bool,
    html: str | None,
) -> None:
    """Fit EFFECT beside the effects of a profile on runs, and write the better profile.

    Values that the profile has already are refitted with it; every value gets its standard
    deviation, the runs and the date.
    """
    from winchkit.catalog import find
    from winchkit.cli.robot_model import read_profile, refuse_options
    from winchkit.diagnosis.add import grow
    from winchkit.schema.robot import RobotProfile

    source = find("profiles", profile)
    declared, catalogue = read_profile(source), catalogue_of(effect_files)
    if isinstance(declared, RobotProfile):
        refuse_options(band, html)
        addition = _to_robot(effect, runs, declared, winch, catalogue)
        write_addition(source, addition, [Path(run).name for run in runs], Path(output))
        click.echo(f"written: {output}", err=True)
        _tell(addition, as_json)
        return
    grown = grow(effect, read_runs(runs, winch), declared, catalogue, band)
    write_addition(source, grown.addition, [Path(run).name for run in runs], Path(output))
    click.echo(f"written: {output}", err=True)
    _tell(grown.addition, as_json)
    if html:
        from winchkit.diagnosis.report.page import addition_html

        title = page_title(declared.name, runs, effect)
        options = given_options(effect_files, winch, band)
        write_page(html, addition_html(grown, title, profile, output, options=options))


def _to_robot(
    effect: str,
    runs: Sequence[str],
    declared: RobotProfile,
    line: str | None,
    catalogue: Catalogue,
) -> Addition:
    """Fit an effect of a robot, on the line that ``EFFECT/LINE`` or --winch names."""
    from winchkit.cli.robot_model import read_poses_of
    from winchkit.diagnosis.robot.add import add_to_robot

    name, _, place = effect.partition("/")
    return add_to_robot(name, read_poses_of(runs), declared, line or place or None, catalogue)


def _tell(addition: Addition, as_json: bool) -> None:
    if as_json:
        echo_json(addition.to_json())
        return
    from winchkit.diagnosis.report.text import addition_text

    click.echo(addition_text(addition))


def write_addition(source: Path, addition: Addition, runs: Sequence[str], out: Path) -> None:
    """Write a fitted addition into a copy of a profile, with its provenance."""
    from winchkit.cli.provenance import provenance
    from winchkit.effects.profile_file import write_fitted

    fitted, judged = provenance(addition.terms, addition.outputs, runs)
    write_fitted(source, fitted, out, judged)
