"""A robot's calibration as one page: errors before and after, pose by pose, and every number."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from html import escape
from math import degrees, isfinite, log10
from typing import TYPE_CHECKING

from winchkit.calibration.robot_result import candidate_lines
from winchkit.diagnosis.report.markup import Markup, element, section, table
from winchkit.diagnosis.report.parts import bullets, lead
from winchkit.diagnosis.report.shell import page

if TYPE_CHECKING:
    from winchkit.calibration.robot import Calibrated
    from winchkit.calibration.robot_next import NextPose
    from winchkit.calibration.robot_predict import PoseErrors

__all__ = ["calibration_html"]

Level = Callable[[float], float]

_WIDTH, _HEIGHT, _LEFT, _BELOW = 720.0, 260.0, 64.0, 34.0
_BEFORE, _AFTER = "#b45309", "#0f766e"
_MM = 1e3


def calibration_html(found: Calibrated, following: Sequence[NextPose], title: str) -> str:
    """The page; it needs neither network nor script for its figures."""
    head = "calibrated" if found.solution.converged else "not settled"
    tone = "explained" if found.solution.converged else "partly"
    return page(
        title,
        (),
        lead(head, tone, list(_sentences(found))),
        section("errors", "Position errors, pose by pose", *_figures(found)),
        section("blind", "What these poses cannot tell", bullets(found.observed.unobservable)),
        section("missing", "What may be missing from the model", bullets(candidate_lines(found))),
        section("notes", "Notes", bullets(found.warnings)),
        section("next", "Poses to measure next", _next(following)),
        section("parameters", "Parameters", _parameters(found)),
    )


def _sentences(found: Calibrated) -> Iterator[str]:
    from winchkit.calibration.robot_predict import rms

    before, after = found.validation_before, found.validation_after
    if isfinite(rms(after.distance)):
        yield (
            f"At {len(after.distance)} poses that were not fitted the position error fell from "
            f"{rms(before.distance) * _MM:.3g} mm to {rms(after.distance) * _MM:.3g} mm rms."
        )
    else:
        yield "No position was held out: how well the model now predicts one is not known."
    yield (
        f"{found.observed.free} parameters were fitted to {len(found.equations.measured)} poses; "
        f"the data see {found.observed.rank} directions of them."
    )


def _figures(found: Calibrated) -> Iterator[Markup]:
    for name, before, after in (
        ("Poses fitted", found.fit_before, found.fit_after),
        ("Poses held out", found.validation_before, found.validation_after),
    ):
        if any(isfinite(value) for value in after.distance):
            yield _figure(name, before, after)


def _figure(name: str, before: PoseErrors, after: PoseErrors) -> Markup:
    """Dots over the poses on a logarithmic scale."""
    rows = [(before.distance * _MM, _BEFORE), (after.distance * _MM, _AFTER)]
    sizes = [float(v) for values, _ in rows for v in values if isfinite(v) and v > 0]
    if not sizes:
        return Markup("")
    low, high = log10(min(sizes)), log10(max(sizes))
    low, high = (low - 0.1, high + 0.1)

    def level(value: float) -> float:
        return (_HEIGHT - _BELOW) * (1 - (log10(value) - low) / (high - low))

    step = (_WIDTH - _LEFT) / max(len(after.distance), 1)
    dots = [
        f'<circle cx="{_LEFT + step * (n + 0.5):.1f}" cy="{level(float(v)):.1f}" r="3" '
        f'fill="{colour}"/>'
        for values, colour in rows
        for n, v in enumerate(values)
        if isfinite(v) and v > 0
    ]
    caption = f"{name}: distance of the predicted from the measured position, before and after."
    drawing = Markup(
        f'<svg viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" width="100%" role="img" '
        f'aria-label="{escape(caption)}">{_axes(low, high, level)}{"".join(dots)}</svg>'
    )
    return element("figure", drawing, element("figcaption", caption))


def _axes(low: float, high: float, level: Level) -> str:
    ticks = [
        digit * 10.0**power
        for power in range(int(low) - 1, int(high) + 2)
        for digit in (1, 2, 5)
        if low <= log10(digit * 10.0**power) <= high
    ]
    lines = "".join(
        f'<line x1="{_LEFT:g}" x2="{_WIDTH:g}" y1="{level(t):.1f}" y2="{level(t):.1f}" '
        f'stroke="currentColor" stroke-opacity="0.15"/><text x="{_LEFT - 6:g}" '
        f'y="{level(t) + 4:.1f}" text-anchor="end" font-size="12" fill="currentColor">{t:g}</text>'
        for t in ticks
    )
    base = _HEIGHT - 8
    legend = "".join(
        f'<circle cx="{_LEFT + at:g}" cy="{base - 4:g}" r="4" fill="{colour}"/><text '
        f'x="{_LEFT + at + 10:g}" y="{base:g}" font-size="12" fill="currentColor">{text}</text>'
        for at, colour, text in ((10, _BEFORE, "before [mm]"), (130, _AFTER, "after [mm]"))
    )
    return lines + legend


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
    return table("In this order; check that the robot can take them.", head, rows)


def _parameters(found: Calibrated) -> Markup:
    rows = []
    for name, estimate in found.estimates.items():
        unit = estimate.parameter.unit
        shown, worth = ("mm", _MM) if unit == "m" else (unit, 1.0)
        sigma = f"{estimate.std * worth:.2g}" if isfinite(estimate.std) else "—"
        rows.append(
            [
                name,
                f"{shown}{', at its ' + estimate.bound + ' bound' if estimate.bound else ''}",
                f"{estimate.nominal * worth:.6g}",
                f"{estimate.value * worth:.6g}",
                sigma,
            ]
        )
    return table(
        "Values with their posterior standard deviation.",
        ["parameter", "unit", "nominal", "value", "sigma"],
        rows,
        words=2,
    )
