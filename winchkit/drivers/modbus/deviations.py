"""Deviations of a device from Modbus TCP that were seen, and how a bench file accepts each.

A device whose answers do not name the unit or the transaction of their request can be accepted
where it is the only one at its address: the connection carries no other answers. Late answers are
then recognised as on a serial line, by their lengths.
"""

from __future__ import annotations

from winchkit.schema.bench import Deviation

_NOT_TOGETHER: set[Deviation] = {"transaction-0", "answers-twice"}


class Deviations:
    """What one connection after another has shown of a device."""

    def __init__(self, bus: str, accepted: tuple[Deviation, ...]) -> None:
        """``bus`` is the name of the bus; ``accepted`` is its key ``deviations``."""
        self.accepted = frozenset(accepted)
        self._bus = bus
        self._seen: dict[Deviation, str] = {}

    def note(self, deviation: Deviation, words: str) -> bool:
        """Take a deviation, in words; returns whether it is accepted."""
        self._seen[deviation] = words
        return deviation in self.accepted

    @property
    def words(self) -> str:
        """Those that were seen and are not accepted, with what accepts them; empty without one."""
        new = [name for name in self._seen if name not in self.accepted]
        if not new:
            return ""
        said = "the device " + " and ".join(self._seen[name] for name in new)
        wanted = self.accepted | set(new)
        if wanted >= _NOT_TOGETHER:
            return (
                f"{said}; this cannot be accepted: a second answer without its own transaction "
                "cannot be distinguished from the answer to the next request"
            )
        names = ", ".join(f'"{name}"' for name in sorted(wanted))
        return (
            f"{said}; if it is the only device there, deviations = [{names}] in "
            f"[bus.{self._bus}] accepts it"
        )
