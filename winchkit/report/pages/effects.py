"""Effects as a page: each with its description, parameters, and signature computed by its code."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, isfinite

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.card import Signature, in_control, parameter_kind, signature
from winchkit.effects.effect import Effect, Parameter
from winchkit.model.stages import OUTPUT_UNITS, OUTPUTS
from winchkit.report.figures.reduction import decimated
from winchkit.report.html.chart import Chart, axis_over
from winchkit.report.html.markup import Markup, element, section, table
from winchkit.report.html.page import page
from winchkit.report.words.numbers import plain, scale_for
from winchkit.report.words.sentence import capital
from winchkit.report.words.vocabulary import OUTPUT_NAMES, listed, meaning, parameter_name

__all__ = ["effects_html"]

_POINTS = 240
_HEIGHT = 190.0
_MOTION = (
    "Along the standard motion: a fast and a slow stroke under 15 kg, then under 45 kg, at rising "
    "temperature. Each curve is the change of the output by the effect, computed by its code."
)


def effects_html(effects: Sequence[Effect], title: str) -> str:
    """The page of one effect, or of a catalogue with its contents first.

    Parameters
    ----------
    effects : sequence of Effect
        The effects.
    title : str
        Title of the page.

    Returns
    -------
    str
        HTML, self-contained.
    """
    contents = [_contents(effects)] if len(effects) > 1 else []
    return page(title, (), *contents, *(_card(effect) for effect in effects))


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


def _card(effect: Effect) -> Markup:
    needs = [need.replace("_", " ") for need in effect.needs]
    pairs = [
        ("formula", element("span", effect.formula, class_="formula")),
        ("source", effect.source),
        ("changes", listed([OUTPUT_NAMES.get(name, name) for name in effect.outputs])),
        ("needs", listed(needs) or "only the motor angle"),
        ("family", effect.family),
        ("contains", listed(list(effect.contains))),
        ("looks like", effect.looks_like),
        ("confused with", listed(list(effect.confused_with), "or")),
        ("distinguished by", effect.told_apart),
        ("in control", in_control(effect)),
    ]
    facts = [
        part for name, text in pairs if text for part in (element("dt", name), element("dd", text))
    ]
    return section(
        effect.id,
        capital(meaning(effect.id)) or effect.id,
        element("p", element("code", effect.id)),
        element("p", effect.what),
        element("dl", *facts, class_="facts"),
        _parameters(effect),
        *_drawing(effect),
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


def _drawing(effect: Effect) -> list[Markup]:
    drawn = signature(effect)
    if not drawn.changes:
        return [element("p", "It has no effect on the standard motion.", class_="quiet")]
    over = "pose of the standard robot, line 1" if effect.of_robots else "time [s]"
    figures = [_moves(drawn, over), *(_change(drawn, name, over) for name in drawn.changes)]
    sizes = ", ".join(
        f"{parameter_name(p.name)} {_size(drawn.values[p.name], p.unit)}"
        for p in effect.parameters
        if isfinite(drawn.values[p.name])
    )
    return [
        element("div", *figures, class_="pair maps"),
        element("p", f"{'' if effect.of_robots else _MOTION} Drawn with {sizes}.", class_="quiet"),
    ]


def _moves(drawn: Signature, over: str) -> Markup:
    said = "Free length of the nominal line, for orientation."
    return _figure((drawn.time, over), drawn.cable_length, ("free length", "m"), "residual", said)


def _change(drawn: Signature, output: str, over: str) -> Markup:
    said = f"Change of the {OUTPUT_NAMES.get(output, output)}."
    shown = ("change", OUTPUT_UNITS[output])
    return _figure((drawn.time, over), drawn.changes[output], shown, "before", said)


def _figure(
    along: tuple[Array, str], values: Array, shown: tuple[str, str], tone: str, said: str
) -> Markup:
    """One curve, its extremes kept."""
    (time, over), (name, unit) = along, shown
    scale = scale_for(float(np.nanmax(np.abs(values))), unit)
    x, (y,) = decimated(time, [values / scale.worth], _POINTS)
    points = [(a, b) for a, b in zip(x.tolist(), y.tolist(), strict=True) if isfinite(b)]
    chart = Chart(
        axis_over(over, x.tolist()),
        axis_over(f"{name} [{scale.label}]", [b for _, b in points], zero=tone == "before"),
        said,
        height=_HEIGHT,
    )
    drawn = chart.draw(chart.line(points, tone))
    return element("figure", drawn, element("figcaption", said))
