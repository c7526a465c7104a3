"""Options of a robot's calibration."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Options:
    """Options of a calibration."""

    effects: tuple[str, ...] = ()
    """Effects of the catalogue that are fitted beside the geometry."""
    sigma: Mapping[str, float] | None = None
    """Standard deviations by kind of equation, SI; those that are not given are estimated."""
    middle_force: float | None = None
    """Force, N, to which cable forces are nearest where an effect needs them and no tension was
    measured."""
