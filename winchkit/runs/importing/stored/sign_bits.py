"""Signed whole numbers that a logger stored without their sign.

A negative value of a field of n bits is 2ⁿ less its magnitude (two's complement), or 2ⁿ⁻¹ more
(sign and magnitude, as some servos send it). Both leave a gap in the values: small ones, and others
just above 2ⁿ⁻¹ or just below 2ⁿ.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from winchkit.arrays import Array
from winchkit.runs.importing.stored.numbers import wrap_of
from winchkit.schema.mapping import MAGNITUDE, TWOS

_BITS = range(8, 33)
"""Widths of counters: a byte to a double word."""
_WORDS = (16, 24, 32)
"""Widths of the fields of a bus, which small values of either sign do not reach by chance."""
_BYTE = 8
_DECIMALS = range(7)
"""Decimals that a logger may have given the numbers of a field."""
_FEWEST = 8
"""Least number of different values on each side of the gap, of a field of any width."""
_EXTENT = 0.75
"""Share of half the range of the field that the values may fill."""
_ALIKE = 5.0
"""Largest ratio of the magnitudes of both signs; two levels of operation are seldom as alike."""
_SMALL = 0.3
"""Share of the largest magnitude below which each sign has values: a signal passes zero."""
_TINY = 0.05
"""Share of half the range of a word that a signal fills whose few values are near both ends."""


@dataclass(frozen=True)
class LostSign:
    """How the numbers of a column without a sign are stored."""

    bits: int
    kind: str
    """``two's complement`` or ``sign and magnitude``."""
    modulus: float
    """Number of values of the field, in the numbers of the file."""
    text: str
    """Values on both sides of the gap."""

    @property
    def stored(self) -> str:
        """As in a mapping."""
        return f"{self.kind} {self.modulus:.12g}"


def lost_sign(values: Array, *, is_small: bool = False) -> LostSign | None:
    """How a column (n,) is stored whose sign seems to be lost; None for another one.

    ``is_small``: for certain, as per cent of a rated torque are, so that all may be negative.
    """
    known = np.unique(values[np.isfinite(values)])
    if len(known) < 2 or known[0] < 0:
        return None
    for decimals in _DECIMALS:
        scale = 10.0**decimals
        whole = np.round(known * scale)
        if np.allclose(whole, known * scale, rtol=0, atol=1e-6):
            return _of_whole(whole, scale, is_small=is_small)
    return None


def sign_by_jumps(values: Array) -> LostSign | None:
    """The same of a signal that fills the range of its field, by its jumps from end to end."""
    known = values[np.isfinite(values)]
    if not len(known) or np.min(known) < 0:
        return None
    scales = (10.0**decimals for decimals in _DECIMALS)
    scale = next((s for s in scales if np.allclose(np.round(known * s), known * s, atol=1e-6)), 0.0)
    if not scale:
        return None
    for bits in _WORDS:
        modulus = 2.0**bits / scale
        wrap = wrap_of(values, (modulus,))
        if wrap is not None and wrap.modulus == modulus:
            text = f"{np.min(known):.12g} to {np.max(known):.12g}, with {wrap.count} jumps between"
            return LostSign(bits, TWOS, modulus, text)
    return None


def _of_whole(known: Array, scale: float, *, is_small: bool) -> LostSign | None:
    """Of sorted different whole numbers."""
    for bits in _BITS if scale == 1 else _WORDS:
        half = 2.0 ** (bits - 1)
        low, high = known[known < half], known[known >= half]
        if known[-1] >= 2 * half or not len(high):
            continue
        for kind, negative in ((MAGNITUDE, high - half), (TWOS, 2 * half - high[::-1])):
            # A byte is that of a share of both signs; a force may have two levels 250 apart.
            is_byte = bits == _BYTE and is_small and len(low) > 0
            is_word = (bits in _WORDS or is_byte) and negative[-1] < _TINY * half
            if is_word and not len(low):
                is_found = is_small
            elif is_word and low[-1] < _TINY * half:
                is_found = True
            else:
                is_found = _is_one_signal(low, negative, half)
            if is_found:
                ends = [
                    f"{part[0] / scale:.12g} to {part[-1] / scale:.12g}"
                    for part in (low, high)
                    if len(part)
                ]
                return LostSign(bits, kind, 2 * half / scale, " and of ".join(ends))
    return None


def _is_one_signal(positive: Array, negative: Array, half: float) -> bool:
    """Whether magnitudes of both signs are of one signal that passes zero; sorted arrays."""
    if len(positive) < _FEWEST or len(negative) < _FEWEST:
        return False
    largest = positive[-1], negative[-1]
    return bool(
        max(largest) < _EXTENT * half
        and max(largest) < _ALIKE * min(largest)
        and positive[0] < _SMALL * largest[0]
        and negative[0] < _SMALL * largest[1]
    )
