"""A diagnosis, a comparison or an addition as one self-contained page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from winchkit.diagnosis.add import Grown
from winchkit.diagnosis.compare import Compared
from winchkit.diagnosis.diagnose import Answer
from winchkit.diagnosis.report.addition_sections import addition_sections
from winchkit.diagnosis.report.comparison_sections import comparison_sections
from winchkit.diagnosis.report.plots import Residuals, plots_of
from winchkit.diagnosis.report.repeat import Command
from winchkit.diagnosis.report.sections import sections
from winchkit.diagnosis.report.shell import page

__all__ = ["addition_html", "comparison_html", "report_html", "residuals_of"]


def report_html(
    answer: Answer,
    title: str,
    story: Sequence[str] = (),
    truth: Mapping[str, object] | None = None,
    profile: str = "",
    *,
    options: Sequence[str] = (),
) -> str:
    """The page of a diagnosis.

    ``story`` tells in sentences what was done; ``truth`` is what a simulated bench hid, revealed
    last; ``profile`` is the profile as the user named it and ``options`` what else the command
    was given, for the commands that repeat all this.
    """
    residuals = residuals_of(answer)
    plots = plots_of(residuals)
    command = Command(residuals.problem.dataset, profile, options)
    return page(title, plots, sections(answer, plots, story, truth, command))


def residuals_of(answer: Answer) -> Residuals:
    """What the page of a diagnosis draws; an ``after`` only where something was named."""
    diagnosis, found = answer.diagnosis, answer.found
    return Residuals(
        answer.inquiry.problem,
        found.begin.residual,
        found.final.residual if diagnosis.steps else None,
        {name: output.noise_rms for name, output in diagnosis.outputs.items()},
    )


def comparison_html(
    compared: Compared, title: str, profile: str = "", *, options: Sequence[str] = ()
) -> str:
    """The page of a comparison; ``profile`` and ``options`` as in :func:`report_html`."""
    noise = {name: error.noise_rms for name, error in compared.comparison.outputs.items()}
    plots = plots_of(Residuals(compared.problem, compared.residual, None, noise))
    command = Command(compared.problem.dataset, profile, options)
    return page(title, plots, comparison_sections(compared.comparison, plots, command))


def addition_html(
    grown: Grown, title: str, profile: str = "", better: str = "", *, options: Sequence[str] = ()
) -> str:
    """The page of an addition; ``better`` is the profile that was written, the rest as above."""
    noise = {name: output.noise_rms for name, output in grown.addition.outputs.items()}
    plots = plots_of(Residuals(grown.problem, grown.begin.residual, grown.final.residual, noise))
    command = Command(grown.problem.dataset, profile, options)
    better = better or "better.toml"
    return page(title, plots, addition_sections(grown.addition, plots, command, better))
