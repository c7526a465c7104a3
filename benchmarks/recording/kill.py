"""Kills a recording at a moment, and tells what was lost."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from recording.synthetic import GIVEN, REMEMBERED, TOLD, WINCHES
from winchkit.runs.log import Log
from winchkit.runs.read import read_log
from winchkit.runs.recover import recover

__all__ = ["Killed", "kill_once"]

_START_TIME = 60.0


@dataclass(frozen=True)
class Killed:
    """One recording that was killed."""

    moment: float
    """After its first cycle, s."""
    given: int
    """Cycles that the recorder had been given."""
    lost: float
    """Time from the newest sample in the file to the newest given, s; of the worst winch."""
    held: float
    """How long the recorder had had the oldest lost sample, s. Less than ``lost`` where the machine
    stood still before: what is given late has old times."""
    gaps: int
    """Cycles missing before the newest in the file, all winches."""
    recovered: bool
    """Whether the recovered file holds what the cut one holds, and is closed."""


def kill_once(folder: Path, moment: float, rotate: str | None = None) -> Killed:
    """Record for ``moment`` seconds from the first cycle on, SIGKILL, read, recover."""
    path, told = folder / "killed.mcap", folder / "told"
    for old in folder.glob("killed*"):
        old.unlink()
    told.write_bytes(bytes(TOLD.size + REMEMBERED * GIVEN.size))
    words = [sys.executable, "-m", "recording.synthetic", str(path), str(told)]
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[1])}
    process = subprocess.Popen([*words, *(["--rotate", rotate] if rotate else [])], env=environment)
    try:
        deadline = time.monotonic() + _START_TIME
        while _told(told)[0] == 0:
            if process.poll() is not None or time.monotonic() > deadline:
                raise RuntimeError("the recording did not start")
            time.sleep(2e-3)
        time.sleep(moment)
    finally:
        end = time.monotonic()
        process.send_signal(signal.SIGKILL)
        process.wait()
    log = read_log(path)
    kept = min(len(log.samples[f"/W{n}/drive"]) for n in range(1, WINCHES + 1))
    given, newest = _told(told)
    return Killed(
        moment=moment,
        given=given,
        lost=_lost(log, newest),
        held=end - _given_at(told, kept) if kept < given else 0.0,
        gaps=_gaps(log),
        recovered=_is_recovered(log, path, folder),
    )


def _lost(log: Log, newest: float) -> float:
    """Time from the newest sample of the worst winch to the newest given."""
    opened = log.layout.rule.opened
    times = [log.samples[f"/W{n}/drive"].times for n in range(1, WINCHES + 1)]
    return newest - min(float(item[-1]) if len(item) else opened for item in times)


def _gaps(log: Log) -> int:
    """Cycles that are missing before the newest in the file; cycle n has the motor angle n."""
    missing = 0
    for n in range(1, WINCHES + 1):
        cycles = log.samples[f"/W{n}/drive"].values[:, 0]
        missing += int(cycles[-1]) + 1 - len(cycles) if len(cycles) else 0
        assert np.all(np.diff(cycles) > 0), "cycles come in order, each once"
    return missing


def _is_recovered(log: Log, path: Path, folder: Path) -> bool:
    """Recover every part, and compare."""
    saved = folder / "saved"
    saved.mkdir(exist_ok=True)
    for old in saved.iterdir():
        old.unlink()
    for file in folder.glob("killed*"):
        recover(file, saved / file.name)
    again = read_log(saved / path.name)
    return again.closed is True and all(
        np.array_equal(again.samples[topic].values, samples.values, equal_nan=True)
        for topic, samples in log.samples.items()
    )


def _given_at(told: Path, cycle: int) -> float:
    place = TOLD.size + cycle % REMEMBERED * GIVEN.size
    moment: float = GIVEN.unpack_from(told.read_bytes(), place)[0]
    return moment


def _told(path: Path) -> tuple[int, float]:
    count, now = TOLD.unpack_from(path.read_bytes())
    return count, now
