"""Figures of runs, results and profiles by matplotlib, with a unit on every axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.residuals.traces import OutputTrace, PoseTrace
from winchkit.diagnosis.results import Comparison, Diagnosis
from winchkit.effects.bind import line_of
from winchkit.errors import UsageError, suggest
from winchkit.quantity_text import PrintScale, scale_for
from winchkit.report.figures.reduction import decimated
from winchkit.report.notebook.style import BLACK, BLUE, GREY, ORANGE, WIDTH, Size, new_figure
from winchkit.report.words.sentence import capital
from winchkit.report.words.vocabulary import OUTPUT_NAMES
from winchkit.runs.run import Run
from winchkit.schema.profiles.axis import AxisProfile
from winchkit.schema.profiles.winch import WinchProfile

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_OUTPUT_HEIGHT, _CHANNEL_HEIGHT, _POSE_HEIGHT = 2.5, 1.15, 2.0
"""Inches per output, channel and pose trace."""
_POINTS = 4000
"""Points of a line, several for each pixel of its width."""
_NAMED_RUNS = 8
"""Runs that a legend names; more would cover the axes."""
_CHANNELS = 8
"""Channels that are drawn without a choice: about one screen."""
_GAP = 0.02
"""Gap between runs that follow each other, as a share of the whole time."""
_LENGTHS = 400
"""Points of a curve, one for two or three pixels."""
_TURN = 2 * np.pi


def result_figure(
    result: Comparison | Diagnosis,
    *,
    output: str | Sequence[str] | None = None,
    run: str | Sequence[str] | None = None,
    figsize: Size = None,
) -> Figure:
    """Measured and predicted over time, with the residual and the noise band below."""
    traces = _chosen(result.traces, output, run)
    noise = {name: fit.noise_rms for name, fit in result.outputs.items()}
    if any(isinstance(trace, PoseTrace) for trace in traces):
        return _pose_figure([t for t in traces if isinstance(t, PoseTrace)], noise, figsize)
    own = [trace for trace in traces if isinstance(trace, OutputTrace)]
    outputs = list(dict.fromkeys(trace.output for trace in own))
    with new_figure(figsize or (WIDTH, _OUTPUT_HEIGHT * len(outputs) + 0.3)) as figure:
        # The width of the letters of the labels differs; their axes begin at one place.
        grid = figure.subplots(
            2 * len(outputs), 1, sharex=True, height_ratios=[1.6, 1.0] * len(outputs), squeeze=False
        )[:, 0]
        for index, name in enumerate(outputs):
            parts = [trace for trace in own if trace.output == name]
            _draw_output(grid[2 * index], grid[2 * index + 1], parts, noise.get(name))
        last = grid[-1]
        several = len({trace.run for trace in own}) > 1
        last.set_xlabel("time, runs one after the other [s]" if several else "time [s]")
        last.margins(x=0.01)
        _name_runs(grid[0], [trace for trace in own if trace.output == outputs[0]])
        legend(figure, *grid[:2])
        figure.align_ylabels()
    return figure


def run_figure(
    run: Run, *, channels: str | Sequence[str] | None = None, figsize: Size = None
) -> Figure:
    """Channels of a run over time, by default the first eight with numbers; one axis each."""
    there = [name for name in run if np.isfinite(run[name]).any()]
    names = there[:_CHANNELS] if channels is None else _known(channels, list(run), "channel")
    if not names:
        raise UsageError(f"run {run.name} has no channel with numbers to draw")
    with new_figure(figsize or (WIDTH, _CHANNEL_HEIGHT * len(names) + 0.4)) as figure:
        axes = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
        for axis, name in zip(axes, names, strict=True):
            rows = decimated([run[name]], _POINTS // 2)
            time, values = run.time[rows], run[name][rows]
            scale = common_scale([values], run.channels[name].unit)
            axis.plot(time, values / scale.worth, color=BLUE)
            axis.set_ylabel(axis_label(name.replace("_", " "), scale, broken=True))
        axes[0].set_title(run.name, loc="left")
        axes[-1].set_xlabel("time [s]")
        figure.align_ylabels()
    return figure


def winch_figure(profile: WinchProfile, *, figsize: Size = None) -> Figure:
    """Motor angle, and cable per drum angle, over the cable length."""
    longest = profile.reference.cable_length
    if isinstance(profile, AxisProfile) or not longest:
        raise UsageError(
            f"profile '{profile.name}' has no reference.cable_length: there is no cable to draw"
        )
    line = line_of(profile)
    lengths = np.linspace(0.0, longest, _LENGTHS)
    angles = line.nominal_motor_angle(lengths)
    arms = np.array([line.arm(float(angle)) for angle in angles]) * profile.gearbox.ratio
    with new_figure(figsize or (WIDTH, 2.4)) as figure:
        left, right = figure.subplots(1, 2)
        left.plot(lengths, angles / _TURN, color=BLUE)
        left.set_ylabel("Motor angle [turns]")
        right.plot(lengths, np.abs(arms) * 1e3, color=BLUE)
        right.set_ylabel("Cable per drum angle [mm/rad]")
        for axis in (left, right):
            axis.set_xlabel("cable length [m]")
        figure.suptitle(profile.name, x=0.0, ha="left", fontsize=8)
    return figure


def _pose_figure(
    traces: Sequence[PoseTrace], noise: Mapping[str, float | None], figsize: Size
) -> Figure:
    """Errors of every output at every pose, all lines or axes, with the noise band."""
    with new_figure(figsize or (WIDTH, _POSE_HEIGHT * len(traces) + 0.3)) as figure:
        axes = figure.subplots(len(traces), 1, sharex=True, squeeze=False)[:, 0]
        for axis, trace in zip(axes, traces, strict=True):
            before = trace.residual_before
            parts = [trace.residual] if before is None else [before, trace.residual]
            scale = common_scale(parts, trace.unit)
            _band(axis, noise.get(trace.output), scale)
            tones = [BLUE] if before is None else [ORANGE, BLUE]
            words = ["profile"] if before is None else ["profile", "with the named effects"]
            number = np.arange(1, len(trace.residual) + 1)
            for part, color, word in zip(parts, tones, words, strict=True):
                lines = axis.plot(number, part / scale.worth, ".", ms=2.5, color=color)
                lines[0].set_label(word)
            axis.axhline(0.0, color=BLACK, lw=0.5)
            axis.set_ylabel(axis_label(f"{_name(trace.output)}:\nresidual", scale))
        axes[-1].set_xlabel("number of the pose")
        legend(figure, axes[0])
        figure.align_ylabels()
    return figure


def _draw_output(
    upper: Axes, lower: Axes, traces: Sequence[OutputTrace], noise: float | None
) -> None:
    """Measured and predicted above, the residual with the noise band below."""
    starts = _starts(traces)
    measured = [trace.measured for trace in traces]
    scale = common_scale(measured, traces[0].unit)
    residuals = [trace.residual_before for trace in traces], [trace.residual for trace in traces]
    drawn = [part for group in residuals for part in group if part is not None]
    fine = common_scale(drawn, traces[0].unit, share=3.0)
    _band(lower, noise, fine)
    named = any(trace.before is not None for trace in traces)
    after = "with the named effects" if named else "predicted"
    for trace, start in zip(traces, starts, strict=True):
        lines = [
            (upper, trace.measured, scale, BLACK, "measured", 1.4),
            (upper, trace.before, scale, ORANGE, "predicted by the profile", 0.9),
            (upper, trace.predicted, scale, BLUE, after, 0.9),
            (lower, trace.residual_before, fine, ORANGE, "", 0.7),
            (lower, trace.residual, fine, BLUE, "", 0.7),
        ]
        for axis, values, own, color, word, width in lines:
            if values is not None:
                rows = decimated([values], max(100, _POINTS // (2 * len(traces))))
                time, shown = trace.time[rows], values[rows]
                first = trace is traces[0] and word
                label = word if first else None
                axis.plot(start + time, shown / own.worth, color=color, lw=width, label=label)
    for axis in (upper, lower):
        for start in starts[1:]:
            axis.axvline(start, color=GREY, lw=0.4, ls=":")
    lower.axhline(0.0, color=BLACK, lw=0.5)
    upper.set_ylabel(axis_label(_name(traces[0].output), scale, broken=True))
    lower.set_ylabel(axis_label("residual", fine, broken=True))


def _starts(traces: Sequence[OutputTrace]) -> list[float]:
    """Start of every run on an axis on which they follow each other."""
    lengths = [float(trace.time[-1]) for trace in traces]
    gap = _GAP * sum(lengths) / len(lengths)
    return [float(sum(lengths[:k]) + k * gap) for k in range(len(lengths))]


def _name_runs(axis: Axes, traces: Sequence[OutputTrace]) -> None:
    """Names of the runs above their curves, where there are few."""
    if not 1 < len(traces) <= _NAMED_RUNS:
        return
    for trace, start in zip(traces, _starts(traces), strict=True):
        axis.annotate(
            trace.run,
            (start, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(0, 2),
            textcoords="offset points",
            va="bottom",
            fontsize=7,
            color=GREY,
        )


def _band(axis: Axes, noise: float | None, scale: PrintScale) -> None:
    if noise is not None and np.isfinite(noise):
        size = noise / scale.worth
        axis.axhspan(-size, size, color=GREY, alpha=0.3, lw=0, label="noise, ± rms")


def legend(figure: Figure, *axes: Axes) -> None:
    """Legend of several axes above the figure."""
    pairs = [pair for axis in axes for pair in zip(*axis.get_legend_handles_labels(), strict=True)]
    figure.legend(*zip(*pairs, strict=True), loc="outside upper center", ncols=4)


def common_scale(parts: Sequence[Array | None], unit: str, share: float = 1.0) -> PrintScale:
    """Unit for the largest value, or for some rms of it."""
    values = np.concatenate(
        [np.zeros(0), *(np.abs(part).ravel() for part in parts if part is not None)]
    )
    known = values[np.isfinite(values)]
    if not len(known):
        return scale_for(0.0, unit)
    size = float(np.max(known)) if share == 1.0 else share * float(np.sqrt(np.mean(known**2)))
    # Angles beyond a turn are in radians, as in the file.
    return PrintScale("rad", 1.0) if unit == "rad" and size > 2 * np.pi else scale_for(size, unit)


def axis_label(name: str, scale: PrintScale, *, broken: bool = False) -> str:
    """``Name [unit]``, on two lines where it is broken."""
    unit = f" [{scale.label}]" if scale.label else ""
    return capital(name) + (unit.replace(" [", "\n[") if broken else unit)


def _name(output: str) -> str:
    return OUTPUT_NAMES.get(output, output.replace("_", " "))


def _chosen(
    traces: Sequence[OutputTrace | PoseTrace],
    output: str | Sequence[str] | None,
    run: str | Sequence[str] | None,
) -> list[OutputTrace | PoseTrace]:
    if not traces:
        raise UsageError("this result holds no samples to draw; call compare or diagnose again")
    outputs = list(dict.fromkeys(trace.output for trace in traces))
    runs = list(dict.fromkeys(trace.run for trace in traces if isinstance(trace, OutputTrace)))
    kept = outputs if output is None else _known(output, outputs, "output")
    kept_runs = runs if run is None else _known(run, runs, "run")
    return [
        trace
        for trace in traces
        if trace.output in kept and (isinstance(trace, PoseTrace) or trace.run in kept_runs)
    ]


def _known(given: str | Sequence[str], there: list[str], kind: str) -> list[str]:
    """Names that are there; raises UsageError for one that is not."""
    names = [given] if isinstance(given, str) else list(given)
    for name in names:
        if name not in there:
            known = f"there are {', '.join(there)}" if there else f"there is no {kind}"
            raise UsageError(f"no {kind} '{name}' to draw; {known}" + suggest(name, there))
    return names
