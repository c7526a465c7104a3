"""Curves that no effect of the catalogue has: whether one explains more than what has a name.

What no catalogue has is often imitated by effects that it has, one or several side by side. A
curve of one output, of the rope's force or of the winding over one variable needs no physics: where
the best of them pays better than the named effects, the names are not what is there. It is never
named itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from winchkit.diagnosis.dataset import Recording
from winchkit.diagnosis.follows import variables_of
from winchkit.diagnosis.noise import orthonormal
from winchkit.diagnosis.predictor import masked
from winchkit.diagnosis.problem import Problem
from winchkit.model.variables import ANGLES

__all__ = ["Beside", "Curve", "best_curve"]

Array = NDArray[np.float64]
_HATS = 20
_TAILS = 0.001
_DEGREES = (1, 2, 3, 4)
_COARSE = (6, 12)
_POWERS = (1.5, 2.0, 3.0)
_TAKEN = (*ANGLES, "direction")
"""Variables of which any curve has a name already."""
_UNIDENTIFIABLE = 1e-7
_NOTHING = 1e-300
_WARMER = 1.0
"""Less is noise of the thermometer rather than a change, K."""


@dataclass(frozen=True)
class Curve:
    """A curve over one variable, and what it would save."""

    place: str
    """Output that it is added to, or ``rope force`` or ``winding``, which show in several."""
    variable: str
    pays: float
    """Whitened squares that it takes, less the price of its numbers."""


class Beside:
    """A whitened residual beside which curves are tried, and what explains a part of it."""

    def __init__(self, residual: Array, jacobian: Array, weight: Array) -> None:
        """``residual`` (rows,) with unknowns of derivative ``jacobian`` (rows, k) still free."""
        self.weight = weight
        self.explained = orthonormal(jacobian * weight[:, None])
        whitened = residual * weight
        self.residual = whitened - self.explained @ (self.explained.T @ whitened)

    @property
    def cost(self) -> float:
        """Whitened squares that are left."""
        return float(self.residual @ self.residual)


def best_curve(problem: Problem, beside: Beside, outputs: Sequence[str]) -> Curve | None:
    """The curve that takes most of a residual, among those that show in one of ``outputs``."""
    best: Curve | None = None
    price = float(np.log(problem.rows))
    for place, variable, laws, columns in _curves(problem, outputs):
        hats = _beside(beside, columns)
        pays = max(hats.gain(law) - price * freedom for law, freedom in laws)
        if best is None or pays > best.pays:
            best = Curve(place, variable, pays)
    return best


@dataclass(frozen=True)
class _Hats:
    """Inner products of whitened hats, and of what is left of them beside a fit."""

    plain: Array
    """(hats, hats)."""
    inner: Array
    """(hats, hats), without what the fit's unknowns explain."""
    products: Array
    """With the residual, (hats,)."""

    def gain(self, law: Array) -> float:
        """Whitened squares that a law of hats, (hats, k), takes."""
        size = np.sqrt(np.maximum(np.diag(law.T @ self.plain @ law), _NOTHING))
        values, vectors = np.linalg.eigh(law.T @ self.inner @ law / np.outer(size, size))
        # Measured by what they were: of what a fit explains whole only rounding is left.
        kept = values > _UNIDENTIFIABLE
        along = vectors[:, kept].T @ ((law.T @ self.products) / size)
        return float(np.sum(along**2 / values[kept]))


_Law = tuple[Array, int]
_Columns = Iterable[tuple[slice, Array]]
"""Some rows, and what the hats change in them, (hats, rows)."""


def _beside(beside: Beside, columns: _Columns) -> _Hats:
    """Inner products of hats, piece by piece."""
    plain, products = np.zeros((_HATS, _HATS)), np.zeros(_HATS)
    through = np.zeros((_HATS, beside.explained.shape[1]))
    for rows, signal in columns:
        whitened = signal * beside.weight[rows]
        plain += whitened @ whitened.T
        through += whitened @ beside.explained[rows]
        products += whitened @ beside.residual[rows]
    return _Hats(plain, plain - through @ through.T, products)


def _curves(
    problem: Problem, outputs: Sequence[str]
) -> Iterator[tuple[str, str, list[_Law], _Columns]]:
    """Place, variable, laws, and what their hats change."""
    recordings = problem.dataset.recordings
    known = [
        variables_of(recording) | {"direction": recording.smooth.at.direction}
        for recording in recordings
    ]
    names = [n for n in known[0] if n not in _TAKEN and all(n in other for other in known)]
    for factor, name in (*((None, n) for n in names), *_products(names)):
        ends = _ends(name, [k[name] for k in known])
        if ends is None:
            continue
        knots = np.linspace(*ends, _HATS)
        hats = [_hats(k[name], knots) for k in known]
        if factor is not None:
            hats = [h * k[factor] for h, k in zip(hats, known, strict=True)]
        laws = _laws(knots, name, level=factor is not None)
        for place, shown in _PLACES.items():
            seen = set(shown) & set(outputs) & set(problem.dataset.outputs)
            if seen and (place != "winding" or (name, factor) == ("cable_length", None)):
                variable = name if factor is None else f"{factor} times {name}"
                yield place, variable, laws, _columns(problem, shown, hats, knots)


def _products(names: Sequence[str]) -> list[tuple[str, str]]:
    """What is worth trying times a curve over what: frictions by place and load, soft ropes.

    The direction is the model's own: how sharply a friction turns is nobody's name.
    """
    force = "load" if "load" in names else "tension"
    pairs = (
        ("direction", "cable_length"),
        ("direction", force),
        (force, "cable_length"),
        ("cable_length", force),
        (force, "temperature"),
    )
    return [pair for pair in pairs if set(pair) <= {"direction", *names}]


def _ends(name: str, values: Sequence[Array]) -> tuple[float, float] | None:
    low, high = np.quantile(np.concatenate(values), [_TAILS, 1 - _TAILS])
    least = _WARMER if name == "temperature" else 1e-9 * max(abs(low), abs(high))
    return (float(low), float(high)) if high - low > least else None


def _hats(values: Array, knots: Array) -> Array:
    """Triangles over the knots that add up to one, (knots, n)."""
    at = np.clip((values - knots[0]) / (knots[1] - knots[0]), 0.0, len(knots) - 1.0)
    cell = np.minimum(at.astype(np.intp), len(knots) - 2)
    out, sample = np.zeros((len(knots), len(values))), np.arange(len(values))
    out[cell, sample] = 1.0 - (at - cell)
    out[cell + 1, sample] = at - cell
    return out


def _laws(knots: Array, name: str, *, level: bool) -> list[_Law]:
    """What a curve may be, in values at the knots, with what each costs to choose.

    With its ``level`` where it is a factor; else that is an offset, and there are effects for it.
    """
    z = np.linspace(-1.0, 1.0, len(knots))
    out: list[_Law] = []
    for degree in _DEGREES:
        powers = np.asarray(np.polynomial.legendre.legvander(z, degree), dtype=np.float64)
        out.append((powers, degree + 1) if level else (powers[:, 1:], degree))
    for count in _COARSE:
        out.append((_hats(z, np.linspace(-1.0, 1.0, count)).T, count))
    for at in z[1:-1]:
        sides = [np.maximum(z - at, 0.0), np.maximum(at - z, 0.0), np.ones_like(z)]
        out.append((np.column_stack(sides[: 2 + level]), 3 + level))
    if name == "speed":
        out += [((np.sign(knots) * np.abs(knots) ** n)[:, None], 2) for n in _POWERS]
    return out


_Shown = Callable[[Recording, Array, Array], Array]


def _columns(
    problem: Problem, shown: Mapping[str, _Shown], hats: Sequence[Array], knots: Array
) -> _Columns:
    """What the hats change in every output of every run."""
    for segment in problem.segments:
        if segment.output in shown:
            recording = problem.dataset.recordings[segment.run]
            signal = shown[segment.output](recording, hats[segment.run], knots)
            yield segment.rows, masked(recording, segment.output, signal)


def _plainly(recording: Recording, hats: Array, knots: Array) -> Array:
    """An instrument's own curve."""
    return hats


def _by_the_arm(recording: Recording, hats: Array, knots: Array) -> Array:
    """Motor torque of a curve of the rope's force."""
    force = recording.smooth.at.tension
    heavy = np.maximum(np.abs(force), 1e-9)
    return np.asarray(hats * recording.nominal_smooth["motor_torque"] * np.sign(force) / heavy)


def _by_virtual_work(recording: Recording, hats: Array, knots: Array) -> Array:
    """Motor torque of a curve of the winding: what the rope moves per turn more, it pulls more."""
    step = knots[1] - knots[0]
    cell = np.floor((recording.smooth.at.free_length - knots[0]) / step)
    cell = np.clip(cell, 0, len(knots) - 2)
    index = np.arange(len(knots))[:, None]
    slopes = ((index == cell + 1) * 1.0 - (index == cell) * 1.0) / step
    return np.asarray(recording.nominal_smooth["motor_torque"] * slopes)


_PLACES: Mapping[str, Mapping[str, _Shown]] = {
    "cable_length": {"cable_length": _plainly},
    "tension": {"tension": _plainly},
    "motor_torque": {"motor_torque": _plainly},
    "rope force": {"tension": _plainly, "motor_torque": _by_the_arm},
    "winding": {"cable_length": _plainly, "motor_torque": _by_virtual_work},
}
"""Where a curve may act, and how each output shows it."""
