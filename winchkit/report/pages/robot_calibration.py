"""Page of a robot's calibration: errors before and after, per pose, and all parameters."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import degrees, isfinite
from typing import TYPE_CHECKING

from winchkit.calibration.robot.results import candidate_lines, in_words, noise_words
from winchkit.report.html.chart import Axis, Chart, axis_over, legend
from winchkit.report.html.markup import Markup, element, section, table
from winchkit.report.html.page import page
from winchkit.report.pages.parts import bullets, lead

if TYPE_CHECKING:
    from winchkit.calibration.robot.calibrate import Calibrated
    from winchkit.calibration.robot.pose_design import NextPose
    from winchkit.calibration.robot.prediction import PoseErrors

__all__ = ["calibration_html"]

_MM = 1e3


def calibration_html(found: Calibrated, following: Sequence[NextPose], title: str) -> str:
    """The page, self-contained and without script.

    Parameters
    ----------
    found : Calibrated
        The calibration.
    following : sequence of NextPose
        Proposed poses.
    title : str
        Title of the page.

    Returns
    -------
    str
        HTML, self-contained.
    """
    head, tone = _verdict(found)
    return page(
        title,
        (),
        lead(head, tone, list(_sentences(found))),
        section("errors", "Position errors of the poses", *_figures(found)),
        section("blind", "Not identifiable from these poses", bullets(found.observed.unobservable)),
        section("missing", "Candidate effects", bullets(candidate_lines(found))),
        section("notes", "Notes", bullets(found.warnings)),
        section("next", "Poses to measure next", _next(following)),
        section("parameters", "Parameters", _parameters(found)),
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


def _sentences(found: Calibrated) -> Iterator[str]:
    from winchkit.calibration.robot.prediction import rms

    before, after = found.validation_before, found.validation_after
    if isfinite(rms(after.distance)):
        yield (
            f"At {len(after.distance)} poses that were not fitted the position error fell from "
            f"{rms(before.distance) * _MM:.3g} mm to {rms(after.distance) * _MM:.3g} mm rms"
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


def _figures(found: Calibrated) -> Iterator[Markup]:
    pairs = [
        ("Poses fitted", found.fit_before, found.fit_after),
        ("Poses held out", found.validation_before, found.validation_after),
    ]
    sizes = [
        float(v) * _MM
        for _, before, after in pairs
        for values in (before.distance, after.distance)
        for v in values
        if isfinite(v) and v > 0
    ]
    if not sizes:
        return
    up = axis_over("position error [mm]", sizes, logarithmic=True)
    drawn = [
        _figure(name, up, before, after)
        for name, before, after in pairs
        if any(isfinite(value) for value in after.distance)
    ]
    yield element("div", *drawn, class_="pair maps")


def _figure(name: str, up: Axis, before: PoseErrors, after: PoseErrors) -> Markup:
    """Dots over the poses, with one scale for all figures and the pose as tooltip."""
    places = after.place.tolist()
    caption = f"{name}: distance of the predicted from the measured position, before and after."
    chart = Chart(axis_over("number of the pose", [1.0, float(len(places))]), up, caption)
    dots = [
        chart.dot(number, v * _MM, word, f"{place}: {v * _MM:.3g} mm {word}")
        for word, values in (("before", before.distance), ("after", after.distance))
        for number, (place, v) in enumerate(zip(places, values.tolist(), strict=True), start=1)
        if isfinite(v) and v > 0
    ]
    colours = legend([("before", "before calibration"), ("after", "after calibration")])
    return element("figure", chart.draw(*dots), colours, element("figcaption", caption))


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
        "In this order. The cables hold the platform in each; check for collisions.",
        head,
        rows,
    )


def _parameters(found: Calibrated) -> Markup:
    rows = []
    for name, estimate in found.estimates.items():
        nominal, value, sigma, unit = in_words(estimate)
        at = f", at its {estimate.bound} bound" if estimate.bound else ""
        rows.append([name, unit + at, nominal, value, sigma])
    return table(
        "Values with their posterior standard deviation.",
        ["parameter", "unit", "nominal", "value", "sigma"],
        rows,
        words=2,
    )
