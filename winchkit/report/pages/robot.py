"""Pages of a robot's diagnosis, comparison and added effect, self-contained and without script."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite, nan, sqrt

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.results import Where
from winchkit.diagnosis.robot.add import RobotGrown
from winchkit.diagnosis.robot.attribution import AXES, on_cables
from winchkit.diagnosis.robot.compare import RobotCompared
from winchkit.diagnosis.robot.diagnose import RobotAnswer
from winchkit.diagnosis.robot.errors import UNITS, Errors
from winchkit.diagnosis.robot.regression import PoseRegression
from winchkit.report.figures.plots import AT_NOISE
from winchkit.report.figures.pose_traces import NUMBER, Trace, traces
from winchkit.report.html.chart import Axis, Chart, axis_over, legend, reading
from winchkit.report.html.markup import Markup, element, table
from winchkit.report.html.page import page
from winchkit.report.pages.addition import addition_sections
from winchkit.report.pages.comparison import comparison_sections
from winchkit.report.pages.diagnosis import sections
from winchkit.report.reproducibility import Command
from winchkit.report.tables import bar
from winchkit.report.words.numbers import Scale, scale_for, unbroken
from winchkit.report.words.sentence import capital, moved_outputs, where_text
from winchkit.report.words.vocabulary import OUTPUT_NAMES

__all__ = [
    "pose_figures",
    "robot_addition_html",
    "robot_comparison_html",
    "robot_report_html",
]

_SPREAD = 0.25
_CHANGED = 1.02


def pose_figures(
    regression: PoseRegression,
    before: Errors,
    after: Errors | None,
    noise: Mapping[str, float | None],
    first: Sequence[str] = (),
) -> list[Markup]:
    """A block per output: its errors over their main variable, and by line or axis.

    ``after`` is None where nothing was changed; outputs in ``first`` come first.
    """
    drawn = traces(regression, before, after)
    drawn.sort(key=lambda t: list(first).index(t.over.output) if t.over.output in first else 99)
    return [
        _output(regression, trace, before, after, noise.get(trace.over.output)) for trace in drawn
    ]


def _output(
    regression: PoseRegression,
    trace: Trace,
    before: Errors,
    after: Errors | None,
    noise: float | None,
) -> Markup:
    name = trace.over.output
    title = element("h3", capital(OUTPUT_NAMES.get(name, name)))
    lines = list(AXES) if name == "platform_position" else list(regression.dataset.names)
    then = None if after is None else on_cables(regression, {name: after[name]})[name]
    each = _each_line(name, lines, on_cables(regression, {name: before[name]})[name], then)
    pair = element("div", _figure(trace, noise), each, class_="pair maps")
    return element("div", title, pair, class_="output")


def _figure(trace: Trace, noise: float | None) -> Markup:
    """Dots of every pose, means as lines, the noise as a band."""
    how, unit = reading(trace.over.variable), UNITS[trace.over.output]
    scale = scale_for(float(np.abs(trace.before).max(initial=0.0)), unit)
    if noise is not None and trace.over.output == "platform_position":
        noise /= sqrt(len(AXES))  # Noise of one axis from that of the distance.
    states = [("before", trace.before)]
    if trace.after is not None and _differ(trace):
        states.append(("after", trace.after))
    elif float(np.sqrt(np.mean(trace.before**2))) < AT_NOISE * (noise or 0.0):
        states = [("residual", trace.before)]
    caption = _caption(trace, noise)
    across = _axis(trace, how.label, np.asarray(how.shown(trace.x)))
    every = [float(v) / scale.worth for _, values in states for v in values]
    up = axis_over(f"measured − predicted [{scale.label}]", every, zero=True)
    chart = Chart(across, up, caption)
    marks = _band(chart, noise, scale)
    places = _beside(trace, how.shown(trace.x), len(states))
    for (tone, values), x in zip(states, places, strict=True):
        dots = zip(x.tolist(), (values / scale.worth).tolist(), strict=True)
        marks += [chart.dot(a, b, tone) for a, b in dots]
    for tone, values in states:
        at, mean = trace.means(values)
        points = zip(how.shown(at).tolist(), (mean / scale.worth).tolist(), strict=True)
        if trace.over.variable != "winch":
            marks.append(chart.line(points, tone))
    said = ["before", "after"] if len(states) > 1 else ["unchanged"]
    words = [(tone, text) for (tone, _), text in zip(states, said, strict=True)]
    drawn = chart.draw(*marks)
    return element("figure", drawn, legend(words), element("figcaption", unbroken(caption)))


def _differ(trace: Trace) -> bool:
    """Whether the added effects changed this output."""
    assert trace.after is not None
    sizes = [float(np.sqrt(np.mean(values**2))) for values in (trace.before, trace.after)]
    return max(sizes) > _CHANGED * min(sizes)


def _caption(trace: Trace, noise: float | None) -> str:
    over = trace.over
    if over.variable == NUMBER:
        name = OUTPUT_NAMES.get(over.output, over.output)
        text = f"{name}; no measured variable explains its error"
    else:
        text = where_text(Where(over.output, over.variable, over.share, line=over.line))
    if trace.line is not None and over.line is None:
        where = "along" if over.output == "platform_position" else "of line"
        text += f", drawn {where} {trace.line}, with the largest share"
    band = "" if noise is None else " The grey band is the noise, ± its rms."
    return f"{capital(text)}. Dots are poses, lines their means.{band}"


def _axis(trace: Trace, label: str, shown: Array) -> Axis:
    if trace.over.variable == "winch":
        return Axis("line, in the order of the file", 0.4, float(trace.x.max()) + 0.6)
    return axis_over(label, shown.tolist())


def _beside(trace: Trace, x: Array, states: int) -> list[Array]:
    """Positions of the dots of each state; those of one line are side by side."""
    if trace.over.variable != "winch":
        return [x] * states
    out = x.copy()
    for value in np.unique(x):
        alike = x == value
        out[alike] += np.linspace(-_SPREAD, _SPREAD, int(np.count_nonzero(alike)))
    return [out] * states


def _band(chart: Chart, noise: float | None, scale: Scale) -> list[Markup]:
    if noise is None or not isfinite(noise):
        return []
    half = noise / scale.worth
    low, high = max(-half, chart.y.low), min(half, chart.y.high)
    ends = (chart.x.low, chart.x.high)
    return [chart.cell(ends, (low, high), "residual", 0.2, f"noise: {scale.text(noise)} rms")]


def _each_line(name: str, lines: Sequence[str], before: Array, after: Array | None) -> Markup:
    """Bars of the error of every line, or axis, before and after."""
    states = [("before", before)] + ([] if after is None else [("after", after)])
    sizes = {tone: [_rms(values[:, k]) for k in range(len(lines))] for tone, values in states}
    every = [size for own in sizes.values() for size in own if isfinite(size)]
    longest = max(every, default=0.0)
    scale = scale_for(longest, UNITS[name])
    rows = [
        [line, *(bar(own[k], 1.05 * longest, None, scale, tone) for tone, own in sizes.items())]
        for k, line in enumerate(lines)
    ]
    kind = "axis" if name == "platform_position" else "line"
    head = [kind, *(tone if after is not None else "error" for tone in sizes)]
    least = (
        " as the least cable forces that balance the residual wrench" if name == "tension" else ""
    )
    return table(f"Error, rms, by {kind}{least}.", head, rows)


def _rms(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if known.size else nan


def robot_report_html(
    answer: RobotAnswer, title: str, profile: str = "", *, options: Sequence[str] = ()
) -> str:
    """The page of a robot's diagnosis; ``profile`` and ``options`` as the user gave them.

    Parameters
    ----------
    answer : RobotAnswer
        The diagnosis.
    title : str
        Title of the page.
    profile : str
        The profile as the user named it.
    options : sequence of str
        Further options of the command.

    Returns
    -------
    str
        HTML, self-contained.
    """
    diagnosis, selection = answer.diagnosis, answer.selection
    before, after = selection.errors
    noise = {name: output.noise_rms for name, output in diagnosis.outputs.items()}
    moved = moved_outputs(diagnosis.outputs) if diagnosis.steps else []
    grown = after if diagnosis.steps else None
    figures = pose_figures(selection.final.regression, before, grown, noise, moved)
    command = Command(selection.preparation.dataset, profile, options)
    return page(title, (), sections(answer, figures, (), None, command))


def robot_comparison_html(
    compared: RobotCompared, title: str, profile: str = "", *, options: Sequence[str] = ()
) -> str:
    """The page of a robot's comparison.

    Parameters
    ----------
    compared : RobotCompared
        The comparison, with its residuals.
    title : str
        Title of the page.
    profile : str
        The profile as the user named it.
    options : sequence of str
        Further options of the command.

    Returns
    -------
    str
        HTML, self-contained.
    """
    comparison, command = (
        compared.comparison,
        Command(compared.regression.dataset, profile, options),
    )
    noise = {name: error.noise_rms for name, error in comparison.outputs.items()}
    figures = pose_figures(compared.regression, compared.errors, None, noise)
    content = comparison_sections(comparison, compared.followed, figures, command)
    return page(title, (), content)


def robot_addition_html(
    grown: RobotGrown,
    title: str,
    profile: str = "",
    better: str = "",
    *,
    options: Sequence[str] = (),
) -> str:
    """The page of an effect added to a robot; ``better`` is the profile that was written.

    Parameters
    ----------
    grown : RobotGrown
        The addition, with its residuals.
    title : str
        Title of the page.
    profile : str
        The profile as the user named it.
    better : str
        The written profile.
    options : sequence of str
        Further options of the command.

    Returns
    -------
    str
        HTML, self-contained.
    """
    outputs = grown.addition.outputs
    noise = {name: output.noise_rms for name, output in outputs.items()}
    before, after = grown.errors
    figures = pose_figures(grown.regression, before, after, noise, moved_outputs(outputs))
    command = Command(grown.regression.dataset, profile, options)
    content = addition_sections(grown.addition, figures, command, better or "better.toml")
    return page(title, (), content)
