"""Candidates that lower an error, and the smallest size of each effect that the runs detect."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, isinf, isnan, log10

from winchkit.diagnosis.diagnose import Answer, WinchAnswer
from winchkit.diagnosis.regression.cross_validation import excess
from winchkit.diagnosis.results import CandidateScore, Detectable, Diagnosis
from winchkit.effects.catalogue import load_catalogue
from winchkit.effects.effect import Effect, Parameter, parameter_name, parameter_unit
from winchkit.quantity_text import quantity

_FEW = 4
"""Effects that a sentence lists; the table has all."""
_LOWERED = 0.9
"""Ratio of the excess over the noise with a candidate and without it below which it is useful: less
than the tenth that a verdict may leave is nothing to add."""


@dataclass(frozen=True)
class Visible:
    """One effect and its smallest detectable size."""

    effect: str
    parameter: str
    text: str
    share: float
    """Multiple of the typical size; NaN where no size within the bounds is detectable."""

    @property
    def usual(self) -> bool:
        """Whether its typical size is detectable."""
        return self.share <= 1.0


def has_typical_sizes(answer: Answer) -> bool:
    """Whether sizes are compared with typical ones, which are those of motors and winches."""
    return not (
        isinstance(answer, WinchAnswer) and answer.engine.regression.dataset.profile.is_linear
    )


def effects_of(answer: Answer) -> dict[str, Effect]:
    """Every effect that a diagnosis tested or that its model has, by id."""
    tried = {score.candidate.effect.id: score.candidate.effect for score in answer.result.scores}
    present = {t.effect.id: t.effect for t in answer.result.final.hypothesis.terms}
    return tried | present


def visible(answer: Answer) -> list[Visible]:
    """All effects of a diagnosis, ordered by detectable size over typical size."""
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
    """The row of the line with the largest detectable size, for all lines of a robot."""
    worst = max(rows, key=lambda row: (isnan(row.share), row.share))
    name, _, line = worst.effect.partition("/")
    if not line:
        return replace(worst, text=f"{worst.text} on all lines equally") if elsewhere else worst
    of = "on any line" if len(rows) > 1 else f"on line {line}"
    return replace(worst, effect=name, text=f"{worst.text} {of}")


def smallest_shown(answer: Answer) -> list[str]:
    """Texts on the effects with the smallest detectable sizes relative to their typical ones."""
    seen = [row for row in visible(answer) if not isnan(row.share)]
    return [f"{row.effect}: {row.parameter} {row.text}" for row in seen[:_FEW]]


def untestable(answer: Answer) -> list[tuple[str, list[str]]]:
    """Effects of the catalogue that cannot be tested, each with its missing parts or channels."""
    tried = {e.partition("/")[0] for e in effects_of(answer)}
    out = []
    known = load_catalogue()
    for effect in known.of_winches() if isinstance(answer, WinchAnswer) else known:
        lacking = answer.engine.regression.missing_needs(effect) if effect.id not in tried else []
        if lacking:
            out.append((effect.id, list(lacking)))
    return out


def useful_candidates(diagnosis: Diagnosis) -> list[CandidateScore]:
    """Candidates with evidence that lower the errors above the noise by a tenth, best first."""
    noise = {name: output.noise_rms for name, output in diagnosis.outputs.items()}
    before = {name: output.heldout_rms_before for name, output in diagnosis.outputs.items()}
    most = _LOWERED * excess(before, noise)
    return [
        one
        for one in diagnosis.candidates
        if one.score > 0
        and (not one.heldout_rms or excess({**before, **one.heldout_rms}, noise) < most)
    ]


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
    """Digits that resolve the difference of a value from a finite null other than zero."""
    if null == 0 or isinf(null) or value == null:
        return 2
    return 1 + max(1, ceil(-log10(abs(value - null) / abs(null))))
