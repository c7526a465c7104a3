"""Online estimators for control: what a measured signal says about one that is not measured."""

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
