"""``winchkit plan`` of a robot: poses to record next."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from string import ascii_uppercase
from typing import TYPE_CHECKING

import click

from winchkit.cli.core.messages import note
from winchkit.cli.core.output import tell
from winchkit.cli.core.terminal import progress_bar
from winchkit.cli.model.options import Asked, read_all, refuse_options
from winchkit.errors import UsageError

if TYPE_CHECKING:
    from winchkit.robot.diagnosis.plan import PosePlan
    from winchkit.schema.profiles.robot import RobotProfile

_FEW = 2
"""Effects named in a row; --json has them all."""


def tell_poses(
    runs: Sequence[str],
    declared: RobotProfile,
    asked: Asked,
    output: str | None,
    bench: str | None,
) -> None:
    """Diagnose, then propose poses; raises UsageError for options that mean nothing here."""
    from winchkit.robot.diagnosis.diagnose import diagnose
    from winchkit.robot.diagnosis.plan import plan as plan_poses

    refuse_options(declared, asked.band, asked.winch)
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
        answer = diagnose(read_all(runs), declared, asked.catalogue, progress)
        progress("designing poses", None)
        plan = plan_poses(answer)
    best = plan.best
    if output and best is not None:
        from winchkit.runs import write_run

        write_run(plan.run(best), output, replace=True)
        note(f"written: {output}, the poses '{best.kind.name}'")
    elif output:
        click.echo(f"nothing written to {output}: no such poses show more", err=True)
    written = output if best is not None else None
    tell({**plan.to_json(), "written": written}, [_poses_text(plan)])


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
            names = f"{first.effect.id} and {second.effect.id}"
            what = told_apart(first.effect, second.effect)
            what = f"What does: {what[:1].lower()}{what[1:]}"
            lines += paragraph(f"No such poses decide between {names}. {what}")
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
