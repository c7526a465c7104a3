"""Candidate set of a robot: effects at their places that the poses could show."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from winchkit.effects.catalogue import Catalogue
from winchkit.effects.effect import Effect
from winchkit.effects.placement import base_of, line_of_effect, placements, with_home_lengths
from winchkit.model.stages import Stage
from winchkit.robot.diagnosis.dataset import RobotDataset
from winchkit.robot.effects.bind import lines_with_home_length
from winchkit.schema.profiles.winch import LAYERED, WinchProfile

BALANCING = frozenset({"payload-mass", "payload-centre", "cell-offset", "cell-thermal"})
"""Effects that may explain an imbalance of tensions while its noise is estimated.

Gains are excluded: zero tension and a platform without weight would balance any data.
"""
_PARTS = {
    "swivel-radius": "a line with a swivel_radius",
    "layer-thickness": "a drum that winds in layers",
    "guide-offset": "a [guide] in a line's winch",
}
_OF_TRACKER = {
    "position": "platform_x, platform_y, platform_z [m]",
    "angles": "platform_roll, platform_pitch, platform_yaw [rad]",
}
_OUTSIDE_LINES = {"tension": "LINE.tension [N] of the load cells", "temperature": "a temperature"}


def candidates_at(dataset: RobotDataset, catalogue: Catalogue) -> Iterator[Effect]:
    """Effects at each of their places, as far as the poses could show them."""
    for effect in catalogue:
        if lacking(effect, dataset):
            continue
        for placed in placements(effect, dataset.names, moving=dataset.moves):
            if _has_part(placed, dataset):
                yield with_needs_met(placed, dataset)


def lacking(effect: Effect, dataset: RobotDataset) -> list[str]:
    """Channels that an effect needs on a robot and that are absent, in words."""
    out = []
    if not effect.places(moving=dataset.moves):
        return ["a motion: poses stand still" if effect.in_motion else "a place on a robot"]
    if "cable_force" in effect.needs and not dataset.has_tension:
        out.append(_OUTSIDE_LINES["tension"])
    if "tension" in effect.outputs and not dataset.has_balance:
        out.append("tensions that carry the platform's weight")
    if effect.stage is Stage.TRACKER:
        kind = "angles" if base_of(effect) == "imu-mounting" else "position"
        if not np.isfinite(getattr(dataset.measured, kind)).any():
            out.append(_OF_TRACKER[kind])
    if "temperature" in effect.needs and not np.isfinite(dataset.measured.temperature).all():
        out.append(_OUTSIDE_LINES["temperature"])
    return out


def lacking_parts(effect: Effect, dataset: RobotDataset) -> list[str]:
    """Parts that an effect needs and that no line has, in words."""
    return [] if _has_part(effect, dataset) else [_PARTS[base_of(effect)]]


def with_needs_met(effect: Effect, dataset: RobotDataset) -> Effect:
    """The effect without needs; a cable law includes the home lengths of lines without one."""
    if "cable_force" in effect.needs and effect.outputs == ("cable_length",):
        known = lines_with_home_length(dataset.robot)
        effect = with_home_lengths(effect, [n for n in dataset.names if n not in known])
    return replace(effect, needs=())


def _has_part(effect: Effect, dataset: RobotDataset) -> bool:
    """Whether a line, or any line for an effect on all, has the part that an effect is about."""
    place = line_of_effect(effect)
    lines = [line for line in dataset.robot.line if not place or line.name == place]
    winches = [line.winch for line in lines if isinstance(line.winch, WinchProfile)]
    if base_of(effect) == "swivel-radius":
        return any(line.swivel_radius > 0 for line in lines)
    if base_of(effect) == "layer-thickness":
        return any(winch.drum.kind in LAYERED for winch in winches)
    if base_of(effect) == "guide-offset":
        return any(winch.guide is not None for winch in winches)
    return True
