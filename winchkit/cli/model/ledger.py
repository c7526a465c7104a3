"""``winchkit ledger``: how a profile grew, as a ladder of held-out errors."""

from __future__ import annotations

import click

from winchkit.cli.core.command import Command
from winchkit.cli.core.output import json_flag, tell
from winchkit.cli.model.options import html_option, profile_option, write_page


@click.command(
    cls=Command,
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
    from winchkit.catalog import find
    from winchkit.cli.model.options import declared_profile
    from winchkit.profile_edit.history import ladder
    from winchkit.report.pages.history import ladder_html, ladder_text

    declared = declared_profile(find("profiles", profile))
    rungs = ladder(declared)
    steps = [rung.to_json() for rung in rungs]
    tell({"profile": declared.name, "steps": steps}, [ladder_text(declared.name, rungs)])
    if html:
        write_page(html, ladder_html(declared.name, rungs))
