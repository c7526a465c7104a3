"""All slow devices on one asyncio thread, each line served by a coroutine of its own."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine, Sequence
from typing import Any, Protocol, TypeVar, runtime_checkable

from winchkit.drivers.clock import Clock, MonotonicClock
from winchkit.drivers.reading import Sensor
from winchkit.drivers.scheduling import event_loop_of, event_of, thread_of
from winchkit.errors import NoReply

T = TypeVar("T")
_COMMAND_TIME = 5.0
"""s: a tare or a write into an EEPROM takes up to some seconds, and waits for the reads before it.
"""


class SlowLine(Protocol):
    """One line with its instruments; its coroutines run on the thread of the slow devices."""

    name: str

    @property
    def sensors(self) -> Sequence[Sensor]:
        """Its instruments."""

    async def serve(self) -> None:
        """Keep the readings of its sensors new until cancelled or closed."""

    async def command(self, sensor: Sensor, name: str) -> None:
        """Send a command of the device file, e.g. ``tare``, and wait for the device's answer."""

    def close(self) -> None:
        """Close the port; ``serve`` returns soon."""


@runtime_checkable
class Identifying(Protocol):
    """A line whose instruments can be identified."""

    async def identify(self, sensor: Sensor) -> dict[str, float]:
        """Serial number and the like, by name."""


class SlowDevices:
    """Serves every line from one thread until closed."""

    def __init__(self, lines: Sequence[SlowLine], clock: Clock | None = None) -> None:
        """Start serving at once; devices that are silent are tried again."""
        self._clock = clock or MonotonicClock()
        self._loop = event_loop_of(self._clock)
        self._lines = tuple(lines)
        self._line_of = {id(sensor): line for line in lines for sensor in line.sensors}
        self._failure: Exception | None = None
        self._thread = thread_of(self._clock, self._run, "slow-devices")
        self._thread.start()

    def close(self) -> None:
        """Stop and close the lines; raises what ended the serving before, if anything."""
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(timeout=3.0)
        if self._failure is not None:
            raise self._failure

    def command(self, sensor: Sensor, name: str) -> None:
        """Send a command between two readings and wait for its answer; raises ConnectionLost."""
        self._wait(self._line_of[id(sensor)].command(sensor, name), sensor)

    def identify(self, sensor: Sensor) -> dict[str, float]:
        """Identity of an instrument, e.g. its serial number; raises as ``command``."""
        line = self._line_of[id(sensor)]
        if not isinstance(line, Identifying):
            return {}
        return self._wait(line.identify(sensor), sensor)

    def _wait(self, coroutine: Coroutine[Any, Any, T], sensor: Sensor) -> T:
        future = asyncio.run_coroutine_threadsafe(coroutine, self._loop)
        answered = event_of(self._clock)
        future.add_done_callback(lambda _: answered.set())
        if not answered.wait(_COMMAND_TIME):
            future.cancel()
            raise NoReply(
                f"{sensor.name}: no answer to a command within {_COMMAND_TIME:g} s; "
                "look at the line's other devices"
            )
        return future.result()

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        tasks = [self._loop.create_task(line.serve()) for line in self._lines]
        self._loop.run_forever()
        for line in self._lines:
            line.close()
        for task in tasks:
            task.cancel()
        ended = self._loop.run_until_complete(asyncio.gather(*tasks, return_exceptions=True))
        self._failure = next((item for item in ended if isinstance(item, Exception)), None)
        self._loop.run_until_complete(asyncio.sleep(0.01))
        self._loop.close()
