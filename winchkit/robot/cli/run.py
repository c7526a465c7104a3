"""``winchkit run`` with a robot programme."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from winchkit.cli.core.early_checks import check_folder
from winchkit.cli.core.messages import note
from winchkit.cli.core.output import tell
from winchkit.errors import UsageError

if TYPE_CHECKING:
    from winchkit.robot.bench.programme import Motions
    from winchkit.schema.bench import BenchSpec
    from winchkit.schema.robot_programme import RobotProgramme


def run_robot(
    programme: RobotProgramme,
    bench: str,
    effects: Sequence[str],
    folder: Path,
    suffix: str,
    *,
    replace: bool,
    dry_run: bool,
) -> None:
    """Plan and check a robot programme, and run it unless this is a dry run."""
    from winchkit.schema.read import read_bench

    spec = read_bench(bench).with_effects(effects)
    if spec.robot is None:
        raise UsageError(
            f"{bench} declares no robot, and '{programme.name}' is a robot programme; write a "
            "table [robot] (docs/formats.md)"
        )
    if dry_run:
        _tell_plan(programme, spec)
        return
    check_folder(folder)
    from winchkit.bench.open import open_bench
    from winchkit.bench.remote.identity import client_name
    from winchkit.robot.bench.programme import run_robot_programme

    def report(repeat: int, number: int) -> None:
        note(f"{programme.name} {repeat}/{programme.repeat}, motion {number}")

    with open_bench(bench, effect_files=effects, name=client_name("run"), realtime="try") as opened:
        written = run_robot_programme(
            opened, programme, folder, suffix=suffix, progress=report, replace_files=replace
        )
    tell({"programme": programme.name, "runs": written}, map(str, written))


def _tell_plan(programme: RobotProgramme, spec: BenchSpec) -> None:
    """Plan from the home pose without a bench."""
    from winchkit.robot.bench.planner import Planner
    from winchkit.robot.bench.programme import planned_motions

    planner = Planner.of(spec)
    motions, _ = planned_motions(planner, programme, planner.robot.home)
    summary = _summary(motions)
    line = (
        f"{programme.name}: {summary['length']:.3f} m of path in {summary['duration']:.1f} s from "
        f"the home pose; cable forces {summary['least_force']:.0f} N to "
        f"{summary['greatest_force']:.0f} N; nothing was moved"
    )
    tell({"programme": programme.name, **summary}, [line])


def _summary(motions: Motions) -> dict[str, float]:
    moves = [one for one in motions if not isinstance(one, float)]
    holds = sum(one for one in motions if isinstance(one, float))
    return {
        "length": sum(one.path.length for one in moves),
        "duration": holds + sum(one.duration for one in moves),
        "least_force": min((float(one.force.min()) for one in moves), default=float("nan")),
        "greatest_force": max((float(one.force.max()) for one in moves), default=float("nan")),
        "largest_force_step": max(
            (float(abs(one.force[1:] - one.force[:-1]).max()) for one in moves),
            default=float("nan"),
        ),
    }
