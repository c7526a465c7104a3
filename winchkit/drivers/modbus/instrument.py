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
_QUICK_RETRIES = 2
_STALE_TIMEOUTS = 2
"""One lost answer is no reason to stop a winch, two are."""
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

    def __init__(
        self,
        name: str,
        device: DeviceSpec,
        unit: int,
        clock: Clock,
        *,
        rate: float,
        timeout: float,
    ) -> None:
        """Poll at ``rate`` readings a second, or at the device's own rate where that is lower.

        ``timeout`` (s) is the line's for one answer.
        """
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
        self.max_age = max(_STALE_TIMEOUTS * timeout, 5 * self.period)
        """A reading older than this is stale, s."""
        self._clock = clock
        self._silence = max(0.0, self.decoder.spec.longest_reply - timeout)
        self._failures = 0
        self._longer = False
        self._fixed = self.decoder.spec.read.fixed

    async def poll(self, client: ModbusClient) -> None:
        """Take one reading; a failure is counted, kept as ``problem`` and retried.

        One that fails again and again is asked less often, so that the others on its line keep
        their rates.
        """
        spec = self.decoder.spec
        self._longer = not self._longer and not self._fixed
        count = spec.read.count + self._longer
        t_request = self._clock.now()
        self.due = max(self.due + self.period, t_request)
        try:
            registers = await client.read(self.unit, spec.read, count, self._silence)
        except DeviceRefused as error:
            self._refused(error)
        except NoReply as error:
            self.counters = replace(self.counters, timeouts=self.counters.timeouts + 1)
            self._failed(error)
        except ConnectionLost as error:
            self._failed(error)
        else:
            self._publish(registers, t_request, self._clock.now())

    async def command(self, client: ModbusClient, name: str) -> None:
        """Send a command of the device file, e.g. ``tare``."""
        spec = self.decoder.spec
        command = spec.command.get(name)
        if command is None:
            known = ", ".join(spec.command) or "none"
            raise NotPermitted(f"{self.name} has no command '{name}'; its device file has {known}")
        await client.write(self.unit, command.register, command.value, self._silence)

    def _refused(self, error: DeviceRefused) -> None:
        if self._longer:
            # A device that ends where its block ends: no alternating lengths for this one.
            self._fixed = True
            return
        self.counters = replace(self.counters, exceptions=self.counters.exceptions + 1)
        self._failed(error)

    def _failed(self, error: ConnectionLost) -> None:
        self.problem = error
        self._failures += 1
        self.due = self._clock.now() + (_RETRY if self._failures > _QUICK_RETRIES else 0.0)

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
        self.problem, self._failures = None, 0
        self.latest = reading
        for listener in self.listeners:
            listener(reading)
