"""``winchkit serve``: the page that shows where a model fails, and adds missing effects."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from winchkit.catalog import find
from winchkit.cli.core.command import Example, ToolCommand
from winchkit.cli.core.completion import complete_bench, complete_sim_bench
from winchkit.cli.core.early_checks import check_bench, check_file
from winchkit.cli.core.messages import note
from winchkit.cli.core.options import PROFILE, RUN, own_effects_option
from winchkit.cli.core.outcome import threads_abandoned
from winchkit.cli.model.options import declared_profile
from winchkit.errors import UsageError


@click.command(
    cls=ToolCommand,
    examples=(
        Example("winchkit serve demo-*.csv -p bench-spiral", "serves until Ctrl-C"),
        Example("winchkit serve --sim demo-elastic-rope --no-browser", "serves until Ctrl-C"),
    ),
)
@click.argument("runs", nargs=-1, metavar="[RUN...]", type=RUN)
@click.option("-p", "--profile", metavar="P", type=PROFILE, help="Profile: a name or a file.")
@click.option(
    "-b",
    "--bench",
    metavar="BENCH.toml",
    shell_complete=complete_bench,
    help="Bench to show; it moves with --allow-motion.",
)
@click.option(
    "--sim",
    "simulated",
    metavar="NAME",
    shell_complete=complete_sim_bench,
    help="Simulated bench to start; the page may move it.",
)
@click.option("--allow-motion", is_flag=True, help="The page may move the bench of --bench.")
@own_effects_option()
@click.option("--folder", default=".", show_default=True, help="Folder of the library view.")
@click.option("--port", default=0, metavar="PORT", help="Port; a free one by default.")
@click.option("--mystery", type=int, metavar="SEED", help="Runs of a bench with a hidden effect.")
@click.option("--no-browser", is_flag=True, help="Open no browser.")
def command(
    *,
    runs: Sequence[str],
    profile: str | None,
    bench: str | None,
    simulated: str | None,
    allow_motion: bool,
    effect_files: Sequence[str],
    folder: str,
    port: int,
    mystery: int | None,
    no_browser: bool,
) -> None:
    """Serve the page in the browser of this computer: runs, model, bench, robot, library.

    The URL is the first line on stdout. The page answers on the loopback address only; other
    computers reach it through a tunnel (docs/page.md). Ctrl-C ends it.
    """
    if bench and simulated:
        raise UsageError("--bench and --sim: choose one")
    if allow_motion and not (bench or simulated):
        raise UsageError("--allow-motion needs --bench or --sim")
    if not 0 <= port <= 65535:
        raise UsageError(f"--port {port}: choose 0 to 65535")
    if not Path(folder).is_dir():
        raise UsageError(f"--folder {folder}: is no folder")
    if mystery is not None and (runs or profile):
        raise UsageError("--mystery: opens runs and a profile of its own; leave RUN and -p out")
    _check_files(runs, profile, bench, simulated)
    if bench or simulated:
        what = f"simulated bench '{simulated}'" if simulated else f"bench of {bench}"
        note(f"the {what} starts; the address of the page follows in some seconds")
    from winchkit.web.server import serve

    # A report or a fit under way is of no use without the page.
    with threads_abandoned():
        serve(
            runs,
            profile,
            port=port,
            folder=folder,
            bench=bench,
            sim=simulated,
            allow_motion=allow_motion or simulated is not None,
            effect_files=effect_files,
            mystery=mystery,
            ready=lambda url: _ready(url, browser=not no_browser),
        )


def _check_files(
    runs: Sequence[str], profile: str | None, bench: str | None, simulated: str | None
) -> None:
    """Raise FileError for a file that was named and is none, before the page loads its packages."""
    from winchkit.schema.read import read_bench, read_simbench

    for run in runs:
        check_file(run)
    if profile is not None:
        declared_profile(find("profiles", profile))
    if bench is not None:
        check_bench(bench)
        read_bench(bench).require_winches()
    if simulated is not None:
        read_simbench(find("sim", simulated))


def _ready(url: str, *, browser: bool) -> None:
    """Print the URL at once, and open the browser where one is wanted."""
    import sys
    import webbrowser

    click.echo(url)
    sys.stdout.flush()
    if browser:
        webbrowser.open(url)
