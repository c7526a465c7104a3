"""Noise spectrum: variance of every frequency band, from repeats or from the saturated model.

With repeats the variance is estimated from pure error: Helmert contrasts of the residuals contain
noise only. The log power over the bands is smoothed by a penalised Whittle likelihood. Without
repeats the variance is that of the residual beside all candidate effects at once (saturated model),
which counts an effect outside the catalogue as noise.

References
----------
Draper, N. R., Smith, H. (1998). Applied Regression Analysis, 3rd ed., ch. 2 (pure error).
Pawitan, Y., O'Sullivan, F. (1994). Nonparametric spectral density estimation using penalized
Whittle likelihood. J. Am. Stat. Assoc. 89, 600-610.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct

from winchkit.arrays import Array
from winchkit.diagnosis.data.input_denoising import contrasts
from winchkit.diagnosis.data.spectrum import smoothed
from winchkit.diagnosis.regression.base import Regression
from winchkit.diagnosis.regression.projection import LEAST_EIGENVALUE, orthonormal

_KNOWN_DIFFERENCES = 6
"""Directions that known differences between repeats may take out of the pure error; screened."""
_NOTICEABLE = 0.02
"""Power of a signature's difference over that of its mean from which it is taken out; screened."""
_LEAST_DOF = 4.0
"""Degrees of freedom that candidates must leave a band for its own variance: half of the rows of a
wide band."""
_FEW_DOF = 10.0
"""Degrees of freedom below which a variance is at least that of higher bands; screened: χ²(10) is
below a quarter of its mean in 1 % of cases; with 25 a ripple of the friction was missed, since
bands above contain what the search has not found yet."""
_REWEIGHTED = 3
"""Reweighting iterations; screened."""
_UPPER = 0.5
"""Share of an output's bands whose noise is a lower bound of that below them; rule of thumb."""
_ROWS_EACH = 4
"""Rows per direction that is projected out of a saturated model; screened."""


@dataclass(frozen=True)
class BandNoise:
    """Variance of the noise per band."""

    power: Array
    """Variance of a spectral coefficient, (n_bands,)."""
    dof: Array
    """Degrees of freedom of each variance estimate, (n_bands,)."""
    rms: dict[str, float]
    """Rms of the noise per output, in time, SI."""
    from_repeats: bool
    """Whether the variance is pure error; else it is that of the saturated model."""

    def inverse_sigma(self, regression: Regression) -> Array:
        """1/σ of every row, shape (n_rows,)."""
        return np.asarray(1 / np.sqrt(self.power[regression.band_of_row]))

    def with_bands(
        self, theirs: NDArray[np.bool_], other: BandNoise, regression: Regression
    ) -> BandNoise:
        """The same with some bands, (n_bands,), from another estimate, if it is not smaller.

        Both may be too small, by what the neighbours or the candidates explain; the noise of
        instruments does not fall towards low frequencies: it is at least that of the upper bands.
        """
        power = np.where(theirs, np.maximum(self.power, other.power), self.power)
        dof = np.where(theirs, other.dof, self.dof)
        for first, edges in _edges(regression).values():
            own = np.arange(first, first + len(edges) - 1)
            upper = own[-max(1, round(_UPPER * len(own))) :]
            white = dof[upper] @ power[upper] / np.sum(dof[upper])
            power[own] = np.where(theirs[own], np.maximum(power[own], white), power[own])
        return replace(self, power=power, dof=dof, rms=_rms(regression, power))

    def uncertainty(self, regression: Regression) -> dict[str, float]:
        """Relative uncertainty (two standard deviations) of the mean square per output; coloured
        noise has few independent values, since most of its power lies in the lowest bands."""
        rows = sums_per_band(regression.share_of_row, regression.band_of_row, len(self.power))
        total, spread = self.power * rows, (self.power * rows) ** 2
        out = {}
        for output in self.rms:
            own = np.array([band[0] == output for band in regression.bands])
            variance = 2 * np.sum((spread * (1 / self.dof + 1 / np.maximum(rows, 1.0)))[own])
            out[output] = float(2 * np.sqrt(variance) / np.sum(total[own]))
        return out


def bands_at(bands: Sequence[tuple[str, float, float]], other: Regression) -> NDArray[np.intp]:
    """The band that holds the frequency of every row of another regression, (n_rows,)."""
    ids = np.zeros(other.n_rows, dtype=np.intp)
    for segment in other.segments:
        own = [index for index, band in enumerate(bands) if band[0] == segment.output]
        edges = [bands[index][1] for index in own[1:]]
        ids[segment.rows] = own[0] + np.searchsorted(edges, segment.band.frequency, side="right")
    return ids


@dataclass(frozen=True)
class ReplicateContrasts:
    """Differences and means of repeated runs, in frequency, with their noise bands and the shares
    of the samples that are compared."""

    difference: Array
    """Helmert contrasts of the repeats of every group and output, (n_differences,)."""
    difference_band: NDArray[np.intp]
    difference_share: Array
    mean: Array
    """Mean of the repeats, scaled to the variance of one run, (n_means,)."""
    mean_band: NDArray[np.intp]
    mean_share: Array


def noise_from_repeats(
    regression: Regression, residual: Array, known: Array, own: Array | None = None
) -> BandNoise:
    """Noise variance from the contrasts of repeated runs (pure error).

    The contrasts of ``known`` (n_rows, k), signatures that may differ between repeats for a
    measured reason, such as the temperature, are projected out where they are noticeable. Those of
    ``own`` (n_rows, m), derivatives by unknowns that every run has for itself, are projected out
    and their degrees of freedom subtracted.
    """
    split = replicate_contrasts(regression, residual)
    count = len(regression.bands)
    dof = sums_per_band(split.difference_share, split.difference_band, count)
    power = _power(regression, split.difference, split.difference_band, dof)
    whole = dof
    taken = _differences(regression, own)
    for _ in range(_REWEIGHTED if known.size or taken.size else 0):
        # The first weights include the known differences: they are computed again without them.
        inverse_sigma = 1 / np.sqrt(_smooth(regression, power, np.maximum(dof, 0.1))[0])
        inverse_sigma = inverse_sigma[split.difference_band]
        basis = _noticeable(regression, known, inverse_sigma)
        if taken.size:
            basis = orthonormal(np.hstack([basis, taken * inverse_sigma[:, None]]))
        whitened = split.difference * inverse_sigma
        left = (whitened - basis @ (basis.T @ whitened)) / inverse_sigma
        dof = whole - sums_per_band(np.sum(basis**2, axis=1), split.difference_band, count)
        power = _power(regression, left, split.difference_band, np.maximum(dof, 1.0))
    power, dof = _smooth(regression, power, np.maximum(dof, 0.1))
    return BandNoise(power, dof, _rms(regression, power), from_repeats=True)


def noise_saturated(
    regression: Regression, residual: Array, *columns: NDArray[np.floating[Any]]
) -> BandNoise:
    """Noise variance of the residual beside all candidate effects (saturated model).

    ``columns`` are derivatives by the unknowns and signatures of all candidates, (n_rows, p) in
    parts, of which only inner products per band are formed: an orthonormal basis would be as large.
    Two-step estimate: the model is fitted with equal weights within an output, and the variance of
    each band is that of its residual. It is not iterated: where a real machine has what no
    candidate explains, reweighting lets the bands with most rows determine the fit, and the
    residual of the others grows until it is above that of no model at all.
    """
    count = len(regression.bands)
    bands = regression.band_of_row
    total = sums_per_band(regression.share_of_row, bands, count)
    power = _even(regression, residual)
    gram, products = _inner_products(regression, residual, columns)
    through = _orthonormalizing(
        np.tensordot(1 / power, gram, axes=1), _fewest_rows(regression) // _ROWS_EACH
    )
    amplitudes = through @ (through.T @ ((1 / power) @ products))
    left, first = residual.copy(), 0
    for part in columns:
        own = amplitudes[first : first + part.shape[1]]
        for segment in regression.segments:
            left[segment.rows] -= part[segment.rows] @ own
        first += part.shape[1]
    leverage = np.sum((gram @ through) * through, axis=(1, 2)) / power
    dof = np.maximum(total - leverage, 1.0)
    power = _power(regression, left, bands, dof)
    # Of a band that the candidates explain whole, the neighbours say how large its variance can be.
    dof = np.where(dof < _LEAST_DOF, np.maximum(dof, _smooth(regression, power, dof)[1]), dof)
    power = _not_below_higher_bands(regression, power, dof)
    return BandNoise(power, dof, _rms(regression, power), from_repeats=False)


def _not_below_higher_bands(regression: Regression, power: Array, dof: Array) -> Array:
    """Variances with those of few degrees of freedom at least the smallest one of the bands above.

    Candidates explain most of what a band of few rows has, by chance too, so that its variance may
    be a hundredth of the noise and its weight decides every fit and cross-validation. The noise of
    instruments does not fall towards low frequencies.
    """
    power = power.copy()
    for first, edges in _edges(regression).values():
        own = np.arange(first, first + len(edges) - 1)
        least = np.minimum.accumulate(power[own][::-1])[::-1]
        above = np.append(least[1:], 0.0)
        few = dof[own] < _FEW_DOF
        power[own] = np.where(few, np.maximum(power[own], above), power[own])
    return power


def _inner_products(
    regression: Regression, residual: Array, columns: Sequence[NDArray[np.floating[Any]]]
) -> tuple[Array, Array]:
    """Inner products of columns per band, (n_bands, p, p), and with the residual, (n_bands, p)."""
    p, count = sum(part.shape[1] for part in columns), len(regression.bands)
    gram, products = np.zeros((count, p, p)), np.zeros((count, p))
    for band, rows in regression.rows_by_band():
        own = np.hstack([part[rows] for part in columns])
        gram[band] += own.T @ own
        products[band] += own.T @ residual[rows]
    return gram, products


def _orthonormalizing(inner: Array, most: int) -> Array:
    """V for which columns of these inner products times V are orthonormal, (p, rank).

    As :func:`~winchkit.diagnosis.regression.projection.orthonormal`, from the inner products alone.
    """
    size = np.sqrt(np.diag(inner))
    present = size > 0
    if not present.any():
        return np.zeros((len(inner), 0))
    scaled = inner[np.ix_(present, present)] / np.outer(size[present], size[present])
    values, vectors = np.linalg.eigh(scaled)
    kept = values > LEAST_EIGENVALUE * values[-1]
    kept[: max(0, len(values) - most)] = False
    out = np.zeros((len(inner), int(np.count_nonzero(kept))))
    out[present] = (vectors[:, kept] / np.sqrt(values[kept])) / size[present, None]
    return out


def replicate_rms(regression: Regression, residual: Array) -> dict[str, float]:
    """Rms of the contrasts of repeats per output, SI; empty without repeats."""
    times = {
        (s.run, s.output): time
        for s, time in zip(regression.segments, regression.in_time(residual), strict=True)
    }
    squares: dict[str, list[Array]] = {}
    for group in regression.replicates:
        for output in regression.outputs:
            if all((run, output) in times for run in group.runs):
                aligned = [
                    times[run, output][rows]
                    for run, rows in zip(group.runs, group.rows, strict=True)
                ]
                squares.setdefault(output, []).append(contrasts(np.array(aligned))[1].ravel() ** 2)
    return {o: float(np.sqrt(np.mean(np.concatenate(parts)))) for o, parts in squares.items()}


def replicate_contrasts(regression: Regression, rows: Array) -> ReplicateContrasts:
    """Contrasts and means of repeats, transformed again on their common samples; empty where no run
    repeats another in any output."""
    times = dict(
        zip(((s.run, s.output) for s in regression.segments), regression.in_time(rows), strict=True)
    )
    edges = _edges(regression)
    nothing, nowhere = np.zeros(0), np.zeros(0, dtype=np.intp)
    parts: tuple[list[Array], list[Array]] = ([nothing], [nothing])
    bands: tuple[list[NDArray[np.intp]], list[NDArray[np.intp]]] = ([nowhere], [nowhere])
    shares: tuple[list[Array], list[Array]] = ([nothing], [nothing])
    share_of = {
        (s.run, s.output): regression.share_of_row[s.rows.start] for s in regression.segments
    }
    bands_of = {(s.run, s.output): s.band for s in regression.segments}
    for group in regression.replicates:
        for output in regression.outputs:
            if any((run, output) not in times for run in group.runs):
                continue
            aligned = np.array(
                [
                    times[run, output][index]
                    for run, index in zip(group.runs, group.rows, strict=True)
                ]
            )
            mean, differences = contrasts(aligned)
            band = replace(bands_of[group.runs[0], output], count=len(mean))
            frequency = band.frequency
            kept = slice(len(frequency))
            first, own = edges[output]
            ids = first + np.searchsorted(own, frequency, side="right") - 1
            spectra = np.asarray(dct(differences, type=2, norm="ortho", axis=1))[:, kept]
            share = float(np.mean([share_of[run, output] for run in group.runs]))
            shares[0].append(np.full(spectra.size, share))
            shares[1].append(np.full(len(frequency), share))
            parts[0].append(spectra.ravel())
            bands[0].append(np.tile(ids, len(spectra)))
            parts[1].append(np.asarray(dct(mean, type=2, norm="ortho"))[kept])
            bands[1].append(ids)
    return ReplicateContrasts(
        np.concatenate(parts[0]),
        np.concatenate(bands[0]),
        np.concatenate(shares[0]),
        np.concatenate(parts[1]),
        np.concatenate(bands[1]),
        np.concatenate(shares[1]),
    )


def _edges(regression: Regression) -> dict[str, tuple[int, Array]]:
    """Number of the first band of every output, and its edges with infinite ends."""
    out: dict[str, tuple[int, Array]] = {}
    for output in regression.outputs:
        own = [i for i, band in enumerate(regression.bands) if band[0] == output]
        inner = [regression.bands[i][1] for i in own[1:]]
        out[output] = own[0], np.array([-np.inf, *inner, np.inf])
    return out


def _differences(regression: Regression, columns: Array | None) -> Array:
    """Contrasts of columns, shape (n_differences, m)."""
    if columns is None or not columns.size:
        return np.zeros((0, 0))
    return np.array([replicate_contrasts(regression, column).difference for column in columns.T]).T


def _noticeable(regression: Regression, known: Array, inverse_sigma: Array) -> Array:
    """Orthonormal directions in which known signatures differ noticeably between repeats."""
    different = []
    for column in known.T:
        split = replicate_contrasts(regression, column)
        whitened = split.difference * inverse_sigma
        mean = split.mean / np.sqrt(_nearest(inverse_sigma, split))
        if whitened @ whitened > _NOTICEABLE * float(mean @ mean):
            different.append(whitened / np.sqrt(whitened @ whitened))
    if not different:
        return np.zeros((len(inverse_sigma), 0))
    left, size, _ = np.linalg.svd(np.array(different).T, full_matrices=False)
    return np.asarray(left[:, :_KNOWN_DIFFERENCES][:, size[:_KNOWN_DIFFERENCES] > 0.1])


def _nearest(inverse_sigma: Array, split: ReplicateContrasts) -> Array:
    """Noise variance of the mean's rows, from the bands of the contrasts."""
    count = int(max(split.mean_band.max(), split.difference_band.max())) + 1
    power = np.ones(count)
    power[split.difference_band] = 1 / inverse_sigma**2
    return power[split.mean_band]


def _fewest_rows(regression: Regression) -> int:
    """Number of rows of the output with the fewest, as far as their samples are compared."""
    return round(min(map(regression.compared_rows, regression.outputs)))


def sums_per_band(values: Array, bands: NDArray[np.intp], count: int) -> Array:
    """Sums of values per noise band, shape (count,)."""
    return np.asarray(np.bincount(bands, weights=values, minlength=count))


def satterthwaite_dof(parts: Array, dof: Array, total: Array | None = None) -> Array:
    """Degrees of freedom (Σ v)²/Σ (v²/ν) of a sum of variances with the degrees of freedom ν.

    ``parts`` are the estimated variances v, not negative, (k,) or (k, n). ``total`` is the whole
    variance where known parts are in it as well, (n,). The result is infinite where nothing is
    estimated.

    References
    ----------
    Satterthwaite, F. E. (1946). An approximate distribution of estimates of variance components.
    Biometrics Bulletin 2, 110-114.
    """
    whole = np.sum(parts, axis=0) if total is None else total
    spread = np.asarray(np.sum(parts**2 / dof, axis=0))
    infinite = np.full_like(spread, np.inf)
    return np.asarray(np.divide(whole**2, spread, out=infinite, where=spread > 0.0))


def _smooth(regression: Regression, power: Array, dof: Array) -> tuple[Array, Array]:
    """Spectrum of every output smoothed over its bands."""
    power, dof = power.copy(), dof.copy()
    for output in regression.outputs:
        own = np.array([band[0] == output for band in regression.bands])
        power[own], dof[own] = smoothed(power[own], dof[own])
    return power, dof


def _even(regression: Regression, residual: Array) -> Array:
    """One variance per output, the same in all its bands."""
    out = np.empty(len(regression.bands))
    for output in regression.outputs:
        parts = [s.rows for s in regression.segments if s.output == output]
        share = regression.compared_rows(output)
        own = [band[0] == output for band in regression.bands]
        out[own] = sum(float(np.sum(residual[rows] ** 2)) for rows in parts) / max(share, 1.0)
    return np.maximum(out, regression.power_floor)


def _power(regression: Regression, values: Array, bands: NDArray[np.intp], dof: Array) -> Array:
    """Mean square per band, at least the floor far below the resolution of instruments."""
    power = sums_per_band(values**2, bands, len(dof)) / np.maximum(dof, 1.0)
    return np.maximum(power, regression.power_floor)


def _rms(regression: Regression, power: Array) -> dict[str, float]:
    """Rms of the noise per output, in time."""
    out = {}
    for output in regression.outputs:
        own = [s for s in regression.segments if s.output == output]
        total = sum(
            float(power[regression.band_of_row[s.rows]] @ regression.share_of_row[s.rows])
            for s in own
        )
        out[output] = float(np.sqrt(total / regression.n_samples(output)))
    return out
