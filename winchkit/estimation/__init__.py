"""Online estimators for control: tension and elongation that no instrument measures.

The public names are :class:`winchkit.DahlEstimator` and :func:`winchkit.identify_dahl`.
"""

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
