"""``winchkit fleet``: diagnoses of many winches and sessions, and what changed between them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import click

from winchkit.cli.core.command import Example, ToolCommand
from winchkit.cli.core.completion import complete_effect
from winchkit.cli.core.lazy import CommandPlace, LazyGroup
from winchkit.cli.core.messages import note, suggest_next
from winchkit.cli.core.options import own_effects_option
from winchkit.cli.core.output import json_flag, tell
from winchkit.cli.core.terminal import progress_bar
from winchkit.cli.model.options import html_option, write_page
from winchkit.errors import UsageError, suggest

_HERE = "winchkit.fleet.cli.fleet"
COMMANDS = {
    "diagnose": CommandPlace(_HERE, "Diagnose every winch and session.", "diagnose"),
    "trend": CommandPlace(_HERE, "What changed, since when, at what cost.", "trend"),
}

_DIAGNOSE_EXAMPLES = (
    Example("winchkit fleet diagnose . -p bench-spiral --jobs 1", "needs an index"),
    Example(
        "winchkit fleet diagnose . -p bench-spiral --scheduler tcp://host:8786",
        "needs a Dask scheduler",
    ),
)
_profile_option = click.option(
    "-p", "--profile", required=True, metavar="P", help="Profile, or folder of WINCH.toml."
)


@click.group(cls=LazyGroup, table=COMMANDS, examples=_DIAGNOSE_EXAMPLES)
def command() -> None:
    """Many winches and sessions: the runs of an indexed folder."""


@click.command("diagnose", cls=ToolCommand, examples=_DIAGNOSE_EXAMPLES)
@click.argument("folder", metavar="DIR")
@_profile_option
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
def diagnose(
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
            effect_files=effect_files,
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


@click.command(
    "trend",
    cls=ToolCommand,
    examples=(
        Example("winchkit fleet trend . -p bench-spiral --effect cell-gain", exit_code=1),
        Example(
            "winchkit fleet trend . -p bench-spiral --effect cell-gain "
            "--limit cell-gain.gain_error=2%",
            exit_code=1,
        ),
    ),
)
@click.argument("folder", metavar="DIR")
@_profile_option
@click.option(
    "--effect",
    "effects",
    multiple=True,
    metavar="NAME",
    shell_complete=complete_effect,
    help="Follow this effect.  [default: named by 'fleet diagnose', and of the profiles]",
)
@click.option(
    "--limit",
    "limits",
    multiple=True,
    metavar="EFFECT.PARAMETER=VALUE",
    help="Value that must not be reached; a trend towards it has a date.",
)
@own_effects_option()
@html_option
@json_flag("Print the answer as JSON.")
def trend(
    *,
    folder: str,
    profile: str,
    effects: Sequence[str],
    limits: Sequence[str],
    effect_files: Sequence[str],
    html: str | None,
) -> int:
    """Fit one set of effects to every session below DIR, and report what changed and since when.

    The same effects are fitted to all winches and dates, so that names do not change from session
    to session. Every series is tested for a step or a trend, and every winch against the others,
    at a false discovery rate of 1 % over all of them. The report says date, size, cost and what to
    do, and names the sessions and runs that it leaves out or that were cut short. Exit code 1:
    something changed, a winch differs from the others or is beyond a limit, profiles were
    exchanged, or something is left out.
    """
    from winchkit.fleet.library.history import library_history
    from winchkit.fleet.report.text import history_text

    known = dict(_limit(text, effect_files) for text in limits)
    with progress_bar() as progress:
        found = library_history(
            folder,
            profile,
            effects=effects,
            effect_files=effect_files,
            limits=known,
            progress=progress,
        )
    history = found.history
    told: dict[str, Any] = {
        **history.to_json(),
        "effects": found.effects,
        "sessions": found.sessions,
        "failures": found.failures,
        "faults": found.faults,
        "outdated": found.outdated,
        "swapped": [vars(swap) for swap in found.swapped],
    }
    sessions = f"{found.sessions} session{'' if found.sessions == 1 else 's'}"
    head = f"{sessions}, effects {', '.join(found.effects)}\n"
    tell(told, [head, history_text(history, found.swapped, found.left_out)])
    if html:
        from winchkit.fleet.report.history import fleet_history_html

        title = "Maintenance report of a fleet"
        write_page(html, fleet_history_html(history, title, found.swapped, found.left_out))
    differs = history.changed or history.odd or history.beyond_limit or found.swapped
    return 1 if differs or found.left_out else 0


def _limit(text: str, effect_files: Sequence[str]) -> tuple[tuple[str, str], float]:
    """``cell-gain.gain_error=2 %`` as effect, parameter and SI value; raises UsageError."""
    from winchkit.cli.core.quantities import check_typed, quantity
    from winchkit.effects.catalogue import load_catalogue
    from winchkit.units import dimension_of

    left, equals, value = text.partition("=")
    name, dot, parameter = left.strip().partition(".")
    if not (equals and dot):
        raise UsageError(f"--limit '{text}': write EFFECT.PARAMETER=VALUE")
    catalogue = load_catalogue(effect_files)
    if name not in catalogue:
        known = [effect.id for effect in catalogue]
        raise UsageError(f"--limit '{text}': there is no effect '{name}'{suggest(name, known)}")
    names = [p.name for p in catalogue[name].parameters]
    if parameter not in names:
        raise UsageError(f"--limit '{text}': {name} has {', '.join(names)}")
    declared = catalogue[name].parameter(parameter)
    dimension = dimension_of(declared.unit) or "ratio"
    check_typed(f"--limit {name}.{parameter}", value, dimension)
    limit = quantity(value, dimension)
    if limit == 0 or (declared.reciprocal and limit < 0):
        where = "above 0" if declared.reciprocal else "above or below 0, which is no effect"
        raise UsageError(f"--limit '{text}': it is {where}")
    if declared.reciprocal:
        return (name, f"1/{parameter}"), 1 / limit
    return (name, parameter), limit
