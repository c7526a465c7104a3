"""Selection engine of a winch's runs: noise from repeats, groups of programme and load as folds."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.regression.base import Folds
from winchkit.diagnosis.regression.coarse import CoarseTimeSeries, coarse_regression
from winchkit.diagnosis.regression.cross_validation import extrapolation, held_out_rms
from winchkit.diagnosis.regression.discretization import without_discretization_error
from winchkit.diagnosis.regression.gls import CoarseProblem, Fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.lack_of_fit import (
    LackOfFitTest,
    lack_of_fit_test,
    output_p_values,
)
from winchkit.diagnosis.regression.noise import BandNoise, noise_from_repeats, noise_saturated
from winchkit.diagnosis.regression.projection import partialled_out
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.diagnosis.selection.candidates import with_grid, with_grid_points
from winchkit.diagnosis.selection.engine import SelectionEngine
from winchkit.diagnosis.selection.onset import best_onset, onset_of
from winchkit.diagnosis.selection.orders import (
    further_orders,
    has_orders,
    periodogram,
)
from winchkit.diagnosis.selection.scores import Projected
from winchkit.effects.effect import Effect
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term
from winchkit.schema.profiles.winch import WinchProfile

_LARGEST_EXTRAPOLATION = 0.2
"""Variance of a held-out group's prediction over the noise's above which five blocks of time
replace groups; theory: it lifts a held-out error by √1.2 = 1.095, to the limit `_AT_NOISE` of the
verdict."""
_MOST_PEAKS = 12
"""Orders that enter the grids in one scan of all effects with an order; computing cost; further
ones are found by the harmonic series and by later scans."""

_LEAST_DOF = 2.0
"""Degrees of freedom from which the noise of a band is that of repeats: F has no mean below."""


class TimeSeriesSelection(SelectionEngine):
    """Selection among hypotheses on a winch's runs, from the profile's own effects on."""

    regression: TimeSeriesRegression

    def __init__(
        self,
        regression: TimeSeriesRegression,
        initial_model: Hypothesis,
        candidates: Iterable[Effect],
    ) -> None:
        self._coarse = coarse_regression(regression)
        if regression.replicates:
            # Without repeats the noise is that beside all candidates, those of every listed order.
            candidates = [_with_first_order(e) if has_orders(e) else e for e in candidates]
        super().__init__(regression, initial_model, candidates)

    def noise(self, residual: Array, jacobian: Array, states: int = 0) -> BandNoise:
        """Noise from the contrasts of repeats; from the saturated model without repeats, and in the
        bands without repeats: of an output that none has or no law explains, or below their lowest
        frequency."""
        if not self.regression.replicates:
            return noise_saturated(self.regression, residual, jacobian, self.signatures.columns)
        offsets = jacobian[:, : self.regression.n_run_offsets]
        own = np.hstack([offsets, jacobian[:, jacobian.shape[1] - states :]])
        noise = noise_from_repeats(self.regression, residual, self._thermal_signatures, own)
        unexplained = self.regression.dataset.unexplained
        few = np.array([output in unexplained for output, _, _ in self.regression.bands])
        few |= noise.dof < _LEAST_DOF
        if not few.any():
            return noise
        beside = noise_saturated(self.regression, residual, jacobian, self.signatures.columns)
        return noise.with_bands(few, beside, self.regression)

    @property
    def profile(self) -> WinchProfile:
        """Profile of the winch."""
        return self.regression.dataset.profile

    @property
    def coarse(self) -> CoarseTimeSeries | None:
        """Every k-th sample of one run of each set of repeats."""
        return self._coarse

    def coarse_problem(self, noise: BandNoise) -> CoarseProblem | None:
        """Every k-th sample of one run of each set of repeats, under this noise."""
        if self._coarse is None:
            return None
        return CoarseProblem(self._coarse, self._coarse.inverse_sigma(noise))

    def held_out_errors(self, fitted: Fit, noise: BandNoise, folds: Folds) -> dict[str, float]:
        """Held-out rms error of every output, SI."""
        return held_out_rms(self.regression, fitted, noise, folds)

    def _choose_folds(self, fitted: Fit, noise: BandNoise) -> Folds:
        """Groups of programme and load, or five blocks of time where an unknown is determined by
        one group only: held-out prediction of that group fails with the effect and without.
        """
        groups = self.regression.groups
        largest = extrapolation(self.regression, fitted, noise, groups)
        return self.regression.five_blocks if largest > _LARGEST_EXTRAPOLATION else groups

    def _test_lack_of_fit(self, present: Fit, noise: BandNoise) -> LackOfFitTest:
        """F test of the residual without the part that the discretisation error explains."""
        left = self._sampled_well(present, noise)
        return lack_of_fit_test(self.regression, left, present.jacobian, noise)

    def p_values(self, fitted: Fit, noise: BandNoise) -> dict[str, float]:
        """Probability of as large a misfit of each output by the noise of the repeats alone."""
        left = self._sampled_well(fitted, noise)
        return output_p_values(self.regression, left, fitted.jacobian, noise)

    def _sampled_well(self, fitted: Fit, noise: BandNoise) -> Array:
        """Residual without the part that the discretisation error explains."""
        weights = noise.inverse_sigma(self.regression)
        return without_discretization_error(self.regression, fitted, weights)

    def discretization_power(self, fitted: Fit, noise: BandNoise) -> dict[str, float]:
        """Decrease of each output's mean square without the discretisation error."""
        regression, left = self.regression, self._sampled_well(fitted, noise)
        explained = fitted.residual**2 - left**2
        return {
            output: max(
                0.0,
                sum(
                    float(np.sum(explained[s.rows]))
                    for s in regression.segments
                    if s.output == output
                )
                / regression.n_samples(output),
            )
            for output in regression.outputs
        }

    def _extend_grids(self, present: Hypothesis) -> bool:
        """Extend the grids of candidates by significant orders and by the best onset.

        The noise is the residual's own power per band, so that a line has to exceed everything else
        in its band. A significant order is tested as every effect that has orders.
        """
        if not any(has_orders(effect) or onset_of(effect) for effect in self._candidates):
            return False
        regression = self.regression
        vector = regression.vector(present)
        unknowns = regression.jacobian(vector, present) if len(vector) else np.zeros((0, 0))
        residual = regression.residual(present)
        if unknowns.shape[1]:
            residual = partialled_out(unknowns, residual)
        noise = noise_saturated(regression, residual, np.zeros((regression.n_rows, 0)))
        inverse_sigma = noise.inverse_sigma(regression)
        if self._coarse is None:
            sampled = regression, present, inverse_sigma
        else:
            coarse = self._coarse
            sampled = coarse.regression, coarse.reduced(present), coarse.inverse_sigma(noise)

        def least(effect: Effect) -> float:
            """Decrease of χ² that the effect needs."""
            return Coordinates(effect).n_parameters * self.penalty_per_parameter

        power: dict[int, float] = {}
        for effect in filter(has_orders, self._candidates):
            scan = periodogram(regression, present, effect, residual, inverse_sigma)
            for order in scan.peaks(least(effect)):
                power[order] = max(power.get(order, 0.0), float(scan.power[order - 1]))
        orders = sorted(power, key=power.__getitem__, reverse=True)[:_MOST_PEAKS]

        def extended(effect: Effect) -> Effect:
            """The effect with further points of its grid, or itself."""
            if has_orders(effect):
                return with_grid_points(effect, "order", orders)
            if onset := onset_of(effect):
                best = best_onset(*sampled, effect)
                if best is not None and best[1] >= least(effect):
                    return with_grid_points(effect, onset.name, best[:1])
            return effect

        new = tuple(map(extended, self._candidates))
        changed = any(a is not b for a, b in zip(new, self._candidates, strict=True))
        self._candidates = new
        return changed

    def further_orders(self, fitted: Fit, effect: Effect, noise: BandNoise) -> tuple[Term, ...]:
        """Further orders of a fit's last effect that its residual contains."""
        if not has_orders(effect):
            return ()
        penalty = self.penalty_per_parameter * Coordinates(effect).n_parameters
        projected = Projected(self.regression, self.signatures, fitted.jacobian, noise)
        others = [
            index
            for index, candidate in enumerate(self.signatures.candidates)
            if candidate.effect.id != effect.id
        ]

        def gain(residual: Array) -> float:
            """Least decrease of χ²: an effect that explains more is added before."""
            explained = projected.explained_ss(projected.products(residual))[others]
            return max(penalty, float(np.max(explained, initial=0.0)))

        return further_orders(
            self.regression, fitted, effect, noise.inverse_sigma(self.regression), gain
        )

    @property
    def _thermal_signatures(self) -> Array:
        """Signatures that may differ between repeats because the temperature does."""
        thermal = [
            index
            for candidate in self.signatures.candidates
            if "temperature" in candidate.effect.needs
            for index in range(candidate.columns.start, candidate.columns.stop)
        ]
        return self.signatures.columns[:, thermal].astype(np.float64)


def _with_first_order(effect: Effect) -> Effect:
    """The effect with the first order of its grid alone: the scan of all orders adds the others."""
    return with_grid(effect, "order", effect.parameter("order").grid[:1])
