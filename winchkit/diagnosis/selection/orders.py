"""Spectrum of a residual over the motor angle: least-squares periodogram at whole orders.

Every order is scanned for an effect whose change of an output is ``E(t) sin(kθ + p)``: cogging (E
constant), ripple of the torque constant (E in proportion to the torque), transmission error of a
gear. The inner products with the whitened residual are exact; the squared lengths of the columns
are those under the noise variance at the local frequency k θ'/2π.

References
----------
Scargle, J. D. (1982). Studies in astronomical time series analysis II. Astrophys. J. 263, 835-853.
Pati, Y. C., Rezaiifar, R., Krishnaprasad, P. S. (1993). Orthogonal matching pursuit. Asilomar.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from winchkit.arrays import Array
from winchkit.diagnosis.data.harmonics import half_of_samples_per_turn, sums_by_order
from winchkit.diagnosis.data.spectrum import to_time
from winchkit.diagnosis.regression.base import Segment
from winchkit.diagnosis.regression.gls import Fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.projection import orthonormal
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.effects.effect import MOTOR_ORDERS, Effect
from winchkit.effects.empirical import EMPIRICAL
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.series import orders_of
from winchkit.effects.term import Term

_LEVEL = 0.01
"""Probability that the largest power of all scanned orders exceeds the threshold by chance;
convention, as the score's."""
_MOST_IN_SERIES = 24
"""Orders that one series may gain in one step; computing cost; later steps add further ones."""
_LEAST_WITHIN = 0.1
"""Share of a column's squared length within the band of the comparison, below which an order is not
scanned; leakage from beyond the band is no longer small against it."""
_LEAST_PERIODS = 3.0
"""Periods within the longest motion from which an order is scanned, where it is less than a turn;
of fewer a smooth curve, such as gravity and a spring together, is a sine."""
_RATES = 200
"""Classes of motor speed for the noise at the local frequency; finer than the noise bands."""
_TURN = 2 * np.pi
"""One turn, rad; definition."""


@dataclass(frozen=True)
class Periodogram:
    """Decrease of χ² by a sine of each order, approximately χ²(2) where there is none.

    Zero beyond the band of the comparison, and below three periods where no run has a whole turn.
    """

    orders: NDArray[np.intp]
    power: Array

    @property
    def threshold(self) -> float:
        """Power that the largest of all scanned orders exceeds by chance in 1 % of cases."""
        scanned = max(1, int(np.count_nonzero(self.power)))
        return 2.0 * float(np.log(scanned / _LEVEL))

    def peaks(self, least: float) -> tuple[int, ...]:
        """Orders above ``least`` and the threshold, largest power first."""
        order = np.argsort(-self.power)
        above = order[self.power[order] > max(least, self.threshold)]
        return tuple(int(self.orders[index]) for index in above)


def has_orders(effect: Effect) -> bool:
    """Whether an effect may stand several times with whole orders per motor turn."""
    names = {p.name for p in effect.parameters if p.whole}
    return effect.polar is not None and names == {"order"} and effect.id not in EMPIRICAL


def periodogram(
    regression: TimeSeriesRegression,
    hypothesis: Hypothesis,
    effect: Effect,
    residual: Array,
    inverse_sigma: Array,
) -> Periodogram:
    """Periodogram of a residual (measured minus predicted) over the orders of an effect."""
    first, count = _orders_per_turn(regression)
    if first > count or regression.missing_needs(effect):
        return Periodogram(np.arange(0), np.zeros(0))
    outputs = sorted(regression.outputs_of(effect.stage) & set(regression.outputs))
    envelopes = _envelopes(regression, hypothesis, effect, outputs)
    weight = inverse_sigma**2
    power = np.zeros(count)
    for output in outputs:
        products, lengths = np.zeros(count, dtype=np.complex128), np.zeros(count)
        within, whole = np.zeros(count), 0.0
        for segment, envelope in zip(regression.segments, envelopes, strict=True):
            if segment.output == output and envelope.any():
                own = weight[segment.rows]
                products += _products(
                    regression, segment, own * residual[segment.rows], envelope, count
                )
                length, inside = _squared_lengths(regression, segment, own, envelope, count)
                lengths += length
                within += inside
                whole += float(envelope @ envelope) / 2
        known = (lengths > 0) & (within > _LEAST_WITHIN * whole)
        known[: first - 1] = False
        power[known] += np.abs(products[known]) ** 2 / lengths[known]
    return Periodogram(np.arange(1, count + 1), power)


def _products(
    regression: TimeSeriesRegression, segment: Segment, weighted: Array, envelope: Array, count: int
) -> NDArray[np.complex128]:
    """Inner products of weighted rows of one segment with E exp(ikθ), k from 1 to ``count``."""
    angle = regression.dataset.recordings[segment.run].signals.motor_angle
    samples = to_time(segment.band.gain * weighted, segment.band) * envelope
    return sums_by_order(angle, samples, count, count)


def _squared_lengths(
    regression: TimeSeriesRegression, segment: Segment, weight: Array, envelope: Array, count: int
) -> tuple[Array, Array]:
    """Squared lengths of the columns E sin(kθ), whitened and, within the band, not whitened."""
    signals = regression.dataset.recordings[segment.run].signals
    rate = np.abs(np.gradient(signals.motor_angle, signals.time)) / _TURN
    edges = np.linspace(0.0, float(np.max(rate)), _RATES + 1)
    size, _ = np.histogram(rate, edges, weights=envelope**2 / 2)
    frequency = np.outer(np.arange(1, count + 1), (edges[1:] + edges[:-1]) / 2)
    # Beyond half the sampling rate a wave is seen at its mirrored frequency.
    half = segment.band.rate / 2
    frequency = np.abs((frequency + half) % (2 * half) - half)
    spectrum = np.append(segment.band.gain**2 * weight, 0.0)
    row = frequency * 2 * segment.band.count / segment.band.rate
    row = np.minimum(row, len(spectrum) - 1).astype(np.intp)
    inside = np.asarray((row < len(spectrum) - 1) @ size, np.float64)
    return np.asarray(spectrum[row] @ size), inside


def further_orders(
    regression: TimeSeriesRegression,
    fitted: Fit,
    effect: Effect,
    inverse_sigma: Array,
    gain: Callable[[Array], float],
) -> tuple[Term, ...]:
    """Further orders of an effect in the residual of a fit, by orthogonal matching pursuit.

    An order has to exceed the ``gain`` of the residual: its penalty, or what another effect would
    explain. All unknowns are projected out before the residual is scanned again.
    """
    hypothesis = fitted.hypothesis
    basis = orthonormal(fitted.jacobian * inverse_sigma[:, None])
    whitened = fitted.residual * inverse_sigma
    whitened = whitened - basis @ (basis.T @ whitened)
    coordinates, before = Coordinates(effect), regression.change(hypothesis)
    present = (orders_of(term) for term in hypothesis.terms if term.effect.id == effect.id)
    excluded = {order for orders in present for order in orders}
    known = inverse_sigma > 0
    found: list[Term] = []
    while len(found) < _MOST_IN_SERIES:
        unweighted = np.divide(whitened, inverse_sigma, out=np.zeros_like(whitened), where=known)
        scan = periodogram(regression, hypothesis, effect, unweighted, inverse_sigma)
        least = gain(unweighted)
        order = next((k for k in scan.peaks(least) if k not in excluded), None)
        if order is None:
            break
        excluded.add(order)
        base = {**effect.null, "order": float(order)}
        columns = np.empty((regression.n_rows, 2))
        for place, step in enumerate(coordinates.usual_steps()):
            term = Term(effect, {**base, **step})
            there = regression.change(hypothesis.with_term(term, regression.n_runs))
            columns[:, place] = (there - before) * inverse_sigma
        projected = columns - basis @ (basis.T @ columns)
        amplitudes, *_ = np.linalg.lstsq(projected, whitened, rcond=None)
        explained = projected @ amplitudes
        if float(explained @ explained) < max(least, scan.threshold):
            continue
        found.append(Term(effect, coordinates.values(np.asarray(amplitudes, np.float64), base)))
        basis = np.hstack([basis, orthonormal(projected)])
        whitened = whitened - explained
    return tuple(found)


def _envelopes(
    regression: TimeSeriesRegression,
    hypothesis: Hypothesis,
    effect: Effect,
    outputs: Collection[str],
) -> list[Array]:
    """E(t) of a change E(t) sin(kθ + p) per segment, from order 1 at both phases; zero where not
    compared. For an effect whose torque is the derivative of its angle it is in quadrature.
    """
    before = regression.change(hypothesis, outputs)
    waves = []
    for step in Coordinates(effect).usual_steps():
        term = Term(effect, {**effect.null, "order": 1.0, **step})
        after = regression.change(hypothesis.with_term(term, regression.n_runs), outputs)
        change = np.zeros(regression.n_rows)
        for rows in regression.rows_of(outputs):
            change[rows] = after[rows] - before[rows]
        waves.append(regression.in_time(change))
    out = []
    for segment, sine, cosine in zip(regression.segments, *waves, strict=True):
        recording = regression.dataset.recordings[segment.run]
        angle, valid = recording.signals.motor_angle, recording.valid[segment.output]
        own, other = np.sin(angle), np.cos(angle)
        pair = (sine * own + cosine * other, sine * other - cosine * own)
        in_phase, quadrature = (np.where(valid, envelope, 0.0) for envelope in pair)
        larger = float(in_phase @ in_phase) >= float(quadrature @ quadrature)
        out.append(in_phase if larger else quadrature)
    return out


def _orders_per_turn(regression: TimeSeriesRegression) -> tuple[int, int]:
    """Lowest order, and half the samples per turn where the motor is slowest, at least 36.

    Orders of poles and slots that are aliased there are still distinguished by the changes of
    speed. Without a whole turn the lowest order has three periods in the longest motion; zero where
    no run covers half a turn, which leaves an order open by more than two.
    """
    # A map of a whole turn ends one step before its beginning.
    angles = [recording.signals.motor_angle for recording in regression.dataset.recordings]
    reach = [float(np.ptp(a)) + 2 * float(np.median(np.abs(np.diff(a)))) for a in angles]
    needed = min(_TURN, max(reach, default=0.0))
    if needed < _TURN / 2:
        return 1, 0
    half = half_of_samples_per_turn(
        [angle for angle, own in zip(angles, reach, strict=True) if own >= needed]
    )
    least = 1 if needed >= _TURN else int(np.ceil(_LEAST_PERIODS * _TURN / needed))
    return least, max(half, int(MOTOR_ORDERS[-1])) if half else 0
