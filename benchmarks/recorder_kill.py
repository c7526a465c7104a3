"""What a log loses when its process is killed; prints JSON, exits 1 when it is too much.

``python benchmarks/recorder_kill.py --times 200``: eight winches at 1 kHz and their load cells at
100 Hz recorded to MCAP (or ``--format csv``), SIGKILL at a random moment up to two seconds. The
promise: at most 0.3 s lost, no sample missing before, ``recover`` makes a whole file with the same
samples, and an independent reader (the package ``mcap``, Python's csv) finds as many as winchkit.
On a machine that stands still at times, what is lost can be more than the recorder ``held``.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import random
import signal
import struct
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from mcap.exceptions import McapError
from mcap.records import Channel, Message
from mcap.stream_reader import StreamReader

from recording.synthetic import CYCLE, EVERY, GIVEN, REMEMBERED, TOLD, WINCHES
from winchkit.errors import RunError
from winchkit.runs.log import Log
from winchkit.runs.read import read_log, read_run
from winchkit.runs.recording.rotation import parts_beside
from winchkit.runs.recover import recover

LIMIT = 0.3
LONGEST = 2.0
_START_TIME = 60.0
_LEAST_ROWS = 2
"""A run has at least so many."""


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
    whole: bool
    """Whether reading gives what an independent reader finds whole: mcap's, or Python's csv."""


def kill_once(
    folder: Path, moment: float, rotate: str | None = None, suffix: str = "mcap"
) -> Killed:
    """Record for ``moment`` seconds from the first cycle on, SIGKILL, read, recover."""
    path, told = folder / f"killed.{suffix}", folder / "told"
    for old in folder.glob("killed*"):
        old.unlink()
    told.write_bytes(bytes(TOLD.size + REMEMBERED * GIVEN.size))
    words = [sys.executable, "-m", "recording.synthetic", str(path), str(told)]
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parent)}
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
    if suffix == "csv":
        return _rows_judged(path, folder, moment, told, end)
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
        whole=sum(map(_messages, _files(path))) == sum(map(len, log.samples.values())),
    )


def _rows_judged(path: Path, folder: Path, moment: float, told: Path, end: float) -> Killed:
    """The same of a log of rows: one for each reading, in which the motor angle is the cycle."""
    given, _ = _told(told)
    lines = [line for file in _files(path) for line in _whole_lines(file)]
    try:
        angles = read_run(path)["W1.motor_angle"]
    except RunError:  # killed before there were two rows
        angles = np.empty(0)
    last = int(angles[-1]) if len(angles) else 0
    return Killed(
        moment=moment,
        given=given,
        lost=(given - 1 - last) * CYCLE,
        held=end - _given_at(told, last + 1) if last + 1 < given else 0.0,
        gaps=int(np.sum(np.round(np.diff(angles)) != EVERY)),
        recovered=_rows_are_recovered(path, folder, angles),
        whole=len(lines) == len(angles) or len(lines) < _LEAST_ROWS,
    )


def _files(path: Path) -> list[Path]:
    """The log's files, in order."""
    return [path] if path.exists() else parts_beside(path)


def _whole_lines(path: Path) -> list[list[str]]:
    """Rows that end with a line feed, by Python's own reader; each has every column."""
    data = path.read_bytes()
    lines = data[: data.rfind(b"\n") + 1].decode().splitlines()
    rows = list(csv.reader(line for line in lines if not line.startswith("#")))
    assert len({len(row) for row in rows}) <= 1, "a line that ends has every column"
    return rows[1:]


def _rows_are_recovered(path: Path, folder: Path, angles: np.ndarray) -> bool:
    """Recover every part, and compare."""
    saved = _emptied(folder / "saved")
    parts = [_is_part_recovered(f, saved, bool(_whole_lines(f))) for f in _files(path)]
    if not len(angles):
        return all(parts)
    return all(parts) and np.array_equal(read_run(saved / path.name)["W1.motor_angle"], angles)


def _is_part_recovered(file: Path, saved: Path, has_samples: bool) -> bool:
    """Recover one part; refused where it was killed before a sample of this part was whole."""
    try:
        recover(file, saved / file.name)
    except RunError:
        return not has_samples
    return has_samples


def _messages(path: Path) -> int:
    """Messages of instruments and drives in a file, by the reader of the package ``mcap``."""
    count = 0
    topics: dict[int, str] = {}
    try:
        with path.open("rb") as stream:
            for record in StreamReader(stream).records:
                if isinstance(record, Channel):
                    topics[record.id] = record.topic
                count += isinstance(record, Message) and topics[record.channel_id].count("/") > 1
    except (McapError, struct.error, EOFError):
        pass
    return count


def _emptied(folder: Path) -> Path:
    folder.mkdir(exist_ok=True)
    for old in folder.iterdir():
        old.unlink()
    return folder


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
    saved = _emptied(folder / "saved")
    parts = [_is_part_recovered(f, saved, bool(_messages(f))) for f in _files(path)]
    again = read_log(saved / path.name)
    return (
        all(parts)
        and again.closed is True
        and all(
            np.array_equal(again.samples[topic].values, samples.values, equal_nan=True)
            for topic, samples in log.samples.items()
        )
    )


def _given_at(told: Path, cycle: int) -> float:
    place = TOLD.size + cycle % REMEMBERED * GIVEN.size
    moment: float = GIVEN.unpack_from(told.read_bytes(), place)[0]
    return moment


def _told(path: Path) -> tuple[int, float]:
    count, now = TOLD.unpack_from(path.read_bytes())
    return count, now


def main() -> int:
    """Kill as often as asked; every second recording is in parts of a second."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=200)
    parser.add_argument("--format", choices=("mcap", "csv"), default="mcap")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    moments = random.Random(given.seed)
    with tempfile.TemporaryDirectory() as folder:
        killed = [
            kill_once(
                Path(folder), moments.uniform(0, LONGEST), "1s" if n % 2 else None, given.format
            )
            for n in range(given.times)
        ]
    over = [vars(item) for item in killed if item.lost > LIMIT]
    lost = sorted(item.lost for item in killed)
    answer = {
        "times": given.times,
        "cycles": sum(item.given for item in killed),
        "lost_median": lost[len(lost) // 2],
        "lost_worst": lost[-1],
        "held_worst": max(item.held for item in killed),
        "over_limit": over,
        "gaps": sum(item.gaps for item in killed),
        "not_recovered": sum(not item.recovered for item in killed),
        "not_whole": sum(not item.whole for item in killed),
        "aim": {"lost_worst": LIMIT, "gaps": 0, "not_recovered": 0, "not_whole": 0},
    }
    print(json.dumps(answer))
    failures = ("over_limit", "gaps", "not_recovered", "not_whole")
    return int(any(answer[name] for name in failures))


if __name__ == "__main__":
    sys.exit(main())
