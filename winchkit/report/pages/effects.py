"""Effects as a page: each with its description, parameters, and signature computed by its code."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, isfinite

import numpy as np

from winchkit.effects.card import Signature, in_control, parameter_kind, signature
from winchkit.effects.effect import NEED_WORDS, Effect, Parameter, parameter_name
from winchkit.model.stages import OUTPUT_UNITS, OUTPUTS
from winchkit.quantity_text import plain, scale_for
from winchkit.report.figures.figure import Figure, FigureAxis, FigureSeries, Panel
from winchkit.report.figures.reduction import decimated
from winchkit.report.html.markup import Markup, element, facts, formula, section, table
from winchkit.report.html.page import figure_block, page
from winchkit.report.words.sentence import capital
from winchkit.report.words.vocabulary import OUTPUT_NAMES, listed, meaning, output_name

_INTERVALS = 120
"""Intervals of the drawn signature, each with its lowest and highest value."""
_SIDE = 480
"""px: width of a figure, of which a row has two."""
_MOTION = (
    "Along the standard motion: a fast and a slow stroke under 15 kg, then under 45 kg, at rising "
    "temperature. Each curve is the change of the output by the effect, computed by its code."
)


def effects_html(effects: Sequence[Effect], title: str) -> str:
    """The page of one effect, or of a catalogue with its contents first."""
    contents = [_contents(effects)] if len(effects) > 1 else []
    drawn = [_drawing(effect) for effect in effects]
    figures = [figure for own, _ in drawn for figure in own]
    cards = [_card(effect, blocks) for effect, (_, blocks) in zip(effects, drawn, strict=True)]
    return page(title, figures, *contents, *cards)


def _contents(effects: Sequence[Effect]) -> Markup:
    """Effects by the first output that they change, each a link to its card."""
    lists = []
    for output in (*OUTPUTS, ""):
        items = [
            element("li", element("a", e.id, href=f"#{e.id}"), f" {meaning(e.id) or e.what}")
            for e in effects
            if ("" if e.of_robots else e.outputs[0]) == output
        ]
        place = f"Effects on {OUTPUT_NAMES[output]}" if output else "Effects on a robot"
        if items:
            lists += [element("h3", place), element("ul", *items)]
    return section("contents", f"{len(effects)} effects", *lists)


def _card(effect: Effect, drawing: Sequence[Markup]) -> Markup:
    pairs = [
        ("formula", formula(effect.formula)),
        ("source", effect.source),
        ("changes", listed([output_name(name) for name in effect.outputs])),
        ("needs", "; ".join(NEED_WORDS[need] for need in effect.needs) or "only the motor angle"),
        ("family", effect.family),
        ("contains", listed(list(effect.contains))),
        ("looks like", effect.looks_like),
        ("confused with", listed(list(effect.confused_with), "or")),
        ("distinguished by", effect.told_apart),
        ("in control", in_control(effect)),
    ]
    return section(
        effect.id,
        capital(meaning(effect.id)) or effect.id,
        element("p", element("code", effect.id)),
        element("p", effect.what),
        facts(pairs),
        _parameters(effect),
        *drawing,
    )


def _parameters(effect: Effect) -> Markup:
    rows = [
        [parameter_name(p.name), parameter_kind(effect, p), *_figures(p)] for p in effect.parameters
    ]
    head = ["parameter", "kind", "null value", "typical size", "from", "to"]
    caption = "The null value of a shape parameter is its default; searches start at typical size."
    return table(caption, head, rows, words=2)


def _figures(parameter: Parameter) -> list[str]:
    unit = parameter.unit
    ends = [
        "any" if end in {inf, -inf} else _size(end, unit) for end in (parameter.low, parameter.high)
    ]
    null = _size(parameter.null, unit) if isfinite(parameter.null) else "∞"
    return [null, _size(parameter.typical, unit), *ends]


def _size(value: float, unit: str) -> str:
    """A chosen size, with as few digits as it has."""
    scale = scale_for(value, unit)
    return scale.labelled(plain(value / scale.worth))


def _drawing(effect: Effect) -> tuple[list[Figure], list[Markup]]:
    drawn = signature(effect)
    if not drawn.changes:
        text = "It has no effect on the standard motion."
        return [], [element("p", text, class_="quiet")]
    over = (
        FigureAxis("pose of the standard robot, line 1")
        if effect.of_robots
        else FigureAxis("time", "s")
    )
    figures = [_figure(effect.id, drawn, name, over) for name in ("", *drawn.changes)]
    sizes = ", ".join(
        f"{parameter_name(p.name)} {_size(drawn.values[p.name], p.unit)}"
        for p in effect.parameters
        if isfinite(drawn.values[p.name])
    )
    text = f"{'' if effect.of_robots else _MOTION} Drawn with {sizes}."
    blocks = [figure_block(figure, _SIDE) for figure in figures]
    pair = element("div", *blocks, class_="pair maps")
    return figures, [pair, element("p", text, class_="quiet")]


def _figure(effect: str, drawn: Signature, output: str, over: FigureAxis) -> Figure:
    """The change of an output, or the free length for orientation; extremes are kept."""
    values = drawn.changes[output] if output else drawn.cable_length
    unit = OUTPUT_UNITS[output] if output else "m"
    scale = scale_for(float(np.nanmax(np.abs(values))), unit)
    rows = decimated([values], _INTERVALS)
    name = output_name(output)
    caption = (
        f"Change of the {name}." if output else "Free length of the nominal line, for orientation."
    )
    tone, label = ("today", "change") if output else ("plain", "free length")
    series = FigureSeries(label, tone, drawn.time[rows], values[rows] / scale.worth)
    return Figure(
        f"signature-{effect}-{output or 'motion'}",
        capital(f"change of the {name}") if output else "Motion",
        caption,
        over,
        (Panel(FigureAxis(label, scale.label, zero=bool(output)), (series,)),),
        source=f"effect {effect}",
    )
