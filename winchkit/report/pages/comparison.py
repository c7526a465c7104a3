"""Sections of the page of a comparison."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from winchkit.diagnosis.residuals.attribution import Attribution
from winchkit.diagnosis.results import Comparison, OutputError
from winchkit.report.comparison_rows import HEAD, followed, offset_text, size_rows
from winchkit.report.figures.plots import AT_NOISE
from winchkit.report.html.markup import Markup, element, join, section, table
from winchkit.report.pages.parts import bullets, data, lead
from winchkit.report.reproducibility import Command, repeat
from winchkit.report.words.numbers import percent, quantity, significant, unbroken
from winchkit.report.words.sentence import capital, often_per_turn
from winchkit.report.words.vocabulary import OUTPUT_NAMES, VARIABLE_NAMES

__all__ = ["comparison_sections", "distance_text"]

_NEXT = (
    "A comparison quantifies the error of the model, not its cause: winchkit diagnose, with the "
    "command below, names the missing effect or states that there is none."
)


def comparison_sections(
    comparison: Comparison,
    over: Mapping[str, Attribution],
    figures: Sequence[Markup],
    command: Command,
) -> Markup:
    """Content below the title; ``over`` is the main variable of each output's error."""
    profile = command.profile
    return join(
        [
            _lead(comparison, over),
            section("residuals", "Residuals", *figures),
            section("data", "Data", data(comparison)),
            section("notes", "Notes", bullets(comparison.notes)),
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
    off = f"The error of the {OUTPUT_NAMES.get(name, name)} is {size}"
    if error.noise_rms is None:
        return f"{off}; its noise is unknown without repeats; {_attributed(over)}."
    noise = f"its noise of {quantity(error.noise_rms, error.unit)}"
    if _at_noise(error):
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
    return f"it depends on {VARIABLE_NAMES.get(over.variable, over.variable)} {share}"


def _lead(comparison: Comparison, over: Mapping[str, Attribution]) -> Markup:
    outputs = comparison.outputs
    texts = [distance_text(name, error, over.get(name)) for name, error in outputs.items()]
    rows = [
        [name, unbroken(followed(error)), *sizes, _ratio(error)]
        for (name, *sizes), error in zip(size_rows(comparison), outputs.values(), strict=True)
    ]
    caption = (
        "Measured less predicted, with the values of the profile's file. Shares are those of the "
        "error's variance."
    )
    inside = [table(caption, ["output", "explained by", *HEAD[1:], "rms / noise"], rows, words=2)]
    if comparison.offset is not None:
        inside.append(element("p", f"{capital(offset_text(comparison.offset))}."))
    return lead(*_chip(list(outputs.values())), texts, *inside, element("p", _NEXT, class_="quiet"))


def _ratio(error: OutputError) -> str:
    return f"{error.rms / error.noise_rms:.2f}" if error.noise_rms else "–"


def _chip(errors: Sequence[OutputError]) -> tuple[str, str]:
    """The comparison in a word, and its colour."""
    if any(error.noise_rms is not None and not _at_noise(error) for error in errors):
        return "Above the noise", "partly"
    if any(error.noise_rms is None for error in errors):
        return "Noise unknown", "partly"
    return "At the noise", "adequate"


def _at_noise(error: OutputError) -> bool:
    return error.noise_rms is not None and error.rms < AT_NOISE * error.noise_rms
