"""``winchkit compare``: how far a profile is from measured runs, and what the error follows."""

from __future__ import annotations

from collections.abc import Sequence

import click

from winchkit.cli.output import echo_json
from winchkit.cli.runs_option import catalogue_of, model_options, read_runs

__all__ = ["command"]


@click.command()
@click.argument("runs", nargs=-1, required=True, metavar="RUN...")
@model_options
def command(
    runs: Sequence[str],
    profile: str,
    effect_files: Sequence[str],
    winch: str | None,
    band: float | None,
    as_json: bool,
) -> None:
    """Compare runs with a profile at its file values; only the length offset is fitted."""
    from winchkit.catalog import find
    from winchkit.diagnosis.compare import compare
    from winchkit.schema.read import read_winch

    declared = read_winch(find("profiles", profile))
    comparison = compare(read_runs(runs, winch), declared, catalogue_of(effect_files), band)
    if as_json:
        echo_json(comparison.to_json())
        return
    from winchkit.diagnosis.report.text import compare_text

    click.echo(compare_text(comparison))
