"""Base of all simulated instruments: conversions, zero, tare, faults, status."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from math import isfinite, nan
from typing import ClassVar, NamedTuple

from winchkit.errors import UsageError, suggest
from winchkit.schema.devices.modbus import StatusMeaning
from winchkit.units import convert, dimension_of, factor

_FAST, _SLOW = 0.05, 0.5
"""Time constants of the two averages whose difference indicates motion, s."""


class Converted(NamedTuple):
    """One conversion, in the unit of the device."""

    due: float
    """Time at which it has passed the filter, s."""
    value: float
    """NaN where no measurement was possible."""
    overload: bool = False
    broken: bool = False


class Converter:
    """Samples ``measure`` at the instants of :attr:`next_conversion` only.

    The filter delays and does not smooth, since a lag would be a further effect.
    """

    def __init__(
        self, measure: Callable[[], float], rate: float, filter_delay: float, *, now: float
    ) -> None:
        self.next_conversion = now
        self._measure = measure
        self._step = 1.0 / rate
        self._delay = filter_delay
        self._pipeline: deque[Converted] = deque()
        self._fast: float | None = None
        self._slow: float | None = None
        self._last = nan
        """The last measured value, which a frozen instrument repeats."""

    def deviate(self, share: float) -> None:
        """Make its clock slower by a share of the declared period."""
        self._step *= 1.0 + share

    def convert(self, faults: set[str]) -> None:
        """Sample at the instant ``next_conversion``, and advance this by one period."""
        now = self.next_conversion
        self.next_conversion = now + self._step
        value = self._last if "frozen" in faults else self._measure()
        self._last = value
        broken = "sensor break" in faults or not isfinite(value)
        seen = nan if broken else value
        self._pipeline.append(Converted(now + self._delay, seen, "overload" in faults, broken))
        if not broken:
            self._average(value)

    def take(self, now: float) -> Converted | None:
        """Next conversion that has passed the filter by ``now``, each once."""
        pipeline = self._pipeline
        return pipeline.popleft() if pipeline and pipeline[0].due <= now else None

    @property
    def motion(self) -> float:
        """Difference of a fast and a slow average, in the unit of the device."""
        if self._fast is None or self._slow is None:
            return 0.0
        return abs(self._fast - self._slow)

    def _average(self, value: float) -> None:
        if self._fast is None or self._slow is None:
            self._fast = self._slow = value
            return
        self._fast += (value - self._fast) * min(1.0, self._step / _FAST)
        self._slow += (value - self._slow) * min(1.0, self._step / _SLOW)


class SimulatedInstrument:
    """An instrument with conversions at its own instants, a filter, zero and tare."""

    KIND: ClassVar[str]
    """Name in messages."""
    FAULTS: ClassVar[tuple[str, ...]]
    """Names of its faults; ``recover`` ends them."""

    def __init__(
        self, measure: Callable[[], float], rate: float, filter_delay: float, *, now: float
    ) -> None:
        """``measure`` returns the present quantity in the unit of the device."""
        self.faults: set[str] = set()
        self.stored = 0
        """Number of writes to its EEPROM."""
        self._converter = Converter(measure, rate, filter_delay, now=now)
        self._shown = Converted(now, 0.0)
        self._zero = self._tare = 0.0
        self._net = False

    @property
    def next_conversion(self) -> float:
        """Instant of the next conversion, s."""
        return self._converter.next_conversion

    @property
    def gross(self) -> float:
        """Reading before the tare; NaN where no measurement is possible."""
        return self._shown.value - self._zero

    def deviate(self, share: float) -> None:
        """Make its clock slower by a share of the declared period."""
        self._converter.deviate(share)

    def convert(self) -> None:
        """Sample at the instant ``next_conversion``, and advance this by one period."""
        self._converter.convert(self.faults)

    def show(self, now: float) -> None:
        """Show the conversions that have passed the filter by ``now``."""
        while (shown := self._converter.take(now)) is not None:
            self._shown = shown
            self._showing()

    def _showing(self) -> None:
        """Called when a conversion is shown first; without effect in the base class."""
        return

    def inject(self, kind: str) -> None:
        """Inject a fault; raises UsageError for an unknown kind."""
        self.check_fault(kind)
        if kind == "recover":
            self.faults.clear()
        else:
            self.faults.add(kind)

    @classmethod
    def check_fault(cls, kind: str) -> None:
        """Raise UsageError for an unknown fault."""
        if kind not in cls.FAULTS:
            raise UsageError(
                f"{cls.KIND} has no fault '{kind}'; use one of {', '.join(cls.FAULTS)}"
                + suggest(kind, list(cls.FAULTS))
            )

    def _obey(self, name: str) -> None:
        """Zero or tare the instrument, if it measures."""
        if name == "gross":
            self._tare, self._net = 0.0, False
        elif name == "zero" and not self._shown.broken:
            self._zero = self._shown.value
        elif name == "tare" and not self._shown.broken:
            self._tare, self._net = self.gross, True


def in_unit(unit: str, measure: Callable[[], float], digit: float = 1.0) -> Callable[[], float]:
    """Convert a measurement in SI to multiples of ``digit`` of the device's unit."""
    dimension = dimension_of(unit)
    if dimension is None:
        raise UsageError(f"unknown unit '{unit}' of a simulated instrument")
    size, origin = factor(unit, dimension) * digit, convert(0.0, unit, dimension)
    return lambda: (measure() - origin) / size


def status_word(
    bits: Mapping[StatusMeaning, Sequence[int]], says: Mapping[StatusMeaning, bool]
) -> int:
    """The status word with the first declared bit of each meaning that is true."""
    return sum(1 << numbers[0] for meaning, numbers in bits.items() if says.get(meaning, False))
