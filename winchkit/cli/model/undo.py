"""``winchkit undo``: take back the last step of a profile's ledger."""

from __future__ import annotations

from pathlib import Path

import click

from winchkit.cli.core.command import Command
from winchkit.cli.core.messages import suggest_next
from winchkit.cli.core.options import output_option
from winchkit.cli.core.standard_input import is_standard_input
from winchkit.cli.model.options import profile_option


@click.command(
    cls=Command,
    examples=(
        "winchkit undo -p better.toml",
        "winchkit undo -p better.toml -o before.toml",
    ),
)
@profile_option
@output_option("Profile to write; else the same file.", "NEW.toml")
def command(profile: str, output: str | None) -> None:
    """Undo the last 'add' or 'remove'; the values that it refitted are restored too."""
    from winchkit.catalog import find
    from winchkit.cli.model.options import declared_profile
    from winchkit.errors import UsageError
    from winchkit.profile_edit.ledger import undo

    if output is None and is_standard_input(profile):
        raise UsageError("-p -: a profile from standard input is written to a file with -o")
    source = find("profiles", profile)
    declared_profile(source)
    if output is None and source != Path(profile):
        raise UsageError(f"'{profile}' ships with winchkit; write the copy to a file with -o")
    done = undo(source, Path(output) if output else source)
    click.echo(f"taken back: {done}")
    suggest_next("ledger", "-p", output or profile)
