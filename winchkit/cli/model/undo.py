"""``winchkit undo``: take back the last step of a profile's ledger."""

from __future__ import annotations

from pathlib import Path

import click

__all__ = ["command"]


@click.command()
@click.option("--profile", "-p", required=True, metavar="P", help="Profile: a name or a file.")
@click.option("-o", "--output", metavar="NEW.toml", help="Profile to write; else the same file.")
def command(profile: str, output: str | None) -> None:
    """Take back what 'add' or 'remove' did last; values that it refitted are as before too."""
    from winchkit.catalog import find
    from winchkit.cli.model.options import declared_profile
    from winchkit.errors import UsageError
    from winchkit.profile_edit.ledger import undo

    source = find("profiles", profile)
    declared_profile(source)
    if output is None and source != Path(profile):
        raise UsageError(f"'{profile}' ships with winchkit; write the copy to a file with -o")
    done = undo(source, Path(output) if output else source)
    click.echo(f"taken back: {done}")
