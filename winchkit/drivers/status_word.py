"""Bits of an instrument's status word, and the quality flags that follow from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from winchkit.drivers.reading import Quality
from winchkit.schema.devices.modbus import StatusMeaning

_FLAGS: Mapping[StatusMeaning, Quality] = {
    "overload": Quality.OVERLOAD,
    "underload": Quality.UNDERLOAD,
    "fault": Quality.FAULT,
    "unstable": Quality.UNSTABLE,
    "busy": Quality.STALE,
}


class StatusWord:
    """Bits by meaning, as a device file declares them; several bits may mean the same."""

    def __init__(self, bits: Mapping[StatusMeaning, Sequence[int]]) -> None:
        self._masks = {meaning: sum(1 << bit for bit in many) for meaning, many in bits.items()}

    def has(self, meaning: StatusMeaning, status: int) -> bool:
        """Whether a status says ``meaning``, e.g. that a tare is active."""
        return bool(status & self._masks.get(meaning, 0))

    def quality(self, status: int) -> Quality:
        """Flags of a reading by its status alone."""
        quality = Quality.GOOD
        for meaning, flag in _FLAGS.items():
            if self.has(meaning, status):
                quality |= flag
        if self._denies("stable", status):
            quality |= Quality.UNSTABLE
        if self._denies("valid", status) and quality.usable:
            quality |= Quality.FAULT
        return quality

    def _denies(self, meaning: StatusMeaning, status: int) -> bool:
        """Whether the device could say something good of the reading, and does not."""
        return meaning in self._masks and not self.has(meaning, status)
