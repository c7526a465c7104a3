"""Readings of an instrument from its raw values: calibration, quality flags, counts, listeners."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from winchkit.drivers.clock import Clock
from winchkit.drivers.counters import Counters, Tally
from winchkit.drivers.reading import InstrumentReading, Quality


@dataclass(frozen=True, slots=True)
class HostScale:
    """True value from the indicated one, SI: c0 + c1 x + c2 x² ..., less the host's own tare."""

    coefficients: tuple[float, ...] = (0.0, 1.0)
    tare: float = 0.0

    def calibrated(self, indicated: float) -> float:
        """True value for an indicated one."""
        value = 0.0
        for coefficient in reversed(self.coefficients):
            value = value * indicated + coefficient
        return value

    def indicated(self, calibrated: float) -> float:
        """Inverse of :meth:`calibrated`; of the two of a parabola the one on its rising side."""
        c0, c1, *rest = self.coefficients
        c2 = rest[0] if rest else 0.0
        root = math.sqrt(max(0.0, c1 * c1 - 4 * c2 * (c0 - calibrated)))
        return 2 * (calibrated - c0) / (c1 + root)

    def apply(self, value: float, gross: float) -> tuple[float, float]:
        """Net and gross value from the net and gross value that the device indicates.

        Where the device itself has a tare, its net value is the difference of two calibrated
        ones: a calibration that is not a straight line through zero belongs to gross values.
        """
        calibrated = self.calibrated(gross)
        taken_off = self.calibrated(gross - value) if value != gross else 0.0
        return calibrated - taken_off - self.tare, calibrated


_BLOCK = 40
"""Trials in a block. With a noise of one step a block alike throughout has a chance of 4e-16."""
_BLOCKS = 10
"""Noisy blocks, 400 trials, before constant counts are judged: an instrument that is quiet at times
shows it in them (rule of thumb)."""
_NOISE = 1.0
"""Steps of the counts; below it a value in the middle of a step may stand for ever.

A step is the smallest change that was ever seen: of an indicator with a division of 10 it is 10.
"""


@dataclass(slots=True)
class _CountStatistics:
    """Statistics of the counts in one state, at rest or moving."""

    noisy: int = 0
    """Number of blocks, all of them noisy."""
    quiet: bool = False
    """Whether a block was ever constant and ended by itself."""
    step: float = math.inf
    """Smallest change of the counts."""
    squares: float = 0.0
    trials: float = 0.0

    def add(self, change: float, run: float) -> None:
        """Take a change of the counts after ``run`` equal trials."""
        self.step = min(self.step, abs(change))
        self.quiet |= run >= _BLOCK
        self.squares += change * change / 2
        self.trials += run
        if self.trials < _BLOCK:
            return
        if self.squares < (_NOISE * self.step) ** 2 * self.trials:
            self.quiet = True
        else:
            self.noisy += 1
        self.squares = self.trials = 0.0

    def too_long(self, run: float) -> bool:
        """Whether so many equal trials are too many for a live instrument."""
        return not self.quiet and self.noisy >= _BLOCKS and run >= _BLOCK


@dataclass(slots=True)
class FrozenDetector:
    """Detector of frozen counts; takes every count of one instrument.

    Constant counts alone are no evidence: a good cell at rest shows the same number for minutes.
    They are evidence where this instrument, in this state (at rest or moving), has never been
    constant for so long before.
    """

    _states: dict[bool, _CountStatistics] = field(
        default_factory=lambda: {True: _CountStatistics(), False: _CountStatistics()}
    )
    _last: float | None = None
    _run: float = 0.0
    _moving: bool = False

    def frozen(self, counts: float, conversions: float, moving: bool) -> bool:
        """Whether the counts are frozen, with the next ones, ``conversions`` after those before.

        Several readings of one conversion count as one trial, conversions that were not read not
        at all.
        """
        trial = min(1.0, conversions)
        if moving != self._moving:
            self._moving, self._run = moving, 0.0
        if self._last is None or counts != self._last:
            if self._last is not None:
                self._states[moving].add(counts - self._last, self._run + trial)
            self._last, self._run = counts, 0.0
            return False
        self._run += trial
        return self._states[moving].too_long(self._run)


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
        self.latest: InstrumentReading | None = None
        self.listeners: list[Callable[[InstrumentReading], None]] = []
        self.rate = rate
        """Of the device, conversions a second."""
        self._frozen_detector = FrozenDetector()

    def publish(
        self, value: float, gross: float, counts: float, quality: Quality, when: Sampled
    ) -> InstrumentReading:
        """Judge what the device says (SI), publish it as a reading; NaN without a usable value."""
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
        reading = InstrumentReading(
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

    def _frozen(self, counts: float, before: InstrumentReading | None, when: Sampled) -> bool:
        if before is None or not math.isfinite(counts):
            return False
        conversions = (when.t_receive - before.t_receive) * self.rate
        return self._frozen_detector.frozen(counts, conversions, self.moving())


class InstrumentReadings:
    """Readings and counters of an instrument, from its publisher; readable on every thread."""

    publisher: Publisher
    _clock: Clock

    @property
    def latest(self) -> InstrumentReading | None:
        """Newest reading."""
        return self.publisher.latest

    @property
    def listeners(self) -> list[Callable[[InstrumentReading], None]]:
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
