"""Colours of pages and figures, in light and dark, and the styles of a figure's marks.

The colours differ in hue and in luminance, so that they remain distinct for colour-blind readers
and in greyscale: ``today`` is the present model, ``with`` the model with a candidate effect.
"""

from __future__ import annotations

from dataclasses import dataclass

LIGHT = {
    "surface": "#FFFFFF",
    "bg": "#F6F7F9",
    "sunk": "#EEF1F4",
    "ink": "#12161C",
    "ink2": "#414B58",
    "muted": "#5F6B79",
    "line": "#DDE2E8",
    "edge": "#858F9C",
    "today": "#C2500F",
    "with": "#0B4A8A",
    "band": "#E4E8ED",
    "brush": "#7B2FA8",
    "action": "#1D4F91",
    "stop": "#C5221A",
    "ok": "#14693A",
    "warn": "#805300",
    "unknown": "#6A3A96",
    "above": "#7B3294",
    "below": "#1B7837",
}
"""Token and colour on a light ground; ``above`` and ``below`` are the signs of a residual map."""

DARK = {
    "surface": "#161B22",
    "bg": "#0E1217",
    "sunk": "#1E252E",
    "ink": "#E9EDF2",
    "ink2": "#BAC4CF",
    "muted": "#929EAC",
    "line": "#29313B",
    "edge": "#66717F",
    "today": "#EE8545",
    "with": "#9CD0FF",
    "band": "#27303A",
    "brush": "#CE93F0",
    "action": "#8DBDF5",
    "stop": "#D6352C",
    "ok": "#6FCF97",
    "warn": "#E9B85A",
    "unknown": "#CFA6F0",
    "above": "#D19BE0",
    "below": "#7FD08F",
}
"""The same on a dark ground."""


@dataclass(frozen=True)
class Style:
    """How a mark or a text is drawn; colours are tokens, lengths px."""

    stroke: str = ""
    fill: str = ""
    width: float = 1.0
    opacity: float = 1.0
    dash: str = ""
    size: float = 0.0
    """Font size; 0 for a mark."""
    bold: bool = False

    def attributes(self, colours: dict[str, str] | None = None) -> dict[str, str]:
        """SVG attributes, with the given colours or with CSS variables of the page."""

        def colour(token: str) -> str:
            if not token:
                return "none"
            return f"var(--{token})" if colours is None else colours[token]

        out = {"fill": colour(self.fill)}
        if self.size:
            out["font-size"] = f"{self.size:g}px" if colours is None else f"{self.size:g}"
            if self.bold:
                out["font-weight"] = "600"
            return out
        out["stroke"] = colour(self.stroke)
        if self.stroke:
            out |= {
                "stroke-width": f"{self.width:g}",
                "stroke-linecap": "butt" if self.dash else "round",
                "stroke-linejoin": "round",
            }
        if self.opacity < 1.0:
            out["opacity"] = f"{self.opacity:g}"
        if self.dash:
            out["stroke-dasharray"] = self.dash
        return out


def _steps(token: str, opacities: tuple[float, ...], name: str) -> dict[str, Style]:
    return {f"{name}-{n}": Style(fill=token, opacity=o) for n, o in enumerate(opacities)}


STYLES: dict[str, Style] = {
    "ground": Style(fill="surface"),
    "rule": Style(stroke="line"),
    "axis": Style(stroke="edge"),
    "zero": Style(stroke="edge"),
    "run": Style(stroke="edge", dash="2 3"),
    "band": Style(fill="band"),
    "limit": Style(stroke="ink", width=1.5),
    "floor": Style(stroke="edge", dash="4 3"),
    "measured-line": Style(stroke="ink", width=2.4, opacity=0.35),
    "plain-line": Style(stroke="muted", width=1.5),
    "plain-mean": Style(stroke="muted", width=2.0),
    "plain-points": Style(stroke="muted", width=6.0),
    "today-line": Style(stroke="today", width=1.25),
    "today-mean": Style(stroke="today", width=2.0),
    "today-dots": Style(stroke="today", width=2.6, opacity=0.35),
    "today-points": Style(stroke="today", width=6.0, opacity=0.85),
    "with-line": Style(stroke="with", width=1.5),
    "with-mean": Style(stroke="with", width=3.0),
    "with-dots": Style(stroke="with", width=2.6, opacity=0.35),
    "with-points": Style(stroke="with", width=6.5),
    "inside": Style(stroke="surface", width=3.2),
    "casing": Style(stroke="surface", width=5.0, opacity=0.75),
    "minus": Style(stroke="surface", width=1.5),
    **_steps("today", (0.14, 0.3, 0.5, 0.72, 1.0), "density"),
    "neutral": Style(fill="line"),
    **_steps("above", (0.1, 0.35, 0.62, 0.95), "above"),
    **_steps("below", (0.1, 0.35, 0.62, 0.95), "below"),
    "title": Style(fill="ink", size=14.0, bold=True),
    "label": Style(fill="ink2", size=12.0),
    "tick": Style(fill="muted", size=12.0),
    "run-label": Style(fill="muted", size=12.0),
    "source": Style(fill="muted", size=11.0),
}
"""Style by the class of a mark or text."""


def token_sheet(colours: dict[str, str]) -> str:
    """Declarations of the tokens as CSS custom properties."""
    return "".join(f"--{name}:{value};" for name, value in colours.items())


def style_sheet() -> str:
    """CSS of all styles, over the tokens of the page."""
    rules = []
    for name, style in STYLES.items():
        declared = ";".join(f"{key}:{value}" for key, value in style.attributes().items())
        # Declared here, as the marks that are used in two places match no selector of a place.
        declared += "" if style.size else ";vector-effect:non-scaling-stroke"
        rules.append(f".f-{name}{{{declared}}}")
    return "\n".join(rules)
