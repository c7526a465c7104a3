"""Whether recorded runs identify the hidden effect, by the generator's own likelihood.

The likelihood ratio of the truth, at its true values, against a rival effect alone is exp(D/2),
D = min ‖y − f_r(z)‖² − ‖y − f‖², in the metric of the noise that the generator added, after the
fit of what every comparison leaves free (the length's zero, one or one a run; a zero of the tension
a run where the logger zeroed it). A rival's response is simulated at its usual size for a grid of
its shape, and its size is the least-squares one; the shapes that come near are simulated again at
0.4, 1 and 1.6 times that size, and the response is linear in between. The hidden effect is
identifiable where the ratio exceeds 20 for every rival, none at all included.

A rival's law may contain the hidden one (a Stribeck curve as flat as Coulomb friction): it is tried
at the shapes of its grid. No code of the diagnosis takes part.

The noise of an output, which the generator added itself, is white (rounding included, step²/12)
and, for a part of its power, AR(1) with the coefficient 0.9 per sample. The precision Q of an AR(1)
sequence is tridiagonal, also where samples are missing (a Markov chain), so that
Σ⁻¹ = I/w − (Q + I/w)⁻¹/w², w the white variance, is applied exactly by a banded Cholesky
decomposition.

References
----------
Rue, H., Held, L. (2005). Gaussian Markov Random Fields. Chapman & Hall, ch. 1-2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, hypot, log, pi

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded

from campaign.bench import Bench
from campaign.loggers import Fault, Logged
from campaign.record import AR
from campaign.sizes import CATALOGUE, PHASED, RECENT, Sized, allowed, shapes
from campaign.truth import OUTPUTS, Hidden, Shown, show
from winchkit.arrays import Array


def gram(columns: Array, rows: NDArray[np.intp], white: float, coloured: float) -> Array:
    """Products CᵀΣ⁻¹C of columns (n, k) at increasing sample numbers ``rows`` (n,); (k, k).

    ``white`` and ``coloured`` are the variances of the two parts.
    """
    plain = columns.T @ columns / white
    if coloured == 0 or len(rows) < 2:
        return plain
    banded = _ar_precision(rows, coloured)
    banded[1] += 1 / white
    return plain - columns.T @ solveh_banded(banded, columns) / white**2


def _ar_precision(rows: NDArray[np.intp], variance: float) -> Array:
    """Precision of AR(1) at some samples, upper banded form (2, n)."""
    correlation = AR ** np.diff(rows).astype(float)
    fresh = 1 - correlation**2
    out = np.zeros((2, len(rows)))
    out[1, 0] = 1.0
    out[1, 1:] = 1 / fresh
    out[1, :-1] += correlation**2 / fresh
    out[0, 1:] = -correlation / fresh
    return out / variance


def without(products: Array, nuisance: Sequence[int]) -> Array:
    """Products of columns after the least-squares fit of the nuisance ones, same shape."""
    own = list(nuisance)
    if not own:
        return products
    cross = products[:, own]
    return np.asarray(products - cross @ np.linalg.pinv(cross[own], hermitian=True) @ cross.T)


def least_along(products: Array, goal: int, knots: Sequence[int]) -> float:
    """Least square of goal − d, d on the broken line from zero through the knots."""
    best, start = float(products[goal, goal]), np.zeros(len(products))
    for knot in knots:
        along = -start
        along[knot] += 1.0
        away = -start
        away[goal] += 1.0
        length = float(along @ products @ along)
        part = float(np.clip(along @ products @ away / length, 0, 1)) if length > 0 else 0.0
        away -= part * along
        best = min(best, float(away @ products @ away))
        start = np.zeros(len(products))
        start[knot] = 1.0
    return best


RATIO = 20.0
_KNOTS = (0.4, 1.0, 1.6)
_NEAR = 0.3
"""Share of the hidden effect's square that a shape may leave to be simulated again."""
_CLOSE = 200.0
"""Twice the logarithm of the ratio below which every shape is simulated again."""
_NOTHING = "nothing"


@dataclass(frozen=True)
class Identity:
    """How well runs identify what is hidden."""

    rival: str
    """The effect that comes nearest."""
    log_ratio: float
    """Natural logarithm of the likelihood of the truth over that of the rival."""

    @property
    def identifiable(self) -> bool:
        """Whether the truth is more likely than every rival by a factor of 20."""
        return self.log_ratio > log(RATIO)


def identity(bench: Bench, hidden: Hidden, fault: Fault) -> Identity:
    """Likelihood ratio of the hidden effect against the nearest single rival."""
    ground = _Ground(bench, hidden, fault)
    forms = [
        _Form(effect, sized, effect in PHASED)
        for effect in (*CATALOGUE, *RECENT)
        if effect not in hidden
        and allowed(effect, bench.winch, bench.load != "cell", bench.warms, len(bench.scene.masses))
        for sized in shapes(effect, bench.winch, bench.scene)[:: 2 if effect in PHASED else 1]
    ]
    starts = [start for form in forms for start in form.starts]
    products = ground.products(starts)
    truth, change = float(products[1, 1]), float(products[0, 0] - products[1, 1])
    least, near, column = [float(products[0, 0])], [], 2
    for form in forms:
        count = len(form.starts)
        square, size = _scaled(products, list(range(column, column + count)))
        column += count
        least.append(square)
        if any(size) and square - truth < max(_CLOSE, _NEAR * change):
            near.append((len(least) - 1, [form.at(size, part) for part in _KNOTS]))
    products = ground.products([values for _, knots in near for values in knots])
    for number, (index, knots) in enumerate(near):
        first = 2 + number * len(knots)
        least[index] = least_along(products, 0, range(first, first + len(knots)))
    nearest = int(np.argmin(least))
    rival = forms[nearest - 1].effect if nearest else _NOTHING
    return Identity(rival, (least[nearest] - truth) / 2)


@dataclass(frozen=True)
class _Form:
    """A rival effect in one shape."""

    effect: str
    sized: Sized
    phased: bool

    @property
    def starts(self) -> list[Hidden]:
        """The usual size, of a sine in two phases."""
        values = self.sized(1.0)
        turned = [{**values, "phase": pi / 2}] if self.phased else []
        return [{self.effect: one} for one in (values, *turned)]

    def at(self, size: Array, part: float) -> Hidden:
        """A part of a size, which of a sine has a cosine and a sine component."""
        values = self.sized(part * hypot(*size))
        if self.phased:
            values["phase"] = atan2(size[1], size[0])
        return {self.effect: values}


def _scaled(products: Array, columns: list[int]) -> tuple[float, Array]:
    """Least square of the first column less multiples of others, and these; none is negative."""
    inner = products[np.ix_(columns, columns)]
    size = np.linalg.pinv(inner, hermitian=True) @ products[columns, 0]
    if len(columns) == 1:
        size = np.maximum(size, 0.0)
    return float(products[0, 0] - 2 * size @ products[columns, 0] + size @ inner @ size), size


class _Ground:
    """What a logger's files say of effects: responses, noise and what is free."""

    def __init__(self, bench: Bench, hidden: Hidden, fault: Fault) -> None:
        self._bench, self._hidden, self._fault = bench, hidden, fault
        self._files = [file for file in fault.files if not file.copy]
        self._outputs = [o for o in OUTPUTS if o != "tension" or bench.load != "cell"]
        anew = {(output, file.run) for output in fault.zeroed for file in self._files}
        self._free = sorted({("cable_length", -1), *anew})

    def products(self, effects: Sequence[Hidden]) -> Array:
        """Products of what is recorded (less the plain winch), its noise, and responses."""
        count = 2 + len(effects)
        total = np.zeros((count + len(self._free),) * 2)
        for same in self._repeats():
            shared = _Responses(self._bench, max(same, key=lambda file: len(self._time(file))).run)
            for file in same:
                plain, true = (
                    show(self._bench.winch, self._bench.situations[file.run], one)
                    for one in ({}, self._hidden)
                )
                changes = [shared.of(file.run, one) for one in effects]
                for output in self._outputs:
                    rows = np.arange(len(file.rows))
                    if output in file.spikes:
                        rows = rows[~file.spikes[output]]
                    at = file.rows[rows]
                    values = file.recording.channels[output][rows]
                    columns = [values - getattr(ideal, output)[at] for ideal in (plain, true)]
                    columns += [change[output][at] for change in changes]
                    columns += [
                        np.full(len(at), float(o == output and run in (-1, file.run)))
                        for o, run in self._free
                    ]
                    total += gram(np.column_stack(columns), at, *self._noise(output))
        return without(total, range(count, len(total)))[:count, :count]

    def _repeats(self) -> list[list[Logged]]:
        """Files of one programme and load together."""
        groups: dict[tuple[int, float], list[Logged]] = {}
        for file in self._files:
            key = self._bench.programmes[file.run], self._bench.situations[file.run].mass
            groups.setdefault(key, []).append(file)
        return list(groups.values())

    def _time(self, file: Logged) -> Array:
        return self._bench.situations[file.run].time

    def _noise(self, output: str) -> tuple[float, float]:
        """Variances of the white and of the coloured part."""
        power, colour = self._bench.noise[output] ** 2, self._bench.colour
        return (1 - colour) * power + self._fault.steps.get(output, 0.0) ** 2 / 12, colour * power


class _Responses:
    """Changes of the outputs by effects in a run and in shorter repeats of it, simulated once."""

    def __init__(self, bench: Bench, run: int) -> None:
        self._bench, self._run = bench, run
        self._plain = show(bench.winch, bench.situations[run], {})
        self._known: dict[int, dict[str, Array]] = {}

    def of(self, run: int, effect: Hidden) -> dict[str, Array]:
        """Change of every output; of an effect of the temperature in ``run`` itself."""
        if any(name.endswith("thermal") for name in effect):
            own = self._bench.situations[run]
            return _change(show(self._bench.winch, own, {}), show(self._bench.winch, own, effect))
        if id(effect) not in self._known:
            other = show(self._bench.winch, self._bench.situations[self._run], effect)
            self._known[id(effect)] = _change(self._plain, other)
        return self._known[id(effect)]


def _change(plain: Shown, other: Shown) -> dict[str, Array]:
    return {output: getattr(other, output) - getattr(plain, output) for output in OUTPUTS}
