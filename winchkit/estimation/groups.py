"""Pulley groups: pulleys of one type, which share friction parameters, with their covariance."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import cos, isfinite, nan, sin
from typing import TYPE_CHECKING

from winchkit.errors import FileError, UsageError
from winchkit.units import dimension_of, parse

if TYPE_CHECKING:
    from winchkit.schema.profiles.winch import WinchProfile

_DAHL = "pulley-dahl"

PULLEY_SLOTS = 5
"""Per pulley: cosine of the wrap, μ, σ, β, index of its group."""
COVARIANCE_SLOTS = 6
"""Per group: variances of μ, σ, β, covariances μσ, μβ, σβ."""


@dataclass(frozen=True)
class PulleyGroup:
    """Pulleys in order from the drum to the platform, with the same Dahl friction."""

    wraps: tuple[float, ...]
    """Wrap angles, rad."""
    friction: float
    """μ, 0 to 1."""
    stiffness: float
    """σ, N/m."""
    shape: float = 1.0
    """β."""
    covariance: tuple[tuple[float, float, float], ...] = ((nan,) * 3,) * 3
    """Of μ, σ and β; NaN where it is not declared, zero for what is taken as exact."""

    @property
    def std(self) -> tuple[float, float, float]:
        """Standard deviations of μ, σ and β."""
        first, second, third = (self.covariance[k][k] ** 0.5 for k in range(3))
        return first, second, third

    @property
    def sliding_std(self) -> float:
        """Standard deviation of the friction of all pulleys in motion, as a share of the tension.

        NaN where that of μ is not known.
        """
        return self.std[0] * sliding_share(self.wraps)

    def check(self) -> None:
        """Raise UsageError for values outside of what a pulley can have."""
        for name, value, low, high in (
            ("friction", self.friction, 0.0, 1.0),
            ("stiffness", self.stiffness, 0.0, float("inf")),
            ("shape", self.shape, 0.0, 10.0),
        ):
            if not (isfinite(value) and low <= value < high):
                raise UsageError(
                    f"{name} of a pulley group is {value:g}; it must be finite, at least {low:g} "
                    f"and below {high:g}"
                )
        if not self.wraps or not all(isfinite(wrap) and wrap >= 0 for wrap in self.wraps):
            raise UsageError(f"wraps of a pulley group are {self.wraps}; give at least one, in rad")


def sliding_share(wraps: Iterable[float]) -> float:
    """Friction of pulleys in motion over tension and μ, by their wrap angles, rad."""
    return sum(2.0 * sin(wrap / 2.0) for wrap in wraps)


def groups_of(profile: WinchProfile) -> tuple[PulleyGroup, ...]:
    """The pulleys of a winch with the friction of its effect ``pulley-dahl`` and the standard
    deviations of its table ``fitted``, NaN without one; empty without the effect. Raises
    FileError."""
    from winchkit.effects.bind import values_of
    from winchkit.effects.catalogue import load_catalogue

    table = next((one for one in profile.effect if one.id == _DAHL), None)
    if table is None or not profile.pulley:
        return ()
    effect = load_catalogue()[_DAHL]
    values, faults = values_of(effect, table)
    if faults:
        raise FileError(faults)
    declared = table.values.get("fitted", {}).get("std", {})
    names = ("friction", "stiffness")
    std = [
        parse(declared[n], dimension_of(effect.parameter(n).unit) or "ratio")
        if n in declared
        else nan
        for n in names
    ]
    wraps = tuple(pulley.wrap for pulley in profile.pulley)
    covariance = ((std[0] ** 2, 0.0, 0.0), (0.0, std[1] ** 2, 0.0), (0.0, 0.0, 0.0))
    return (
        PulleyGroup(wraps, values["friction"], values["stiffness"], values["shape"], covariance),
    )


def flat_pulleys(groups: Sequence[PulleyGroup]) -> list[float]:
    """Constants of all pulleys in one list, as the kernels read them."""
    flat: list[float] = []
    for index, group in enumerate(groups):
        for wrap in group.wraps:
            flat += [cos(wrap), group.friction, group.stiffness, group.shape, float(index)]
    return flat


def flat_covariances(groups: Sequence[PulleyGroup]) -> list[float]:
    """Covariances of all groups in one list, as the kernels read them."""
    flat: list[float] = []
    for group in groups:
        c = group.covariance
        flat += [c[0][0], c[1][1], c[2][2], c[0][1], c[0][2], c[1][2]]
    return flat
