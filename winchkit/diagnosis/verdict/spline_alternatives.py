"""Curves over one variable (linear B-splines), and the change of every output by them.

A basis function is one at its knot and falls to zero at the neighbouring knots. Every curve is a
sum of them, so that their Gram matrix serves all curves over one variable at one place.

References
----------
de Boor, C. (1978). A Practical Guide to Splines. Springer.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.data.dataset import Recording
from winchkit.diagnosis.regression.base import Segment
from winchkit.diagnosis.regression.prediction_cache import masked
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.residuals.attribution import LEAST_TEMPERATURE_RANGE, variables_of
from winchkit.model.variables import ANGLES, COMPOUND

_KNOTS = 20
"""Knots of the linear B-splines; screened; varied."""
_TAILS = 0.001
"""Share of samples beyond the outermost knots, each side; screened; varied."""
_DEGREES = (1, 2, 3, 4)
"""Degrees of polynomial curves; rule of thumb; varied."""
_COARSE_KNOTS = (6, 12)
"""Knots of coarse linear splines; screened; varied."""
_POWERS = (1.5, 2.0, 3.0)
"""Powers of the speed; rule of thumb; varied."""
_ORDERS = (1, 2, 3)
"""Highest order of a curve over one turn; rule of thumb: of bearings, seals and brakes."""
_TURN = " in its turn"
"""After the name of an angle, of which only the place in its turn counts."""
_EXCLUDED_VARIABLES = (*ANGLES, *COMPOUND, "direction")
"""Variables over which the catalogue has every curve already, or that are tried in a product; the
angle of an axis, which has no cable length, is its position."""
Law = tuple[Array, int]
"""Values of a curve at the knots, (knots, k) for k parameters, and the number that is penalised."""
_ChangeByCurve = Callable[[Recording, Array, Array], Array]
Columns = Iterable[tuple[slice, Array]]
"""Some rows, and the change of them by the basis functions, (knots, rows)."""


@dataclass(frozen=True)
class CurveFamily:
    """Curves over one variable at one place."""

    place: str
    """Output that they are added to, or ``cable_force`` or ``winding``."""
    variable: str
    laws: Sequence[Law]
    knots: Array
    basis: Sequence[Array]
    """Basis functions of every run, (knots, samples)."""

    def columns(self, regression: TimeSeriesRegression) -> Columns:
        """Change of every output of every run by the basis functions."""
        for segment in regression.segments:
            own = self.columns_in(regression, segment)
            if own is not None:
                yield segment.rows, own

    def columns_in(self, regression: TimeSeriesRegression, segment: Segment) -> Array | None:
        """Change of one output of one run, (knots, rows); None where they do not act."""
        change = PLACES[self.place].get(segment.output)
        if change is None:
            return None
        recording = regression.dataset.recordings[segment.run]
        signal = change(recording, self.basis[segment.run], self.knots)
        return masked(recording, segment.output, signal)


def curves(
    regression: TimeSeriesRegression,
    outputs: Sequence[str],
    only: Container[tuple[str, str]] | None = None,
) -> Iterator[CurveFamily]:
    """Families of curves that change one of ``outputs``; ``only`` those of a place and variable."""
    recordings = regression.dataset.recordings
    known = [_with_factors(recording) for recording in recordings]
    position = "cable_length" if "cable_length" in known[0] else "motor_angle"
    names = [name for name in known[0] if all(name in other for other in known)]
    alone = [
        name
        for name in names
        if name == position or not (name in _EXCLUDED_VARIABLES or name.endswith(_TURN))
    ]
    for factor, name in (*((None, n) for n in alone), *_products(names, position)):
        variable = name if factor is None else f"{factor} times {name}"
        if only is not None and not any((place, variable) in only for place in PLACES):
            continue
        ends = _ends(name, [own_variables[name] for own_variables in known])
        if ends is None:
            continue
        knots = np.linspace(*ends, _KNOTS)
        basis = [linear_splines(own_variables[name], knots) for own_variables in known]
        if factor is not None:
            basis = [
                columns * own_variables[factor]
                for columns, own_variables in zip(basis, known, strict=True)
            ]
        laws = laws_over(knots, name, level=factor is not None)
        for place, changes in PLACES.items():
            changed_outputs = set(changes) & set(outputs) & set(regression.dataset.outputs)
            wanted = only is None or (place, variable) in only
            winding = place != "winding" or (name, factor) == ("cable_length", None)
            if wanted and changed_outputs and winding:
                yield CurveFamily(place, variable, laws, knots, basis)


def _with_factors(recording: Recording) -> dict[str, Array]:
    """Variables of a run with those of products: the direction, and angles in their turn."""
    out = variables_of(recording)
    turns = {name + _TURN: np.mod(out[name], 2 * np.pi) for name in ANGLES if name in out}
    return out | turns | {"direction": recording.smooth.at.direction}


def _products(names: Sequence[str], position: str) -> list[tuple[str, str]]:
    """Products of a factor and a curve: friction by place, by place in a turn, by load, by load and
    speed, or by time; compliant cables. The direction is the expected one of the model: how steep
    it is, is not tested.
    """
    force = "load" if "load" in names else "tension"
    pairs = (
        *(("direction", name + _TURN) for name in ANGLES),
        (force, "speed"),
        ("direction", "time"),
        ("speed", "time"),
        ("direction", position),
        ("direction", force),
        (force, "cable_length"),
        ("cable_length", force),
        (force, "temperature"),
    )
    return [pair for pair in pairs if set(pair) <= set(names)]


def _ends(name: str, values: Sequence[Array]) -> tuple[float, float] | None:
    low, high = np.quantile(np.concatenate(values), [_TAILS, 1 - _TAILS])
    least = LEAST_TEMPERATURE_RANGE if name == "temperature" else 1e-9 * max(abs(low), abs(high))
    return (float(low), float(high)) if high - low > least else None


def linear_splines(values: Array, knots: Array) -> Array:
    """Linear B-splines over equidistant knots, (knots, values), which add up to one."""
    at = np.clip((values - knots[0]) / (knots[1] - knots[0]), 0.0, len(knots) - 1.0)
    cell = np.minimum(at.astype(np.intp), len(knots) - 2)
    out, sample = np.zeros((len(knots), len(values))), np.arange(len(values))
    out[cell, sample] = 1.0 - (at - cell)
    out[cell + 1, sample] = at - cell
    return out


def laws_over(knots: Array, name: str, *, level: bool) -> list[Law]:
    """Curves over a variable in values at the knots, with the number of parameters of each. Only a
    factor has a level of its own (``level``): any other is an offset, for which the catalogue has
    effects.
    """
    if name.endswith(_TURN):
        return [(_waves(knots, order), 1 + 2 * order) for order in _ORDERS]
    z = np.linspace(-1.0, 1.0, len(knots))
    out: list[Law] = []
    for degree in _DEGREES:
        powers = np.asarray(np.polynomial.legendre.legvander(z, degree), dtype=np.float64)
        out.append((powers, degree + 1) if level else (powers[:, 1:], degree))
    for count in _COARSE_KNOTS:
        out.append((linear_splines(z, np.linspace(-1.0, 1.0, count)).T, count))
    for at in z[1:-1]:
        sides = [np.maximum(z - at, 0.0), np.maximum(at - z, 0.0), np.ones_like(z)]
        out.append((np.column_stack(sides[: 2 + level]), 3 + level))
    if name == "speed":
        out += [((np.sign(knots) * np.abs(knots) ** n)[:, None], 2) for n in _POWERS]
    return out


def _waves(angle: Array, orders: int) -> Array:
    """Constant, cosine and sine up to an order of a turn, (angles, 1 + 2 orders)."""
    waves = [wave(k * angle) for k in range(1, orders + 1) for wave in (np.cos, np.sin)]
    return np.column_stack([np.ones_like(angle), *waves])


def _direct_change(recording: Recording, basis: Array, knots: Array) -> Array:
    """A curve of the instrument itself."""
    return basis


def _torque_by_cable_force(recording: Recording, basis: Array, knots: Array) -> Array:
    """Change of the motor torque by a curve of the cable force."""
    force = recording.smooth.at.tension
    magnitude = np.maximum(np.abs(force), 1e-9)
    return np.asarray(basis * recording.nominal_smooth["motor_torque"] * np.sign(force) / magnitude)


def _torque_by_winding(recording: Recording, basis: Array, knots: Array) -> Array:
    """Change of the motor torque by a curve of the winding, by the principle of virtual work."""
    step = knots[1] - knots[0]
    cell = np.floor((recording.smooth.at.free_length - knots[0]) / step)
    cell = np.clip(cell, 0, len(knots) - 2)
    index = np.arange(len(knots))[:, None]
    slopes = ((index == cell + 1) * 1.0 - (index == cell) * 1.0) / step
    return np.asarray(recording.nominal_smooth["motor_torque"] * slopes)


PLACES: Mapping[str, Mapping[str, _ChangeByCurve]] = {
    "cable_length": {"cable_length": _direct_change},
    "tension": {"tension": _direct_change},
    "motor_torque": {"motor_torque": _direct_change},
    "cable_force": {"tension": _direct_change, "motor_torque": _torque_by_cable_force},
    "winding": {"cable_length": _direct_change, "motor_torque": _torque_by_winding},
}
"""Where a curve may act, and the change of each output by it."""
