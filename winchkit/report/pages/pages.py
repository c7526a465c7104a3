"""A diagnosis, a comparison or an addition as one self-contained page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from winchkit import wings
from winchkit.diagnosis.add import FittedAddition, FittedWinchAddition
from winchkit.diagnosis.compare import Compared, WinchCompared
from winchkit.diagnosis.diagnose import Answer, WinchAnswer
from winchkit.diagnosis.linear_axis import in_units_of
from winchkit.diagnosis.results import OutputError, OutputFit
from winchkit.profile_edit.naming import extended_name
from winchkit.report.figures.error_ratios import error_ratios, present
from winchkit.report.figures.figure import Figure
from winchkit.report.figures.maps import map_figures
from winchkit.report.figures.residuals import OutputFigures, Residuals, residual_figures
from winchkit.report.figures.unexplained import open_law_figures, unexplained_figures
from winchkit.report.html.markup import Markup
from winchkit.report.html.page import page
from winchkit.report.pages.addition import addition_sections
from winchkit.report.pages.comparison import comparison_sections
from winchkit.report.pages.diagnosis import sections
from winchkit.report.pages.parts import drawings
from winchkit.report.reproducibility import CommandLine
from winchkit.report.words.headline import size_texts, worst_outputs


def report_html(
    answer: Answer,
    title: str,
    story: Sequence[str] = (),
    truth: Mapping[str, object] | None = None,
    profile: str = "",
    *,
    options: Sequence[str] = (),
) -> str:
    """The page of a diagnosis."""
    if (by_wing := wings.call("html", answer)) is not None:
        return str(by_wing(answer, title, profile, options=options))
    assert isinstance(answer, WinchAnswer), "of a winch"
    command = CommandLine(answer.engine.regression.dataset, profile, options)
    outputs = answer.diagnosis.outputs
    ratios, drawn, cards = _drawn(outputs, residuals_of(answer, command.source))
    patterns = unexplained_figures(answer, command.source)
    laws = open_law_figures(answer, command.source)
    content = sections(
        answer,
        cards,
        story,
        truth,
        command,
        title=title,
        unexplained=patterns,
        open_laws=laws,
        ratios=ratios,
    )
    html = page(title, [*drawn, *laws, *patterns], content, headed=False)
    return in_units_of(answer.engine.regression.dataset.profile, html)


def report_figures(answer: Answer, source: str = "") -> list[Figure]:
    """The figures of the page of a diagnosis, the worst output first."""
    if (by_wing := wings.call("figures", answer)) is not None:
        return list(by_wing(answer, source))
    assert isinstance(answer, WinchAnswer), "of a winch"
    _, drawn, _ = _drawn(answer.diagnosis.outputs, residuals_of(answer, source))
    return [*drawn, *open_law_figures(answer, source), *unexplained_figures(answer, source)]


def residuals_of(answer: WinchAnswer, source: str = "") -> Residuals:
    """Residuals on the page of a diagnosis; ``after`` only where an effect was named."""
    diagnosis, found = answer.diagnosis, answer.result
    return Residuals(
        answer.engine.regression,
        found.initial_model.residual,
        found.final.residual if diagnosis.steps else None,
        {name: output.noise_rms for name, output in diagnosis.outputs.items()},
        _changed([step.effects[0] for step in diagnosis.steps]),
        source,
        tuple(worst_outputs(diagnosis.outputs)),
    )


def _changed(effects: Sequence[str]) -> str:
    """Name of the model with added effects."""
    return f"with {effects[0]}" if len(effects) == 1 else f"with {len(effects)} effects"


def residuals_of_comparison(compared: WinchCompared, source: str = "") -> Residuals:
    """Residuals on the page of a comparison."""
    outputs = compared.comparison.outputs
    noise = {name: error.noise_rms for name, error in outputs.items()}
    order = tuple(worst_outputs(outputs))
    return Residuals(
        compared.regression, compared.residual, None, noise, source=source, order=order
    )


def residuals_of_addition(fitted: FittedWinchAddition, source: str = "") -> Residuals:
    """Residuals on the page of an addition."""
    outputs = fitted.addition.outputs
    return Residuals(
        fitted.regression,
        fitted.initial_model.residual,
        fitted.final.residual,
        {name: output.noise_rms for name, output in outputs.items()},
        _changed([fitted.addition.added[0].label]),
        source,
        tuple(worst_outputs(outputs)),
    )


def comparison_html(
    compared: Compared, title: str, profile: str = "", *, options: Sequence[str] = ()
) -> str:
    """The page of a comparison; ``profile`` and ``options`` as in :func:`report_html`."""
    if (by_wing := wings.call("html", compared)) is not None:
        return str(by_wing(compared, title, profile, options=options))
    assert isinstance(compared, WinchCompared), "of a winch"
    command = CommandLine(compared.regression.dataset, profile, options)
    residuals = residuals_of_comparison(compared, command.source)
    own = residual_figures(residuals)
    ratios, drawn, cards = _drawn(compared.comparison.outputs, residuals, own)
    over = {one.output: one.followed for one in own if one.followed}
    content = comparison_sections(
        compared.comparison, over, cards, command, title=title, ratios=ratios
    )
    return page(title, drawn, content, headed=False)


def comparison_figures(compared: Compared, source: str = "") -> list[Figure]:
    """The figures of the page of a comparison, the worst output first."""
    if (by_wing := wings.call("figures", compared)) is not None:
        return list(by_wing(compared, source))
    assert isinstance(compared, WinchCompared), "of a winch"
    return _drawn(compared.comparison.outputs, residuals_of_comparison(compared, source))[1]


def addition_html(
    fitted: FittedAddition,
    title: str,
    profile: str = "",
    better: str = "",
    *,
    options: Sequence[str] = (),
) -> str:
    """The page of an added effect; ``better`` is the written profile, the others as above."""
    if (by_wing := wings.call("html", fitted)) is not None:
        return str(by_wing(fitted, title, profile, better, options=options))
    assert isinstance(fitted, FittedWinchAddition), "of a winch"
    command = CommandLine(fitted.regression.dataset, profile, options)
    residuals = residuals_of_addition(fitted, command.source)
    ratios, drawn, cards = _drawn(fitted.addition.outputs, residuals)
    better = better or extended_name(command.profile, fitted.addition.added[0].effect.id)
    content = addition_sections(fitted.addition, cards, command, better, title=title, ratios=ratios)
    html = page(title, drawn, content, headed=False)
    return in_units_of(fitted.regression.dataset.profile, html)


def addition_figures(fitted: FittedAddition, source: str = "") -> list[Figure]:
    """The figures of the page of an addition, the worst output first."""
    if (by_wing := wings.call("figures", fitted)) is not None:
        return list(by_wing(fitted, source))
    assert isinstance(fitted, FittedWinchAddition), "of a winch"
    return _drawn(fitted.addition.outputs, residuals_of_addition(fitted, source))[1]


def _drawn(
    outputs: Mapping[str, OutputError] | Mapping[str, OutputFit],
    residuals: Residuals,
    own: Sequence[OutputFigures] | None = None,
) -> tuple[Figure | None, list[Figure], list[Markup]]:
    """Error of every output over its noise, that and all figures of the outputs, and a card of each
    output."""
    own = residual_figures(residuals) if own is None else own
    ratios = error_ratios(
        outputs,
        extended=residuals.after is not None,
        changed=residuals.changed,
        source=residuals.source,
    )
    maps = map_figures(residuals, {one.output: one.scale for one in own})
    every = [
        figure
        for one in own
        for figure in (one.over_time, one.over_variable, *maps.get(one.output, ()))
        if figure is not None
    ]
    return ratios, [*present(ratios), *every], drawings(own, maps, size_texts(outputs))
