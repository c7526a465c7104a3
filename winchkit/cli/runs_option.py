"""What compare, diagnose and add share: reading runs, a profile and a user's own effects."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import click

from winchkit.errors import Fault, FileError, UsageError

if TYPE_CHECKING:
    from winchkit.effects.catalogue import Catalogue
    from winchkit.runs.run import Run

__all__ = ["ALL", "ManyValues", "catalogue_of", "model_options", "read_each", "read_runs"]

ALL = "all"
"""Said to ``--winch``: every winch of the runs by itself."""


class ManyValues(click.Command):
    """A command whose options shown as ``RUN...`` take several values: ``--fit a.csv b.csv``."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Spell ``--fit a b`` as ``--fit a --fit b`` before click reads it."""
        several = [p for p in self.params if str(p.metavar or "").endswith("...")]
        many = {name for p in several if isinstance(p, click.Option) for name in p.opts}
        out: list[str] = []
        current: str | None = None
        for arg in args:
            if arg.startswith("-") and arg != "-":
                current = arg if arg in many else None
                out.append(arg)
            elif current is not None and out[-1] != current:
                out += [current, arg]
            else:
                out.append(arg)
        return super().parse_args(ctx, out)


def model_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Options of every command that holds a model against runs."""
    for option in (
        click.option("--json", "as_json", is_flag=True, help="Print the answer as JSON."),
        click.option("--band", metavar="HZ", type=float, help="Low-pass of the torque, Hz."),
        click.option("--winch", help="Which winch of runs with several."),
        click.option(
            "--effects", "effect_files", multiple=True, metavar="FILE", help="Your own effects."
        ),
        click.option(
            "--profile", "-p", required=True, metavar="P", help="Profile: a name or a file."
        ),
    ):
        function = option(function)
    return function


def read_runs(paths: Sequence[str], winch: str | None) -> list[Run]:
    """Runs of one winch. Raises FileError with the faults of all files."""
    return [_of_winch(run, winch) for run in _read(paths)]


def read_each(paths: Sequence[str]) -> dict[str, list[Run]]:
    """Runs of every winch that is in all of them, each file read once. Raises FileError."""
    runs = _read(paths)
    names = [name for name in runs[0].winches() if all(name in run.winches() for run in runs)]
    if not names:
        listed = "; ".join(f"{run.path}: {', '.join(run.winches())}" for run in runs)
        raise UsageError(f"no winch is in all of the runs: {listed}")
    return {name: [run.of_winch(name) for run in runs] for name in names}


def _read(paths: Sequence[str]) -> list[Run]:
    from winchkit.runs import read_run

    runs: list[Run] = []
    faults: list[Fault] = []
    for path in paths:
        try:
            runs.append(read_run(path))
        except FileError as error:
            faults += error.faults
    if faults:
        raise FileError(faults)
    return runs


def _of_winch(run: Run, winch: str | None) -> Run:
    known = run.winches()
    if winch is None:
        if len(known) > 1:
            raise UsageError(
                f"{run.path}: has the winches {', '.join(known)}; choose one with --winch"
            )
        return run.of_winch(known[0])
    if known != [""] and winch not in known:
        raise UsageError(f"{run.path}: no winch '{winch}'; it has {', '.join(known)}")
    return run.of_winch(winch if known != [""] else "")


def catalogue_of(effect_files: Sequence[str]) -> Catalogue:
    """All effects, a user's own included."""
    from winchkit.effects import load_catalogue

    return load_catalogue(effect_files)
