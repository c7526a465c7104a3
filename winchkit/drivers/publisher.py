"""Readings of an instrument from its raw values: calibration, quality flags, counts, listeners."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from winchkit.drivers.clock import Clock
from winchkit.drivers.counters import Counters, Tally
from winchkit.drivers.frozen_counts import FrozenDetector
from winchkit.drivers.host_scale import HostScale
from winchkit.drivers.reading import Quality, Reading


@dataclass(frozen=True, slots=True)
class Sampled:
    """When a device was asked, when it answered, and within what interval it sampled, s."""

    t_request: float
    t_receive: float
    earliest: float
    latest: float


def _never() -> bool:
    return False


class Publisher:
    """The readings of one instrument; ``publish`` for one thread, everything else to be read."""

    def __init__(self, rate: float) -> None:
        """``rate`` is the device's, in conversions a second."""
        self.tally = Tally()
        self.scale = HostScale()
        """Calibration and tare by the host; may be replaced at any time."""
        self.moving: Callable[[], bool] = _never
        """Whether the winch moves now, so that the counts should move as well."""
        self.latest: Reading | None = None
        self.listeners: list[Callable[[Reading], None]] = []
        self.rate = rate
        """Of the device, conversions a second."""
        self._frozen_detector = FrozenDetector()

    def publish(
        self, value: float, gross: float, counts: float, quality: Quality, when: Sampled
    ) -> Reading:
        """Make a reading of what the device says (SI), judge it and publish it to the listeners.

        Without a value (NaN) or with a flag that makes it unusable it is NaN.
        """
        before = self.latest
        if before is not None and counts == before.raw:
            quality |= Quality.DUPLICATE
            self.tally.duplicates += 1
        if self._frozen(counts, before, when):
            quality |= Quality.FROZEN
        if not math.isfinite(value):
            quality |= Quality.FAULT if quality.usable else Quality.GOOD
        net = total = math.nan
        if quality.usable:
            net, total = self.scale.apply(value, gross)
        reading = Reading(
            net,
            total,
            counts,
            quality,
            when.t_request,
            when.t_receive,
            t_sample=(when.earliest + when.latest) / 2,
            t_uncertainty=(when.latest - when.earliest) / 2,
        )
        self.tally.reading(when.t_receive, when.t_receive - when.t_request)
        self.latest = reading
        for listener in self.listeners:
            listener(reading)
        return reading

    def _frozen(self, counts: float, before: Reading | None, when: Sampled) -> bool:
        if before is None or not math.isfinite(counts):
            return False
        conversions = (when.t_receive - before.t_receive) * self.rate
        return self._frozen_detector.frozen(counts, conversions, self.moving())


class InstrumentReadings:
    """Readings and counters of an instrument, from its publisher; readable on every thread."""

    publisher: Publisher
    _clock: Clock

    @property
    def latest(self) -> Reading | None:
        """Newest reading."""
        return self.publisher.latest

    @property
    def listeners(self) -> list[Callable[[Reading], None]]:
        """Called with every reading, on the thread that receives it."""
        return self.publisher.listeners

    @property
    def host_tare(self) -> float:
        """Value that the host subtracts from the calibrated one, SI."""
        return self.publisher.scale.tare

    @property
    def tally(self) -> Tally:
        """Counts up to now."""
        return self.publisher.tally

    @property
    def counters(self) -> Counters:
        """What happened since the start."""
        return self.tally.counters(self._clock.now())
