"""What ``winchkit plan`` says of a robot: the poses to take next, as a table and as a file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from string import ascii_uppercase
from typing import TYPE_CHECKING

import click

from winchkit.cli.output import echo_json
from winchkit.cli.robot_model import refuse_options
from winchkit.cli.runs_option import Asked, read_all
from winchkit.errors import UsageError

if TYPE_CHECKING:
    from winchkit.diagnosis.robot.plan import PosePlan
    from winchkit.schema.robot import RobotProfile

__all__ = ["tell_poses"]

_FEW = 2


def tell_poses(
    runs: Sequence[str],
    declared: RobotProfile,
    asked: Asked,
    output: str | None,
    bench: str | None,
    as_json: bool,
) -> None:
    """Diagnose, then propose poses; raises UsageError for options that mean nothing here."""
    from winchkit.diagnosis.robot.diagnose import diagnose_robot
    from winchkit.diagnosis.robot.plan import plan_poses

    refuse_options(asked.band, asked.winch)
    if bench is not None:
        raise UsageError(
            "--bench: a robot's plan keeps to the poses that pulling ropes can hold inside its "
            "frame; leave it out"
        )
    if output is not None and Path(output).suffix == ".toml":
        raise UsageError(
            f"-o {output}: a robot's plan is a list of poses and no programme; name a .csv file"
        )
    plan = plan_poses(diagnose_robot(read_all(runs), declared, asked.catalogue))
    best = plan.best
    if output and best is not None:
        from winchkit.runs import write_run

        write_run(plan.run(best), output)
        click.echo(f"written: {output}", err=True)
    elif output:
        click.echo(f"nothing written to {output}: no such poses tell more", err=True)
    if as_json:
        echo_json({**plan.to_json(), "written": output if best is not None else None})
    else:
        click.echo(_text(plan))


def _text(plan: PosePlan) -> str:
    """A line a kind, the best first, then its poses."""
    from math import degrees

    from winchkit.diagnosis.report.columns import hanging
    from winchkit.diagnosis.report.wording import percent
    from winchkit.diagnosis.robot.next_poses import reach

    if not plan.offers:
        return "nothing to tell apart, and these poses would have shown every effect of usual size"
    letters = ascii_uppercase[: len(plan.pairs)]
    head = ["what poses to take next (nothing to tell apart: what they would show besides)"]
    if plan.pairs:
        head = ["what poses to take next, with the chance (power) that they tell apart"]
        head += [
            f"  {letter}: {a.effect.id} / {b.effect.id}"
            for letter, (a, b) in zip(letters, plan.pairs, strict=False)
        ]
    rows = [["poses", "reach", "turn", *letters, "shows besides"]]
    for offer in plan.offers:
        away, turned = reach(offer)
        powers = [percent(power) for power in plan.of_pairs(offer)]
        shown = plan.shows(offer)
        told = ", ".join(shown[:_FEW]) or "—"
        told += f" and {len(shown) - _FEW} more" if len(shown) > _FEW else ""
        far = [f"{away * 1e3:.0f} mm", f"{degrees(turned):.0f}°"]
        rows.append([f"{len(offer.pose.position)} {offer.kind.name}", *far, *powers, told])
    return "\n".join([*head, *hanging(rows), *_silent(plan), *_listed(plan)])


def _silent(plan: PosePlan) -> list[str]:
    """What no poses tell apart, and what does."""
    from winchkit.diagnosis.report.columns import paragraph
    from winchkit.diagnosis.robot.next_poses import WORTHWHILE
    from winchkit.effects.effect import told_apart

    lines = []
    for index, (first, second) in enumerate(plan.pairs):
        if max(offer.powers[index] for offer in plan.offers) < WORTHWHILE:
            names = f"{first.effect.id} / {second.effect.id}"
            what = told_apart(first.effect, second.effect)
            lines += paragraph(f"{names}: no such poses tell them apart. What does: {what}")
    if plan.best is None and not plan.pairs:
        hidden = ", ".join(term.effect.id for term in plan.hidden)
        lines += paragraph(f"No such poses would show what these did not: {hidden}.")
    return lines


def _listed(plan: PosePlan) -> list[str]:
    """The poses of the best offer."""
    from math import degrees

    from winchkit.diagnosis.report.columns import aligned
    from winchkit.model.robot import angles_of

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
    told = f"the poses '{offer.kind.name}', in this order; -o FILE.csv writes them"
    return ["", told, *aligned(rows)]
