"""One instrument on a line: polls it, turns answers into readings, counts what goes wrong."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from winchkit.drivers.clock import Clock
from winchkit.drivers.modbus.client import ModbusClient
from winchkit.drivers.modbus.reading import Decoder, Quality, Reading
from winchkit.errors import ConnectionLost, DeviceRefused, NoReply, NotPermitted
from winchkit.schema.device import DeviceSpec

__all__ = ["Counters", "Instrument"]

_RETRY = 0.5
_LATE = 0.02


@dataclass(frozen=True, slots=True)
class Counters:
    """What happened since the start."""

    readings: int = 0
    duplicates: int = 0
    timeouts: int = 0
    exceptions: int = 0


class Instrument:
    """A Modbus instrument. ``latest`` is what other threads read."""

    def __init__(self, name: str, device: DeviceSpec, unit: int, rate: float, clock: Clock) -> None:
        """Poll at ``rate`` readings a second, or at the device's own rate where that is lower."""
        self.name = name
        self.unit = unit
        self.decoder = Decoder(device)
        self.period = 1.0 / min(rate, self.decoder.spec.rate)
        self.latest: Reading | None = None
        self.status = 0
        self.counters = Counters()
        self.problem: ConnectionLost | None = None
        """Why there is no new reading, while there is none."""
        self.due = clock.now()
        self.listeners: list[Callable[[Reading], None]] = []
        self._clock = clock
        self._longer = False
        self._fixed = self.decoder.spec.read.fixed

    @property
    def max_age(self) -> float:
        """A reading older than this is stale, s."""
        return max(0.25, 5 * self.period)

    async def poll(self, client: ModbusClient, timeout: float) -> None:
        """Take one reading; a failure is counted, kept as ``problem`` and retried later."""
        spec = self.decoder.spec
        silence = max(0.0, spec.longest_reply - timeout)
        self._longer = not self._longer and not self._fixed
        count = spec.read.count + self._longer
        t_request = self._clock.now()
        self.due = max(self.due + self.period, t_request)
        try:
            registers = await client.read(self.unit, spec.read, count, silence)
        except DeviceRefused as error:
            self._refused(error)
        except NoReply as error:
            self.counters = replace(self.counters, timeouts=self.counters.timeouts + 1)
            self._failed(error)
        except ConnectionLost as error:
            self._failed(error)
        else:
            self._publish(registers, t_request, self._clock.now())

    async def command(self, client: ModbusClient, name: str, timeout: float) -> None:
        """Send a command of the device file, e.g. ``tare``."""
        spec = self.decoder.spec
        command = spec.command.get(name)
        if command is None:
            known = ", ".join(spec.command) or "none"
            raise NotPermitted(f"{self.name} has no command '{name}'; its device file has {known}")
        silence = max(0.0, spec.longest_reply - timeout)
        await client.write(self.unit, command.register, command.value, silence)

    def _refused(self, error: DeviceRefused) -> None:
        if self._longer:
            # A device that ends where its block ends: no alternating lengths for this one.
            self._fixed = True
            return
        self.counters = replace(self.counters, exceptions=self.counters.exceptions + 1)
        self._failed(error)

    def _failed(self, error: ConnectionLost) -> None:
        self.problem = error
        self.due = self._clock.now() + _RETRY

    def _publish(self, registers: list[int], t_request: float, t_receive: float) -> None:
        spec = self.decoder.spec
        decoded = self.decoder.decode(registers)
        quality, self.status = decoded.quality, decoded.status
        duplicate = self.latest is not None and decoded.counts == self.latest.raw
        if duplicate:
            quality |= Quality.DUPLICATE
        if t_receive - t_request > _LATE:
            quality |= Quality.LATE
        conversion = 1.0 / spec.rate
        reading = Reading(
            value=decoded.value,
            gross=decoded.gross,
            raw=decoded.counts,
            quality=quality,
            t_request=t_request,
            t_receive=t_receive,
            t_sample=(t_request + t_receive - conversion) / 2 - spec.filter_delay,
            t_uncertainty=(t_receive - t_request + conversion) / 2,
        )
        self.counters = replace(
            self.counters,
            readings=self.counters.readings + 1,
            duplicates=self.counters.duplicates + duplicate,
        )
        self.problem = None
        self.latest = reading
        for listener in self.listeners:
            listener(reading)
