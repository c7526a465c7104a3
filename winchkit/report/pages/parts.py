"""Common parts of the pages of a diagnosis, a comparison and an added effect."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from winchkit import wings
from winchkit.diagnosis.data.dataset import Dataset
from winchkit.diagnosis.results import Comparison, Diagnosis
from winchkit.quantity_text import unbroken
from winchkit.report.figures.figure import Figure
from winchkit.report.figures.residuals import OutputFigures, run_names
from winchkit.report.html.markup import Markup, details, element, facts
from winchkit.report.html.page import figure_block
from winchkit.report.words.caveats import caveat_text, finding_texts, used_text
from winchkit.report.words.sentence import capital
from winchkit.report.words.vocabulary import listed, output_name

_ICONS = {
    "adequate": '<circle cx="8" cy="8" r="6"/><path d="M5.2 8.2l2 2 3.6-4.2"/>',
    "explained": (
        '<circle cx="8" cy="8" r="6" stroke-dasharray="2.2 1.6"/><path d="M8 5.4v5.2M5.4 8h5.2"/>'
    ),
    "partly": '<circle cx="8" cy="8" r="6"/><path d="M8 2v12M8 5h4M8 8h5.5M8 11h4"/>',
    "unknown": (
        '<path d="M8 1.8L14.2 8 8 14.2 1.8 8z"/>'
        '<path d="M6.6 6.6c.2-1.8 3-1.6 2.8.1-.1 1-1.4 1-1.4 2.1M8 10.9v.1"/>'
    ),
    "undecided": '<circle cx="8" cy="8" r="6"/><path d="M5 8h6"/>',
}
"""Icon beside the verdict's word, by its colour."""
_SIDE = 480
"""Width of a figure beside one over time, px."""


def lead(
    context: str,
    chip: str,
    tone: str,
    headline: str,
    rows: Sequence[tuple[str, str]],
    *beside: Markup,
) -> Markup:
    """Result of a page: a word, a headline, and a summary of questions and answers, if any.

    ``tone`` is a verdict whose colour is taken: adequate, explained, partly, unknown, undecided.
    """
    icon = Markup(f'<svg viewBox="0 0 16 16" aria-hidden="true">{_ICONS[tone]}</svg>')
    head = element(
        "div",
        element("h2", icon, capital(chip), id="verdict-heading", class_="chip"),
        element("h1", unbroken(headline)),
        class_="lead",
    )
    brief = element(
        "div",
        facts(((question, _unbroken_words(answer)) for question, answer in rows), "steps"),
        *([element("div", *beside)] if any(beside) else []),
        class_="card brief" if any(beside) else "card",
        id="summary",
    )
    return element(
        "section",
        element("p", context, class_="context"),
        head,
        brief,
        id="verdict",
        class_=f"verdict {tone}",
        aria_labelledby="verdict-heading",
    )


def _unbroken_words(text: str) -> str:
    """Text with no-break spaces between numbers and units; markup as it is."""
    return text if isinstance(text, Markup) else unbroken(text)


def code_block(*commands: str) -> Markup:
    """Commands, one a line."""
    return element("pre", element("code", "\n".join(commands)), tabindex="0")


def compared_text(dataset: Dataset, profile: str) -> str:
    """``4 runs, 46.4 s: demo 10 kg (2), demo 20 kg (2); profile bench-spiral``."""
    if (by_wing := wings.call("size_text", dataset)) is not None:
        return f"{by_wing(dataset)}; profile {profile}"
    times = [recording.signals.time for recording in dataset.recordings]
    whole = sum(float(time[-1] - time[0]) for time in times)
    names = run_names(dataset)
    often = {name: names.count(name) for name in names}
    kinds = [name if n == 1 else f"{name} ({n})" for name, n in often.items()]
    few = kinds if len(kinds) <= 6 else [*kinds[:5], f"{len(kinds) - 5} more"]
    runs = "1 run" if len(times) == 1 else f"{len(times)} runs"
    duration = f"{whole:.1f} s" if whole < 600 else f"{whole / 60:.0f} min"
    return f"{runs}, {duration}: {listed(few)}; profile {profile}"


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
    figures: Sequence[OutputFigures], maps: Mapping[str, Sequence[Figure]], sizes: Mapping[str, str]
) -> list[Markup]:
    """A card per output, the first open; ``sizes`` are remarks on their errors."""
    cards = []
    for number, own in enumerate(figures):
        blocks = [figure_block(own.over_time)]
        if own.over_variable is None:
            blocks.append(
                element("p", "No measured variable explains the residual.", class_="quiet")
            )
        else:
            blocks.append(figure_block(own.over_variable, _SIDE))
        pair = element("div", *blocks, class_="pair")
        found = maps.get(own.output, ())
        more = [figure_block(one, _SIDE) for one in found]
        over = details(
            "Mean residual over two variables", element("div", *more, class_="pair maps")
        )
        cards.append(
            output_card(own.output, [pair, *([over] if more else [])], sizes, opened=number == 0)
        )
    return cards


def output_card(
    output: str, content: Sequence[Markup], sizes: Mapping[str, str], *, opened: bool
) -> Markup:
    """The figures of an output; the first card is open, the others are to be opened."""
    title = capital(output_name(output))
    size = element("span", unbroken(sizes.get(output, "")), class_="beside")
    if opened:
        return element("div", element("h2", title, " ", size), *content, class_="output")
    head = element("summary", element("h2", title), size)
    return element("details", head, *content, class_="output")
