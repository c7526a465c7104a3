"""Sections of the page of a comparison."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from winchkit.diagnosis.residuals.attribution import Attribution
from winchkit.diagnosis.results import Comparison, OutputError
from winchkit.quantity_text import percent, quantity, scale_for, significant, unbroken
from winchkit.report.comparison_rows import HEAD, followed, offset_text, size_rows
from winchkit.report.figures.figure import Figure
from winchkit.report.html.markup import Markup, element, folded, join, table
from winchkit.report.html.page import figure_block
from winchkit.report.pages.parts import bullets, code_block, compared_text, data, lead
from winchkit.report.reproducibility import CommandLine, repeat
from winchkit.report.words.headline import at_noise, comparison_headline, worst_outputs
from winchkit.report.words.sentence import capital, often_per_turn
from winchkit.report.words.vocabulary import output_name, variable_name

_NEXT = (
    "A comparison quantifies the error, not its cause. This command names the missing effect, or "
    "states that there is none:"
)


def comparison_sections(
    comparison: Comparison,
    over: Mapping[str, Attribution],
    figures: Sequence[Markup],
    command: CommandLine,
    *,
    title: str = "",
    ratios: Figure | None = None,
) -> Markup:
    """Content of the page; ``over`` is the main variable of each output's error."""
    profile = command.profile
    return join(
        [
            _lead(comparison, over, command, title=title, ratios=ratios),
            element("div", *figures, id="residuals"),
            folded("attribution", "Error of every output", _table(comparison)),
            folded("data", "Data", data(comparison)),
            folded("notes", "Notes", bullets(comparison.notes)),
            repeat(
                command,
                [command.compare(profile), command.diagnose(profile)],
                "comparison",
                comparison.to_json(),
            ),
        ]
    )


def distance_text(name: str, error: OutputError, over: Attribution | None) -> str:
    """Error of one output, its ratio to the noise, and its attribution."""
    size = f"{quantity(error.rms, error.unit)} rms"
    off = f"The error of the {output_name(name)} is {size}"
    if error.noise_rms is None:
        return f"{off}; its noise is unknown without repeats; {_attributed(over)}."
    noise = f"its noise of {quantity(error.noise_rms, error.unit)}"
    if at_noise(error):
        return f"{off}, about {noise}."
    ratio = error.rms / error.noise_rms if error.noise_rms else None
    beside = "with" if ratio is None else f"{significant(ratio, 2)} times"
    return f"{off}, {beside} {noise}; {_attributed(over)}."


def _attributed(over: Attribution | None) -> str:
    if over is None:
        return "no measured variable explains it"
    share = f"({percent(over.share)} of its variance)"
    if over.order is not None:
        return f"it has {often_per_turn(over.variable, over.order)} {share}"
    return f"it depends on {variable_name(over.variable)} {share}"


def _lead(
    comparison: Comparison,
    over: Mapping[str, Attribution],
    command: CommandLine,
    *,
    title: str,
    ratios: Figure | None,
) -> Markup:
    outputs = comparison.outputs
    texts = [
        element("div", unbroken(distance_text(name, outputs[name], over.get(name))))
        for name in worst_outputs(outputs)
    ]
    chip, tone = _chip(list(outputs.values()))
    beside = [_sizes(comparison), *([figure_block(ratios, 480)] if ratios else [])]
    rows = [
        ("Compared", compared_text(command.dataset, command.profile)),
        ("Error", join(texts)),
        ("Cause", join([_NEXT, code_block(command.diagnose(command.profile))])),
    ]
    return lead(title, chip, tone, comparison_headline(comparison), rows, *beside)


def _sizes(comparison: Comparison) -> Markup:
    """Error, noise and their ratio, the worst output first."""
    rows = []
    for name in worst_outputs(comparison.outputs):
        error = comparison.outputs[name]
        scale = scale_for(error.rms, error.unit)
        noise = "unknown" if error.noise_rms is None else scale.text(error.noise_rms)
        size = element("span", scale.text(error.rms), class_="before")
        measured = quantity(error.signal_rms, error.unit)
        rows.append([output_name(name), size, noise, _ratio(error), measured])
    head = ["output", "error, rms", "noise", "÷ noise", "measured"]
    return table("Measured less predicted, with the values of the profile's file.", head, rows)


def _table(comparison: Comparison) -> Markup:
    sizes = {row[0]: row[1:] for row in size_rows(comparison)}
    rows = []
    for name in worst_outputs(comparison.outputs):
        error, words = comparison.outputs[name], output_name(name)
        rows.append([words, unbroken(followed(error)), *sizes[words], _ratio(error)])
    caption = (
        "Measured less predicted, with the values of the profile's file. Shares are those of the "
        "error's variance."
    )
    out = [table(caption, ["output", "explained by", *HEAD[1:], "÷ noise"], rows, words=2)]
    if comparison.offset is not None:
        out.append(element("p", f"{capital(offset_text(comparison.offset))}."))
    return join(out)


def _ratio(error: OutputError) -> str:
    return significant(error.rms / error.noise_rms, 2) if error.noise_rms else "–"


def _chip(errors: Sequence[OutputError]) -> tuple[str, str]:
    """The comparison in a word, and its colour."""
    if any(error.noise_rms is not None and not at_noise(error) for error in errors):
        return "Above the noise", "partly"
    if any(error.noise_rms is None for error in errors):
        return "Noise unknown", "partly"
    return "At the noise", "adequate"
