"""The interpolation period 60C2h, which has to equal the SYNC period."""

from __future__ import annotations

from collections.abc import Iterator

from winchkit.drivers.can.canopen.node import SdoNode
from winchkit.errors import DeviceRefused, NotPermitted

_EXPONENTS = (-3, -4, -5, -6, -2)
"""Of ten in 60C2h:2, ms first as most drives accept it; beside them 0.1 ms, 0.01 ms, µs and 10 ms.
"""
_LARGEST = 255
"""60C2h:1 is an UNSIGNED8."""
_EXACT = 1e-6
"""Relative: decimals of a bench file are not exact in binary (1e-16), and a cycle of 1 s is not
1e-6 off."""


def set_cycle(node: SdoNode, cycle: float) -> float | None:
    """Make 60C2h equal to ``cycle`` (s); returns what the drive keeps, None without a 60C2h.

    A drive may take only some of the exponents by which the same period can be written; that which
    it has is tried first, as it may be read-only. Raises
    NotPermitted when it takes none of them, NoReply.
    """
    kept = _kept(node)
    if kept is None or abs(kept - cycle) <= _EXACT * cycle:
        return kept
    refusals = []
    present = node.read(0x60C2, 2)
    for exponent, value in sorted(_ways(cycle), key=lambda way: way[0] != present):
        try:
            if exponent != node.read(0x60C2, 2):
                node.write_verified(0x60C2, 2, exponent)
            node.write_verified(0x60C2, 1, value)
        except DeviceRefused as error:
            refusals.append(str(error))
            continue
        return _kept(node)
    kept = _kept(node)
    reason = refusals[-1] if refusals else "a whole number of µs, of 0.1 ms up to 25.5 ms, or of ms"
    raise NotPermitted(
        f"{node.place(0x60C2, 1)} cannot hold a cycle of {cycle * 1e3:g} ms, the drive keeps "
        f"{(kept or 0) * 1e3:g} ms: {reason}; set another `cycle` in the bench file"
    )


def _ways(cycle: float) -> Iterator[tuple[int, int]]:
    for exponent in _EXPONENTS:
        value = cycle / 10.0**exponent
        if 1 <= round(value) <= _LARGEST and abs(value - round(value)) <= _EXACT * value:
            yield exponent, round(value)


def _kept(node: SdoNode) -> float | None:
    value, exponent = node.read_if_there(0x60C2, 1), node.read_if_there(0x60C2, 2)
    if value is None or exponent is None:
        return None
    return float(value * 10.0**exponent)
