"""Frame of every page: one file with its styles, script and data, without network access."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import date
from importlib.resources import files

from winchkit.report.figures.figure import Figure
from winchkit.report.figures.layout import WIDE
from winchkit.report.figures.tokens import DARK, LIGHT, STYLES, style_sheet, token_sheet
from winchkit.report.html.markup import Markup, element, inline
from winchkit.report.html.svg import page_svg

_POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src blob:"
_ZOOM = (
    ("in", "+", "Enlarge"),
    ("out", "−", "Reduce"),
    ("left", "←", "Move left"),
    ("right", "→", "Move right"),
    ("reset", "Reset", "Show the whole time"),
)
_FILES = ("PNG", "SVG", "CSV")


def page(title: str, figures: Sequence[Figure], *content: Markup, headed: bool = True) -> str:
    """A whole page: title (unless the content is ``headed`` itself), content, and figures' data."""
    day = element("p", f"winchkit, {date.today()}", class_="quiet")
    head = [element("header", element("h1", title), day)] if headed else []
    script = _script(figures) if figures else []
    body = element("body", element("main", *head, *content), *script)
    return f'<!DOCTYPE html>\n<html lang="en">{_head(title)}{body}</html>\n'


def figure_block(figure: Figure, width: float = WIDE) -> Markup:
    """A figure of a page with its buttons, which the script shows, and its caption."""
    name = figure.title
    zoom = [
        element(
            "button", text, type="button", data_zoom=key, title=what, aria_label=f"{what}: {name}"
        )
        for key, text, what in (_ZOOM if figure.zoom else ())
    ]
    save = [
        element("button", kind, type="button", data_save=kind.lower(), aria_label=f"{kind}: {name}")
        for kind in _FILES
    ]
    tools = element(
        "div",
        *([element("span", *zoom, class_="group")] if zoom else []),
        element("span", *save, class_="group"),
        class_="tools",
        hidden="",
    )
    return element(
        "figure",
        tools,
        element("div", page_svg(figure, width), class_="canvas"),
        element("figcaption", figure.caption),
        class_="figure",
        data_figure=figure.id,
    )


def _script(figures: Sequence[Figure]) -> list[Markup]:
    """Script elements: the data of the figures, the styles of saved figures, and the program."""
    data = {figure.id: {"source": figure.source, **figure.table().to_json()} for figure in figures}
    styles = {f"f-{name}": style.attributes(LIGHT) for name, style in STYLES.items()}
    embedded = inline({"figures": data, "styles": styles})
    return [
        Markup(f'<script type="application/json" id="figures">{embedded}</script>'),
        Markup(f"<script>{_asset('report.js')}</script>"),
    ]


def _head(title: str) -> Markup:
    policy = f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">'
    dark = f"@media screen and (prefers-color-scheme:dark){{:root{{{token_sheet(DARK)}}}}}"
    tokens = f":root{{{token_sheet(LIGHT)}}}{dark}"
    return element(
        "head",
        Markup('<meta charset="utf-8">'),
        Markup(policy),
        Markup('<meta name="viewport" content="width=device-width, initial-scale=1">'),
        Markup('<meta name="color-scheme" content="light dark">'),
        element("title", title),
        Markup(f"<style>{tokens}\n{_asset('report.css')}\n{style_sheet()}</style>"),
    )


def _asset(name: str) -> str:
    """A file of the folder ``assets`` beside this module."""
    return (files("winchkit.report.html") / "assets" / name).read_text(encoding="utf-8")
