"""The cable guide of a sizing: lead screw and toothed belt (Eq. 15–18)."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi

from winchkit.model.sizing import parts
from winchkit.model.sizing.row import Row, down, up
from winchkit.schema.profiles.sizing import BeltChoice, ScrewChoice, SizeSpec


def guide_rows(spec: SizeSpec) -> Iterator[Row]:
    """Requirements of the screw and of the belt, where the specification has them."""
    if spec.screw is None:
        return
    ratio = 1.0 if spec.belt is None else spec.belt.ratio
    drum_speed = spec.requirement.speed / spec.drum.winding_radius
    yield from _screw_rows(spec, spec.screw, ratio, drum_speed)
    if spec.belt is not None:
        yield from _belt_rows(spec.belt, drum_speed)


def _screw_rows(
    spec: SizeSpec, screw: ScrewChoice, ratio: float, drum_speed: float
) -> Iterator[Row]:
    pitch = spec.drum.groove_pitch
    yield Row.equal(
        "guide per drum turn",
        "III.D",
        screw.lead * ratio,
        pitch,
        "m",
        f"a screw lead of {pitch / ratio * 1e3:.4g} mm",
        f"a belt ratio of {pitch / screw.lead:.4g} screw turns per drum turn",
    )
    speed = drum_speed * ratio if screw.speed is None else screw.speed
    nut_speed = drum_speed * pitch / (2 * pi)
    least = 2 * pi * nut_speed / speed
    yield Row.at_least(
        "screw lead",
        "Eq. 15",
        screw.lead,
        least * (1 - 1e-9),
        "m",
        f"a screw lead of {up(least * 1e3)} mm",
    )
    yield from _reach_rows(spec, screw, speed)


def _reach_rows(spec: SizeSpec, screw: ScrewChoice, speed: float) -> Iterator[Row]:
    """Requirements of a screw's length: at least the drum's width, and limited by its speed."""
    safe = parts.critical_speed(screw.diameter, screw.length, screw.ends)
    thick = parts.screw_diameter(speed, screw.length, screw.ends)
    short = screw.length * (safe / speed) ** 0.5
    yield Row.at_most(
        "screw speed",
        "Eq. 16",
        speed,
        safe,
        "rad/s",
        f"a core diameter of {up(thick * 1e3)} mm",
        f"at most {down(short * 1e3)} mm between the bearings",
    )
    yield Row.at_least(
        "screw travel",
        "III.C",
        screw.length - screw.nut,
        spec.drum.width,
        "m",
        f"{up((spec.drum.width + screw.nut) * 1e3)} mm between the bearings",
    )


def _belt_rows(belt: BeltChoice, drum_speed: float) -> Iterator[Row]:
    needed = parts.belt_module(belt.power, drum_speed)
    larger = [module for module in parts.STANDARD_MODULES if module >= needed]
    carried = belt.power * (belt.module / needed) ** 3
    standard = (f"the standard module {larger[0] * 1e3:g} mm",) if larger else ()
    yield Row.at_least(
        "belt module",
        "Eq. 17",
        belt.module,
        needed,
        "m",
        *standard,
        f"at most {down(carried, 2)} W over this belt",
    )
    first, second = (belt.module * teeth / 2 for teeth in (belt.drum_teeth, belt.screw_teeth))
    length = parts.belt_length(belt.centre_distance, first, second)
    teeth = max(1, round(length / (pi * belt.module)))
    whole = teeth * pi * belt.module
    yield Row("belt length", "Eq. 18", length, "m", note=f"{teeth} teeth: {whole * 1e3:.1f} mm")
    yield Row(
        "centre distance for it",
        "Eq. 18",
        parts.centre_distance(whole, first, second),
        "m",
        note=f"given {belt.centre_distance * 1e3:.4g} mm",
    )
