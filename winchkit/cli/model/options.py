"""What commands that hold a model against runs are asked: runs, a profile, effects of one's own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from re import compile as pattern
from typing import TYPE_CHECKING, Any

import click

from winchkit import wings
from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.early_checks import check_folder, check_new_file
from winchkit.cli.core.messages import note, suggest_next
from winchkit.cli.core.options import PROFILE, RUN, all_of, checked, own_effects_option
from winchkit.errors import Fault, FileError, UsageError, of_each
from winchkit.schema.programme import ALL

if TYPE_CHECKING:
    from winchkit.effects.catalogue import Catalogue
    from winchkit.report.figures.figure import Figure
    from winchkit.runs.run import Run
    from winchkit.schema.profiles.robot import RobotProfile
    from winchkit.schema.profiles.winch import WinchProfile

profile_option = click.option(
    "-p",
    "--profile",
    required=True,
    metavar="P",
    type=PROFILE,
    help="Profile: a name or a file.",
)
runs_argument = click.argument("runs", nargs=-1, required=True, metavar="RUN...", type=RUN)


def fit_option(help: str, *, required: bool = False) -> Callable[..., Any]:
    """The option ``--fit``: runs by which values are fitted."""
    return click.option(
        "--fit", "runs", multiple=True, required=required, metavar="RUN...", type=RUN, help=help
    )


_MODEL_OPTIONS = all_of(
    profile_option,
    own_effects_option(),
    click.option("--winch", help="Which winch or axis of the runs; 'all' for each by itself."),
    click.option(
        "--predicted",
        metavar="OUTPUT=COLUMN",
        help="Column of another model's prediction: motor_torque=tau_model.",
    ),
    click.option("--band", metavar="HZ", type=float, help="Low-pass of the torque, Hz."),
)


@dataclass(frozen=True)
class Asked:
    """A profile as the user named it, and how to hold it against runs."""

    profile: str
    effect_files: Sequence[str]
    winch: str | None
    band: float | None
    predicted: str | None = None

    @property
    def source(self) -> Path:
        """The profile's file."""
        from winchkit.catalog import find

        return find("profiles", self.profile)

    @property
    def declared(self) -> WinchProfile:
        """The profile of a winch or an axis. Raises FileError with its faults."""
        from winchkit.schema.read import read_profile

        return read_profile(self.source)

    @property
    def catalogue(self) -> Catalogue:
        """All effects, a user's own included."""
        from winchkit.effects import load_catalogue

        return load_catalogue(self.effect_files)

    def runs(
        self, paths: Sequence[str], declared: WinchProfile | RobotProfile | None = None
    ) -> list[Run]:
        """Runs of the one winch, or of all lines of a robot; FileError with all faults."""
        if declared is not None and wings.call("compare", declared) is not None:
            if self.predicted is not None:
                raise UsageError("--predicted: is of one winch or axis, not of a robot")
            return read_all(paths)
        return self._predicted(read_runs(paths, self.winch))

    def runs_of_each(self, paths: Sequence[str]) -> dict[str, list[Run]]:
        """Runs of every winch or axis that is in all of them. Raises FileError, UsageError."""
        return {name: self._predicted(runs) for name, runs in read_each(paths).items()}

    def _predicted(self, runs: list[Run]) -> list[Run]:
        if self.predicted is None:
            return runs
        from winchkit.runs.predicted import with_prediction

        return [with_prediction(run, self.predicted) for run in runs]

    def placed(self, effect: str, declared: WinchProfile | RobotProfile) -> str:
        """``EFFECT/LINE`` where --winch names a line of a robot."""
        from winchkit.schema.profiles.robot import RobotProfile

        on_line = isinstance(declared, RobotProfile) and self.winch is not None
        return f"{effect.partition('/')[0]}/{self.winch}" if on_line else effect

    @property
    def each(self) -> bool:
        """Whether every winch or axis of the runs is asked for by itself."""
        return self.winch == ALL

    @property
    def options(self) -> tuple[str, ...]:
        """Options beside runs and profile, as words of a command that repeats them."""
        out = [word for path in self.effect_files for word in ("--effects", path)]
        out += [] if self.winch is None else ["--winch", self.winch]
        out += [] if self.band is None else ["--band", f"{self.band:g}"]
        out += [] if self.predicted is None else ["--predicted", self.predicted]
        return tuple(out)


class ManyValues(ToolCommand):
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
    """Options of every command that holds a model against runs; it gets them as ``asked``."""

    @wraps(function)
    def bundled(
        profile: str,
        effect_files: Sequence[str],
        winch: str | None,
        band: float | None,
        predicted: str | None,
        **others: Any,
    ) -> Any:
        return function(asked=Asked(profile, effect_files, winch, band, predicted), **others)

    return _MODEL_OPTIONS(bundled)


def read_runs(paths: Sequence[str], winch: str | None) -> list[Run]:
    """Runs of one winch. Raises FileError with the faults of all files."""
    return [_of_winch(run, winch) for run in read_all(paths)]


def read_each(paths: Sequence[str]) -> dict[str, list[Run]]:
    """Runs of every winch that is in all of them, each file read once. Raises FileError."""
    runs = read_all(paths)
    names = [name for name in runs[0].winches() if all(name in run.winches() for run in runs)]
    if not names:
        listed = "; ".join(f"{run.path}: {', '.join(run.winches())}" for run in runs)
        raise UsageError(f"no winch or axis is in all of the runs: {listed}")
    return {name: [run.of_winch(name) for run in runs] for name in names}


def read_all(paths: Sequence[str]) -> list[Run]:
    """Runs with all that they hold. Raises FileError with the faults of all files."""
    from winchkit.runs import read_run

    return of_each(read_run, paths)


def _of_winch(run: Run, winch: str | None) -> Run:
    known = run.winches()
    if winch is None:
        if len(known) > 1:
            raise UsageError(
                f"{run.path}: has columns of {', '.join(known)}; choose one with --winch, "
                "or use compare or diagnose with --winch all for each by itself"
            )
        return run.of_winch(known[0])
    named = known if known != [""] else list(filter(None, [run.metadata.get("winch")]))
    if named and winch not in named:
        raise UsageError(f"{run.path}: has no winch or axis '{winch}'; it has {', '.join(named)}")
    return run.of_winch(winch if known != [""] else "")


def _check_page(path: str, option: str) -> None:
    """Raise FileError for a page that cannot be written; :func:`save_page` makes one folder."""
    parent = Path(path).parent
    check_new_file(path if parent.is_dir() else str(parent), option)


html_option = click.option(
    "--html",
    metavar="FILE",
    callback=checked(_check_page),
    help="Also write the answer as one page.",
)
_RUNS_NAMED = 3
"""Runs that a title names; more are counted."""


def _check_figures(folder: str, option: str) -> None:
    """Refuse ``--figures`` before any work where the folder or PNG cannot be written."""
    from winchkit.report.figures.export import require_png

    check_folder(folder, option)
    require_png()


figures_option = click.option(
    "--figures",
    metavar="DIR",
    callback=checked(_check_figures),
    help="Also write every figure as PNG, SVG and CSV into this folder.",
)
_NO_FILE = pattern(r"[^\w.-]")
_PAGE_BEGINS = b"<!DOCTYPE html>"


def write_page(path: str, page: str) -> None:
    """Write a page as :func:`save_page` does and say so on stderr."""
    save_page(path, page)
    note(f"report: {path}")


def write_figures(folder: str, figures: Sequence[Figure]) -> None:
    """Write figures as :func:`save_figures` does and report it on stderr."""
    save_figures(folder, figures)
    note(f"figures: {folder} ({len(figures)} as PNG, SVG and CSV)")


def save_figures(folder: str, figures: Sequence[Figure], winch: str | None = None) -> None:
    """Write figures as PNG, SVG and CSV; those of one of several winches start with its name."""
    from winchkit.report.figures import export

    prefix = "" if winch is None else f"{_NO_FILE.sub('-', winch) or 'winch'}-"
    export.write_figures(figures, Path(folder), prefix)


def save_page(path: str, page: str) -> None:
    """Write a page; the folder is made where its parent exists.

    Raises FileError where it cannot be written, and for a file there that is no page: a run
    named after ``--html`` by mistake stays what it is.
    """
    target = Path(path)
    try:
        target.parent.mkdir(exist_ok=True)
        if target.is_file() and not _may_be_replaced(target):
            raise FileError(
                Fault("holds something else than a page and was left alone; name another", path)
            )
        target.write_text(page, encoding="utf-8")
    except OSError as error:
        reason = error.strerror or error
        raise FileError(
            Fault(f"the page cannot be written: {reason}; name another file for --html", path)
        ) from error


def pages_beside(path: str, winches: Sequence[str]) -> dict[str, str]:
    """Pages beside that of all, ``report-A.html``; UsageError where two winches would get one."""
    page = Path(path)
    names = {w: f"{page.stem}-{_NO_FILE.sub('-', w) or 'winch'}{page.suffix}" for w in winches}
    if len(set(names.values())) < len(names):
        raise UsageError(f"--html: no page for each of {', '.join(winches)}")
    return names


def page_title(profile: str, runs: Sequence[str], effect: str = "") -> str:
    """``bench-spiral: a.csv, b.csv``, or ``bench-spiral: 12 runs, a.csv to l.csv``."""
    from winchkit.report.words.vocabulary import runs_listed

    added = f" with {effect}" if effect else ""
    return f"{profile}{added}: {runs_listed([Path(run).name for run in runs], _RUNS_NAMED)}"


def _may_be_replaced(target: Path) -> bool:
    """Whether a file is empty or an earlier page."""
    with target.open("rb") as there:
        return there.read(len(_PAGE_BEGINS)) in {b"", _PAGE_BEGINS}


def suggest_with(
    command: str, asked: Asked, runs: Sequence[str], *more: str, profile: str | None = None
) -> None:
    """Suggest a command on the same runs, by the same profile unless another is named."""
    suggest_next(command, runs, "-p", profile or asked.profile, *asked.options, *more)


def declared_profile(path: Path) -> WinchProfile | RobotProfile:
    """The profile of a winch or of a robot. Raises FileError."""
    from winchkit.schema.profiles.winch import WinchProfile
    from winchkit.schema.read import read_any, read_profile

    value: Any = read_any(path)
    if isinstance(value, WinchProfile) or wings.call("compare", value) is not None:
        declared: WinchProfile | RobotProfile = value
        return declared
    # The reader of winches refuses every other kind in its own words.
    return read_profile(path)


def refuse_options(
    declared: WinchProfile | RobotProfile, band: float | None, winch: str | None = None
) -> None:
    """Raise UsageError for options that mean nothing for a robot's poses."""
    from winchkit.schema.profiles.robot import RobotProfile

    if not isinstance(declared, RobotProfile):
        return
    if band is not None:
        raise UsageError("--band: a robot's poses stand still and have no torque to filter")
    if winch is not None:
        raise UsageError("--winch: a robot's lines are judged together; leave it out")


def refuse_curves(declared: WinchProfile | RobotProfile) -> None:
    """Raise UsageError for a robot's profile where a curve along a winch's run is asked for."""
    from winchkit.schema.profiles.robot import RobotProfile

    if isinstance(declared, RobotProfile):
        raise UsageError(
            f"'{declared.name}' is a robot: there is no initial curve along its poses. "
            "'winchkit diagnose' reports what explains the residual; write the effect by hand, as "
            "examples/my_effect.py, with on_robot, and give it with --effects"
        )
