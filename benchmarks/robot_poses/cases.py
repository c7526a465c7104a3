"""What is hidden in the robots of ``robot_diagnosis.py``: one thing, two, none, or none known."""

from __future__ import annotations

import math
from dataclasses import replace

from robot_poses.hidden import BASE, MASS, Case
from robot_poses.truth import HOME, UPPER, Row, Vector, turn

STILL = (0.0,) * 8
ELASTIC = "cable-elongation-linear"
STIFFNESS = f"{ELASTIC}.axial_stiffness"


def _shifted(points: tuple[Vector, ...], line: int, by: Vector) -> tuple[Vector, ...]:
    x, y, z = (a + b for a, b in zip(points[line], by, strict=True))
    return (*points[:line], (x, y, z), *points[line + 1 :])


def _changed(values: tuple[float, ...], line: int, by: float) -> tuple[float, ...]:
    return (*values[:line], values[line] + by, *values[line + 1 :])


SOFT = replace(BASE, stiffness=2e5, home_tension=40.0)
MOVED = replace(BASE, exit=_shifted(BASE.exit, 2, (1e-3, -2e-3, 1e-3)))
LOOSE = replace(BASE, anchor=_shifted(BASE.anchor, 4, (1e-3, 1e-3, -2e-3)))
WIDER = replace(BASE, swivel=_changed(BASE.swivel, 5, 1.5e-3))
LARGER = replace(BASE, winding=_changed(BASE.winding, 1, 0.2e-3))
AT_EXIT = {"exit-point/3.x": 1e-3, "exit-point/3.y": -2e-3, "exit-point/3.z": 1e-3}
AT_ANCHOR = {"anchor-point/5.x": 1e-3, "anchor-point/5.y": 1e-3, "anchor-point/5.z": -2e-3}


def _waves(line: int, row: Row) -> float:
    """A cable length that no effect of the catalogue has."""
    return 3e-4 * math.sin(row.position[0] * 130 + line)


def _joint(line: int, row: Row) -> float:
    """Line 4 hangs on a joint that yields above 45 N."""
    return -2e-5 * max(0.0, row.tension[3] - 45.0) if line == 3 else 0.0


def _bends(line: int, row: Row) -> float:
    """A platform that bends: its upper anchors yield along z with all that pulls at them."""
    if line >= UPPER:
        return 0.0
    place, rotation = row.position, turn(*row.angles)
    down = -2e-6 * sum(row.tension)
    moved = replace(BASE, anchor=_shifted(BASE.anchor, line, (0.0, 0.0, down)))
    return BASE.length(line, place, rotation) - moved.length(line, place, rotation)


def _scaled(row: Row) -> Row:
    """A tracker whose metre is two millimetres too long."""
    x, y, z = (h + 1.002 * (p - h) for h, p in zip(HOME, row.position, strict=True))
    return replace(row, seen_position=(x, y, z))


def _spanned(row: Row) -> Row:
    """A cell on line 2 that shows four per cent too much."""
    return replace(row, tension=_changed(row.tension, 1, 0.04 * row.tension[1]))


def _warmer(line: int, row: Row) -> float:
    """Steel cables, a metre of them, that grow with the hall."""
    length = BASE.length(line, row.position, turn(*row.angles))
    return length * 1.1e-5 * (row.temperature - 20.0)


CASES: tuple[Case, ...] = (
    Case("none"),
    Case("none, tracker wanders", wander=2e-5),
    Case("none, no repeats", repeats=0),
    Case("elastic ropes", (ELASTIC,), SOFT, values={STIFFNESS: 2e5}),
    Case(
        "home length",
        ("home-length/4",),
        home=_changed(STILL, 3, 0.5e-3),
        values={"home-length/4.length": 0.5e-3},
    ),
    Case(
        "payload mass",
        ("payload-mass",),
        mass=MASS + 0.25,
        values={"payload-mass.mass_error": 0.25},
    ),
    Case(
        "payload centre",
        ("payload-centre",),
        centre=(0.02, -0.01, 0.0),
        values={"payload-centre.x": 0.02, "payload-centre.y": -0.01, "payload-centre.z": 0.0},
    ),
    Case("cell gain", ("cell-gain/2",), seen=_spanned, values={"cell-gain/2.gain_error": 0.04}),
    Case("exit point", ("exit-point/3",), MOVED, values=AT_EXIT),
    Case("exit point, no repeats", ("exit-point/3",), MOVED, values=AT_EXIT, repeats=0),
    Case("exit point, tracker wanders", ("exit-point/3",), MOVED, values=AT_EXIT, wander=2e-5),
    Case("anchor point", ("anchor-point/5",), LOOSE, values=AT_ANCHOR),
    Case(
        "swivel radius",
        ("swivel-radius/6",),
        WIDER,
        values={"swivel-radius/6.radius_error": 1.5e-3},
    ),
    Case(
        "drum radius",
        ("drum-radius/2", "gear-ratio/2"),
        LARGER,
        values={"drum-radius/2.radius_error": 0.2e-3},
    ),
    Case(
        "warm ropes",
        ("cable-thermal",),
        beyond=_warmer,
        warm=10.0,
        values={"cable-thermal.expansion": 1.1e-5},
    ),
    Case(
        "elastic, exit point",
        (ELASTIC, "exit-point/3"),
        replace(MOVED, stiffness=2e5, home_tension=40.0),
        values={**AT_EXIT, STIFFNESS: 2e5},
    ),
    Case(
        "home length, payload",
        ("home-length/4", "payload-mass"),
        home=_changed(STILL, 3, 0.5e-3),
        mass=MASS + 0.25,
        values={"home-length/4.length": 0.5e-3, "payload-mass.mass_error": 0.25},
    ),
    Case(
        "anchor, swivel radius",
        ("anchor-point/5", "swivel-radius/6"),
        replace(LOOSE, swivel=WIDER.swivel),
        values={**AT_ANCHOR, "swivel-radius/6.radius_error": 1.5e-3},
    ),
    Case("outside: waves", beyond=_waves, outside=True),
    Case("outside: a joint gives way", beyond=_joint, outside=True),
    Case("outside: platform bends", beyond=_bends, outside=True, as_geometry=True),
    Case("outside: tracker's metre", seen=_scaled, outside=True, as_geometry=True),
    Case("outside: waves, no repeats", beyond=_waves, outside=True, repeats=0),
)
