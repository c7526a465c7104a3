"""Common parts of the pages of a diagnosis, a comparison and an added effect."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from winchkit.diagnosis.results import Comparison, Diagnosis
from winchkit.report.figures.plots import OutputPlots, Plot
from winchkit.report.html.markup import Markup, element
from winchkit.report.words.caveats import caveat_text, finding_texts, used_text
from winchkit.report.words.numbers import unbroken
from winchkit.report.words.sentence import capital
from winchkit.report.words.vocabulary import OUTPUT_NAMES

__all__ = ["bullets", "data", "drawings", "lead"]


def lead(chip: str, tone: str, sentences: Sequence[str], *inside: Markup) -> Markup:
    """Result of a page: a word, sentences, and tables.

    ``tone`` is a verdict whose colour is taken: adequate, explained, partly, unknown.
    """
    texts = [element("p", unbroken(text), class_="sentence") for text in sentences]
    return element(
        "section",
        element("h2", chip, id="verdict-heading", class_="chip"),
        *texts,
        *inside,
        id="verdict",
        class_=f"verdict {tone}",
        aria_labelledby="verdict-heading",
    )


def bullets(lines: Sequence[str]) -> Markup:
    """A list of sentences; empty without any."""
    items = [element("li", capital(line)) for line in lines]
    return element("ul", *items) if items else Markup("")


def data(result: Comparison | Diagnosis) -> Markup:
    """Caveats, findings on the runs, and the share of the samples that is compared."""
    used = used_text(result.used_share)
    return bullets(
        [
            *(caveat_text(code) for code in result.caveats),
            *finding_texts(result.sanity),
            *([used] if used else []),
        ]
    )


def drawings(
    plots: Sequence[OutputPlots],
    maps: Mapping[str, Sequence[Markup]],
    first: Sequence[str] = (),
) -> list[Markup]:
    """The figures of every output, with its maps below; some outputs come first."""
    ordered = sorted(
        plots, key=lambda p: first.index(p.output) if p.output in first else len(first)
    )
    return [_output(own, maps.get(own.output, ())) for own in ordered]


def _output(own: OutputPlots, maps: Sequence[Markup]) -> Markup:
    title = element("h3", capital(OUTPUT_NAMES.get(own.output, own.output)))
    pair = element("div", *maps, class_="pair maps") if maps else Markup("")
    if own.over_variable is None:
        words = element("p", "No measured variable explains the residual.", class_="quiet")
        return element("div", title, _figure(own.over_time), words, pair, class_="output")
    both = element("div", _figure(own.over_time), _figure(own.over_variable), class_="pair")
    return element("div", title, both, pair, class_="output")


def _figure(plot: Plot) -> Markup:
    canvas = element("div", class_="plot", data_plot=plot.id, role="img", aria_label=plot.caption)
    return element("figure", canvas, element("figcaption", unbroken(plot.caption)))
