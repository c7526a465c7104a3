"""The sections of a comparison's page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from winchkit.diagnosis.residuals.attribution import Attribution
from winchkit.diagnosis.results import Comparison, OutputError
from winchkit.report.comparison_rows import HEAD, followed, offset_text, size_rows
from winchkit.report.figures.plots import AT_NOISE
from winchkit.report.html.markup import Markup, element, join, section, table
from winchkit.report.pages.parts import bullets, lead
from winchkit.report.reproducibility import Command, repeat
from winchkit.report.words.numbers import percent, quantity, significant, unbroken
from winchkit.report.words.sentence import capital, often_per_turn
from winchkit.report.words.vocabulary import OUTPUT_NAMES, VARIABLE_NAMES

__all__ = ["comparison_sections", "distance_text"]

_NEXT = (
    "A comparison tells how far off the model is, not why: winchkit diagnose, as written below, "
    "names the effect that is missing, or says that none is."
)


def comparison_sections(
    comparison: Comparison,
    over: Mapping[str, Attribution],
    figures: Sequence[Markup],
    command: Command,
) -> Markup:
    """Everything below the title; ``over`` is what each output's error follows most."""
    profile = command.profile
    return join(
        [
            _lead(comparison, over),
            section("residuals", "Where the model fails", *figures),
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
    """How far one output is off, beside its noise, and what the error follows."""
    off = f"The {OUTPUT_NAMES.get(name, name)} is off by {quantity(error.rms, error.unit)} rms"
    if error.noise_rms is None:
        return f"{off}, its noise unknown without a repeated run; {_following(over)}."
    noise = f"its noise of {quantity(error.noise_rms, error.unit)}"
    if _at_noise(error):
        return f"{off}, about {noise}."
    ratio = error.rms / error.noise_rms if error.noise_rms else None
    beside = "beside" if ratio is None else f"{significant(ratio, 2)} times"
    return f"{off}, {beside} {noise}; {_following(over)}."


def _following(over: Attribution | None) -> str:
    if over is None:
        return "it hardly follows anything that was measured"
    share = f"({percent(over.share)} of the error)"
    if over.order is not None:
        return f"it repeats {often_per_turn(over.variable, over.order)} {share}"
    return f"it follows the {VARIABLE_NAMES.get(over.variable, over.variable)} {share}"


def _lead(comparison: Comparison, over: Mapping[str, Attribution]) -> Markup:
    outputs = comparison.outputs
    told = [distance_text(name, error, over.get(name)) for name, error in outputs.items()]
    rows = [
        [name, _trends(error), *sizes, _ratio(error)]
        for (name, *sizes), error in zip(size_rows(comparison), outputs.values(), strict=True)
    ]
    caption = "Measured less predicted, the profile's values as they are in the file."
    inside = [table(caption, ["output", "follows", *HEAD[1:], "rms / noise"], rows, words=2)]
    if comparison.offset is not None:
        inside.append(element("p", f"{capital(offset_text(comparison.offset))}."))
    return lead(*_chip(list(outputs.values())), told, *inside, element("p", _NEXT, class_="quiet"))


def _trends(error: OutputError) -> str:
    return unbroken(followed(error).removeprefix("follows "))


def _ratio(error: OutputError) -> str:
    return f"{error.rms / error.noise_rms:.2f}" if error.noise_rms else "–"


def _chip(errors: Sequence[OutputError]) -> tuple[str, str]:
    """The comparison in a word, and its tone."""
    if any(error.noise_rms is not None and not _at_noise(error) for error in errors):
        return "Above the noise", "partly"
    if any(error.noise_rms is None for error in errors):
        return "Noise unknown", "partly"
    return "At the noise", "adequate"


def _at_noise(error: OutputError) -> bool:
    return error.noise_rms is not None and error.rms < AT_NOISE * error.noise_rms
