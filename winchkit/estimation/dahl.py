"""The tension at the platform, sample by sample, from the cell's reading and the rope's motion."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, isnan, nan, sqrt
from typing import NamedTuple

from winchkit.errors import UsageError
from winchkit.estimation.groups import PULLEY_SLOTS, PulleyGroup, flat_covariances, flat_pulleys
from winchkit.estimation.kernels import PLAIN, STATE_SLOTS, Kernels

__all__ = ["DahlEstimator", "PlatformTension"]

_UNIFORM = 3.0**-0.5


class PlatformTension(NamedTuple):
    """Tension at the platform end of the rope."""

    value: float
    """N; NaN before the first sample that can be used and for a sample that cannot."""
    std: float
    """Standard deviation, N: of the cell, of the parameters, of the friction at the start."""


class DahlEstimator:
    """Takes the friction of the pulleys off the cell's reading, with presliding (Eq. 25, 27).

    The friction of every pulley follows the rope by the exact Dahl step under the limit μ N of the
    tensions on its two sides. How far it is built up at the first sample is unknown; the standard
    deviation says so until the rope has moved.

        estimator = DahlEstimator([PulleyGroup(wraps=(1.57, 3.14), friction=0.02, stiffness=2e3)])
        tension, std = estimator.update(cell, wound_in)
    """

    __slots__ = (
        "_advance",
        "_covariances",
        "_dead_band",
        "_floor",
        "_kernels",
        "_position",
        "_pulleys",
        "_state",
        "_sums",
    )

    def __init__(
        self,
        groups: Sequence[PulleyGroup],
        *,
        cell_std: float = 0.0,
        model_std: float = 0.0,
        dead_band: float = 0.0,
        kernels: Kernels = PLAIN,
    ) -> None:
        """Take pulleys from the drum to the platform; standard deviations in N.

        ``dead_band`` (m) is the motion that counts as standstill, several times the encoder's
        noise: friction of this kind would forget itself in a position that trembles. ``kernels``
        come from :func:`winchkit.estimation.compiled`, else plain Python is used.
        """
        if not groups:
            raise UsageError("a DahlEstimator needs at least one pulley group")
        for group in groups:
            group.check()
        for name, value in (
            ("cell_std", cell_std),
            ("model_std", model_std),
            ("dead_band", dead_band),
        ):
            if not (isfinite(value) and value >= 0):
                raise UsageError(f"{name} is {value:g}; it must be finite and not negative")
        self._kernels = kernels
        self._advance = kernels.advance
        self._pulleys = kernels.array(flat_pulleys(groups))
        self._covariances = kernels.array(flat_covariances(groups))
        self._sums = kernels.array([0.0] * (3 * len(groups)))
        self._floor = cell_std * cell_std + model_std * model_std
        self._dead_band = dead_band
        self.reset()

    def reset(self) -> None:
        """Forget the friction, as after a rope that moved unseen."""
        count = len(self._pulleys) // PULLEY_SLOTS
        self._state = self._kernels.array([0.0] * (STATE_SLOTS * count))
        self._position = nan

    @property
    def forces(self) -> tuple[float, ...]:
        """Friction of every pulley, positive where the rope last ran to the platform, N."""
        return tuple(float(force) for force in self._state[::STATE_SLOTS])

    def update(self, tension: float, position: float) -> PlatformTension:
        """Take one sample: the cell's ``tension`` (N) and the rope wound in (m, any origin).

        A sample that is not finite is answered by NaN and changes nothing: what the rope moved
        meanwhile counts with the next good one.
        """
        moved = self._position - position
        if not (isfinite(position) and isfinite(tension)):
            return PlatformTension(nan, nan)
        if isnan(moved):
            return self._begin(tension, position)
        if -self._dead_band <= moved <= self._dead_band:
            moved = 0.0
        else:
            self._position = position
        value, variance = self._advance(
            tension, moved, self._state, self._pulleys, self._covariances, self._sums
        )
        return PlatformTension(value, sqrt(variance + self._floor))

    def _begin(self, tension: float, position: float) -> PlatformTension:
        """The first sample: no friction is assumed, anything up to the limit is possible."""
        self._position = position
        pulleys = self._pulleys
        for j in range(len(self._state) // STATE_SLOTS):
            p = PULLEY_SLOTS * j
            cosine, friction = pulleys[p], pulleys[p + 1]
            limit = friction * abs(tension) * sqrt(max(0.0, 2.0 - 2.0 * cosine))
            self._state[STATE_SLOTS * j + STATE_SLOTS - 1] = _UNIFORM * limit
        value, variance = self._advance(
            tension, 0.0, self._state, self._pulleys, self._covariances, self._sums
        )
        return PlatformTension(value, sqrt(variance + self._floor))
