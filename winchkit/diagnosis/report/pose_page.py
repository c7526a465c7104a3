"""What a robot's poses came to as one self-contained page, without script."""

from __future__ import annotations

from collections.abc import Sequence

from winchkit.diagnosis.report.addition_sections import addition_sections
from winchkit.diagnosis.report.comparison_sections import comparison_sections
from winchkit.diagnosis.report.pose_figures import pose_figures
from winchkit.diagnosis.report.repeat import Command
from winchkit.diagnosis.report.sections import sections
from winchkit.diagnosis.report.sentence import moved_outputs
from winchkit.diagnosis.report.shell import page
from winchkit.diagnosis.robot.add import RobotGrown
from winchkit.diagnosis.robot.answer import RobotAnswer
from winchkit.diagnosis.robot.compare import RobotCompared

__all__ = ["robot_addition_html", "robot_comparison_html", "robot_report_html"]


def robot_report_html(
    answer: RobotAnswer, title: str, profile: str = "", *, options: Sequence[str] = ()
) -> str:
    """The page of a robot's diagnosis; ``profile`` and ``options`` as the user gave them."""
    diagnosis, seen = answer.diagnosis, answer.seen
    before, after = seen.errors
    noise = {name: output.noise_rms for name, output in diagnosis.outputs.items()}
    moved = moved_outputs(diagnosis.outputs) if diagnosis.steps else []
    grown = after if diagnosis.steps else None
    figures = pose_figures(seen.final.problem, before, grown, noise, moved)
    command = Command(seen.study.dataset, profile, options)
    return page(title, (), sections(answer, figures, (), None, command))


def robot_comparison_html(
    compared: RobotCompared, title: str, profile: str = "", *, options: Sequence[str] = ()
) -> str:
    """The page of a robot's comparison."""
    comparison, command = compared.comparison, Command(compared.problem.dataset, profile, options)
    noise = {name: error.noise_rms for name, error in comparison.outputs.items()}
    figures = pose_figures(compared.problem, compared.errors, None, noise)
    content = comparison_sections(comparison, compared.followed, figures, command)
    return page(title, (), content)


def robot_addition_html(
    grown: RobotGrown,
    title: str,
    profile: str = "",
    better: str = "",
    *,
    options: Sequence[str] = (),
) -> str:
    """The page of an effect added to a robot; ``better`` is the profile that was written."""
    outputs = grown.addition.outputs
    noise = {name: output.noise_rms for name, output in outputs.items()}
    before, after = grown.errors
    figures = pose_figures(grown.problem, before, after, noise, moved_outputs(outputs))
    command = Command(grown.problem.dataset, profile, options)
    content = addition_sections(grown.addition, figures, command, better or "better.toml")
    return page(title, (), content)
