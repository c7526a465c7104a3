"""The pytest plugin: benches by name or declared, faults, frames, assertions, nothing left over."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from winchkit.errors import FileError, LimitTripped, UsageError
from winchkit.testing.opened import OpenedBench
from winchkit.testing.plugin import SimBenchFixture

ROOT = Path(__file__).parents[2]
WEIGHT = 10 * 9.80665


@pytest.fixture
def sim(sim_bench: SimBenchFixture) -> OpenedBench:
    return sim_bench("spiral-bench")


def test_a_bench_by_name_moves_and_its_truth_is_asserted(sim: OpenedBench) -> None:
    sim.bench.winch["A"].move_by(wind_in=0.1, speed=0.3)
    sim.assert_moved("A", -0.1, 2e-3)
    sim.assert_tension("A", WEIGHT, 1.0)
    sim.assert_state("A", "switch on disabled")
    sim.mark()
    sim.assert_moved("A", 0.0)


def test_what_is_not_true_is_reported_with_what_is(sim: OpenedBench) -> None:
    with pytest.raises(AssertionError, match=r"moved by \+0.0000 m, expected \+1.0000 m"):
        sim.assert_moved("A", 1.0)
    with pytest.raises(AssertionError, match=r"in 'switch on disabled', not in 'fault'.*disabled"):
        sim.assert_state("A", "fault", within=0.05)
    with pytest.raises(AssertionError, match=r"tension is 98\.\d N, expected 50 N"):
        sim.assert_tension("A", 50.0, within=0.05)
    with pytest.raises(AssertionError, match="tension"):
        sim.assert_tension("A", WEIGHT, within=0.05, lasting=0.0, tolerance=-1.0)


def test_winches_declared_in_the_test(sim_bench: SimBenchFixture) -> None:
    sim = sim_bench(
        winches={
            "left": {"profile": "bench-grooved", "truth": {"load_mass": "5 kg"}},
            "right": {"truth": {"load_mass": "15 kg"}, "limits": {"speed": "0.2 m/s"}},
        },
        seed=4,
    )
    assert list(sim.bench.winch) == ["left", "right"]
    assert sim.spec.winch["right"].limits.speed == 0.2
    assert sim.spec.winch["right"].limits.acceleration == 1.5
    assert [wiring.servo.node for wiring in sim.spec.winch.values()] == [1, 2]
    sim.assert_tension("left", 5 * 9.80665, 1.0)
    sim.assert_tension("right", 15 * 9.80665, 1.0)
    sim.bench.winch["right"].jog(pay_out=0.1, duration=0.3)
    sim.assert_moved("left", 0.0, 1e-6)
    assert sim.length("right") > 4.01


def test_declarations_with_faults_are_refused_like_files(sim_bench: SimBenchFixture) -> None:
    with pytest.raises(FileError, match=r"sim-bench.toml:\d+: winch.A.limits.sped"):
        sim_bench(winches={"A": {"limits": {"sped": "1 m/s"}}})
    with pytest.raises(FileError, match="did you mean 'spiral-bench'"):
        sim_bench("spirl-bench")
    with pytest.raises(UsageError, match="needs a name"):
        sim_bench()
    with pytest.raises(FileError, match="elastic rope"):
        sim_bench("spiral-bench", hidden=["elastick rope"])


def test_two_benches_do_not_receive_each_other(sim_bench: SimBenchFixture) -> None:
    first, second = sim_bench("spiral-bench"), sim_bench("spiral-bench")
    first.bench.winch["A"].jog(wind_in=0.1, duration=0.3)
    second.assert_moved("A", 0.0, 1e-6)
    assert not [frame for frame in second.frames_of("A.rpdo1") if frame.values["60FFh"]]


def test_frames_have_names_and_values(sim: OpenedBench) -> None:
    begin = sim.clock.now()
    sim.bench.winch["A"].jog(pay_out=0.1, duration=0.2)
    words = [frame.values["6040h"] for frame in sim.frames_of("A.rpdo1", begin)]
    assert list(dict.fromkeys(word for word in words if word & 4)) == [0x06, 0x07, 0x0F]
    targets = [frame.values["60FFh"] for frame in sim.frames_of("A.rpdo1", begin)]
    assert min(targets) < 0
    assert max(targets) <= 0
    everything = sim.frames
    assert [frame.time for frame in everything] == sorted(frame.time for frame in everything)
    writes = [frame for frame in everything if "write 6060h" in frame.words]
    assert writes[-1].words.endswith("= 9 CSV")
    assert sim.frames_of("nmt")[-1].words == "A: start"
    assert {frame.words for frame in sim.frames_of("host.heartbeat")} == {"host: operational"}
    assert "080#" in str(sim.frames_of("sync")[0])
    by_number, by_name = sim.frames_of(0x181), sim.frames_of("A.tpdo1")
    assert by_number
    assert by_name[: len(by_number)] == by_number  # the drive goes on sending between the two
    assert all(frame.from_drive for frame in sim.frames_of("A.tpdo2"))
    with pytest.raises(UsageError, match=r"did you mean 'A\.tpdo1'"):
        sim.frames_of("A.tpdo11")


def test_dropped_frames_never_arrive(sim: OpenedBench) -> None:
    sim.bench.winch["A"].jog(pay_out=0.1, hold=1.0)
    sim.assert_state("A", "operation enabled")
    begin = sim.clock.now()
    mend = sim.drop("A.tpdo2")
    assert sim.wait_until(lambda: bool(sim.bench.snapshot.tripped))
    assert all(frame.lost for frame in sim.frames_of("A.tpdo2", begin + 0.01))
    assert not any(frame.lost for frame in sim.frames_of("A.tpdo1", begin))
    assert [trip.kind for trip in sim.bench.snapshot.tripped] == ["feedback"]
    sim.assert_state("A", "switch on disabled")
    mend()
    sim.bench.reset()
    sim.bench.winch["A"].jog(pay_out=0.1, duration=0.2)


def test_delayed_frames_come_late(sim: OpenedBench) -> None:
    """The status word shows the fault within a cycle, the emergency after the delay."""
    late = 0.05
    begin = sim.clock.now()
    sim.delay("A.emergency", late)
    sim.drive_fault("A")
    assert sim.wait_until(lambda: bool(sim.frames_of("A.emergency", begin)))
    told = [f.time for f in sim.frames_of("A.tpdo1", begin) if f.values["6041h"] & 0x08]
    (arrived,) = [frame.time for frame in sim.frames_of("A.emergency", begin)]
    assert late - 2 * sim.spec.cycle <= arrived - told[0] <= late + 0.01


def test_a_wire_that_cannot_be_is_refused(sim: OpenedBench) -> None:
    with pytest.raises(UsageError, match="share"):
        sim.drop("A", share=0.0)
    with pytest.raises(UsageError, match="delay"):
        sim.delay("A", 0.0)
    with pytest.raises(UsageError, match="no fault 'fire'"):
        sim.drive_fault("A", "fire")


@pytest.mark.slow
def test_a_frozen_and_a_silent_cell(sim: OpenedBench) -> None:
    cell = sim.bench.winch["A"].sensors["cell"]
    sim.freeze_cell("A")
    sim.clock.sleep(0.1)
    frozen = cell.latest.raw
    sim.clock.sleep(0.2)
    assert cell.latest.raw == frozen
    sim.recover()
    assert sim.wait_until(lambda: cell.latest is not None and cell.latest.raw != frozen)
    sim.silence_cell("A")
    assert sim.wait_until(lambda: sim.bench.snapshot.winch["A"].quality["cell"] == "stale")  # type: ignore[index]
    with pytest.raises(Exception, match="no load cell reading"):
        sim.bench.winch["A"].jog(wind_in=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["lose_heartbeat", "reboot", "drive_fault"])
def test_faults_of_the_drive_trip_the_bench(sim: OpenedBench, kind: str) -> None:
    expected = {"lose_heartbeat": "heartbeat", "reboot": "boot-up", "drive_fault": "fault"}[kind]
    sim.bench.winch["A"].jog(pay_out=0.1, hold=1.0)
    sim.assert_state("A", "operation enabled")
    getattr(sim, kind)("A")
    assert sim.wait_until(
        lambda: expected in {trip.kind for trip in sim.bench.snapshot.tripped}, within=8.0
    )
    sim.recover()
    sim.clock.sleep(1.0 if kind == "reboot" else 0.2)
    with pytest.raises(LimitTripped if kind != "drive_fault" else Exception, match="latched"):
        sim.bench.winch["A"].jog(pay_out=0.1)
    sim.bench.reset()
    sim.bench.winch["A"].jog(pay_out=0.1, duration=0.2)


def test_a_drive_that_receives_nothing_of_the_host_stops_itself(sim: OpenedBench) -> None:
    sim.bench.winch["A"].jog(pay_out=0.2, hold=1.0)
    sim.assert_state("A", "operation enabled")
    begin = sim.clock.now()
    sim.lose_host()
    sim.assert_state("A", "switch on disabled")
    assert sim.frames_of("A.emergency", begin)[0].values["code"] == 0x8130
    sim.recover()
    sim.bench.reset()
    sim.bench.winch["A"].jog(pay_out=0.2, duration=0.2)


def test_hung_loads_are_weighed(sim: OpenedBench) -> None:
    sim.hang("A", 20.0)
    sim.assert_tension("A", 2 * WEIGHT, 0.5)


def test_what_a_callback_raises_comes_out_of_close(sim: OpenedBench) -> None:
    def fail(_snapshot: object) -> None:
        raise KeyError("user's own")

    sim.bench.on_cycle(fail)
    assert sim.wait_until(lambda: sim.bench.loop.failure is not None)
    with pytest.raises(KeyError, match="user's own"):
        sim.close()
    sim.close()


def test_a_function_that_still_steers_does_not_keep_it_open(sim_bench: SimBenchFixture) -> None:
    sim = sim_bench("spiral-bench")
    sim.bench.on_cycle(lambda _snapshot: {"A": -0.1})
    sim.assert_state("A", "operation enabled")
    sim.close()


def test_nothing_is_left_running(sim_bench: SimBenchFixture) -> None:
    before = set(threading.enumerate())
    sim = sim_bench("spiral-bench")
    assert set(threading.enumerate()) > before
    sim.bench.winch["A"].jog(pay_out=0.1, hold=1.0)
    sim.close()
    deadline = time.monotonic() + 5
    while left := set(threading.enumerate()) - before:
        assert time.monotonic() < deadline, left
        time.sleep(0.01)


def test_the_plugin_is_registered_and_light() -> None:
    """A session that does not use it imports one file and pytest, nothing else."""
    code = (
        "import sys, winchkit.testing.plugin\n"
        "heavy = {'numpy', 'scipy', 'can', 'canopen', 'pymodbus', 'pydantic', 'tomlkit', 'rich'}\n"
        "assert not heavy & set(sys.modules), heavy & set(sys.modules)\n"
        "from importlib.metadata import entry_points\n"
        "(one,) = [e for e in entry_points(group='pytest11') if e.name == 'winchkit']\n"
        "assert one.value == 'winchkit.testing.plugin'\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)
