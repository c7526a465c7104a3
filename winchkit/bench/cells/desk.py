"""The slow instruments of a bench by name: readings and commands."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from winchkit.bench.cells.instruments import device_of, refs_of
from winchkit.drivers.clock import Clock
from winchkit.drivers.publisher import HostScale, InstrumentReadings, Publisher
from winchkit.drivers.reading import InstrumentReading, Sensor
from winchkit.drivers.slow import SlowDevices, SlowLine
from winchkit.errors import NoReply, NotPermitted, UsageError, suggest
from winchkit.schema.bench import BenchSpec, DeviceRef
from winchkit.schema.devices.device import DeviceSpec

_FIRST_READING = 2.0
"""s: several time-outs and the connection of a slow line (rule of thumb)."""
_POLL = 0.01
"""s: as fast as the fastest usual cell is read."""
_BATCHES = 10
"""The mean's standard error by batch means holds for correlated noise; ten batches give it with 24
% (1/√(2·9))."""
_FEWEST, _ENOUGH = 2, 20
"""Readings: two have a standard deviation; 20 have a mean with a quarter of their noise."""
_TIMEOUT = 5.0
"""So long it waits for enough readings of a slow instrument, s."""


@runtime_checkable
class Shared(Protocol):
    """A line that shares its time out among its instruments."""

    def room_for(self, sensor: Sensor) -> float:
        """Readings a second that there is room for."""

    def time_of(self, sensor: Sensor) -> float:
        """How long a reading keeps the line busy, s."""


@runtime_checkable
class Noting(Protocol):
    """A line that may have a note about its port or its device."""

    @property
    def note(self) -> str:
        """Remark on the port or the device; empty where there is none."""


@runtime_checkable
class Storing(Protocol):
    """An instrument that can be let write its EEPROM."""

    may_store: bool


@dataclass(frozen=True)
class Steady:
    """A value that was watched for a while, N (or the instrument's own SI unit)."""

    mean: float
    std: float
    """Of the mean, from batches, so that slow noise counts in full."""
    noise: float
    """Standard deviation of single readings."""
    readings: int


class CellDesk:
    """Instruments by ``WINCH.ROLE``, e.g. ``A.cell``, with their operations."""

    def __init__(
        self,
        spec: BenchSpec,
        clock: Clock,
        lines: Sequence[SlowLine],
        slow: SlowDevices,
        sensors: Mapping[str, Mapping[str, Sensor]],
        *,
        permit: Callable[[str], None] = lambda _name: None,
    ) -> None:
        """Take open instruments; ``permit`` raises where a zero or tare may not be changed now."""
        self.spec, self.clock, self.lines, self.permit = spec, clock, lines, permit
        self.sensors: Mapping[str, Sensor] = {
            f"{winch}.{role}": sensor
            for winch, roles in sensors.items()
            for role, sensor in roles.items()
        }
        self._slow = slow

    def ref(self, name: str) -> DeviceRef:
        """How an instrument is wired."""
        return _refs(self.spec)[name]

    def device(self, name: str) -> DeviceSpec:
        """The device file of an instrument."""
        return device_of(self.spec, self.ref(name))

    def line(self, name: str) -> str:
        """The bus that an instrument hangs on."""
        return self.ref(name).bus

    def sharing(self, name: str) -> int:
        """How many instruments share its line."""
        return sum(self.line(other) == self.line(name) for other in self.sensors)

    def line_rate(self, name: str) -> float | None:
        """Readings a second that its line has room for; None on a line that is not polled."""
        line = self._line_of(name)
        return line.room_for(self.sensors[name]) if isinstance(line, Shared) else None

    def line_time(self, name: str) -> float | None:
        """How long one of its readings keeps the line busy, s, as it was measured."""
        line = self._line_of(name)
        return line.time_of(self.sensors[name]) if isinstance(line, Shared) else None

    def line_note(self, name: str) -> str:
        """Remark on its port, e.g. on an adapter that holds bytes back."""
        line = self._line_of(name)
        return line.note if isinstance(line, Noting) else ""

    def _line_of(self, name: str) -> SlowLine:
        sensor = self.sensors[name]
        return next(item for item in self.lines if any(one is sensor for one in item.sensors))

    def command(self, name: str, command: str) -> None:
        """Send a command of the device file; raises NoReply, DeviceRefused, NotPermitted."""
        self._slow.command(self.sensors[name], command)

    def store(self, name: str, command: str) -> None:
        """Send a command that writes the device's EEPROM; raises as :meth:`command`."""
        check_permanent(self.spec, name, command)
        sensor = self.sensors[name]
        if isinstance(sensor, Storing):
            sensor.may_store = True
            try:
                self._slow.command(sensor, command)
            finally:
                sensor.may_store = False

    def publisher(self, name: str) -> Publisher:
        """What turns the device's values into readings, with the host's calibration and tare."""
        sensor = self.sensors[name]
        assert isinstance(sensor, InstrumentReadings), "as every instrument of a bench"
        return sensor.publisher

    def identify(self, name: str) -> dict[str, float]:
        """Identity of the device; raises NoReply, DeviceRefused."""
        return self._slow.identify(self.sensors[name])

    def first_reading(self, name: str) -> InstrumentReading:
        """Wait for a reading; raises what keeps it from coming."""
        sensor = self.sensors[name]
        deadline = self.clock.now() + _FIRST_READING
        while sensor.latest is None:
            if self.clock.now() > deadline:
                raise sensor.problem or NoReply(
                    f"{sensor.name}: no reading within {_FIRST_READING:g} s; check its line"
                )
            self.clock.sleep(_POLL)
        return sensor.latest

    def readings(self, name: str, duration: float) -> list[InstrumentReading]:
        """Every reading of the next ``duration`` s, longer where they are few; raises NoReply."""
        self.first_reading(name)
        sensor, taken = self.sensors[name], list[InstrumentReading]()
        end = self.clock.now() + duration
        sensor.listeners.append(taken.append)
        try:
            self.clock.sleep(duration)
            while len(taken) < _ENOUGH and self.clock.now() < end + _TIMEOUT:
                self.clock.sleep(_POLL)
        finally:
            sensor.listeners.remove(taken.append)
        if len(taken) < _FEWEST:
            raise sensor.problem or NoReply(
                f"{sensor.name}: {len(taken)} readings within {duration + _TIMEOUT:g} s"
            )
        return taken


def full_name(spec: BenchSpec, name: str | None) -> str:
    """``A.cell`` for ``A``, or for None where it is the only cell; raises UsageError."""
    known = list(_refs(spec))
    cells = [item for item in known if item.endswith(".cell")]
    if name is None and len(cells) == 1:
        return cells[0]
    if name is not None:
        for candidate in (name, f"{name}.cell"):
            if candidate in known:
                return candidate
    what = f"no instrument '{name}'" if name else "no instrument is given"
    listed = ", ".join(known) or "none"
    raise UsageError(f"{what}; the bench has {listed}{suggest(name or '', known)}")


def check_permanent(spec: BenchSpec, name: str, wanted: str) -> None:
    """Raise NotPermitted where a device has no such command that writes its EEPROM."""
    device = device_of(spec, _refs(spec)[name])
    lasting = [command for command, permanent in device.commands.items() if permanent]
    if wanted not in lasting:
        listed = ", ".join(lasting) or "none"
        raise NotPermitted(
            f"{name}: '{device.name}' has no command '{wanted}' that writes its EEPROM; "
            f"it has {listed}" + (f": --command {lasting[0]}" if lasting else "")
        )


def steady(readings: Sequence[InstrumentReading]) -> Steady:
    """The mean of usable readings' net values; raises NotPermitted where too many are none."""
    return _mean(readings, [item.value for item in readings if item.quality.usable])


def indicated(readings: Sequence[InstrumentReading], scale: HostScale) -> Steady:
    """The mean of the gross value that the device itself shows, the host's calibration undone."""
    shown = [scale.indicated(item.gross) for item in readings if item.quality.usable]
    return _mean(readings, shown)


def _mean(readings: Sequence[InstrumentReading], values: Sequence[float]) -> Steady:
    if len(values) < max(_BATCHES, len(readings) // 2):
        flags = {str(item.quality) for item in readings if not item.quality.usable}
        raise NotPermitted(
            f"{len(values)} usable readings of {len(readings)}"
            + (f"; the others are {' / '.join(sorted(flags))}" if flags else "")
            + "; look at `winchkit cell diagnose`"
        )
    size = len(values) // _BATCHES
    batches = [statistics.fmean(values[k * size : (k + 1) * size]) for k in range(_BATCHES)]
    return Steady(
        statistics.fmean(values),
        statistics.stdev(batches) / _BATCHES**0.5,
        statistics.pstdev(values),
        len(values),
    )


def _refs(spec: BenchSpec) -> dict[str, DeviceRef]:
    """Instruments as they are wired, by ``WINCH.ROLE``."""
    return {f"{winch}.{role}": ref for (winch, role), ref in refs_of(spec).items()}
