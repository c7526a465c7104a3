"""``winchkit diagnose``: which physical effect the profile lacks, or that it lacks none."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from winchkit.cli.output import echo_json
from winchkit.cli.runs_option import catalogue_of, model_options, read_runs

__all__ = ["command"]


@click.command()
@click.argument("runs", nargs=-1, required=True, metavar="RUN...")
@model_options
@click.option("--html", metavar="FILE", help="Also write the report as one page.")
def command(
    runs: Sequence[str],
    profile: str,
    effect_files: Sequence[str],
    winch: str | None,
    band: float | None,
    as_json: bool,
    html: str | None,
) -> None:
    """Name the physical effect that the model lacks, with its size and what it would buy.

    Two runs of one programme and load are the measure of the noise: record everything twice.
    """
    from winchkit.catalog import find
    from winchkit.diagnosis.diagnose import diagnose
    from winchkit.schema.read import read_winch

    declared = read_winch(find("profiles", profile))
    answer = diagnose(read_runs(runs, winch), declared, catalogue_of(effect_files), band)
    if html:
        from winchkit.diagnosis.report.page import report_html

        title = f"{declared.name}: {', '.join(Path(run).name for run in runs)}"
        Path(html).write_text(report_html(answer, title, profile=profile), encoding="utf-8")
        click.echo(f"report: {html}", err=True)
    if as_json:
        echo_json(answer.diagnosis.to_json())
        return
    from winchkit.diagnosis.report.text import report_text

    click.echo(report_text(answer))
