"""Logs a bench: every channel with its own time stamps (MCAP), or rows (CSV), by the file's name.

In rows, one stands at each reading's estimated moment of sampling of the slowest instrument; every
other channel is interpolated there between its own two neighbouring samples, and is NaN where it
has none. While that instrument is silent rows are at the samples of the others. The log begins when
every channel has come, or after half a second. A log by channels is brought to the same rows when
it is read (``winchkit.runs.align``).

The control thread only hands over its snapshot. One thread writes, another waits for the disk; what
goes wrong there ends the log, never the control loop.
"""

from __future__ import annotations

import dataclasses
import logging
import math
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from winchkit.bench.control.snapshot import BenchSnapshot
from winchkit.bench.recording.feed import CHANNELS, TARED, Feed, Silences
from winchkit.drivers.clock import Clock
from winchkit.drivers.reading import Sensor
from winchkit.drivers.scheduling import event_of, thread_of
from winchkit.errors import Fault, FileError
from winchkit.runs.recording.open_log import open_log
from winchkit.runs.recording.rotation import Rotation
from winchkit.runs.recording.sync import Syncer

if TYPE_CHECKING:
    from winchkit.bench.tracker import TrackerReceiver


class OwnedLog:
    """What stations with and without drives do with their log."""

    _recorder: Recorder | None = None

    def log_rows(self) -> int:
        """Rows written so far; raises the error that has ended the writing."""
        if self._recorder is None:
            return 0
        self._recorder.check()
        return self._recorder.rows

    def end_log(self) -> int:
        """End the log and return its rows."""
        recorder, self._recorder = self._recorder, None
        if recorder is None:
            return 0
        recorder.close()
        return recorder.rows


_LOGGER = logging.getLogger(__name__)
_PERIOD = {".csv": 0.05}
_CHUNK_PERIOD = 0.075
"""A quarter of what a log by channels may lose, s: each chunk is whole on its own, and a machine
that is busy elsewhere may let it wait for two of them more."""
_COUNT_PERIOD = 1.0
"""s: counters change slowly, and a log that was moved is noticed within it."""
_DEVICE_TARE = {
    True: "the device shows net",
    False: "the device shows gross",
    None: "the device does not say whether it is tared",
}


class Recorder:
    """Writes one log; a context manager. ``feed`` is called by the control loop."""

    def __init__(
        self,
        path: str | Path,
        sensors: Mapping[str, Mapping[str, Sensor]],
        clock: Clock,
        metadata: Mapping[str, str],
        detach: Callable[[Recorder], None] = lambda _recorder: None,
        *,
        tracker: TrackerReceiver | None = None,
        rotation: Rotation | None = None,
        replace: bool = False,
        has_drives: bool = True,
    ) -> None:
        """Log winches with their sensors by role, and the robot's tracker.

        Without drives ``feed`` is not called. ``replace`` removes an earlier log of that name.
        Raises FileError where it cannot write, UsageError where that would be another log's loss.
        """
        self._sensors, self._clock, self._detach = sensors, clock, detach
        self._offset = _utc_less(clock)
        self._feed = Feed(sensors, clock.now(), tracker, has_drives=has_drives)
        layout = dataclasses.replace(self._feed.layout, clock_offset=self._offset)
        self._about = {**metadata, "clock_offset": f"{self._offset / 1e9:.6f} s"}
        self._tares = tares_in_force(sensors)
        about = {**self._about, **_tare_metadata(self._tares)}
        self._silences = Silences(layout)
        self._syncer = Syncer()
        try:
            self._log = open_log(
                Path(path), layout, about, rotation, self._syncer.watch, replace=replace
            )
        except BaseException:
            self._feed.close()
            self._syncer.close()
            raise
        self.path = self._log.parts[0]
        """Of its first part."""
        self._said: tuple[Any, ...] = ()
        self._told = False
        self._counted = -math.inf
        self.failure: BaseException | None = None
        """What has ended the log before it was closed, e.g. FileError for a full disk."""
        self._stopping = event_of(clock)
        self._period = _PERIOD.get(self.path.suffix.lower(), _CHUNK_PERIOD)
        self._thread = thread_of(clock, self._run, "recorder")
        self._thread.start()

    @property
    def rows(self) -> int:
        """Rows of the run so far."""
        return self._log.rows

    @property
    def parts(self) -> tuple[Path, ...]:
        """Files so far, the last one being written."""
        return tuple(self._log.parts)

    def feed(self, snapshot: BenchSnapshot) -> None:
        """Take a cycle; cheap, for the control thread. Raises what has ended the writing.

        Parameters
        ----------
        snapshot : BenchSnapshot
            Of the newest cycle.
        """
        self.check()
        self._feed.give(snapshot)

    def check(self) -> None:
        """Raise what has ended the writing, e.g. FileError for a full disk."""
        if self.failure is not None:
            raise self.failure

    def counters(self) -> dict[str, dict[str, Any]]:
        """Counts so far, by instrument (``A.cell``) and of the log itself."""
        return {
            **counters_of(self._sensors),
            "log": {
                "rows": self.rows,
                "parts": len(self.parts),
                "drops": self._feed.lost,
                "silent": self._silences.counted(),
            },
        }

    def close(self) -> None:
        """Write pending samples and finish the file; raises the error of the writing."""
        self._detach(self)
        self._feed.close()
        self._stopping.set()
        self._thread.join()
        if self.failure is not None and not self._told:
            self._told = True
            raise self.failure

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _run(self) -> None:
        try:
            while not self._stopping.wait(self._period):
                self._write()
            self._write()
            self._log.require_in_place()
            self._log.close({"clock_offset": f"{_utc_less(self._clock) / 1e9:.6f} s"})
        except BaseException as error:  # noqa: BLE001 - kept, and raised by check and close
            self.failure = error
            self._feed.abandon()
            with suppress(FileError):  # the disk has refused already
                self._log.close({"ended": str(error)})
            _LOGGER.error("the log has ended, the bench goes on: %s", error)  # noqa: TRY400
        finally:
            self._syncer.close()

    def _write(self) -> None:
        if self._syncer.error is not None:
            message = f"the disk refuses it: {self._syncer.error.strerror}"
            raise FileError(Fault(message, str(self.parts[-1])))
        now = self._clock.now()
        pieces, snapshots = self._feed.take()
        self._silences.note(pieces, now)
        self._note_tares()
        for snapshot in snapshots:
            self._note_changes(snapshot)
        if now - self._counted >= _COUNT_PERIOD:
            self._counted = now
            self._log.require_in_place()
            self._log.count(now, self.counters())
        self._log.write(pieces, now)

    def _note_changes(self, snapshot: BenchSnapshot) -> None:
        """Write an event for each change; the words of a warning may have numbers of each cycle."""
        winches = [(w.phase, w.state, w.commander) for w in snapshot.winch.values()]
        warned = [(warning.kind, warning.winch) for warning in snapshot.warnings]
        # The tares are another dictionary only where one has changed.
        said = (winches, snapshot.tripped, snapshot.overruns, warned, self._tares)
        if said == self._said:
            return
        self._said = said
        self._log.add_event(
            snapshot.time,
            {
                "winch": {
                    name: {
                        "phase": item.phase.value,
                        "state": item.state,
                        "commander": item.commander,
                    }
                    for name, item in snapshot.winch.items()
                },
                "tripped": [str(trip) for trip in snapshot.tripped],
                "overruns": snapshot.overruns,
                "warnings": [str(warning) for warning in snapshot.warnings],
                "tare": self._tares,
            },
        )

    def _note_tares(self) -> None:
        """Keep tares that have changed for the next event and the metadata of the next part."""
        tares = tares_in_force(self._sensors)
        if tares != self._tares:
            self._tares = tares
            self._log.metadata = {**self._about, **_tare_metadata(tares)}


def counters_of(sensors: Mapping[str, Mapping[str, Sensor]]) -> dict[str, dict[str, Any]]:
    """Counts so far, by instrument (``A.cell``)."""
    return {
        f"{name}.{role}": dataclasses.asdict(instrument.counters)
        for name, by_role in sensors.items()
        for role, instrument in by_role.items()
    }


def tares_in_force(sensors: Mapping[str, Mapping[str, Sensor]]) -> dict[str, str]:
    """Each instrument's tare (``A.cell``) in words: the host's, and what the device says."""
    return {
        f"{name}.{role}": f"{instrument.host_tare:.9g} {CHANNELS[role][1]} of the host, "
        + _DEVICE_TARE[instrument.tared]
        for name, by_role in sensors.items()
        for role, instrument in by_role.items()
        if role in TARED
    }


def _tare_metadata(tares: Mapping[str, str]) -> dict[str, str]:
    return {f"tare.{name}": text for name, text in tares.items()}


def _utc_less(clock: Clock) -> int:
    """UTC less the bench's clock, ns: of several tries the one that was least disturbed."""
    tries = []
    for _ in range(5):
        before, utc, after = clock.now(), time.time_ns(), clock.now()
        tries.append((after - before, utc - round((before + after) / 2 * 1e9)))
    return min(tries)[1]
