"""Page of a robot's calibration: errors before and after, per pose, and all parameters."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import degrees, isfinite
from typing import TYPE_CHECKING

import numpy as np

from winchkit.quantity_text import quantity, scale_for
from winchkit.report.figures.figure import Figure, FigureAxis, FigureSeries, Panel
from winchkit.report.html.markup import Markup, element, folded, table
from winchkit.report.html.page import figure_block, page
from winchkit.report.pages.parts import bullets, lead
from winchkit.report.words.sentence import capital
from winchkit.robot.calibration.prediction import rms
from winchkit.robot.calibration.results import candidate_lines, in_words, noise_words

if TYPE_CHECKING:
    from winchkit.robot.calibration.calibrate import Calibrated
    from winchkit.robot.calibration.pose_design import NextPose
    from winchkit.robot.calibration.prediction import PoseErrors
    from winchkit.robot.identification.parameters import Estimated

_MM = 1e3
_MOST = 5
"""Parameters in the lead, largest change first; the table has all."""
_SIDE = 560
"""px: width of a figure, of which a row has two."""


def calibration_html(
    found: Calibrated,
    following: Sequence[NextPose],
    title: str,
    source: str = "",
    written: str = "",
) -> str:
    """The page, self-contained; ``written`` is the profile, empty where none was."""
    chip, tone = _verdict(found)
    figures = calibration_figures(found, source)
    pair = [figure_block(figure, _SIDE) for figure in figures]
    compared, *others = _sentences(found)
    blind = found.observed.unobservable
    rows = [
        ("Compared", _compared(found)),
        ("Error", compared),
        ("Fitted", others[0]),
        ("Cause", others[1] if len(others) > 1 else ""),
        ("Result", capital(found.refusal) if found.refusal else ""),
        ("Written to", element("code", written) if written and not found.refusal else ""),
        ("Would decide", _decides(following, blind)),
    ]
    return page(
        title,
        figures,
        lead(title, chip, tone, headline(found), rows, _changes(found)),
        element("div", *pair, class_="pair maps output") if pair else Markup(""),
        folded("blind", "Not identifiable from these poses", bullets(blind)),
        folded("missing", "Candidate effects", bullets(candidate_lines(found))),
        folded("notes", "Notes", bullets(found.warnings)),
        folded("next", "Poses to measure next", _next(following)),
        folded("parameters", "Parameters", _parameters(found)),
        headed=False,
    )


def _compared(found: Calibrated) -> str:
    held = len(found.validation_after.distance)
    fitted = len(found.equations.measured)
    profile = found.equations.robot.profile.name
    return f"{fitted} poses fitted, {held} held out; profile {profile}"


def headline(found: Calibrated) -> str:
    """Return the result of a calibration in a sentence."""
    if found.refusal:
        return "The robot is not calibrated"
    before, after = found.validation_before.distance, found.validation_after.distance
    if not isfinite(rms(after)):
        return "The robot is calibrated; no pose was held out"
    scale = scale_for(rms(before), "m")
    return f"Pose error falls from {scale.span(rms(before), rms(after))}"


def _decides(following: Sequence[NextPose], blind: Sequence[str]) -> str:
    if following:
        return f"{len(following)} poses to measure next are listed below."
    if blind:
        return (
            f"{len(blind)} parameters are not identifiable from these poses: winchkit calibrate "
            "--next 8 proposes poses that determine more of them."
        )
    return "Poses at other places that the calibrated model does not predict to within its noise."


def largest_changes(found: Calibrated) -> list[list[str]]:
    """Return the largest changes in multiples of their standard deviation."""

    def size(item: tuple[str, Estimated]) -> float:
        one = item[1]
        ratio = abs(one.value - one.nominal) / one.std if one.std > 0 else 0.0
        return ratio if isfinite(ratio) else 0.0

    ranked = sorted(found.estimates.items(), key=lambda item: -size(item))[:_MOST]
    rows = []
    for name, estimate in ranked:
        nominal, value, sigma, unit = in_words(estimate)
        change = in_words(replace(estimate, value=estimate.value - estimate.nominal))[1]
        signed = change if change.startswith("-") else f"+{change}"
        texts = f"{signed} ± {sigma} {unit}", f"{nominal} to {value}"
        rows.append([_readable(name), *(text.replace("-", "−") for text in texts)])
    return rows


def _changes(found: Calibrated) -> Markup:
    return table(
        "Largest changes, and the values before and after.",
        ["parameter", "change", "from, to"],
        largest_changes(found),
    )


def _verdict(found: Calibrated) -> tuple[str, str]:
    """The result in a word, and its colour."""
    if found.refusal:
        return "not calibrated", "unknown"
    if not found.solution.converged:
        return "not converged", "partly"
    if found.candidates:
        return "calibrated, with a missing effect", "partly"
    if found.observed.unobservable:
        return "calibrated in part", "partly"
    return "calibrated", "explained"


def _readable(name: str) -> str:
    """``1.exit_point.x`` as ``cable 1, exit point x``."""
    line, dot, own = name.partition(".")
    words = (own if dot and line.isdigit() else name).replace("_", " ").replace(".", " ")
    return f"cable {line}, {words}" if dot and line.isdigit() else words


def _sentences(found: Calibrated) -> Iterator[str]:
    before, after = found.validation_before, found.validation_after
    if isfinite(rms(after.distance)):
        yield (
            f"At {len(after.distance)} poses that were not fitted the position error fell from "
            f"{quantity(rms(before.distance), 'm')} to {quantity(rms(after.distance), 'm')} rms"
            + (
                f", and the rotation error from {degrees(rms(before.angle)):.3g}° to "
                f"{degrees(rms(after.angle)):.3g}°."
                if isfinite(rms(after.angle))
                else "."
            )
        )
    else:
        yield "No position was held out: the prediction error of the model is unknown."
    yield (
        f"{found.observed.free} parameters were fitted to {len(found.equations.measured)} poses; "
        f"the rank of the data is {found.observed.rank}. Standard deviations of the residuals: "
        f"{noise_words(found)}."
    )
    if found.candidates:
        first = found.candidates[0]
        yield (
            f"They exceed the noise: the effect {first.effect} would explain "
            f"{first.share * 100:.0f} % of their variance."
        )


def calibration_figures(found: Calibrated, source: str = "") -> list[Figure]:
    """Position errors of the poses before and after, held out first."""
    pairs = [
        ("held-out", "Poses held out", found.validation_before, found.validation_after),
        ("fitted", "Poses fitted", found.fit_before, found.fit_after),
    ]
    every = np.concatenate([e.distance for *_, before, after in pairs for e in (before, after)])
    every = every[every > 0] * _MM
    if not len(every):
        return []
    limits = (float(every.min()) / 1.25, float(every.max()) * 1.25)
    up = FigureAxis("position error", "mm", logarithmic=True, limits=limits)
    return [
        _figure(name, title, up, (before, after), source)
        for name, title, before, after in pairs
        if any(isfinite(value) for value in after.distance)
    ]


def _figure(
    name: str, title: str, up: FigureAxis, errors: tuple[PoseErrors, PoseErrors], source: str
) -> Figure:
    """Points over the poses on a logarithmic axis, rms as lines."""
    before, after = errors
    series, number = [], np.arange(1.0, len(after.distance) + 1)
    for tone, word, one in (
        ("today", "before calibration", before),
        ("with", "after calibration", after),
    ):
        size = np.asarray(one.distance, dtype=float) * _MM
        size[~(size > 0)] = np.nan
        series.append(FigureSeries(word, tone, number, size, "points"))
    for drawn in series[:2]:
        mean = rms(drawn.y)
        ends = np.array([0.0, len(after.distance) + 1.0])
        text = f"rms {quantity(mean / _MM, 'm')}"
        line = FigureSeries("", drawn.tone, ends, np.full(2, mean), "line", text)
        series.append(line)
    return Figure(
        f"pose-error-{name}",
        title,
        f"{title}: distance of the predicted from the measured position, before and after "
        "calibration.",
        FigureAxis("pose", limits=(0.0, len(after.distance) + 1.0)),
        (Panel(up, tuple(series)),),
        source=source,
        names=tuple(str(place) for place in after.place),
    )


def _next(following: Sequence[NextPose]) -> Markup:
    if not following:
        return Markup("")
    rows = [
        [
            str(number),
            *(f"{value * _MM:.0f}" for value in pose.position),
            *(f"{degrees(value):.1f}" for value in pose.angles),
            f"{pose.gain:.1f}",
        ]
        for number, pose in enumerate(following, start=1)
    ]
    head = ["", "x [mm]", "y [mm]", "z [mm]", "roll [°]", "pitch [°]", "yaw [°]", "gain [bit]"]
    return table(
        "In this order. The cables hold the platform in each; check for collisions.", head, rows
    )


def _parameters(found: Calibrated) -> Markup:
    rows = []
    for name, estimate in found.estimates.items():
        nominal, value, sigma, unit = in_words(estimate)
        at = f", at its {estimate.bound} bound" if estimate.bound else ""
        numbers = [text.replace("-", "−") for text in (nominal, value, sigma)]
        rows.append([name, unit + at, *numbers])
    return table(
        "Values with their posterior standard deviation.",
        ["parameter", "unit", "nominal", "value", "sigma"],
        rows,
        words=2,
    )
