"""A log played as a live source: the bench's own callbacks see what the bench showed."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from fed import CYCLE, DELAY, SetClock, angle, recording, tension
from winchkit.bench.control.snapshot import BenchSnapshot, Phase
from winchkit.bench.recording.replay import open_replay
from winchkit.errors import RunError


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "lift.mcap"
    with recording(path) as (fed, recorder):
        fed.run(recorder, 2.0)
    return path


def test_callbacks_see_every_cycle_with_what_was_known_then(log: Path) -> None:
    replay = open_replay(log, SetClock())
    seen: list[BenchSnapshot] = []
    remove = replay.on_cycle(seen.append)
    assert replay.play(fast=True) == len(seen) == 500
    assert replay.winches == ("A", "B")
    for snapshot in seen[50::37]:
        winch = snapshot.winch["B"]
        assert winch.motor_angle == pytest.approx(angle(winch.time), abs=1e-5)
        age = (winch.tension, tension(winch.time), tension(winch.time - DELAY - 6 * CYCLE))
        assert min(age[1:]) <= age[0] <= max(age[1:]), "the newest reading, no later one"
        assert winch.temperature == 20.0
    assert [snapshot.cycle for snapshot in seen] == list(range(1, 501))
    assert {snapshot.winch["A"].phase for snapshot in seen} == {Phase.MOVING}
    assert seen[-1].winch["A"].cable_length == 3.0, "what the bench made of the motor angle"
    remove()
    replay.play(fast=True)
    assert len(seen) == 500


def test_phases_and_trips_come_when_they_came(tmp_path: Path) -> None:
    path = tmp_path / "trip.mcap"
    with recording(path, "A") as (fed, recorder):
        fed.run(recorder, 1.0)
        fed.phase = Phase.STOPPING
        fed.trip("too tight")
        fed.run(recorder, 1.0)
    seen = list(open_replay(path, SetClock()).snapshots())
    first = next(n for n, snapshot in enumerate(seen) if snapshot.tripped)
    assert first == pytest.approx(250, abs=2)
    assert [str(trip) for trip in seen[-1].tripped] == ["winch A: too tight"]
    assert seen[first - 1].winch["A"].phase is Phase.MOVING
    assert seen[first].winch["A"].phase is Phase.STOPPING


def test_it_keeps_the_logs_pace(log: Path) -> None:
    clock = SetClock(0.0)
    replay = open_replay(log, clock)
    late: list[float] = []
    replay.on_cycle(lambda snapshot: late.append(clock.time - CYCLE * (snapshot.cycle - 1)))
    replay.play()
    assert clock.time == pytest.approx(499 * CYCLE, abs=CYCLE)
    assert max(map(abs, late)) <= CYCLE


def test_a_run_of_rows_is_played_too(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("time [s],motor_angle [rad],tension [N]\n0,1,10\n0.1,2,\n0.2,3,30\n")
    seen = list(open_replay(path, SetClock()).snapshots())
    assert [item.time for item in seen] == [0.0, 0.1, 0.2]
    assert [item.winch["A"].motor_angle for item in seen] == [1.0, 2.0, 3.0]
    assert [item.winch["A"].tension for item in seen] == pytest.approx(
        [10.0, math.nan, 30.0], nan_ok=True
    )


def test_a_log_without_a_winch_is_refused(tmp_path: Path) -> None:
    with recording(tmp_path / "none.mcap"):
        pass
    with pytest.raises(RunError, match="no winch's motor angle"):
        open_replay(tmp_path / "none.mcap")
