"""What runs could have shown, in words: from which size on an effect would have been seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, isinf, isnan, log10

from winchkit.diagnosis.diagnose import Answer
from winchkit.diagnosis.results import Detectable
from winchkit.effects.catalogue import load_catalogue
from winchkit.effects.effect import Effect, Parameter
from winchkit.report.words.numbers import quantity
from winchkit.report.words.vocabulary import parameter_name, parameter_unit

__all__ = ["Visible", "effects_of", "smallest_shown", "unseen", "visible"]

_FEW = 4


@dataclass(frozen=True)
class Visible:
    """One effect and the size from which on these runs would have shown it."""

    effect: str
    parameter: str
    text: str
    share: float
    """Of the usual size; NaN where no size within the bounds would have been seen."""

    @property
    def usual(self) -> bool:
        """Whether its usual size would have been seen."""
        return self.share <= 1.0


def effects_of(answer: Answer) -> dict[str, Effect]:
    """Every effect that a diagnosis tried or has, by id."""
    tried = {score.candidate.effect.id: score.candidate.effect for score in answer.result.scores}
    present = {t.effect.id: t.effect for t in answer.result.final.hypothesis.terms}
    return tried | present


def visible(answer: Answer) -> list[Visible]:
    """All effects of a diagnosis, those that would have been seen soonest first."""
    effects = effects_of(answer)
    placed: dict[tuple[str, bool, str], list[Visible]] = {}
    for item in answer.diagnosis.detectable:
        if item.effect in effects:
            name, _, line = item.effect.partition("/")
            row = _row(item, effects[item.effect].parameter(item.parameter))
            placed.setdefault((name, bool(line), item.parameter), []).append(row)
    rows = [
        _on_any_line(own, (name, not line, parameter) in placed)
        for (name, line, parameter), own in placed.items()
    ]
    return sorted(rows, key=lambda row: (isnan(row.share), row.share))


def _on_any_line(rows: Sequence[Visible], elsewhere: bool) -> Visible:
    """The line of a robot on which an effect must be largest to be seen, for all its lines.

    ``elsewhere`` says whether the same effect may be on one line and on all of them alike.
    """
    worst = max(rows, key=lambda row: (isnan(row.share), row.share))
    name, _, line = worst.effect.partition("/")
    if not line:
        return replace(worst, text=f"{worst.text} on all lines alike") if elsewhere else worst
    of = "on any line" if len(rows) > 1 else f"on line {line}"
    return replace(worst, effect=name, text=f"{worst.text} {of}")


def smallest_shown(answer: Answer) -> list[str]:
    """A few words each on the effects that these runs would have shown soonest."""
    seen = [row for row in visible(answer) if not isnan(row.share)]
    return [f"{row.effect}: {row.parameter} {row.text}" for row in seen[:_FEW]]


def unseen(answer: Answer) -> list[tuple[str, list[str]]]:
    """Effects of the catalogue that no run could show, each with what it lacks."""
    tried = {e.partition("/")[0] for e in effects_of(answer)}
    out = []
    for effect in load_catalogue():
        lacking = answer.engine.regression.missing_needs(effect) if effect.id not in tried else []
        if lacking:
            out.append((effect.id, list(lacking)))
    return out


def _row(item: Detectable, parameter: Parameter) -> Visible:
    name = parameter_name(item.parameter)
    unit = parameter_unit(item.parameter, item.unit)
    if isnan(item.smallest):
        return Visible(item.effect, name, "at no size within its bounds", float("nan"))
    shown = quantity(item.smallest, unit, _digits(item.smallest, parameter.null))
    if parameter.reciprocal or isinf(parameter.null):
        share = parameter.typical / item.smallest
        return Visible(item.effect, name, f"up to {shown}", share)
    share = abs((item.smallest - parameter.null) / (parameter.typical - parameter.null))
    sense = "from" if item.smallest >= parameter.null else "below"
    return Visible(item.effect, name, f"{sense} {shown}", share)


def _digits(value: float, null: float) -> int:
    """Digits that show how far a value is from a null that is neither zero nor infinite."""
    if null == 0 or isinf(null) or value == null:
        return 2
    return 1 + max(1, ceil(-log10(abs(value - null) / abs(null))))
