"""Tension at the platform, sample by sample, from the cell's reading and the motion of the cable.

References
----------
Dahl, P. R. (1968). A solid friction model. Aerospace Corporation, TOR-0158(3107-18)-1.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, isnan, nan, sqrt
from typing import NamedTuple

from winchkit.errors import UsageError
from winchkit.estimation.groups import PULLEY_SLOTS, PulleyGroup, flat_covariances, flat_pulleys
from winchkit.estimation.kernels import PLAIN, STATE_SLOTS, Kernels

UNIFORM = 3.0**-0.5
"""Standard deviation of a uniform distribution from −1 to 1: friction that is unknown within its
limit."""


class PlatformTension(NamedTuple):
    """Tension at the platform end of the cable."""

    value: float
    """N; NaN before the first usable sample and for one that is not."""
    std: float
    """Standard deviation, N: of the cell, the parameters, and the friction at the start."""


class DahlEstimator:
    """Removes pulley friction with presliding from a load cell's reading (Eq. 25, 27).

    The friction of every pulley follows the cable by the exact step of the Dahl model, with the
    limit μ N from the tensions on both sides. Its value at the first sample is not known; the
    standard deviation contains that until the cable has moved.

    Examples
    --------
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
        """Take pulleys in order from the drum to the platform.

        Parameters
        ----------
        groups
            Pulleys with their friction.
        cell_std, model_std
            Standard deviations of the cell and of the model, N.
        dead_band
            Motion that counts as standstill, m; several times the noise of the encoder, since a
            Dahl friction loses its state in a position that trembles.
        kernels
            From :func:`winchkit.estimation.compiled`, else plain Python.

        Raises
        ------
        UsageError
            Without a group, or for negative or infinite numbers.
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
        """Restart with unknown friction, as after motion that was not measured."""
        count = len(self._pulleys) // PULLEY_SLOTS
        self._state = self._kernels.array([0.0] * (STATE_SLOTS * count))
        self._position = nan

    @property
    def forces(self) -> tuple[float, ...]:
        """Friction of every pulley, positive where the cable last ran towards the platform, N."""
        return tuple(float(force) for force in self._state[::STATE_SLOTS])

    def update(self, tension: float, position: float) -> PlatformTension:
        """Update with one sample.

        Parameters
        ----------
        tension
            Reading of the cell, N.
        position
            Cable wound in, any origin, m.

        Returns
        -------
        PlatformTension
            NaN for a sample that is not finite; its motion counts with the next finite one.
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
        """First sample: zero friction, its standard deviation that of a uniform distribution."""
        self._position = position
        pulleys = self._pulleys
        for j in range(len(self._state) // STATE_SLOTS):
            p = PULLEY_SLOTS * j
            cosine, friction = pulleys[p], pulleys[p + 1]
            limit = friction * abs(tension) * sqrt(max(0.0, 2.0 - 2.0 * cosine))
            self._state[STATE_SLOTS * j + STATE_SLOTS - 1] = UNIFORM * limit
        value, variance = self._advance(
            tension, 0.0, self._state, self._pulleys, self._covariances, self._sums
        )
        return PlatformTension(value, sqrt(variance + self._floor))
