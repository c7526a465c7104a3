"""A winch of the campaign: its numbers, drawn at random, and its profile as a file."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from pathlib import Path

import numpy as np

Random = np.random.Generator


@dataclass(frozen=True)
class Winch:
    """Numbers of a winch and its cable, SI."""

    kind: str
    radius: float
    growth: float
    """Per layer; of a squared drum the area per length, of a grooved one the pitch."""
    ratio: float
    direction: int
    motor_reference: float
    length_reference: float
    wound_turns: float
    dead_length: float
    inclination: float
    wraps: tuple[float, ...]
    guide_distance: float
    """Zero without a guide."""


def draw_winch(random: Random) -> Winch:
    """Any winch that the profile format can say."""
    kind = str(random.choice(["spiral", "grooved", "archimedean", "squared"]))
    growth = {
        "spiral": random.uniform(5e-5, 3e-3),
        "archimedean": random.uniform(1e-4, 3e-3),
        "grooved": random.uniform(2e-3, 8e-3),
        "squared": random.uniform(2e-6, 2e-4),
    }[kind]
    ratio = float(random.choice([1.0, 3.0, 5.0, 10.0, 20.0, 20.4, 12.25, 33.3, 50.0]))
    return Winch(
        kind=kind,
        radius=round(random.uniform(0.03, 0.12), 4),
        growth=round(float(growth), 7),
        ratio=ratio,
        direction=int(random.choice([1, 1, -1])),
        motor_reference=round(random.uniform(-20, 20), 2) if random.random() < 0.5 else 0.0,
        length_reference=round(random.uniform(3, 9), 2),
        wound_turns=round(random.uniform(4, 9), 2),
        dead_length=round(random.uniform(0.3, 2.0), 2) if random.random() < 0.6 else 0.0,
        inclination=90.0 if random.random() < 0.7 else round(random.uniform(0, 80), 0),
        wraps=tuple(round(random.uniform(30, 180), 0) for _ in range(int(random.integers(0, 4)))),
        guide_distance=round(random.uniform(0.2, 0.6), 2) if random.random() < 0.5 else 0.0,
    )


def write_profile(winch: Winch, path: Path) -> None:
    """Write the nominal winch, without any effect."""
    key = {"grooved": "groove_pitch", "squared": "build_up"}.get(winch.kind, "layer_growth")
    lines = [
        "schema = 1",
        'kind = "winch"',
        f'name = "{path.stem}"',
        "[drum]",
        f'kind = "{winch.kind}"',
        f'winding_radius = "{winch.radius * 1e3!r} mm"',
        f'{key} = "{winch.growth * 1e3!r} mm"',
        "[cable]",
        'diameter = "4 mm"',
        f'dead_length = "{winch.dead_length} m"',
        "[path]",
        f'inclination = "{winch.inclination} deg"',
        "[gearbox]",
        f"ratio = {winch.ratio}",
        f"direction = {winch.direction}",
        "[reference]",
        f'motor_angle = "{winch.motor_reference} rad"',
        f'cable_length = "{winch.length_reference} m"',
        f"wound_turns = {winch.wound_turns}",
    ]
    if winch.guide_distance:
        # A matching screw: one pitch a turn where there is a groove.
        lead = winch.growth if winch.kind == "grooved" else 4e-3
        lines += [
            "[guide]",
            f'screw_lead = "{lead * 1e3!r} mm"',
            "belt_ratio = 1.0",
            f'distance = "{winch.guide_distance} m"',
        ]
    for wrap in winch.wraps:
        lines += ["[[pulley]]", 'radius = "40 mm"', f'wrap = "{wrap} deg"']
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def turns_for(winch: Winch, length: float) -> float:
    """Drum angle that pays out about ``length``, rad."""
    return length / (winch.radius + winch.growth / (2 * pi))
