"""Sections of the page of an added effect."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from winchkit.diagnosis.add import Addition
from winchkit.diagnosis.results import OutputFit
from winchkit.quantity_text import significant
from winchkit.report import tables
from winchkit.report.figures.figure import Figure
from winchkit.report.html.markup import Markup, element, folded, join, table
from winchkit.report.html.page import figure_block
from winchkit.report.pages.parts import bullets, code_block, compared_text, lead
from winchkit.report.reproducibility import CommandLine, repeat
from winchkit.report.words.headline import worst_outputs
from winchkit.report.words.sentence import capital, gain_text, moved_outputs, still_text, worse_text
from winchkit.report.words.vocabulary import error_scale, meaning, output_name, values_text


def addition_sections(
    addition: Addition,
    figures: Sequence[Markup],
    command: CommandLine,
    better: str,
    *,
    title: str = "",
    ratios: Figure | None = None,
) -> Markup:
    """Content of the page; ``better`` is the profile that was written."""
    term, values = addition.added
    commands = [
        command.add(term.effect.id, command.profile, better),
        command.compare(better),
        command.diagnose(better),
    ]
    return join(
        [
            _lead(addition, better, command, title=title, ratios=ratios),
            element("div", *figures, id="residuals"),
            folded(
                "effects",
                "Added effect: formula and source",
                tables.named([(term.effect, term.label, values)]),
            ),
            folded("parameters", "All effects of the new profile", _parameters(addition)),
            folded("notes", "Notes", bullets(addition.notes)),
            repeat(command, commands, "addition", addition.to_json()),
        ]
    )


def addition_sentence(addition: Addition) -> str:
    """The added effect with its values, and the change of the held-out errors."""
    term, values = addition.added
    text = ", ".join(part for part in (meaning(term.effect.id), values_text(values)) if part)
    named = f"Added {term.label} to the profile{f': {text}' if text else ''}."
    outputs = addition.outputs
    gain = gain_text(outputs, "With it")
    worse = worse_text(outputs)
    nothing = "" if gain or worse else "It does not change the held-out errors."
    return " ".join(part for part in (named, gain, nothing, worse, still_text(outputs)) if part)


def _lead(
    addition: Addition, better: str, command: CommandLine, *, title: str, ratios: Figure | None
) -> Markup:
    term, _ = addition.added
    chip, tone = _chip(addition.outputs)
    beside = [_errors(addition.outputs), *([figure_block(ratios, 480)] if ratios else [])]
    rows = [
        ("Fitted to", compared_text(command.dataset, command.profile)),
        ("Error", addition_sentence(addition)),
        ("Written to", element("code", better)),
        ("Next", code_block(command.diagnose(better))),
    ]
    head = capital(meaning(term.effect.id)) or f"Added: {term.label}"
    return lead(title, chip, tone, head, rows, *beside)


def _chip(outputs: Mapping[str, OutputFit]) -> tuple[str, str]:
    """The result in a word, and its colour."""
    if worse_text(outputs):
        return "Added, with larger errors", "unknown"
    if not moved_outputs(outputs):
        return "Added without gain", "partly"
    return "Added", "explained"


def _errors(outputs: Mapping[str, OutputFit]) -> Markup:
    """Errors before and after per output, fitted and held out, and the noise."""
    rows = []
    for name in worst_outputs(outputs):
        output = outputs[name]
        scale = error_scale(output)
        errors = [output.heldout_rms_before, output.heldout_rms_after]
        noise = output.noise_rms
        rows.append(
            [
                output_name(name),
                *(
                    element("span", scale.text(error), class_=tone)
                    for error, tone in zip(errors, ("before", "after"), strict=True)
                ),
                "unknown" if noise is None else scale.text(noise),
                significant(output.heldout_rms_after / noise, 2) if noise else "–",
                f"{scale.text(output.rms_before)} → {scale.text(output.rms_after)}",
            ]
        )
    head = ["output", "today", "with it", "noise", "÷ noise", "fitted"]
    caption = (
        "Held-out error, rms: measured on runs that the fit had not seen. The last column is the "
        "error of the fitted runs."
    )
    return table(caption, head, rows)


def _parameters(addition: Addition) -> Markup:
    last = len(addition.terms) - 1
    rows = [
        [
            element("code", term.label),
            "added" if at == last else "refitted",
            meaning(term.effect.id) or term.effect.what,
            values_text(values),
        ]
        for at, (term, values) in enumerate(addition.terms)
    ]
    head = ["effect", "status", "meaning", "values"]
    caption = "All values are fitted together, ± one standard deviation."
    return table(caption, head, rows, words=4)
