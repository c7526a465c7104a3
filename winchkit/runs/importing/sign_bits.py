"""Signed whole numbers that a logger stored without their sign.

A negative value of a field of n bits is 2ⁿ less its magnitude (two's complement), or 2ⁿ⁻¹ more
(sign and magnitude, as some servos send it). Both leave a gap in the values: small ones, and others
just above 2ⁿ⁻¹ or just below 2ⁿ.
"""

from __future__ import annotations

import numpy as np

from winchkit.arrays import Array

__all__ = ["lost_sign"]

_BITS = range(8, 33)
"""Widths of counters: a byte to a double word."""
_FEWEST = 8
"""Least number of different values on each side of the gap."""
_EXTENT = 0.75
"""Share of half the range of the field that the values may fill."""
_ALIKE = 5.0
"""Largest ratio of the magnitudes of both signs; two levels of operation are seldom as alike."""
_SMALL = 0.3
"""Share of the largest magnitude below which each sign has values: a signal passes zero."""


def lost_sign(name: str, values: Array) -> str:
    """Description of a column whose sign seems to be lost; empty for another one.

    Parameters
    ----------
    name : str
        Column, for the text.
    values : (n,) array
        Numbers as in the file; NaN where missing.

    Returns
    -------
    str
        How many bits the field has, and how to restore the sign.
    """
    known = np.unique(values[np.isfinite(values)])
    if len(known) < 2 * _FEWEST or known[0] < 0 or not np.all(known == np.round(known)):
        return ""
    for bits in _BITS:
        half = 2.0 ** (bits - 1)
        low, high = known[known < half], known[known >= half]
        if known[-1] >= 2 * half or len(low) < _FEWEST or len(high) < _FEWEST:
            continue
        if _is_one_signal(low, high - half, half):
            how = f"sign and magnitude: {half:.0f} - value where it is {half:.0f} or more"
        elif _is_one_signal(low, 2 * half - high[::-1], half):
            how = f"two's complement: value - {2 * half:.0f} where it is {half:.0f} or more"
        else:
            continue
        return (
            f"'{name}' has values of {low[0]:.0f} to {low[-1]:.0f} and of {high[0]:.0f} to "
            f"{high[-1]:.0f}, as signed numbers of {bits} bits stored without a sign ({how}): "
            "restore the sign in the file, or say that there is none"
        )
    return ""


def _is_one_signal(positive: Array, negative: Array, half: float) -> bool:
    """Whether magnitudes of both signs are of one signal that passes zero; sorted arrays."""
    largest = positive[-1], negative[-1]
    return bool(
        max(largest) < _EXTENT * half
        and max(largest) < _ALIKE * min(largest)
        and positive[0] < _SMALL * largest[0]
        and negative[0] < _SMALL * largest[1]
    )
