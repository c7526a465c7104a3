"""Noise taken out of measured inputs before an effect's change is evaluated on them.

With a noisy load, rope elasticity is mistaken for hysteresis, because a Dahl loop happens to
denoise the tension. So each effect's change is evaluated on the part of the load that follows
the rope's acceleration and, of the rest, on what repeats agree on; the prediction itself keeps
the load as measured.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct, idct

from winchkit.diagnosis.spectrum import band_edges

__all__ = ["agreed", "contrasts", "quiet"]

Array = NDArray[np.float64]
_FLOOR_SHARE = 1 / 3


def contrasts(aligned: Array) -> tuple[Array, Array]:
    """Mean part and differences of repeats, each with the variance of one run's noise.

    ``aligned`` (m, n) → (n,) the sum over √m, and (m − 1, n) Helmert contrasts, orthogonal to it
    and to each other.
    """
    m = len(aligned)
    mean = aligned.sum(axis=0) / np.sqrt(m)
    differences = [
        (aligned[:j].sum(axis=0) - j * aligned[j]) / np.sqrt(j * (j + 1)) for j in range(1, m)
    ]
    return mean, np.array(differences).reshape(m - 1, aligned.shape[1])


def quiet(signal: Array) -> Array:
    """A signal without white noise: Wiener gain per band over the floor of its top third."""
    full = np.asarray(dct(signal, type=2, norm="ortho"))
    power = full**2
    top = power[int(len(power) * (1 - _FLOOR_SHARE)) :]
    floor = float(np.mean(top)) if len(top) else 0.0
    return _gained(full, power, np.full_like(power, floor))


def agreed(signals: Sequence[Array], rows: Sequence[NDArray[np.intp]]) -> list[Array]:
    """What its repeats know of each signal, on its own samples; zero where they do not overlap.

    A signal's own noise takes no part: it is in what the signal predicts as well, and what is
    left of it would be taken for a lag or a loop that denoises it.
    """
    if len(signals) < 2:
        return [quiet(signal) for signal in signals]
    aligned = np.array([signal[index] for signal, index in zip(signals, rows, strict=True)])
    _, differences = contrasts(aligned)
    noise = np.mean(np.asarray(dct(differences, type=2, norm="ortho", axis=1)) ** 2, axis=0)
    out = []
    for own, (signal, index) in enumerate(zip(signals, rows, strict=True)):
        others, _ = contrasts(np.delete(aligned, own, axis=0))
        full = np.asarray(dct(others, type=2, norm="ortho"))
        shared = np.zeros_like(signal)
        shared[index] = _gained(full, full**2, noise) / np.sqrt(len(signals) - 1)
        out.append(shared)
    return out


def _gained(full: Array, power: Array, noise: Array) -> Array:
    """Inverse transform with each band scaled by the share of its power that is not noise."""
    edges = band_edges(np.arange(len(full), dtype=float), 1)
    gain = np.ones_like(full)
    for low, high in pairwise(edges):
        inside = slice(
            0 if low == -np.inf else int(np.ceil(low)),
            len(full) if high == np.inf else int(np.ceil(high)),
        )
        total = float(np.sum(power[inside]))
        share = 1 - float(np.sum(noise[inside])) / total if total > 0 else 0.0
        # A ratio of two sums of n squares varies by 2/√n: below two of that, nothing is there.
        deviation = 2 / np.sqrt(inside.stop - inside.start)
        gain[inside] = share if share > min(2 * deviation, 0.9) else 0.0
    gain[0] = 1.0
    return np.asarray(idct(full * gain, type=2, norm="ortho"))
