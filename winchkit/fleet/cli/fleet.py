"""``winchkit fleet``: many winches and sessions."""

from __future__ import annotations

import click

from winchkit.cli.core.command import Example
from winchkit.cli.core.lazy import CommandPlace, LazyGroup

COMMANDS = {
    "diagnose": CommandPlace("winchkit.fleet.cli.diagnose", "Diagnose every winch and session."),
    "trend": CommandPlace("winchkit.fleet.cli.trend", "What changed, since when, at what cost."),
}

DIAGNOSE_EXAMPLES = (
    Example("winchkit fleet diagnose . -p bench-spiral --jobs 1", "needs an index"),
    Example(
        "winchkit fleet diagnose . -p bench-spiral --scheduler tcp://host:8786",
        "needs a Dask scheduler",
    ),
)
profile_option = click.option(
    "-p", "--profile", required=True, metavar="P", help="Profile, or folder of WINCH.toml."
)


@click.group(
    cls=LazyGroup,
    table=COMMANDS,
    examples=DIAGNOSE_EXAMPLES,
)
def command() -> None:
    """Many winches and sessions: the runs of an indexed folder."""
