"""All winches of a recording as one page: a row for each, common effects, links to their pages."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from winchkit.diagnosis.results import Comparison, Diagnosis, Estimate, OutputError, Place, Step
from winchkit.fleet.diagnosis.anova import SharedAttribution, SharedError
from winchkit.fleet.diagnosis.meta_analysis import Pooled, SharedEffect
from winchkit.quantity_text import PrintScale, percent, quantity, scale_for, significant, unbroken
from winchkit.report.figures.error_ratios import fleet_error_ratios
from winchkit.report.figures.figure import Figure
from winchkit.report.html.markup import Markup, compact, element, folded, section, table
from winchkit.report.html.page import figure_block, page
from winchkit.report.pages.parts import bullets, lead
from winchkit.report.words.columns import aligned, hanging, paragraph
from winchkit.report.words.headline import at_noise
from winchkit.report.words.sentence import capital, main_patterns, where_text
from winchkit.report.words.steps import has_other_law
from winchkit.report.words.vocabulary import (
    OUTPUT_NAMES,
    VARIABLE_NAMES,
    VERDICT_NAMES,
    clause,
    estimate_text,
    listed,
    values_text,
    variable_name,
)

_FOLLOWED = 3
"""Variables of an attribution in one cell of a table."""
_CAUSES = 4
"""Effects in the lead of the page; all stand below."""
_SIDE = 560
"""px: width of a figure, of which a row has two."""
_ORDER = ("unknown", "undecided", "partly", "explained", "adequate")
_SOME = {0: "No effect is", 1: "1 effect is"}
_BY_CHANCE = 0.01
"""Least probability at which a false alarm of one of many winches is reported."""
_ALL = 0.9
"""Least common part of a share at which it counts as common to all winches."""


def shared_effects_text(
    found: Mapping[str, Diagnosis], shared: Sequence[SharedEffect], chances: Mapping[str, float]
) -> str:
    """Diagnoses of all winches, a line of 80 columns each, with the probabilities of a false alarm
    (:func:`winchkit.fleet.diagnosis.meta_analysis.alarms`), and their common effects."""
    lines = [f"all {len(found)} winches", *hanging(winch_rows(found, chances), words=2)]
    if shared:
        lines += ["", "effects in common and in single winches"]
        lines += [line for one in shared for line in paragraph(effect_text(one), "  ", "    ")]
    return "\n".join(lines)


def shared_errors_text(found: Mapping[str, Comparison], shared: Mapping[str, SharedError]) -> str:
    """Comparisons of all winches, a line of 80 columns each, and the common attribution of their
    errors."""
    lines = [f"all {len(found)} winches", *aligned(error_rows(found))]
    lines += ["", "share of the errors' variance explained by"]
    lines += [line for text in error_texts(shared) for line in paragraph(text, "  ", "    ")]
    return "\n".join(lines)


def winch_rows(found: Mapping[str, Diagnosis], chances: Mapping[str, float]) -> list[list[str]]:
    """Per winch its name, its verdict, and its effects."""
    rows = []
    for name, one in found.items():
        text, chance = _found(one), chances.get(name, 0.0)
        if chance > _BY_CHANCE:
            text += f"; false alarm of one in {len(found)} winches: {percent(chance)} of recordings"
        rows.append([name, VERDICT_NAMES[one.verdict], text])
    return rows


def effect_text(shared: SharedEffect) -> str:
    """``the drum has runout (drum-eccentricity): only in H: amplitude = …; excluded in A``."""
    first, *others = shared.effects
    ids = f"{first}, or {listed(others, 'or')}" if others else first
    what = f"{clause(first)} ({ids})"
    if shared.by_place and shared.place is not None:
        what = f"{_at(shared.place)}, most often {first}"
    parts = [f"{what}: {_where(shared)}"]
    if shared.without:
        parts.append(f"excluded in {listed(list(shared.without))}")
    if shared.unsure:
        parts.append(f"not decidable in {listed(list(shared.unsure))} with these runs")
    return "; ".join(parts)


def _at(place: Place) -> str:
    """``effects of the motor on the motor torque over the speed``."""
    over = f" over the {variable_name(place.variable)}" if place.variable else ""
    output = OUTPUT_NAMES.get(place.output, place.output)
    return f"effects of the {place.part} on the {output}{over}"


def error_rows(found: Mapping[str, Comparison]) -> list[list[str]]:
    """A head, and per winch its name and the rms of every output's error, with the noise."""
    outputs = dict.fromkeys(output for one in found.values() for output in one.outputs)
    rows = [["error, rms (noise)", *(OUTPUT_NAMES.get(output, output) for output in outputs)]]
    scales = {}
    for output in outputs:
        own = [one.outputs[output] for one in found.values() if output in one.outputs]
        scales[output] = scale_for([error.rms for error in own], own[0].unit)
    for name, one in found.items():
        cells = []
        for output, scale in scales.items():
            error = one.outputs.get(output)
            cells.append("–" if error is None else _beside_noise(error, scale))
        rows.append([name, *cells])
    return rows


def _beside_noise(error: OutputError, scale: PrintScale) -> str:
    """``2.10 mm (0.13)``."""
    if error.noise_rms is None:
        return scale.text(error.rms)
    return f"{scale.text(error.rms)} ({significant(error.noise_rms / scale.worth, 2)})"


def error_texts(shared: Mapping[str, SharedError]) -> Iterator[str]:
    """Per output the attribution of its errors: ``motor torque (…): direction 87 %, …``."""
    for output, error in shared.items():
        text = "; ".join(_followed(one) for one in error.follows[:_FOLLOWED])
        most = [
            f", {percent(s)} of the variance in {w}" for w, s in error.winches.items() if s > 0.5
        ]
        off = f"{quantity(error.rms, error.unit)} rms{''.join(most)}"
        name = OUTPUT_NAMES.get(output, output)
        yield f"{name} ({off}): {text or 'no measured variable'}"


def _followed(one: SharedAttribution) -> str:
    name = "constant of each winch" if one.variable == "winch" else VARIABLE_NAMES[one.variable]
    text = f"{name} {percent(one.share)}"
    if one.variable != "winch":
        if one.common >= _ALL * one.share:
            return f"{text}, common to all"
        text += f", {percent(one.common)} common to all"
    return f"{text}, outlying: {listed(list(one.outlying))}" if one.outlying else text


def _found(one: Diagnosis) -> str:
    if one.steps:
        return "; ".join(_step(step) for step in one.steps)
    if one.verdict == "adequate":
        return "residual at the noise floor"
    patterns = [where_text(where) for where in main_patterns(one.where)[:1]]
    return "; ".join(patterns) or "no known effect"


def _step(step: Step) -> str:
    first, *others = step.effects
    values = values_text(step.parameters.get(first, {}))
    beside = f" (or {listed(others, 'or')})" if others else ""
    if has_other_law(step):
        beside = " or another law"
    return f"{first}{beside} {values}{' (refitted)' if step.refitted else ''}".strip()


def _where(shared: SharedEffect) -> str:
    values = ", ".join(_value(name, p) for name, p in shared.parameters.items())
    text = f": {values}" if values else ""
    if len(shared.winches) == 1:
        only = "only" if not shared.unsure else "at least"
        return f"{only} in {shared.winches[0]}{text}"
    every = not shared.without and not shared.unsure
    who = f"all {len(shared.winches)}" if every else listed(list(shared.winches))
    return f"in {who}, {_likeness(shared)}{text}"


def _likeness(shared: SharedEffect) -> str:
    """Homogeneity of the winches over all parameters of the effect."""
    outlying = dict.fromkeys(name for p in shared.parameters.values() for name in p.outlying)
    if all(p.homogeneous for p in shared.parameters.values()):
        return "equal in size"
    return f"equal in size except {listed(list(outlying))}" if outlying else "of different sizes"


def _value(name: str, one: Pooled) -> str:
    text = estimate_text(name, Estimate(one.value, one.std, one.unit))
    if one.homogeneous or one.outlying:
        return text
    return f"{text} in the mean, standard deviation {quantity(one.spread, one.unit, 2)} of winches"


def shared_effects_html(
    found: Mapping[str, Diagnosis],
    shared: Sequence[SharedEffect],
    chances: Mapping[str, float],
    title: str,
    pages: Mapping[str, str],
) -> str:
    """The page over the diagnoses of all winches, with the probabilities of a false alarm;
    ``pages`` are the files of the single ones."""
    plain = winch_rows(found, chances)
    rows = [[_link(name, pages), verdict, unbroken(text)] for name, verdict, text in plain]
    texts = [unbroken(effect_text(one)) for one in shared]
    verdicts = [one.verdict for one in found.values()]
    kinds = dict.fromkeys(sorted(verdicts, key=_ORDER.index))
    counted = [f"{verdicts.count(v)} {VERDICT_NAMES[v].lower()}" for v in kinds]
    worst = next(iter(kinds), "adequate")
    chip = ("Effects missing", "explained") if shared else (VERDICT_NAMES[worst], worst)
    beside = [
        ("Compared", f"{len(found)} winches, each by itself, with one profile"),
        ("Verdicts", f"{capital(', '.join(counted))}."),
        ("Cause", bullets(texts[:_CAUSES]) if texts else "No effect is missing in any winch."),
        ("Cure", "The page of each winch has its command."),
    ]
    headline = (
        f"{_SOME.get(len(shared), f'{len(shared)} effects are')} missing over {len(found)} winches"
    )
    return _page(
        title,
        (*chip, headline, beside),
        fleet_error_ratios(found),
        _table(["winch", "verdict", "effects"], rows, 3),
        folded("shared", "Effects in common and in single winches", bullets(texts)),
        _as_json({"effects": [one.to_json() for one in shared], "alarms": dict(chances)}),
    )


def shared_errors_html(
    found: Mapping[str, Comparison],
    shared: Mapping[str, SharedError],
    title: str,
    pages: Mapping[str, str],
) -> str:
    """The page over the comparisons of all winches, as :func:`shared_effects_html`."""
    head, *rows = error_rows(found)
    linked = [[_link(name, pages), *cells] for name, *cells in rows]
    texts = [unbroken(text) for text in error_texts(shared)]
    above = [name for name, one in found.items() if not all(map(at_noise, one.outputs.values()))]
    beside = [
        ("Compared", f"{len(found)} winches, each by itself, with one profile"),
        ("Error", f"Above the noise, or of unknown noise: {listed(above)}." if above else ""),
        ("Cause", "winchkit diagnose with the same runs and --winch all names missing effects."),
    ]
    headline = f"{len(above)} of {len(found)} winches exceed their noise"
    chip = ("Above the noise", "partly") if above else ("At the noise", "adequate")
    return _page(
        title,
        (*chip, headline, beside),
        fleet_error_ratios(found),
        _table(head, linked, 1),
        folded("shared", "Share of the errors' variance explained by", bullets(texts)),
        _as_json({"outputs": {name: error.to_json() for name, error in shared.items()}}),
    )


def _page(
    title: str,
    result: tuple[str, str, str, Sequence[tuple[str, str]]],
    figures: Sequence[Figure],
    winches: Markup,
    *others: Markup,
) -> str:
    """Summary, errors of all winches as figures, and a row for each winch."""
    chip, tone, headline, rows = result
    blocks = [figure_block(figure, _SIDE) for figure in figures]
    drawn = element("div", *blocks, class_="pair maps output") if blocks else Markup("")
    each = section("winches", "Every winch", winches)
    return page(title, figures, lead(title, chip, tone, headline, rows), each, drawn, *others,
                headed=False)  # fmt: skip


def _table(head: Sequence[str], rows: Sequence[Sequence[str]], words: int) -> Markup:
    return table("Each winch separately, with the same profile.", head, rows, words=words)


def _link(name: str, pages: Mapping[str, str]) -> Markup:
    return element("a", name or "the winch", href=pages[name])


def _as_json(shared: Mapping[str, object]) -> Markup:
    return folded("json", "Common effects as JSON", element("pre", compact(shared, indent=1)))
