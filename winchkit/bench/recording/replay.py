"""A log as a live source: the pictures of a bench, one after another, for the same callbacks."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.bench.control.snapshot import BenchSnapshot, Phase, Trip, WinchSnapshot
from winchkit.drivers.clock import Clock, MonotonicClock
from winchkit.errors import Fault, RunError
from winchkit.runs.layout import SourceSignal
from winchkit.runs.log import Log
from winchkit.runs.read import read_log

_LEAST_WAIT = 2e-3
"""s: shorter waits are longer than ordered on most systems, and the next one makes up for them."""
_MEASURED = ("motor_angle", "motor_velocity", "motor_torque", "tension", "load", "temperature")
_SHOWN = ("cable_length", "cable_speed", "length_known")
_PHASES = {phase.value: phase for phase in Phase}
_UNTOLD: Mapping[str, Any] = {}


class Replay:
    """Plays a log to the callbacks that a bench has too; speeds that they return move nothing."""

    def __init__(self, log: Log, clock: Clock) -> None:
        """Raises RunError for a log without a winch in it."""
        self._clock = clock
        self._callbacks: list[Callable[[BenchSnapshot], object]] = []
        self._events = sorted(log.events, key=lambda note: note.time)
        self._fields: dict[str, dict[str, tuple[Array, Array]]] = {}
        for source in log.layout.sources:
            samples = log.samples[source.topic]
            for n, signal in enumerate(source.signals):
                place = _place(source.topic, signal)
                if place is not None:
                    winch, name = place
                    values = (samples.times, samples.values[:, n])
                    self._fields.setdefault(winch, {})[name] = values
        self.moments = self._drive_moments()
        """When there is a picture: the samples of the drives, s."""
        if not len(self.moments):
            raise RunError(Fault("holds no winch's motor angle to replay", log.path))
        self._start = log.layout.rule.start or float(self.moments[0])

    @property
    def winches(self) -> tuple[str, ...]:
        """Names of the winches; ``A`` for a run that names none."""
        return tuple(self._fields)

    def on_cycle(self, callback: Callable[[BenchSnapshot], object]) -> Callable[[], None]:
        """Call a function with every picture; returns a function that takes it off again."""
        self._callbacks.append(callback)
        return lambda: self._callbacks.remove(callback)

    def snapshots(self) -> Iterator[BenchSnapshot]:
        """Every picture, as fast as it is asked for; each value is the newest at its moment."""
        held = {
            winch: {name: self._held(*values) for name, values in fields.items()}
            for winch, fields in self._fields.items()
        }
        event = 0
        told = self._events[0].value if self._events else _UNTOLD
        for index, moment in enumerate(self.moments.tolist()):
            while event < len(self._events) and self._events[event].time <= moment:
                told, event = self._events[event].value, event + 1
            winches = {
                name: _picture(
                    moment,
                    {key: values[index] for key, values in fields.items()},
                    told.get("winch", _UNTOLD).get(name, _UNTOLD),
                )
                for name, fields in held.items()
            }
            trips = (Trip("replayed", "", text, latches=True) for text in told.get("tripped", ()))
            yield BenchSnapshot(
                moment - self._start,
                index + 1,
                winches,
                tuple(trips),
                overruns=told.get("overruns", 0),
            )

    def play(self, *, fast: bool = False) -> int:
        """Call the callbacks at the log's pace, or as fast as they return; returns the pictures."""
        begin, count = self._clock.now(), 0
        for snapshot, moment in zip(self.snapshots(), self.moments.tolist(), strict=True):
            left = moment - self.moments[0] - (self._clock.now() - begin)
            if not fast and left > _LEAST_WAIT:
                self._clock.sleep(left)
            for callback in list(self._callbacks):
                callback(snapshot)
            count += 1
        return count

    def _drive_moments(self) -> Array:
        times = [own["motor_angle"][0] for own in self._fields.values() if "motor_angle" in own]
        return np.unique(np.concatenate(times)) if times else np.empty(0)

    def _held(self, times: Array, values: Array) -> list[float]:
        """The newest value at every moment; NaN before the first."""
        if not len(times):
            return [math.nan] * len(self.moments)
        order = np.argsort(times, kind="stable")
        last = np.searchsorted(times[order], self.moments, side="right") - 1
        found = np.where(last >= 0, values[order][np.maximum(last, 0)], np.nan)
        return list(found.tolist())


def open_replay(path: str | Path, clock: Clock | None = None) -> Replay:
    """Open a log or a run for playing.

    Parameters
    ----------
    path : str or Path
        CSV or MCAP.
    clock : Clock, optional
        By which the samples are timed; by default that of the computer.

    Returns
    -------
    Replay
        At its beginning.

    Raises
    ------
    RunError
        For an invalid file.
    """
    return Replay(read_log(path), clock or MonotonicClock())


def _place(topic: str, signal: SourceSignal) -> tuple[str, str] | None:
    """Winch and field of a picture to which a signal belongs; None for none."""
    of_topic = topic.strip("/").rpartition("/")[0] or "A"
    if not signal.column:
        return (of_topic, signal.name) if signal.name in _SHOWN else None
    winch, _, channel = signal.column.rpartition(".")
    if channel == "cable_length":
        channel = "length"
    elif channel not in _MEASURED:
        return None
    return winch or of_topic, channel


def _picture(moment: float, values: Mapping[str, float], told: Mapping[str, Any]) -> WinchSnapshot:
    phase, state = told.get("phase"), told.get("state", "replayed")
    known = dict.fromkeys((*_MEASURED, *_SHOWN, "length"), math.nan) | dict(values)
    return WinchSnapshot(
        phase=_PHASES.get(str(phase), Phase.DISABLED),
        state=str(state),
        time=moment,
        motor_angle=known["motor_angle"],
        motor_velocity=known["motor_velocity"],
        motor_torque=known["motor_torque"],
        cable_length=known["cable_length"],
        cable_speed=known["cable_speed"],
        tension=known["tension"],
        load=known["load"],
        load_tension=known["load"] if math.isfinite(known["load"]) else known["tension"],
        length=known["length"],
        temperature=known["temperature"],
        length_known=known["length_known"] != 0.0,
        commander=str(told.get("commander", "")),
    )
