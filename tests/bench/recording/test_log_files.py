"""Log files: created exclusively and locked; of two logs onto one path one is refused."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from fed import BENCHMARKS, SUPPORT, Fed, SetClock, recording
from waiting import run_together
from winchkit.bench.recording.recorder import Recorder
from winchkit.errors import FileError, UsageError
from winchkit.runs import open_writer, read_run, write_run
from winchkit.runs.read import read_log
from winchkit.runs.recording.rotation import Rotation, part_path
from winchkit.runs.recover import recover

SUFFIXES = pytest.mark.parametrize("suffix", ["csv", "mcap"])
PARTS = Rotation(duration=1.0)


def started(path: Path, rotation: Rotation | None = None, *, replace: bool = False) -> Recorder:
    clock = SetClock()
    return Recorder(path, Fed(clock, "A").sensors, clock, {}, rotation=rotation, replace=replace)


@SUFFIXES
def test_an_earlier_log_is_never_written_over_unasked(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"lift.{suffix}"
    with recording(path, "A") as (fed, recorder):
        fed.run(recorder, 1.0)
    held = path.read_bytes()
    for name in (path, tmp_path / "." / ".." / tmp_path.name / path.name):
        with pytest.raises(UsageError, match="contains a log already; name another file"):
            started(name)
    with pytest.raises(UsageError, match="contains a log already"):
        started(path, PARTS), "its parts would stand beside it"
    with pytest.raises(UsageError, match="contains a log already"):
        open_writer(path, [("time", "s")])
    assert path.read_bytes() == held
    started(path, replace=True).close()
    assert len(path.read_bytes()) < len(held)


@SUFFIXES
@pytest.mark.parametrize("replace", [False, True])
def test_of_two_logs_onto_one_path_one_is_refused(
    tmp_path: Path, suffix: str, replace: bool
) -> None:
    path = tmp_path / f"lift.{suffix}"
    (tmp_path / "folder").symlink_to(tmp_path)
    other = tmp_path / f"other.{suffix}"
    other.symlink_to(path)
    hard = tmp_path / f"hard.{suffix}"
    with recording(path, "A") as (fed, recorder):
        os.link(path, hard)
        fed.run(recorder, 1.0)
        for name in (path, tmp_path / "folder" / path.name, other, hard):
            with pytest.raises(UsageError, match="another log is being written to it"):
                started(name, replace=True)
            with pytest.raises(UsageError, match=r"another log is being written|holds a log"):
                started(name, replace=replace)
        with pytest.raises(UsageError, match="another log is being written to it"):
            started(path, PARTS, replace=True)
        fed.run(recorder, 1.0)
    run = read_run(path)
    assert len(run) == 96
    assert run["motor_angle"] == pytest.approx(run["motor_angle"][0] + 3 * run.time, abs=1e-5)


@SUFFIXES
def test_nothing_else_writes_to_a_log_that_is_being_written(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"lift.{suffix}"
    with recording(tmp_path / f"other.{suffix}", "A") as (fed, recorder):
        fed.run(recorder, 1.0)
    other = read_run(tmp_path / f"other.{suffix}")
    with recording(path, "A") as (fed, recorder):
        fed.run(recorder, 1.0)
        with pytest.raises(UsageError, match="another log is being written to it"):
            write_run(other, path)
        with pytest.raises(UsageError, match="another log is being written to it"):
            recover(tmp_path / f"other.{suffix}", path, replace=True)
    assert len(read_run(path)) == 46


def test_a_log_that_is_being_written_is_not_called_cut_off(tmp_path: Path) -> None:
    path = tmp_path / "lift.mcap"
    with recording(path, "A") as (fed, recorder):
        fed.run(recorder, 1.0)
        while recorder.rows < 20:
            recorder.check()
        (note,) = read_run(path).notes
        assert note.startswith("the log is still being written; its ")
    assert read_run(path).notes == ()


@SUFFIXES
def test_a_log_in_parts_holds_the_whole_name(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"lift.{suffix}"
    with recording(path, "A", rotation=PARTS) as (fed, recorder):
        for _ in range(3):
            fed.run_until_written(recorder, 1.1)
        first, last = recorder.parts[0], recorder.parts[-1]
        assert first != last
        for name in (path, first, last):
            for rotation in (None, PARTS):
                with pytest.raises(UsageError, match="another log is being written to it"):
                    started(name, rotation, replace=True)
        assert not path.exists()
        fed.run(recorder, 0.2)
    assert read_log(path).closed is (True if suffix == "mcap" else None)
    kept = [part.read_bytes() for part in recorder.parts]
    with pytest.raises(UsageError, match="contains a log already"):
        started(path, PARTS)
    with pytest.raises(UsageError, match="contains a log already"):
        started(path)
    assert [part.read_bytes() for part in recorder.parts] == kept
    started(path, replace=True).close()
    assert sorted(tmp_path.iterdir()) == [path], "the earlier parts are gone"


@SUFFIXES
def test_a_part_that_is_there_already_is_left_alone(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"lift.{suffix}"
    foreign = part_path(path, 2)
    with recording(path, "A", rotation=PARTS) as (fed, recorder):
        foreign.write_bytes(b"somebody's own")
        fed.run(recorder, 1.1)
        while len(recorder.parts) < 2:
            fed.run(recorder, 0.1)
            recorder.check()
        fed.run(recorder, 0.5)
    assert foreign.read_bytes() == b"somebody's own"
    assert recorder.parts[:2] == (part_path(path, 1), part_path(path, 3))
    assert len(read_log(recorder.parts).samples) > 0


@SUFFIXES
@pytest.mark.parametrize("how", ["removed", "replaced", "cut off"])
def test_a_log_that_is_taken_away_is_reported(tmp_path: Path, suffix: str, how: str) -> None:
    path = tmp_path / f"lift.{suffix}"
    clock = SetClock()
    fed = Fed(clock, "A")
    recorder = Recorder(path, fed.sensors, clock, {})
    fed.run_until_written(recorder, 0.5)
    if how == "cut off":
        os.truncate(path, 0)
    elif how == "removed":
        path.unlink()
    else:
        (tmp_path / "new").write_bytes(b"")
        (tmp_path / "new").replace(path)
    fed.run(recorder, 1.5)
    with pytest.raises(FileError, match=f"was {how} by another program while it was written"):
        recorder.close()
    assert isinstance(recorder.failure, FileError)


RECORD = """
import sys, time
sys.path[:0] = [{tests!r}, {benchmarks!r}]
from pathlib import Path
from fed import Fed, SetClock
from winchkit.bench.recording.recorder import Recorder
from winchkit.errors import UsageError
from winchkit.runs.recording.rotation import Rotation
clock = SetClock()
fed = Fed(clock, "A")
path, number = Path(sys.argv[1]), int(sys.argv[2])
print("ready", flush=True)
sys.stdin.readline()
rotation = Rotation(duration=1.0) if number % 2 else None
try:
    recorder = Recorder(
        path, fed.sensors, clock, {{"number": str(number)}}, rotation=rotation, replace=True
    )
except UsageError as error:
    print("refused", error)
    sys.exit(2)
print("logs", flush=True)
sys.stdin.readline()
fed.run(recorder, 0.9)
recorder.close()
"""


@pytest.mark.slow
@SUFFIXES
def test_of_processes_that_begin_at_once_exactly_one_logs(tmp_path: Path, suffix: str) -> None:
    """Half of them in parts, all of them with leave to replace."""
    path = tmp_path / f"lift.{suffix}"
    path.write_bytes(b"an earlier log\n")
    script = RECORD.format(tests=SUPPORT, benchmarks=BENCHMARKS)
    processes = [
        subprocess.Popen(
            [sys.executable, "-c", script, str(path), str(number)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        for number in range(6)
    ]
    for process in processes:
        assert process.stdout.readline() == "ready\n"
    for process in processes:
        process.stdin.write("\n")
        process.stdin.flush()
    said = []
    for process in processes:
        said.append(process.stdout.readline().split()[0])
    assert sorted(said) == ["logs", *["refused"] * 5], said
    for process in processes:
        process.communicate("\n", timeout=60)
    winner = said.index("logs")
    assert [process.returncode == 0 for process in processes] == [n == winner for n in range(6)]
    run = read_run(path)
    assert run.metadata["number"] == str(winner)
    assert len(run) == 41


def test_of_threads_that_begin_at_once_exactly_one_logs(tmp_path: Path) -> None:
    began, refused = [], []
    gate = threading.Barrier(4)

    def begin() -> None:
        gate.wait()
        try:
            began.append(started(tmp_path / "lift.mcap"))
        except UsageError as error:
            refused.append(error)

    threads = [threading.Thread(target=begin) for _ in range(4)]
    run_together(threads)
    assert (len(began), len(refused)) == (1, 3)
    began[0].close()


@pytest.mark.skipif(sys.platform == "win32", reason="SIGKILL is POSIX")
def test_the_lock_dies_with_the_process(tmp_path: Path) -> None:
    path = tmp_path / "lift.mcap"
    script = RECORD.format(tests=SUPPORT, benchmarks=BENCHMARKS)
    with subprocess.Popen(
        [sys.executable, "-c", script, str(path), "0"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        process.stdin.write("\n")
        process.stdin.flush()
        assert [process.stdout.readline() for _ in range(2)] == ["ready\n", "logs\n"]
        with pytest.raises(UsageError, match="another log is being written to it"):
            started(path, replace=True)
        process.kill()
    started(path, replace=True).close()


@pytest.mark.skipif(sys.platform != "linux", reason="LOCK_EX of flock(1)")
def test_the_lock_is_one_that_other_programs_see(tmp_path: Path) -> None:
    """``flock`` of util-linux, which knows nothing of winchkit."""
    path = tmp_path / "lift.mcap"
    asked = ["flock", "--nonblock", "--exclusive", str(path), "true"]
    recorder = started(path)
    assert subprocess.run(asked, check=False).returncode == 1
    recorder.close()
    assert subprocess.run(asked, check=False).returncode == 0
    held = subprocess.Popen(
        ["flock", str(path), "sh", "-c", "echo held; read line"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert held.stdout.readline() == "held\n"
    with pytest.raises(UsageError, match="another log is being written to it"):
        started(path, replace=True)
    held.communicate("\n")
