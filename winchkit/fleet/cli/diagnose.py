"""``winchkit fleet diagnose``: every winch and session of a library."""

from __future__ import annotations

from collections.abc import Sequence

import click

from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.messages import note, suggest_next
from winchkit.cli.core.options import own_effects_option
from winchkit.cli.core.output import json_flag, tell
from winchkit.cli.core.terminal import progress_bar
from winchkit.fleet.cli.fleet import DIAGNOSE_EXAMPLES, profile_option


@click.command(
    "diagnose",
    cls=ToolCommand,
    examples=DIAGNOSE_EXAMPLES,
)
@click.argument("folder", metavar="DIR")
@profile_option
@own_effects_option()
@click.option("--band", metavar="HZ", type=float, help="Low-pass of the torque, Hz.")
@click.option(
    "--jobs",
    type=click.IntRange(min=1),
    metavar="N",
    help="Processes; 1 needs no Dask.  [default: by cores and memory]",
)
@click.option("--scheduler", metavar="ADDRESS", help="Workers of this Dask scheduler instead.")
@json_flag("Print the answer as JSON.")
def command(
    *,
    folder: str,
    profile: str,
    effect_files: Sequence[str],
    band: float | None,
    jobs: int | None,
    scheduler: str | None,
) -> int:
    """Diagnose the runs of every winch and session below DIR that have no diagnosis yet.

    Runs of one winch that started on one UTC day, or have the same metadata session, belong
    together. Results are the tables diagnoses and estimates of the library. Ctrl-C keeps what is
    done, and the next call goes on. Runs that are lost, unreadable or cut short are named. Exit
    code 1: there is one, or a session has no diagnosis.
    """
    from winchkit.fleet.library.diagnose import diagnose_library

    with progress_bar() as progress:
        report = diagnose_library(
            folder,
            profile,
            effects=effect_files,
            band=band,
            jobs=jobs,
            scheduler=scheduler,
            progress=progress,
        )
    for session, reason in report.failures.items():
        note(f"{session}: {reason}")
    for path, fault in report.faults.items():
        note(f"{path}: {fault}")
    counts = f"{report.diagnosed} diagnosed, {report.unchanged} unchanged"
    runs = f"{len(report.faults)} run{'' if len(report.faults) == 1 else 's'} with a fault"
    tell(report.to_json(), [f"{counts}, {len(report.failures)} failed, {runs}"])
    suggest_next("library", "list", folder)
    return 1 if report.failures or report.faults else 0
