"""``winchkit ledger`` and ``undo``: the steps by which a profile grew, and the last one undone."""

from __future__ import annotations

from pathlib import Path

import click

from winchkit.catalog import find
from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.messages import suggest_next
from winchkit.cli.core.options import output_option, replace_option
from winchkit.cli.core.output import json_flag, tell
from winchkit.cli.core.standard_input import is_standard_input
from winchkit.cli.model.options import declared_profile, html_option, profile_option, write_page
from winchkit.errors import UsageError


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit ledger -p better.toml",
        "winchkit ledger -p better.toml --html ledger.html",
    ),
)
@profile_option
@json_flag("Print the ledger as JSON.")
@html_option
def command(profile: str, html: str | None) -> None:
    """List every effect that was added to or removed from a profile, and the errors then."""
    from winchkit.profile_edit.history import ladder
    from winchkit.report.pages.history import ladder_html, ladder_text

    declared = declared_profile(find("profiles", profile))
    rungs = ladder(declared)
    steps = [rung.to_json() for rung in rungs]
    tell({"profile": declared.name, "steps": steps}, [ladder_text(declared.name, rungs)])
    if html:
        write_page(html, ladder_html(declared.name, rungs))


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit undo -p better.toml",
        "winchkit undo -p better.toml -o before.toml",
    ),
)
@profile_option
@output_option("Profile to write; else the same file.", "NEW.toml")
@replace_option
def undo(profile: str, output: str | None, replace: bool) -> None:
    """Undo the last 'add' or 'remove'; the values that it refitted are restored too."""
    from winchkit.profile_edit.ledger import undo as undone

    if output is None and is_standard_input(profile):
        raise UsageError("-p -: a profile from standard input is written to a file with -o")
    source = find("profiles", profile)
    declared_profile(source)
    if output is None and source != Path(profile):
        raise UsageError(f"'{profile}' ships with winchkit; write the copy to a file with -o")
    done = undone(source, Path(output or source), replace=replace)
    click.echo(f"taken back: {done}")
    suggest_next("ledger", "-p", output or profile)
