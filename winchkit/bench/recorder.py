"""Logs a bench: one row per reading of its slowest instrument, everything at that moment.

A row stands at the reading's estimated moment of sampling; every other channel is interpolated
there between its own two neighbouring samples, and is NaN where it has none. The log begins
when every channel has come, or after half a second.
"""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path
from types import TracebackType
from typing import Self

from winchkit.bench.series import Series
from winchkit.bench.snapshot import BenchSnapshot, Phase
from winchkit.drivers.clock import Clock
from winchkit.drivers.modbus.instrument import Instrument
from winchkit.drivers.modbus.reading import Reading
from winchkit.runs.writer import open_writer

__all__ = ["CHANNELS", "Recorder"]

CHANNELS: dict[str, tuple[str, str]] = {
    "cell": ("tension", "N"),
    "load": ("load", "N"),
    "length": ("cable_length", "m"),
    "temperature": ("temperature", "degC"),
}
"""Channel and unit by role of the sensor."""

_FAST = {"motor_angle": "rad", "motor_velocity": "rad/s", "motor_torque": "N m"}
_FAST_ATTRIBUTES = tuple(_FAST)
_PERIOD = 0.05
_PATIENCE = 0.5
_FAST_GAP = 0.1
_BARE_PERIOD = 0.01
_UNPOWERED = (Phase.DISABLED, Phase.ENABLING, Phase.RESETTING)


class Recorder:
    """Writes one run; a context manager. ``feed`` is called by the control loop."""

    def __init__(
        self,
        path: str | Path,
        sensors: Mapping[str, Mapping[str, Instrument]],
        clock: Clock,
        metadata: Mapping[str, str],
        detach: Callable[[Recorder], None] = lambda _recorder: None,
    ) -> None:
        """Log winches with their sensors by role. Raises FileError where it cannot write."""
        self.rows = 0
        self.path = Path(path)
        self._clock, self._detach = clock, detach
        prefix = {name: f"{name}." if len(sensors) > 1 else "" for name in sensors}
        self._series: dict[str, Series] = {}
        self._fast = {
            name: [self._add(prefix[name] + key, _FAST_GAP) for key in _FAST] for name in sensors
        }
        columns = [("time", "s")]
        columns += [(prefix[name] + key, unit) for name in sensors for key, unit in _FAST.items()]
        self._listening: list[tuple[Instrument, Callable[[Reading], None]]] = []
        self._moments: deque[float] = deque()
        self._base = _slowest(sensors)
        for name, by_role in sensors.items():
            for role, instrument in by_role.items():
                channel, unit = CHANNELS[role]
                columns.append((prefix[name] + channel, unit))
                self._listen(prefix[name] + channel, instrument)
        self._start: float | None = None
        self._opened = clock.now()
        self._last = self._last_time = -math.inf
        self._writer = open_writer(path, columns, metadata)
        self._error: BaseException | None = None
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        self._thread.start()

    def feed(self, snapshot: BenchSnapshot) -> None:
        """Take the drives' newest values; cheap, for the control thread."""
        for name, series in self._fast.items():
            winch = snapshot.winch[name]
            if math.isfinite(winch.time):
                for item, key in zip(series, _FAST_ATTRIBUTES, strict=True):
                    # While the brake holds the rope the drive's torque says nothing of it.
                    unknown = key == "motor_torque" and winch.phase in _UNPOWERED
                    item.append(winch.time, math.nan if unknown else getattr(winch, key))
        if self._base is None and snapshot.time - self._last >= _BARE_PERIOD:
            self._last = snapshot.time
            self._moments.append(snapshot.time)

    def check(self) -> None:
        """Raise what has ended the writing, e.g. FileError for a full disk."""
        if self._error is not None:
            raise self._error

    def close(self) -> None:
        """Write what is pending and finish the file; raises what the writing raised."""
        self._detach(self)
        for instrument, listener in self._listening:
            instrument.listeners.remove(listener)
        self._listening.clear()
        self._stopping.set()
        self._thread.join()
        self._writer.close()
        if self._error is not None:
            error, self._error = self._error, None
            raise error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def _add(self, column: str, max_gap: float) -> Series:
        return self._series.setdefault(column, Series(max_gap))

    def _listen(self, column: str, instrument: Instrument) -> None:
        series = self._add(column, max(_FAST_GAP, 5 * instrument.period))
        base = instrument is self._base

        def take(reading: Reading) -> None:
            series.append(reading.t_sample, reading.value)
            if base:
                self._moments.append(reading.t_sample)

        self._listening.append((instrument, take))
        instrument.listeners.append(take)

    def _run(self) -> None:
        try:
            while not self._stopping.wait(_PERIOD):
                self._write_rows()
            self._write_rows(final=True)
        except BaseException as error:  # noqa: BLE001 - kept, and raised by close
            self._error = error

    def _write_rows(self, final: bool = False) -> None:
        """Write every row whose channels are complete; one that has gone silent is not awaited.

        At the end the rows that still wait for a channel are dropped.
        """
        now = self._clock.now()
        awaited = [item for item in self._series.values() if item.reaches(now - _PATIENCE)]
        while self._moments:
            moment = self._moments[0]
            if not all(item.reaches(moment) for item in awaited):
                break
            self._moments.popleft()
            self._write_row(moment)
        if final:
            self._moments.clear()
        self._writer.flush()

    def _write_row(self, moment: float) -> None:
        if moment <= self._last_time or moment < self._opened:
            return
        row = {column: series.at(moment) for column, series in self._series.items()}
        if self._start is None:
            slow = {k: v for k, v in row.items() if not k.endswith("motor_torque")}
            if moment < self._opened + _PATIENCE and any(map(math.isnan, slow.values())):
                return
            self._start = moment
        self._last_time = moment
        self._writer.append({"time": moment - self._start, **row})
        self.rows += 1


def _slowest(sensors: Mapping[str, Mapping[str, Instrument]]) -> Instrument | None:
    """The instrument that sets the rows: the slowest load cell, else length, else load."""
    for role in ("cell", "length", "load"):
        there = [by_role[role] for by_role in sensors.values() if role in by_role]
        if there:
            return max(there, key=lambda item: item.period)
    return None
