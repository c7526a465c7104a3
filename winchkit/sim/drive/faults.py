"""Faults that can be injected into a simulated drive, by name."""

from __future__ import annotations

from dataclasses import dataclass

from winchkit.errors import UsageError, suggest


@dataclass(frozen=True)
class FaultKind:
    """A fault that the drive detects: its error code, and whether a ramp is still possible."""

    code: int
    cuts: bool = False
    """The power is removed at once, independent of 605Eh."""


FAULTS: dict[str, FaultKind] = {
    "over-current": FaultKind(0x2310, cuts=True),
    "over-voltage": FaultKind(0x3210),
    "under-voltage": FaultKind(0x3220),
    "over-temperature": FaultKind(0x4310),
    "torque off": FaultKind(0x5441, cuts=True),
    "encoder": FaultKind(0x7305, cuts=True),
    "following error": FaultKind(0x8611),
}
"""Fault kinds that the drive reports by an error code of CiA 402."""

CONDITIONS = {
    "reboot": "restarts as after power-on",
    "map lost": "loses its PDO mapping without a restart",
    "host lost": "detects a loss of the host's heartbeat, until the next one",
    "heartbeat stop": "sends no heartbeat",
    "tpdo stop": "sends no PDO",
    "slow sdo": "answers every SDO late",
    "sdo abort": "answers every SDO with an abort",
    "emergency storm": "sends an emergency message with every tick",
    "enable input open": "has no torque and cannot be enabled, as with STO",
    "silence": "neither receives nor sends frames, as with a cut cable",
    "recover": "ends the lasting faults",
}
"""Fault kinds without an error code."""


def known(kind: str) -> str:
    """Check the name of a fault kind; raises UsageError with the known names."""
    names = [*FAULTS, *CONDITIONS]
    if kind not in names:
        raise UsageError(
            f"a simulated drive has no fault '{kind}'; use one of {', '.join(names)}"
            + suggest(kind, names)
        )
    return kind
