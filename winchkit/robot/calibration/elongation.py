"""Laws of elongation that a robot's calibration can fit, with priors and bounds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class LawParameter:
    """One parameter of a law in the unit that is fitted."""

    name: str
    unit: str
    start: float
    std: float
    low: float = -np.inf
    high: float = np.inf
    reciprocal: bool = False
    """Files have 1/value: a stiffness is fitted as a compliance."""


LAWS: dict[str, tuple[LawParameter, ...]] = {
    "cable-elongation-linear": (
        LawParameter("axial_stiffness", "N", 0.0, 2e-5, 0.0, 1e-3, reciprocal=True),
    ),
    "cable-elongation-quartic": (
        LawParameter("k1", "N", 0.0, 2e-5, 0.0, 1e-3, reciprocal=True),
        LawParameter("b2", "1", 0.0, 100.0),
        LawParameter("b3", "1", 0.0, 3e4),
        LawParameter("b4", "1", 0.0, 1e7),
    ),
    "cable-elongation-exponential": (
        LawParameter("strain_scale", "1", 0.0, 2e-3, 0.0, 0.2),
        LawParameter("force_scale", "N", 200.0, 100.0, 1.0, 1e6),
    ),
}
"""Effects of the catalogue that a robot's calibration can fit, one law for all cables."""
