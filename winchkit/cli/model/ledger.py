"""``winchkit ledger``: how a profile grew, as a ladder of held-out errors."""

from __future__ import annotations

import click

from winchkit.cli.core.command import Command
from winchkit.cli.core.output import echo_json
from winchkit.cli.model.options import html_option, profile_option, write_page


@click.command(
    cls=Command,
    examples=(
        "winchkit ledger -p better.toml",
        "winchkit ledger -p better.toml --html ledger.html",
    ),
)
@profile_option
@click.option("--json", "as_json", is_flag=True, help="Print the ledger as JSON.")
@html_option
def command(profile: str, as_json: bool, html: str | None) -> None:
    """List every effect that was added to or removed from a profile, and the errors then."""
    from winchkit.catalog import find
    from winchkit.cli.model.options import declared_profile
    from winchkit.profile_edit.history import ladder

    declared = declared_profile(find("profiles", profile))
    rungs = ladder(declared)
    if as_json:
        steps = [rung.to_json() for rung in rungs]
        echo_json({"schema": 1, "profile": declared.name, "steps": steps})
    else:
        from winchkit.report.pages.history import ladder_text

        click.echo(ladder_text(declared.name, rungs))
    if html:
        from winchkit.report.pages.history import ladder_html

        write_page(html, ladder_html(declared.name, rungs))
