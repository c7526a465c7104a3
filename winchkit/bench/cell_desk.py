"""The slow instruments of a bench by themselves: no drive is touched, none needs to be there."""

from __future__ import annotations

import statistics
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, runtime_checkable

from winchkit.bench.instruments import can_buses, device_of, instruments, refs_of
from winchkit.bench.owner import Ownership
from winchkit.drivers.clock import Clock, MonotonicClock
from winchkit.drivers.host_scale import HostScale
from winchkit.drivers.modbus.line import ModbusLine
from winchkit.drivers.publisher import Publisher, Publishing
from winchkit.drivers.reading import Reading, Sensor
from winchkit.drivers.slow import SlowDevices
from winchkit.errors import NoReply, NotPermitted, UsageError
from winchkit.schema.bench import BenchSpec, DeviceRef
from winchkit.schema.device import DeviceSpec
from winchkit.units import suggest

__all__ = [
    "CellDesk",
    "Steady",
    "cell_desk",
    "full_name",
    "indicated",
    "permanent_commands",
    "steady",
]

_FIRST_READING = 2.0
_POLL = 0.01
_BATCHES = 10
_FEWEST, _ENOUGH = 2, 20
_PATIENCE = 5.0
"""So long it waits for enough readings of a slow instrument, s."""


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
    """Instruments by ``WINCH.ROLE``, e.g. ``A.cell``, and what can be done with them."""

    def __init__(self, spec: BenchSpec, clock: Clock, stack: ExitStack) -> None:
        """Use :func:`cell_desk`."""
        self.spec = spec
        self.clock = clock
        buses = {}
        for name in can_buses(spec):
            from winchkit.drivers.can.bus import CanBus

            buses[name] = CanBus(spec.bus[name], name, clock)
            stack.callback(buses[name].close)
        by_winch, self.lines = instruments(spec, clock, buses)
        self.sensors: Mapping[str, Sensor] = {
            f"{winch}.{role}": sensor
            for winch, roles in by_winch.items()
            for role, sensor in roles.items()
        }
        self._slow = SlowDevices(self.lines)
        stack.callback(self._slow.close)

    def named(self, name: str | None) -> str:
        """The full name of an instrument; a winch stands for its cell. Raises UsageError."""
        return full_name(self.spec, name)

    def ref(self, name: str) -> DeviceRef:
        """How an instrument is wired."""
        return _refs(self.spec)[name]

    def device(self, name: str) -> DeviceSpec:
        """The device file of an instrument."""
        return device_of(self.spec, self.ref(name))

    def line(self, name: str) -> str:
        """The bus that an instrument hangs on."""
        return self.ref(name).bus

    def line_rate(self, name: str) -> float:
        """Readings a second that the line would allow an instrument, were nothing else a limit."""
        sensor = self.sensors[name]
        line = next(item for item in self.lines if sensor in item.sensors)
        return line.room_for(sensor) if isinstance(line, ModbusLine) else float("inf")

    def command(self, name: str, command: str) -> None:
        """Send a command of the device file; raises NoReply, DeviceRefused, NotPermitted."""
        self._slow.command(self.sensors[name], command)

    def store(self, name: str, command: str) -> None:
        """Send a command that writes the device's EEPROM; raises as :meth:`command`."""
        permanent_commands(self, name, command)
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
        assert isinstance(sensor, Publishing), "every instrument of a bench publishes this way"
        return sensor.publisher

    def identify(self, name: str) -> dict[str, float]:
        """What the device says of itself; raises NoReply, DeviceRefused."""
        return self._slow.identify(self.sensors[name])

    def first_reading(self, name: str) -> Reading:
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

    def readings(self, name: str, duration: float) -> list[Reading]:
        """Every reading of the next ``duration`` s, longer where they are few.

        Raises what keeps them from coming.
        """
        self.first_reading(name)
        sensor, taken = self.sensors[name], list[Reading]()
        end = self.clock.now() + duration
        sensor.listeners.append(taken.append)
        try:
            self.clock.sleep(duration)
            while len(taken) < _ENOUGH and self.clock.now() < end + _PATIENCE:
                self.clock.sleep(_POLL)
        finally:
            sensor.listeners.remove(taken.append)
        if len(taken) < _FEWEST:
            raise sensor.problem or NoReply(
                f"{sensor.name}: {len(taken)} readings within {duration + _PATIENCE:g} s"
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
    what = f"no instrument '{name}'" if name else "which instrument?"
    listed = ", ".join(known) or "none"
    raise UsageError(f"{what}; the bench has {listed}{suggest(name or '', known)}")


def permanent_commands(desk: CellDesk, name: str, wanted: str) -> None:
    """Raise NotPermitted where a device has no such command that writes its EEPROM."""
    device = desk.device(name)
    commands = (device.modbus or device.process or device).__dict__.get("command", {})
    lasting = [key for key, item in commands.items() if getattr(item, "permanent", False)]
    if wanted not in lasting:
        listed = ", ".join(lasting) or "none"
        raise NotPermitted(
            f"{name}: '{device.name}' has no command '{wanted}' that writes its EEPROM; "
            f"it has {listed}"
        )


def steady(readings: Sequence[Reading]) -> Steady:
    """The mean of usable readings' net values; raises NotPermitted where too many are none."""
    return _mean(readings, [item.value for item in readings if item.quality.usable])


def indicated(readings: Sequence[Reading], scale: HostScale) -> Steady:
    """The mean of the gross value that the device itself shows, the host's calibration undone."""
    shown = [scale.indicated(item.gross) for item in readings if item.quality.usable]
    return _mean(readings, shown)


def _mean(readings: Sequence[Reading], values: Sequence[float]) -> Steady:
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


@contextmanager
def cell_desk(bench_file: str | Path, clock: Clock | None = None) -> Iterator[CellDesk]:
    """Own a bench for its slow instruments only.

    Raises FileError, ConnectionLost, and NotPermitted where another process owns the bench.
    """
    from winchkit.schema.read import read_bench

    spec = read_bench(bench_file)
    with ExitStack() as stack:
        stack.callback(Ownership(spec).close)
        yield CellDesk(spec, clock or MonotonicClock(), stack)


def _refs(spec: BenchSpec) -> dict[str, DeviceRef]:
    """Instruments as they are wired, by ``WINCH.ROLE``."""
    return {f"{winch}.{role}": ref for (winch, role), ref in refs_of(spec).items()}
