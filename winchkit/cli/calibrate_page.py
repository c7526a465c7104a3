"""A robot's calibration as one page: errors before and after, pose by pose, and every number."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from math import degrees, floor, isfinite, log10
from typing import TYPE_CHECKING

from winchkit.calibration.robot_result import candidate_lines, in_words, noise_words
from winchkit.diagnosis.report.markup import Markup, element, section, table
from winchkit.diagnosis.report.parts import bullets, lead
from winchkit.diagnosis.report.shell import page

if TYPE_CHECKING:
    from winchkit.calibration.robot import Calibrated
    from winchkit.calibration.robot_next import NextPose
    from winchkit.calibration.robot_predict import PoseErrors

__all__ = ["calibration_html"]

_WIDTH, _HEIGHT = 720.0, 284.0
_LEFT, _RIGHT, _ABOVE, _BELOW = 64.0, 10.0, 16.0, 52.0
_BEFORE, _AFTER = "#b45309", "#0f766e"
_MM = 1e3
_DECADE = 0.1


def calibration_html(found: Calibrated, following: Sequence[NextPose], title: str) -> str:
    """The page; it needs neither network nor script for its figures."""
    head, tone = _verdict(found)
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


def _verdict(found: Calibrated) -> tuple[str, str]:
    """A word for what came out, and its colour."""
    if not found.solution.converged:
        return "not settled", "partly"
    if found.candidates:
        return "calibrated, but something is missing", "partly"
    if found.observed.unobservable:
        return "calibrated in part", "partly"
    return "calibrated", "explained"


def _sentences(found: Calibrated) -> Iterator[str]:
    from winchkit.calibration.robot_predict import rms

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
        yield "No position was held out: how well the model now predicts one is not known."
    yield (
        f"{found.observed.free} parameters were fitted to {len(found.equations.measured)} poses; "
        f"the data see {found.observed.rank} directions of them. Left over, one standard "
        f"deviation each: {noise_words(found)}."
    )
    if found.candidates:
        first = found.candidates[0]
        yield (
            f"That is not noise alone: the effect {first.effect} would explain "
            f"{first.share * 100:.0f} % of it."
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
    scale = _Scale(log10(min(sizes)) - _DECADE, log10(max(sizes)) + _DECADE)
    for name, before, after in pairs:
        if any(isfinite(value) for value in after.distance):
            yield _figure(name, scale, before, after)


@dataclass(frozen=True)
class _Scale:
    """Millimetres as heights, the same for both figures, by their logarithms."""

    low: float
    high: float

    def __call__(self, value: float) -> float:
        share = (log10(value) - self.low) / (self.high - self.low)
        return _ABOVE + (_HEIGHT - _ABOVE - _BELOW) * (1 - share)

    @property
    def ticks(self) -> list[float]:
        """1, 2 and 5 of every decade, of many decades the ones alone."""
        digits = (1, 2, 5) if self.high - self.low < 3 else (1,)
        steps = [
            digit * 10.0**power
            for power in range(floor(self.low) - 1, floor(self.high) + 2)
            for digit in digits
        ]
        return [step for step in steps if self.low <= log10(step) <= self.high]


def _figure(name: str, scale: _Scale, before: PoseErrors, after: PoseErrors) -> Markup:
    """Dots over the poses on a logarithmic scale; each tells its pose when pointed at."""
    places = after.place.tolist()
    step = (_WIDTH - _LEFT - _RIGHT) / len(places)
    dots = [
        f'<circle cx="{_LEFT + step * (n + 0.5):.1f}" cy="{scale(v * _MM):.1f}" r="3" '
        f'fill="{colour}"><title>{escape(place)}: {v * _MM:.3g} mm {word}</title></circle>'
        for word, colour, values in (
            ("before", _BEFORE, before.distance),
            ("after", _AFTER, after.distance),
        )
        for n, (place, v) in enumerate(zip(places, values.tolist(), strict=True))
        if isfinite(v) and v > 0
    ]
    caption = f"{name}: distance of the predicted from the measured position, before and after."
    drawing = Markup(
        f'<svg viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" width="100%" role="img" '
        f'aria-label="{escape(caption)}">{_axes(scale, len(places), step)}{"".join(dots)}</svg>'
    )
    return element("figure", drawing, element("figcaption", caption))


def _axes(scale: _Scale, count: int, step: float) -> str:
    lines = "".join(
        f'<line x1="{_LEFT:g}" x2="{_WIDTH:g}" y1="{scale(t):.1f}" y2="{scale(t):.1f}" '
        f'stroke="currentColor" stroke-opacity="0.15"/>'
        + _label(_LEFT - 6, scale(t) + 4, f"{t:g}", "end")
        for t in scale.ticks
    )
    every = next(n for n in (1, 2, 5, 10, 20, 50, 100, 200, 500, 10**6) if count <= 12 * n)
    numbers = "".join(
        _label(_LEFT + step * (n - 0.5), _HEIGHT - _BELOW + 16, str(n), "middle")
        for n in range(every, count + 1, every)
    )
    base = _HEIGHT - 8
    legend = "".join(
        f'<circle cx="{_LEFT + at:g}" cy="{base - 4:g}" r="4" fill="{colour}"/>'
        + _label(_LEFT + at + 10, base, text, "start")
        for at, colour, text in ((10, _BEFORE, "before [mm]"), (130, _AFTER, "after [mm]"))
    )
    return lines + numbers + legend + _label(_WIDTH, base, "number of the pose", "end")


def _label(x: float, y: float, text: str, anchor: str) -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-size="12" '
        f'fill="currentColor">{text}</text>'
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
        "In this order. Ropes hold the platform in each; look that nothing else is in the way.",
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
