"""An effect's card: description, parameters, and signature computed by its code."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, isfinite
from textwrap import fill, wrap
from typing import Any

import numpy as np

from winchkit import wings
from winchkit.arrays import Array
from winchkit.effects.effect import NEED_WORDS, Effect, Parameter, Values
from winchkit.effects.reference_motion import STANDARD_PROFILE, standard_motion
from winchkit.effects.term import Term
from winchkit.model.line import Line
from winchkit.model.stages import OUTPUT_UNITS

_PLACES = {"all": "all lines equally", "one": "one line", "platform": "the platform"}
_BARS = "▁▂▃▄▅▆▇█"
_WIDTH = 36
"""Bars: half a terminal's line beside names and sizes."""
_SAMPLES = 400
"""Of a plotted signature: one a pixel of its figure."""
_COLUMNS = 80
"""Characters of a terminal's line."""
_MARGIN = 15
"""Characters: the longest title (``Confused with``) and two blanks."""
_FLAT = 1e-9
"""Relative to the largest value: a smaller span is rounding."""


@dataclass(frozen=True)
class Signature:
    """Changes by an effect of typical size along the standard motion; arrays (n,), SI."""

    values: Mapping[str, float]
    time: Array
    cable_length: Array
    """Free length of the nominal line, m."""
    changes: Mapping[str, Array]
    """Changed outputs."""


def usual_values(effect: Effect) -> dict[str, float]:
    """Values of typical size, SI: amplitudes at their typical value, shapes at their default."""
    sizes = {p.name: p.typical for p in effect.parameters if p.role == "amplitude"}
    return effect.null | sizes | dict(effect.probes[-1] if effect.probes else {})


def signature(effect: Effect, values: Values | None = None) -> Signature:
    """Signature of an effect on the standard motion, or of a robot's effect on the standard poses,
    by default with values of typical size.
    """
    values = usual_values(effect) if values is None else values
    if effect.of_robots:
        length, changed = wings.part("robot", "changes")(effect, dict(values))
        poses = np.arange(len(length), dtype=float)
        return Signature(values, poses, length, changed)
    motion = standard_motion()
    bare = Line(STANDARD_PROFILE).predict(motion)
    changed = Line(STANDARD_PROFILE, (Term(effect, values).modifier(),)).predict(motion)
    changes = {name: changed[name] - bare[name] for name in bare}
    return Signature(
        values=values,
        time=motion.at.time,
        cable_length=bare["cable_length"],
        changes={name: change for name, change in changes.items() if np.any(change != 0)},
    )


def sparkline(values: Array, width: int = _WIDTH) -> str:
    """Values in any unit as Unicode bars from their lowest to their highest; a gap where all are
    NaN. Each bar is the value of its interval farthest from the median, so that spikes are visible.
    """
    finite = values[np.isfinite(values)]
    if not len(finite):
        return " " * width
    low, span, middle = float(finite.min()), float(np.ptp(finite)), float(np.median(finite))
    if span <= _FLAT * float(np.max(np.abs(finite))):
        return _BARS[len(_BARS) // 2] * width
    bars = ""
    for stretch in np.array_split(values, width):
        here = stretch[np.isfinite(stretch)]
        if len(here):
            farthest = float(here[np.argmax(np.abs(here - middle))])
            bars += _BARS[round((farthest - low) / span * (len(_BARS) - 1))]
        else:
            bars += " "
    return bars


def card(effect: Effect) -> str:
    """The card as text of at most 80 columns."""
    paragraphs = [
        ("What", effect.what),
        ("Formula", effect.formula),
        ("Source", effect.source),
        ("Changes", ", ".join(effect.outputs)),
        ("Needs", "; ".join(NEED_WORDS[need] for need in effect.needs) or "only the motor angle"),
        ("On a robot", ", ".join(_PLACES[p] for p in sorted(effect.on_robot))),
        ("Family", effect.family),
        ("Contains", ", ".join(effect.contains)),
        ("Looks like", effect.looks_like),
        ("Confused with", ", ".join(effect.confused_with)),
        ("Separated by", effect.told_apart),
        ("In control", in_control(effect)),
    ]
    lines = [effect.id, ""]
    lines += [_paragraph(title, text) for title, text in paragraphs if text]
    lines += ["", "Parameters", *_table(effect), *_plausible(effect), "", *_drawing(effect)]
    return "\n".join(lines)


def in_control(effect: Effect) -> str:
    """Whether the length and tension of an open winch use an effect, or the reason why not."""
    reason = effect.not_in_control
    return f"left out: {reason}" if reason else "used for a winch's length or tension"


def card_data(effect: Effect) -> dict[str, Any]:
    """The card as data, SI, as ``winchkit effects ID --json`` prints it."""
    drawn = signature(effect)
    return {
        "id": effect.id,
        "what": effect.what,
        "formula": effect.formula,
        "source": effect.source,
        "outputs": list(effect.outputs),
        "needs": list(effect.needs),
        "on_robot": sorted(effect.on_robot),
        "family": effect.family,
        "contains": list(effect.contains),
        "looks_like": effect.looks_like,
        "confused_with": list(effect.confused_with),
        "told_apart": effect.told_apart,
        "not_in_control": effect.not_in_control,
        "parameters": [_parameter_data(p, parameter_kind(effect, p)) for p in effect.parameters],
        "signature": {
            "values": dict(drawn.values),
            "time": _listed(drawn.time),
            "cable_length": _listed(drawn.cable_length),
            "changes": {
                name: {"unit": OUTPUT_UNITS[name], "values": _listed(change)}
                for name, change in drawn.changes.items()
            },
        },
    }


def _paragraph(title: str, text: str) -> str:
    return fill(
        text,
        width=_COLUMNS,
        initial_indent=f"{title:<{_MARGIN}}",
        subsequent_indent=" " * _MARGIN,
        break_on_hyphens=False,
    )


def _table(effect: Effect) -> list[str]:
    rows = [("name", "unit", "null value", "typical", "range", "kind")]
    for p in effect.parameters:
        kind = parameter_kind(effect, p)
        gone = f"{p.null:g}" if kind == "amplitude" else f"(default {p.null:g})"
        rows.append((p.name, p.unit, gone, f"{p.typical:g}", _range(p), kind))
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    return [
        "  " + "  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]


def _plausible(effect: Effect) -> list[str]:
    """Ranges of values that a real machine can have, with their reasons."""
    lines = []
    for p in effect.parameters:
        if p.plausible is not None:
            of = f" of {p.plausible.of}" if p.plausible.of else ""
            unit = "" if p.unit == "1" or of else f" {p.unit}"
            above = p.plausible.high == inf
            ends = "from {:g}" if above else "{:g} to {:g}"
            text = ends.format(p.plausible.low, p.plausible.high) + unit + of
            text += " on a winch" if p.plausible.of_winch else ""
            lines.append(
                fill(
                    f"plausible {p.name}: {text} ({p.plausible.reason})",
                    width=_COLUMNS,
                    initial_indent="  ",
                    subsequent_indent="    ",
                    break_on_hyphens=False,
                )
            )
    return lines


def parameter_kind(effect: Effect, parameter: Parameter) -> str:
    """Kind of a parameter: an amplitude, a phase, a shape, a whole order, or fixed."""
    if effect.polar and parameter.name == effect.polar[1]:
        return "phase"
    return "whole order" if parameter.whole else parameter.role


def _range(parameter: Parameter) -> str:
    if parameter.low == -inf and parameter.high == inf:
        return "any"
    if parameter.high == inf:
        return f"from {parameter.low:g}"
    return f"{parameter.low:g} to {parameter.high:g}"


def _drawing(effect: Effect) -> list[str]:
    """The signature over time, one line per output that changes."""
    drawn = signature(effect)
    usual = ", ".join(f"{name} {x:g}" for name, x in drawn.values.items() if isfinite(x))
    over = [
        f"Signature over {drawn.time[-1]:.0f} s of the standard motion (a fast and a slow stroke",
        *wrap(f"under 15 kg, then under 45 kg), with {usual}", _COLUMNS),
    ]
    if effect.of_robots:
        text = f"Signature over {len(drawn.time)} poses of the standard robot, on line 1, with"
        over = wrap(f"{text} {usual}", _COLUMNS)
    lines = [*over, f"  {'moves':<13}{sparkline(drawn.cable_length)}  cable_length"]
    for name, change in drawn.changes.items():
        low, high = float(np.nanmin(change)), float(np.nanmax(change))
        lines.append(
            f"  {name:<13}{sparkline(change)}  {low:+.3g} to {high:+.3g} {OUTPUT_UNITS[name]}"
        )
    return lines if drawn.changes else [*lines, "  no change on this motion"]


def _listed(values: Array) -> list[float]:
    """Values, evenly spaced where they are many."""
    index = np.linspace(0, len(values) - 1, min(_SAMPLES, len(values))).round().astype(int)
    return list(values[index].tolist())


def _parameter_data(parameter: Parameter, kind: str) -> dict[str, Any]:
    names = ("name", "unit", "null", "typical", "low", "high")
    return {
        **{name: getattr(parameter, name) for name in names},
        "kind": kind,
        "plausible": None if parameter.plausible is None else vars(parameter.plausible),
    }
