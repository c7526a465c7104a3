"""Online estimators for control: tension and elongation from signals that do not measure them."""

from winchkit.estimation.dahl import DahlEstimator, PlatformTension
from winchkit.estimation.groups import PulleyGroup
from winchkit.estimation.kernels import PLAIN, Kernels, compiled, fastest

__all__ = [
    "PLAIN",
    "DahlEstimator",
    "Kernels",
    "PlatformTension",
    "PulleyGroup",
    "compiled",
    "fastest",
]
