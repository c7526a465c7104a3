"""``winchkit plan``: the next motion programme, as a file that ``winchkit run`` executes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from shlex import quote
from string import ascii_uppercase
from typing import TYPE_CHECKING

import click

from winchkit.cli.core.command import ToolCommand
from winchkit.cli.core.completion import files_of_kind
from winchkit.cli.core.messages import note, suggest_next
from winchkit.cli.core.options import BENCH, output_option, replace_option
from winchkit.cli.core.output import json_flag, tell
from winchkit.cli.core.terminal import progress_bar
from winchkit.cli.model.options import (
    Asked,
    declared_profile,
    model_options,
    runs_argument,
    suggest_with,
)
from winchkit.errors import UsageError, suggest

if TYPE_CHECKING:
    from winchkit.diagnosis.design.plan import Offer
    from winchkit.diagnosis.plan import WinchPlan
    from winchkit.schema.bench import LimitSpec
    from winchkit.schema.profiles.winch import WinchProfile


_FEW = 2
"""Effects named in a row; --json has them all."""


@click.command(
    cls=ToolCommand,
    examples=(
        "winchkit plan demo-*.csv -p bench-spiral",
        "winchkit plan demo-*.csv -p bench-spiral -b bench.toml -o next.toml",
    ),
)
@runs_argument
@output_option(
    "Programme (.toml) to write, the first of the list; of a robot poses (.csv).", "NEXT"
)
@replace_option
@click.option(
    "-b",
    "--bench",
    metavar="FILE",
    type=BENCH,
    help="Bench file whose limits say how far, how fast and how heavy; else as the RUNs were.",
)
@model_options
@json_flag("Print the answer as JSON.")
def command(
    runs: Sequence[str], output: str | None, replace: bool, bench: str | None, asked: Asked
) -> None:
    """Propose motion programmes, ranked by the effects that they distinguish and show per minute.

    Kinds of programmes are tried on the model with the noise of the RUNs: those that separate
    the effects that these runs cannot distinguish come first, else those that show what these
    could not. Run the file with 'winchkit run NEXT.toml --bench B' and diagnose again.
    For a robot's profile the plan is a list of poses, and NEXT.csv a run of them to measure at.
    """
    from winchkit import wings
    from winchkit.diagnosis.profiles import require_winch
    from winchkit.regular_file import refuse_existing

    declared = declared_profile(asked.source)
    if output is not None:
        refuse_existing(Path(output), replace)
    if (by_wing := wings.call("plan_command", declared)) is not None:
        by_wing(runs, declared, asked, output, bench)
    else:
        _plan_winch(runs, require_winch(declared), asked, output, bench, replace=replace)


def _plan_winch(
    runs: Sequence[str],
    declared: WinchProfile,
    asked: Asked,
    output: str | None,
    bench: str | None,
    *,
    replace: bool,
) -> None:
    """The next programme of one winch."""
    from winchkit.diagnosis.diagnose import diagnose
    from winchkit.diagnosis.plan import plan
    from winchkit.regular_file import refuse_existing
    from winchkit.report.words.columns import paragraph
    from winchkit.report.words.sentence import plan_texts
    from winchkit.schema.profiles.axis import AxisProfile
    from winchkit.schema.write import write_programme

    if isinstance(declared, AxisProfile):
        raise UsageError(
            f"'{declared.name}' is an axis, and motion programmes are in cable length; "
            "'winchkit diagnose' lists the next runs"
        )
    path = None if output is None else _programme_file(output)
    if path is not None:
        refuse_existing(path, replace)
    limits = None if bench is None else _limits(bench, asked.winch)
    with progress_bar() as progress:
        answer = diagnose(
            asked.runs(runs), declared, asked.catalogue, asked.band, progress=progress
        )
        progress("simulating programmes", None)
        found = plan(answer, asked.catalogue, limits)
    chosen = found.offers[0].kind.name if path else None
    texts = plan_texts(found)
    if found.inseparable and limits is None:
        texts.append("With --bench BENCH.toml the plan uses the whole range of that bench.")
    said = [line for text in texts for line in paragraph(text)]
    lines = [_text(found), *said] if found.pairs else [_first(found), *said, "", _text(found)]
    tell({**found.to_json(), "programme": path, "chosen": chosen}, lines)
    if path is None:
        words = () if bench is None else ("-b", bench)
        suggest_with("plan", asked, runs, *words, "-o", "next.toml")
        return
    write_programme(found.programme(path.stem), path, replace=True)
    note(f"written: {path}, the first of the list: {found.offers[0].kind.name}")
    suggest_run(path, bench)


def suggest_run(path: Path, bench: str | None) -> None:
    """Suggest to execute a programme; without any bench file the command has a blank to fill."""
    if bench is None and len(files_of_kind(Path(), ("bench",))) != 1:
        note(f"on a bench: winchkit run {quote(str(path))} -b BENCH.toml")
        return
    suggest_next("run", str(path), *(() if bench is None else ("-b", bench)))


def _programme_file(output: str) -> Path:
    """Name of a programme's file; raises UsageError for the suffix of another kind of file."""
    path = Path(output)
    if path.suffix not in {"", ".toml"}:
        raise UsageError(f"-o {output}: a motion programme is a .toml file; name one")
    return path.with_suffix(".toml")


def _limits(bench: str, winch: str | None) -> LimitSpec:
    """How far, how fast and how heavy the next programme may go on a bench."""
    from winchkit.schema.read import read_bench

    wired = read_bench(bench).winch
    if winch is None and len(wired) > 1:
        raise UsageError(f"no winch is given: {bench} has {', '.join(wired)}; give --winch")
    name = winch or next(iter(wired))
    if name not in wired:
        known = list(wired)
        raise UsageError(
            f"{bench} has no winch '{name}'; it has {', '.join(known)}{suggest(name, known)}"
        )
    return wired[name].limits


def _first(plan: WinchPlan) -> str:
    """The programme to run, where no effects are to be distinguished."""
    best = plan.offers[0]
    return f"Run next: {best.kind.name}, {best.minutes:.1f} minutes."


def _text(plan: WinchPlan) -> str:
    """A line a kind, the best first; pairs of effects by letters."""
    from winchkit.quantity_text import percent
    from winchkit.report.words.columns import aligned, hanging, paragraph

    found, pairs = plan.offers, plan.pairs
    if not pairs:
        rows = [["programme", "min", "could show"]]
        rows += [[o.kind.name, f"{o.minutes:.1f}", _shown(o, _FEW)] for o in found]
        said = "programmes, and the effects that they could show and these runs could not"
        return "\n".join([said, *hanging(rows)])
    letters = ascii_uppercase[: len(pairs)]
    table = [["programme", "minutes", *letters]]
    for offer in found:
        powers = [percent(power) for power in offer.powers[: len(letters)]]
        table.append([offer.kind.name, f"{offer.minutes:.1f}", *powers])
    head = ["what to run next, with the power to distinguish"]
    head += [
        f"  {letter}: {a.effect.id} / {b.effect.id}"
        for letter, (a, b) in zip(letters, pairs, strict=False)
    ]
    besides: list[str] = []
    if found[0].shows:
        besides = paragraph(f"the first could also show: {_shown(found[0])}", "  ", "    ")
    return "\n".join([*head, *aligned(table), *besides])


def _shown(offer: Offer, most: int | None = None) -> str:
    """Effects that a programme would show and the runs so far do not."""
    listed = ", ".join(offer.shows[:most]) or "—"
    left = len(offer.shows) - len(offer.shows[:most])
    return f"{listed} and {left} more" if left else listed
