"""Samples of a running bench for its recorder, in pieces by source, at little cost to its loop."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, fields
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from winchkit.bench.control.snapshot import BenchSnapshot, Phase
from winchkit.drivers.reading import InstrumentReading, Sensor
from winchkit.runs.align import longest_wait
from winchkit.runs.layout import Layout, RowRule, SignalSource, SourceSamples, SourceSignal

if TYPE_CHECKING:
    from winchkit.bench.tracker import TrackedPose, TrackerReceiver


@dataclass
class _Silence:
    """Intervals without a sample that are longer than rows wait for one, of one source."""

    times: int = 0
    longest: float = 0.0
    """s."""
    now: float = 0.0
    """s; 0 while samples come."""


class Silences:
    """Notes when the samples of a source cease, and when they come again."""

    def __init__(self, layout: Layout) -> None:
        """Every source is awaited from the beginning of the log on."""
        self._longest = {source.topic: longest_wait(source) for source in layout.sources}
        self._last = dict.fromkeys(self._longest, layout.rule.opened)
        self._silences = {topic: _Silence() for topic in self._longest}

    def note(self, pieces: Mapping[str, SourceSamples], now: float) -> None:
        """Take what has arrived until ``now`` (s)."""
        for topic, silence in self._silences.items():
            arrived = pieces[topic].received if topic in pieces else np.empty(0)
            longest, last = self._longest[topic], self._last[topic]
            if len(arrived):
                steps = np.diff(arrived, prepend=last)
                over = steps[steps > longest]
                # The first of them may be the one that was under way.
                silence.times += len(over) - bool(silence.now and len(over) and over[0] == steps[0])
                silence.longest = max(silence.longest, *over, 0.0)
                self._last[topic] = last = max(last, float(arrived[-1]))
            silent = now - last if now - last > longest else 0.0
            silence.times += bool(silent and (len(arrived) or not silence.now))
            silence.now, silence.longest = silent, max(silence.longest, silent)

    def counted(self) -> dict[str, dict[str, Any]]:
        """Number, longest and present silence of each source (``A.cell``) that had one."""
        return {
            topic[1:].replace("/", "."): asdict(silence)
            for topic, silence in self._silences.items()
            if silence.times
        }


CHANNELS: dict[str, tuple[str, str]] = {
    "cell": ("tension", "N"),
    "load": ("load", "N"),
    "length": ("cable_length", "m"),
    "temperature": ("temperature", "degC"),
}
"""Channel and unit by role of the sensor."""
TARED = ("cell", "load", "length")
"""Roles whose instruments can be tared; a row holds the gross value beside the net one."""

_DRIVE = {"motor_angle": "rad", "motor_velocity": "rad/s", "motor_torque": "N m"}
_OF_PROFILE = {"cable_length": "m", "cable_speed": "m/s", "length_known": "1"}
"""Of the cable, from the motor angle; a log keeps what the bench showed, a run does not. Where the
length is not known (0) it is NaN."""
_of_drive = attrgetter("time", *_DRIVE, *_OF_PROFILE, "phase")
_TORQUE = 1 + list(_DRIVE).index("motor_torque")
_TIMES = ("t_request", "t_receive", "t_sample", "t_uncertainty")
_NUMBERS = tuple(
    item.name
    for item in fields(InstrumentReading)
    if item.type == "float" and item.name not in _TIMES[1:3]
)
_of_reading = attrgetter("t_sample", "t_receive", *_NUMBERS)
_FAST_GAP = 0.1
"""s: values of a drive or tracker further apart are not interpolated; 25 cycles at the usual 4 ms.
"""
_BARE_PERIOD = 0.0095
"""Rows of a bench without instruments: a hundredth of a second, less the jitter of a cycle."""
_JITTER = 0.95
"""Share of an instrument's period: two samples of a drive are nearly as far apart as two readings.
"""
_TRACKER = SignalSource(
    "/robot/tracker",
    (
        *(SourceSignal(axis, "m", f"tracker_{axis}") for axis in "xyz"),
        *(SourceSignal(part, "1", f"tracker_{part}") for part in ("qw", "qx", "qy", "qz")),
        SourceSignal("tracker_time", "s"),
    ),
    _FAST_GAP,
)
"""Poses in the tracker's frame at the times of their arrival; its own times are not in a run."""
_UNPOWERED = (Phase.DISABLED, Phase.ENABLING, Phase.RESETTING)
_WAITING = 65_536
"""Cycles, and readings of an instrument, that may wait for a slow disk: a minute at 1 kHz."""


class Feed:
    """Collects snapshots and readings; one thread gives, another takes."""

    def __init__(
        self,
        sensors: Mapping[str, Mapping[str, Sensor]],
        opened: float,
        tracker: TrackerReceiver | None = None,
        *,
        has_drives: bool = True,
    ) -> None:
        """Listen to winches with their sensors by role, and a tracker, from ``opened`` (s) on."""
        prefix = {name: f"{name}." if len(sensors) > 1 else "" for name in sensors}
        self.lost = 0
        """Cycles and readings that were dropped because they were not taken in time."""
        self._snapshots: deque[BenchSnapshot] = deque(maxlen=_WAITING)
        self._readings: dict[str, deque[InstrumentReading]] = {}
        self._listening: list[tuple[Sensor, Callable[[InstrumentReading], None]]] = []
        self._drives = {name: f"/{name}/drive" for name in sensors if has_drives}
        self._sampled = dict.fromkeys(self._drives, -math.inf)
        """Time of the drive's last sample that was taken, s."""
        sources = [_drive_source(topic, prefix[name]) for name, topic in self._drives.items()]
        topics: dict[int, str] = {}
        base = _slowest(sensors)
        for name, by_role in sensors.items():
            for role, instrument in by_role.items():
                topic = f"/{name}/{role}"
                topics.setdefault(id(instrument), topic)
                sources.append(_sensor_source(topic, prefix[name], role, instrument))
                self._listen(topic, instrument)
        if base is None and not has_drives:
            base = max(
                (one for by_role in sensors.values() for one in by_role.values()),
                key=lambda item: item.period,
            )
        rule = (
            RowRule(next(iter(self._drives.values())), opened, _BARE_PERIOD)
            if base is None
            else RowRule(topics[id(base)], opened, spacing=_JITTER * base.period)
        )
        self._tracker, self._tracked = tracker, opened
        if tracker is not None:
            sources.append(_TRACKER)
        self.layout = Layout(tuple(sources), rule)

    def give(self, snapshot: BenchSnapshot) -> None:
        """Take a cycle; for the control thread."""
        if len(self._snapshots) == _WAITING:
            self.lost += 1
        self._snapshots.append(snapshot)

    def take(self) -> tuple[dict[str, SourceSamples], list[BenchSnapshot]]:
        """New samples since the last call, by topic, and the snapshots themselves."""
        snapshots = [self._snapshots.popleft() for _ in range(len(self._snapshots))]
        pieces = {}
        for name, topic in self._drives.items():
            rows = [_of_drive(snapshot.winch[name]) for snapshot in snapshots]
            pieces[topic] = _drive_samples(rows, self._sampled[name])
            self._sampled[name] = max(self._sampled[name], *pieces[topic].received, -math.inf)
        for topic, waiting in self._readings.items():
            pieces[topic] = _samples([waiting.popleft() for _ in range(len(waiting))])
        poses = [] if self._tracker is None else self._tracker.since(self._tracked)
        if poses:
            self._tracked = poses[-1].received
            pieces[_TRACKER.topic] = _tracked(poses)
        return {topic: samples for topic, samples in pieces.items() if len(samples)}, snapshots

    def close(self) -> None:
        """Stop listening; the recorder's own thread may come to it at the same time."""
        with suppress(IndexError):
            while True:
                instrument, listener = self._listening.pop()
                instrument.listeners.remove(listener)

    def abandon(self) -> None:
        """Stop listening and drop the remaining samples."""
        self.close()
        self._snapshots.clear()
        for waiting in self._readings.values():
            waiting.clear()

    def _listen(self, topic: str, instrument: Sensor) -> None:
        waiting = self._readings.setdefault(topic, deque(maxlen=_WAITING))

        def take(reading: InstrumentReading) -> None:
            if len(waiting) == _WAITING:
                self.lost += 1
            waiting.append(reading)

        self._listening.append((instrument, take))
        instrument.listeners.append(take)


def _drive_source(topic: str, prefix: str) -> SignalSource:
    measured = [SourceSignal(name, unit, prefix + name) for name, unit in _DRIVE.items()]
    shown = [SourceSignal(name, unit) for name, unit in _OF_PROFILE.items()]
    return SignalSource(topic, (*measured, *shown), _FAST_GAP)


def _sensor_source(topic: str, prefix: str, role: str, instrument: Sensor) -> SignalSource:
    channel, unit = CHANNELS[role]
    units = {"value": unit, "gross": unit, "raw": "1"}
    columns = {"value": prefix + channel}
    if role in TARED:
        columns["gross"] = f"{prefix}{channel}_gross"
    signals = [
        SourceSignal(
            channel if name == "value" else name,
            units.get(name, "s" if name in _TIMES else unit),
            columns.get(name, ""),
        )
        for name in _NUMBERS
    ]
    return SignalSource(
        topic, (*signals, SourceSignal("quality", "1")), max(_FAST_GAP, 5 * instrument.period)
    )


def _drive_samples(rows: list[tuple[Any, ...]], after: float) -> SourceSamples:
    """Values of a drive after a time (s); each SYNC's once."""
    if not rows:
        return SourceSamples.joined([], len(_DRIVE) + len(_OF_PROFILE))
    unpowered = [row[-1] in _UNPOWERED for row in rows]
    table = np.array([row[:-1] for row in rows])
    # While the brake holds the cable the drive's torque says nothing of it.
    table[unpowered, _TORQUE] = math.nan
    known = table[:, 0] > after
    known[1:] &= table[1:, 0] != table[:-1, 0]
    table = table[known]
    return SourceSamples(table[:, 0], table[:, 0], table[:, 1:])


def _tracked(poses: list[TrackedPose]) -> SourceSamples:
    received = np.array([pose.received for pose in poses])
    values = np.array([(*pose.position, *pose.quaternion, pose.time) for pose in poses])
    return SourceSamples(received, received, values)


def _samples(readings: list[InstrumentReading]) -> SourceSamples:
    if not readings:
        return SourceSamples.joined([], len(_NUMBERS) + 1)
    table = np.array([(*_of_reading(item), item.quality.value) for item in readings], dtype=float)
    return SourceSamples(table[:, 0], table[:, 1], table[:, 2:])


def _slowest(sensors: Mapping[str, Mapping[str, Sensor]]) -> Sensor | None:
    """The instrument that sets the rows: the slowest load cell, else length, else load."""
    for role in ("cell", "length", "load"):
        there = [by_role[role] for by_role in sensors.values() if role in by_role]
        if there:
            return max(there, key=lambda item: item.period)
    return None
