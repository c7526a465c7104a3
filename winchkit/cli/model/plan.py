"""``winchkit plan``: the next motion programme, as a file that ``winchkit run`` executes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from shlex import quote
from string import ascii_uppercase
from typing import TYPE_CHECKING

import click

from winchkit.cli.core.command import Command
from winchkit.cli.core.completion import files_of_kind
from winchkit.cli.core.messages import note, suggest_next
from winchkit.cli.core.options import BENCH, output_option
from winchkit.cli.core.output import echo_json
from winchkit.cli.core.terminal import progress_bar
from winchkit.cli.model.options import (
    Asked,
    json_option,
    model_options,
    read_all,
    refuse_options,
    runs_argument,
    suggest_with,
)
from winchkit.errors import UsageError, suggest

if TYPE_CHECKING:
    from winchkit.diagnosis.design.plan import Offer
    from winchkit.diagnosis.plan import Plan
    from winchkit.effects.term import Term
    from winchkit.robot.diagnosis.plan import PosePlan
    from winchkit.schema.bench import LimitSpec
    from winchkit.schema.profiles.robot import RobotProfile
    from winchkit.schema.profiles.winch import WinchProfile


def tell_poses(
    runs: Sequence[str],
    declared: RobotProfile,
    asked: Asked,
    output: str | None,
    bench: str | None,
    as_json: bool,
) -> None:
    """Diagnose, then propose poses; raises UsageError for options that mean nothing here."""
    from winchkit.robot.diagnosis.diagnose import diagnose_robot
    from winchkit.robot.diagnosis.plan import plan_poses

    refuse_options(asked.band, asked.winch)
    if bench is not None:
        raise UsageError(
            "--bench: a robot's plan keeps to the poses that pulling cables can hold inside its "
            "frame; leave it out"
        )
    if output is not None and Path(output).suffix == ".toml":
        raise UsageError(
            f"-o {output}: a robot's plan is a list of poses and no programme; name a .csv file"
        )
    with progress_bar() as progress:
        answer = diagnose_robot(read_all(runs), declared, asked.catalogue, progress)
        progress("designing poses", None)
        plan = plan_poses(answer)
    best = plan.best
    if output and best is not None:
        from winchkit.runs import write_run

        write_run(plan.run(best), output)
        note(f"written: {output}, the poses '{best.kind.name}'")
    elif output:
        click.echo(f"nothing written to {output}: no such poses show more", err=True)
    if as_json:
        echo_json({**plan.to_json(), "written": output if best is not None else None})
    else:
        click.echo(_poses_text(plan))


def _poses_text(plan: PosePlan) -> str:
    """A line a kind, the best first, then its poses."""
    from math import degrees

    from winchkit.quantity_text import percent
    from winchkit.report.words.columns import hanging
    from winchkit.robot.diagnosis.pose_design import reach

    if not plan.offers:
        return (
            "nothing to distinguish, and every effect of usual size is detectable with these poses"
        )
    letters = ascii_uppercase[: len(plan.pairs)]
    head = ["poses to record next (nothing to distinguish: what else they would show)"]
    if plan.pairs:
        head = ["poses to record next, with the power to distinguish"]
        head += [
            f"  {letter}: {a.effect.id} / {b.effect.id}"
            for letter, (a, b) in zip(letters, plan.pairs, strict=False)
        ]
    rows = [["poses", "reach", "turn", *letters, "shows besides"]]
    for offer in plan.offers:
        away, turned = reach(offer)
        powers = [percent(power) for power in plan.of_pairs(offer)]
        shown = plan.shows(offer)
        listed = ", ".join(shown[:_FEW]) or "—"
        listed += f" and {len(shown) - _FEW} more" if len(shown) > _FEW else ""
        far = [f"{away * 1e3:.0f} mm", f"{degrees(turned):.0f}°"]
        rows.append([f"{len(offer.pose.position)} {offer.kind.name}", *far, *powers, listed])
    return "\n".join([*head, *hanging(rows), *_indistinguishable(plan), *_listed(plan)])


def _indistinguishable(plan: PosePlan) -> list[str]:
    """What no poses distinguish, and what does."""
    from winchkit.diagnosis.design.discrimination import LEAST_POWER
    from winchkit.effects.effect import told_apart
    from winchkit.report.words.columns import paragraph

    lines = []
    for index, (first, second) in enumerate(plan.pairs):
        if max(offer.powers[index] for offer in plan.offers) < LEAST_POWER:
            names = f"{first.effect.id} / {second.effect.id}"
            what = told_apart(first.effect, second.effect)
            lines += paragraph(f"{names}: no such poses distinguish them. What does: {what}")
    if plan.best is None and not plan.pairs:
        hidden = ", ".join(term.effect.id for term in plan.hidden)
        lines += paragraph(f"No such poses would show what these did not: {hidden}.")
    return lines


def _listed(plan: PosePlan) -> list[str]:
    """The poses of the best offer."""
    from math import degrees

    from winchkit.model.rotation import angles_of
    from winchkit.report.words.columns import aligned

    offer = plan.best
    if offer is None:
        return []
    rows = [["", "x [mm]", "y [mm]", "z [mm]", "roll [°]", "pitch [°]", "yaw [°]"]]
    turned = angles_of(offer.pose.rotation).tolist()
    for number, (place, angles) in enumerate(
        zip(offer.pose.position.tolist(), turned, strict=True), start=1
    ):
        cells = [f"{v * 1e3:.0f}" for v in place]
        cells += [f"{round(degrees(v), 1) + 0.0:.1f}" for v in angles]
        rows.append([str(number), *cells])
    head = f"the poses '{offer.kind.name}', in this order; -o FILE.csv writes them"
    return ["", head, *aligned(rows)]


_FEW = 2
"""Effects named in a row; --json has them all."""


@click.command(
    cls=Command,
    examples=(
        "winchkit plan demo-*.csv -p bench-spiral",
        "winchkit plan demo-*.csv -p bench-spiral -b bench.toml -o next.toml",
    ),
)
@runs_argument
@output_option(
    "Programme (.toml) to write, the first of the list; of a robot poses (.csv).", "NEXT"
)
@click.option(
    "-b",
    "--bench",
    metavar="FILE",
    type=BENCH,
    help="Bench file whose limits say how far, how fast and how heavy; else as the RUNs were.",
)
@model_options
@json_option
def command(
    runs: Sequence[str], output: str | None, bench: str | None, asked: Asked, as_json: bool
) -> None:
    """Propose motion programmes, ranked by the effects that they distinguish and show per minute.

    Kinds of programmes are tried on the model with the noise of the RUNs: those that separate
    the effects that these runs cannot distinguish come first, else those that show what these
    could not. Run the file with 'winchkit run NEXT.toml --bench B' and diagnose again.
    For a robot's profile the plan is a list of poses, and NEXT.csv a run of them to measure at.
    """
    from winchkit.cli.model.options import declared_profile
    from winchkit.schema.profiles.robot import RobotProfile

    declared = declared_profile(asked.source)
    if isinstance(declared, RobotProfile):
        from winchkit.cli.model.plan import tell_poses

        tell_poses(runs, declared, asked, output, bench, as_json)
    else:
        _plan_winch(runs, declared, asked, output, bench, as_json)


def _plan_winch(
    runs: Sequence[str],
    declared: WinchProfile,
    asked: Asked,
    output: str | None,
    bench: str | None,
    as_json: bool,
) -> None:
    """The next programme of one winch."""
    from winchkit.diagnosis.diagnose import diagnose
    from winchkit.diagnosis.plan import plan
    from winchkit.schema.profiles.axis import AxisProfile
    from winchkit.schema.programme import write_programme

    if isinstance(declared, AxisProfile):
        raise UsageError(
            f"'{declared.name}' is an axis, and motion programmes are in cable length; "
            "'winchkit diagnose' lists the next runs"
        )
    path = None if output is None else _programme_file(output)
    limits = None if bench is None else _limits(bench, asked.winch)
    with progress_bar() as progress:
        answer = diagnose(
            asked.runs(runs), declared, asked.catalogue, asked.band, progress=progress
        )
        progress("simulating programmes", None)
        found = plan(answer, asked.catalogue, limits)
    if as_json:
        best = found.offers[0].kind.name
        echo_json({**found.to_json(), "programme": path, "chosen": best if path else None})
    else:
        click.echo(_text(found.offers, found.pairs))
        for line in _silent(found, widened=limits is not None):
            click.echo(line)
    if path is None:
        words = () if bench is None else ("-b", bench)
        suggest_with("plan", asked, runs, *words, "-o", "next.toml")
        return
    write_programme(found.programme(path.stem), path)
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


def _silent(found: Plan, *, widened: bool) -> list[str]:
    """What none of these programmes distinguishes, and what does."""
    from winchkit.effects.effect import told_apart

    lines, operating_range = [], found.operating_range
    for first, second in found.inseparable:
        names = f"{first.effect.id} / {second.effect.id}"
        lines.append(
            f"{names}: no such motion within {operating_range.low:.2f} m to "
            f"{operating_range.high:.2f} m distinguishes them. What does: "
            f"{told_apart(first.effect, second.effect)}"
        )
    if lines and not widened:
        lines.append("With --bench BENCH.toml the plan goes as far as that bench may.")
    return lines


def _text(found: Sequence[Offer], pairs: Sequence[tuple[Term, Term]]) -> str:
    """A line a kind, the best first; pairs of effects by letters."""
    from winchkit.quantity_text import percent
    from winchkit.report.words.columns import aligned, hanging, paragraph

    if not pairs:
        rows = [["programme", "minutes", "shows besides"]]
        rows += [[o.kind.name, f"{o.minutes:.1f}", _shown(o, _FEW)] for o in found]
        said = "what to run next (nothing to distinguish: what else it would show)"
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
    besides = paragraph(f"the first shows besides: {_shown(found[0])}", "  ", "    ")
    return "\n".join([*head, *aligned(table), *besides])


def _shown(offer: Offer, most: int | None = None) -> str:
    """Effects that a programme would show and the runs so far do not."""
    listed = ", ".join(offer.shows[:most]) or "—"
    left = len(offer.shows) - len(offer.shows[:most])
    return f"{listed} and {left} more" if left else listed
