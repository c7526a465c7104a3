"""The whole bench against the simulated one in real time: CAN frames, Modbus, logs, stations."""

from __future__ import annotations

import math
import os
import re
import shutil
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from waiting import until
from winchkit import catalog, open_bench
from winchkit.bench.bench import Bench
from winchkit.bench.control.snapshot import Phase
from winchkit.bench.emergency_stop import stop_on_bus
from winchkit.bench.programme import run_programme
from winchkit.bench.remote.client import attach
from winchkit.errors import FileError, LimitTripped, MotionError, NotPermitted, UsageError
from winchkit.runs import read_run
from winchkit.schema.bench import BenchSpec
from winchkit.schema.programme import Programme, ProgrammeStep
from winchkit.schema.read import read_simbench
from winchkit.sim.live.bench import LiveBench
from winchkit.sim.live.paced_clock import PacedClock

pytestmark = pytest.mark.realtime


@pytest.fixture
def clock() -> PacedClock:
    """Stands still while this machine is busy elsewhere."""
    return PacedClock()


@pytest.fixture
def live(clock: PacedClock) -> Iterator[LiveBench]:
    declared = read_simbench(catalog.find("sim", "spiral-bench"))
    with LiveBench(declared, seed=3, clock=clock.simulation) as running:
        yield running


@pytest.fixture
def bench(live: LiveBench, clock: PacedClock) -> Iterator[Bench]:
    with open_bench(live.bench_spec, clock) as opened:
        opened.on_cycle(clock.control)
        yield opened


def test_jog_move_log_and_the_instruments_agree(bench: Bench, tmp_path: Path) -> None:
    winch = bench.winch["A"]
    start = winch.cable_length
    winch.jog(wind_in=0.2, duration=0.6)
    assert winch.snapshot.phase is Phase.DISABLED
    assert 0.05 < start - winch.cable_length < 0.16
    path, missed_before = tmp_path / "lift.csv", bench.loop.overruns
    with bench.log(path, {"programme": "up"}):
        winch.move_to(3.6, 0.4)
    missed = bench.loop.overruns - missed_before
    assert winch.cable_length == pytest.approx(3.6, abs=2e-3)
    assert winch.tension == pytest.approx(10 * 9.80665, abs=6)
    run = read_run(path)
    assert run.metadata["programme"] == "up"
    assert run.load_mass == 10.0
    # A computer that missed cycles, which the loop counts, has fewer rows.
    assert 0.008 < run.interval < 0.012 or missed > len(run) // 20
    assert np.isfinite(run["motor_angle"]).mean() > 0.98
    measured, turned = run["cable_length"], run["motor_angle"]
    expected = np.array([bench.loop.winches["A"].cable.cable_length(a) for a in turned])
    assert np.nanmax(np.abs(measured - expected)) < 5e-3
    assert np.nanstd(measured - expected) < 1e-3


def test_a_jog_ends_without_its_beats_and_other_errors_stop_it(
    live: LiveBench, clock: PacedClock
) -> None:
    with open_bench(live.bench_spec, clock) as bench:
        winch = bench.winch["A"]
        winch.jog(pay_out=0.2)
        until(lambda: winch.snapshot.phase is Phase.MOVING)
        until(lambda: winch.snapshot.phase is Phase.DISABLED)
        assert not winch.moving
    with pytest.raises(ZeroDivisionError):
        fail_while_moving(live.bench_spec, clock)
    with live.up_to_date():
        assert live.winches["A"].drive.state.name == "SWITCH_ON_DISABLED"
        assert abs(live.winches["A"].plant.motor_velocity) < 1e-3


def fail_while_moving(spec: BenchSpec, clock: PacedClock) -> None:
    with open_bench(spec, clock) as bench:
        bench.winch["A"].jog(pay_out=0.2, hold=1.0)
        until(lambda: abs(bench.winch["A"].snapshot.cable_speed) > 0.1)
        raise ZeroDivisionError


def test_a_callback_steers_and_its_error_comes_out_of_the_block(
    live: LiveBench, clock: PacedClock
) -> None:
    seen: list[float] = []

    def steer(snapshot: object) -> dict[str, float]:
        seen.append(time.monotonic())
        if len(seen) > 150:
            raise KeyError("user's own")
        return {"A": -0.1}

    bench = open_bench(live.bench_spec, clock)
    start = bench.winch["A"].cable_length
    bench.on_cycle(steer)
    until(lambda: bench.loop.failure is not None)
    until(lambda: bench.snapshot.at_rest)
    assert bench.winch["A"].cable_length > start + 0.01
    with pytest.raises(KeyError, match="user's own"), bench:
        pass


def test_what_is_refused(bench: Bench, live: LiveBench) -> None:
    winch = bench.winch["A"]
    with pytest.raises(NotPermitted, match="beyond the limits"):
        winch.move_to(7.0)
    with pytest.raises(UsageError, match="not a finite number"):
        winch.jog(pay_out=math.nan)
    with pytest.raises(UsageError, match=r"no winch 'B'; it has A"):
        bench.named("B")
    before = winch.cable_length
    for call in (winch.jog, winch.move_by):
        name = call.__name__
        with pytest.raises(UsageError, match=rf"{name}\(-0.1\).*write {name}\(pay_out=...\) or"):
            call(-0.1)
        given: dict[str, Any]
        for given in ({}, {"pay_out": 0.1, "wind_in": 0.1}):
            with pytest.raises(UsageError, match="needs one of pay_out= and wind_in="):
                call(**given)
        for value in (-0.1, 0.0, math.inf):
            with pytest.raises(UsageError, match=r"not a (positive|finite) number"):
                call(wind_in=value)
    assert not winch.moving
    assert winch.cable_length == pytest.approx(before, abs=1e-4)
    program = re.escape(Path(sys.argv[0]).name)
    with pytest.raises(NotPermitted, match=rf"owned by {program} \(process {os.getpid()}, user"):
        open_bench(live.bench_spec)


def test_a_silent_cell_stops_the_winch(bench: Bench, live: LiveBench) -> None:
    winch = bench.winch["A"]
    winch.move_to(3.0, 0.1, wait=False)
    until(lambda: abs(winch.snapshot.cable_speed) > 0.05)
    live.inject("A.cell", "silence")
    with pytest.raises(LimitTripped, match="no load cell reading"):
        winch.wait()
    until(lambda: bench.snapshot.at_rest)
    assert math.isnan(winch.tension)


def test_stations_attach_log_tare_and_stop(bench: Bench, tmp_path: Path) -> None:
    station, other = attach(bench.spec), attach(bench.spec)
    try:
        assert station.names() == ["A"]
        other.start_log(str(tmp_path / "other.csv"))
        station.jog("A", pay_out=0.2, hold=0.7)
        until(lambda: bench.winch["A"].snapshot.cable_speed > 0.1)
        other.stop()
        assert bench.snapshot.at_rest
        with pytest.raises(MotionError, match=r"winch A was stopped by .* before its motion"):
            station.refresh("A")
        assert other.end_log() > 5
        assert abs(station.tare(None)) < 8
        with pytest.raises(UsageError, match="no winch 'Z'"):
            station.moving("Z")
        assert station.status()["winch"]["A"]["phase"] == "disabled"
    finally:
        station.close()
        other.close()
    bench.close()
    assert attach(bench.spec) is None


def test_a_log_of_a_station_that_cannot_go_on_disturbs_no_other(
    bench: Bench, tmp_path: Path
) -> None:
    """The folder vanishes, the next part cannot start; a thread that raises fails this test."""
    station = attach(bench.spec)
    assert station is not None
    folder = tmp_path / "gone"
    folder.mkdir()
    station.start_log(str(folder / "lift.csv"), "1s")
    until(lambda: station.log_rows() > 10)
    shutil.rmtree(folder)
    with pytest.raises(FileError, match=r"cannot be written|was removed by another program"):
        until(lambda: station.log_rows() < 0)
    until(lambda: any("logging failed" in text for text in station.status()["warnings"]))
    station.close()
    other = attach(bench.spec)
    cycle = other.status()["cycle"]
    until(lambda: other.status()["cycle"] > cycle)
    other.close()


def test_a_station_that_goes_away_releases_its_winches(bench: Bench) -> None:
    station = attach(bench.spec)
    station.step("A", pay_out=0.6, speed=0.1)
    until(lambda: bench.winch["A"].snapshot.cable_speed > 0.05)
    station.close()
    until(lambda: bench.snapshot.at_rest)
    assert bench.winch["A"].cable_length < 4.5


def test_stop_without_an_owner_acts_on_the_bus(live: LiveBench, clock: PacedClock) -> None:
    """The drive is left moving by an owner that died: here its loop is simply ended."""
    bench = open_bench(live.bench_spec, clock)
    bench.winch["A"].jog(pay_out=0.2, hold=1.0)
    until(lambda: bench.winch["A"].snapshot.cable_speed > 0.1)
    bench.loop.close()
    (stopped,) = stop_on_bus(live.bench_spec)
    assert stopped.confirmed
    with live.up_to_date():
        assert abs(live.winches["A"].plant.motor_velocity) < 0.1
        assert live.winches["A"].drive.state.name != "OPERATION_ENABLED"
    bench.close()


def test_a_programme_writes_a_run_per_load_and_repeat(
    bench: Bench, live: LiveBench, tmp_path: Path
) -> None:
    steps = (
        ProgrammeStep(ask="hang 10 kg", load_mass=10.0),
        ProgrammeStep(by=-0.1, speed=0.3),
        ProgrammeStep(hold=0.2),
        ProgrammeStep(ask="hang 20 kg", load_mass=20.0),
        ProgrammeStep(by=0.1, speed=0.3),
    )
    asked: list[str] = []

    def hang(step: ProgrammeStep) -> None:
        assert bench.snapshot.at_rest
        asked.append(str(step.ask))
        live.answer(step)

    written = run_programme(bench, Programme("short", steps, repeat=2), tmp_path, hang)
    assert [path.name for path in written] == [
        "short-10kg-1.csv",
        "short-20kg-1.csv",
        "short-10kg-2.csv",
        "short-20kg-2.csv",
    ]
    assert asked == ["hang 10 kg", "hang 20 kg"] * 2
    for path in written:
        run = read_run(path)
        assert run.load_mass is not None
        weight = run.load_mass * 9.80665
        assert np.nanmean(run["tension"]) == pytest.approx(weight, rel=0.1)
        assert run.metadata["programme"] == "short"


def test_the_first_repeat_begins_where_repeats_end(
    bench: Bench, live: LiveBench, tmp_path: Path
) -> None:
    """A run of a programme is a motion of its own, wherever the winch stood before."""
    steps = (ProgrammeStep(to=3.7, speed=0.4), ProgrammeStep(to=3.85, speed=0.4))
    written = run_programme(bench, Programme("same", steps, repeat=2), tmp_path, live.answer)
    first, second = (read_run(path) for path in written)
    begins = [float(run["motor_angle"][0]) for run in (first, second)]
    assert bench.winch["A"].length_at(begins[0]) == pytest.approx(3.85, abs=2e-3)
    assert begins[0] == pytest.approx(begins[1], abs=0.05)
    assert np.ptp(first["motor_angle"]) == pytest.approx(np.ptp(second["motor_angle"]), rel=0.01)


def test_a_question_of_temperature_is_answered_by_the_simulation(
    bench: Bench, live: LiveBench, tmp_path: Path
) -> None:
    steps = (
        ProgrammeStep(ask="bring rope and machine to 20 degC", temperature=20.0),
        ProgrammeStep(by=-0.1, speed=0.3),
        ProgrammeStep(ask="bring rope and machine to 35 degC", temperature=35.0),
        ProgrammeStep(by=0.1, speed=0.3),
    )
    written = run_programme(bench, Programme("warm", steps), tmp_path, live.answer)
    means = [float(np.nanmean(read_run(path)["temperature"])) for path in written]
    assert means == pytest.approx([20.0, 35.0], abs=0.5)


def test_a_bench_whose_drive_does_not_exist(live: LiveBench) -> None:
    spec: BenchSpec = live.bench_spec
    wiring = spec.winch["A"]
    ghost = replace(spec, winch={"A": replace(wiring, servo=replace(wiring.servo, node=44))})
    with pytest.raises(OSError, match="node 44"):
        open_bench(ghost)
    with open_bench(spec) as bench:
        assert bench.snapshot.at_rest


def test_a_stop_from_another_thread_ends_a_timed_jog(bench: Bench) -> None:
    stopper = threading.Timer(0.4, bench.stop)
    stopper.start()
    begin = time.monotonic()
    with pytest.raises(MotionError, match=r"was stopped by .* before its motion was finished"):
        bench.winch["A"].jog(pay_out=0.1, duration=30.0)
    assert time.monotonic() - begin < 10
    stopper.join()
    assert bench.snapshot.at_rest
