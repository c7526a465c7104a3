"""A diagnosis, a comparison or an addition as one self-contained page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from winchkit.diagnosis.add import Grown
from winchkit.diagnosis.compare import Compared
from winchkit.diagnosis.diagnose import WinchAnswer
from winchkit.report.figures.maps import maps_drawn
from winchkit.report.figures.plots import OutputPlots, Residuals, plots_of
from winchkit.report.html.markup import Markup
from winchkit.report.html.page import page
from winchkit.report.pages.addition import addition_sections
from winchkit.report.pages.comparison import comparison_sections
from winchkit.report.pages.diagnosis import sections
from winchkit.report.pages.parts import drawings
from winchkit.report.reproducibility import Command
from winchkit.report.words.sentence import moved_outputs

__all__ = ["addition_html", "comparison_html", "report_html", "residuals_of"]


def report_html(
    answer: WinchAnswer,
    title: str,
    story: Sequence[str] = (),
    truth: Mapping[str, object] | None = None,
    profile: str = "",
    *,
    options: Sequence[str] = (),
) -> str:
    """The page of a diagnosis.

    Parameters
    ----------
    answer : WinchAnswer
        The diagnosis.
    title : str
        Title of the page.
    story : sequence of str, optional
        Sentences on the procedure.
    truth : mapping, optional
        The hidden effect of a simulated bench, shown at the end.
    profile : str, optional
        The profile as the user named it, for the printed commands.
    options : sequence of str, optional
        Further options of the command.

    Returns
    -------
    str
        HTML, self-contained.
    """
    residuals, diagnosis = residuals_of(answer), answer.diagnosis
    plots = plots_of(residuals)
    moved = moved_outputs(diagnosis.outputs) if diagnosis.steps else []
    figures = _figures(residuals, plots, moved)
    command = Command(residuals.regression.dataset, profile, options)
    return page(title, plots, sections(answer, figures, story, truth, command))


def residuals_of(answer: WinchAnswer) -> Residuals:
    """Residuals on the page of a diagnosis; ``after`` only where an effect was named."""
    diagnosis, found = answer.diagnosis, answer.result
    return Residuals(
        answer.engine.regression,
        found.initial_model.residual,
        found.final.residual if diagnosis.steps else None,
        {name: output.noise_rms for name, output in diagnosis.outputs.items()},
    )


def comparison_html(
    compared: Compared, title: str, profile: str = "", *, options: Sequence[str] = ()
) -> str:
    """The page of a comparison; ``profile`` and ``options`` as in :func:`report_html`.

    Parameters
    ----------
    compared : Compared
        The comparison, with its residuals.
    title : str
        Title of the page.
    profile : str
        The profile as the user named it.
    options : sequence of str
        Further options of the command.

    Returns
    -------
    str
        HTML, self-contained.
    """
    noise = {name: error.noise_rms for name, error in compared.comparison.outputs.items()}
    residuals = Residuals(compared.regression, compared.residual, None, noise)
    plots = plots_of(residuals)
    figures = _figures(residuals, plots)
    command = Command(compared.regression.dataset, profile, options)
    over = {own.output: own.followed for own in plots if own.followed}
    return page(title, plots, comparison_sections(compared.comparison, over, figures, command))


def addition_html(
    grown: Grown, title: str, profile: str = "", better: str = "", *, options: Sequence[str] = ()
) -> str:
    """The page of an added effect; ``better`` is the written profile, the others as above.

    Parameters
    ----------
    grown : Grown
        The addition, with its residuals.
    title : str
        Title of the page.
    profile : str
        The profile as the user named it.
    better : str
        The written profile.
    options : sequence of str
        Further options of the command.

    Returns
    -------
    str
        HTML, self-contained.
    """
    noise = {name: output.noise_rms for name, output in grown.addition.outputs.items()}
    residuals = Residuals(
        grown.regression, grown.initial_model.residual, grown.final.residual, noise
    )
    plots = plots_of(residuals)
    figures = _figures(residuals, plots, moved_outputs(grown.addition.outputs))
    command = Command(grown.regression.dataset, profile, options)
    better = better or "better.toml"
    return page(title, plots, addition_sections(grown.addition, figures, command, better))


def _figures(
    residuals: Residuals, plots: Sequence[OutputPlots], first: Sequence[str] = ()
) -> list[Markup]:
    """Curves and maps of every output; some outputs come first."""
    return drawings(plots, maps_drawn(residuals, {p.output: p.scale for p in plots}), first)
