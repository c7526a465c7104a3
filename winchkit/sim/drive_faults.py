"""What can be made to go wrong with a simulated drive, by name."""

from __future__ import annotations

from winchkit.errors import UsageError
from winchkit.units import suggest

__all__ = ["CONDITIONS", "ERROR_CODES", "known"]

ERROR_CODES: dict[str, int] = {
    "over-current": 0x2310,
    "over-voltage": 0x3210,
    "under-voltage": 0x3220,
    "over-temperature": 0x4310,
    "torque off": 0x5441,
    "encoder": 0x7305,
    "following error": 0x8611,
}
"""Fault kinds that the drive reports by an error code of CiA 402."""

CONDITIONS = ("reboot", "heartbeat stop", "silence", "recover")
"""Fault kinds that need no code; ``recover`` ends the lasting ones."""


def known(kind: str) -> str:
    """Check the name of a fault kind; raises UsageError naming those there are."""
    names = [*ERROR_CODES, *CONDITIONS]
    if kind not in names:
        raise UsageError(
            f"a simulated drive has no fault '{kind}'; use one of {', '.join(names)}"
            + suggest(kind, names)
        )
    return kind
