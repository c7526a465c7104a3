"""Tests of the control loop beside this file, on simulated winches: ``pytest`` needs no hardware.

``sim_bench`` is a fixture of winchkit.
"""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from tension_hold import FASTEST, hold, speed_for

from winchkit.testing.opened import OpenedBench
from winchkit.testing.plugin import SimBenchFixture

CHAIN = "heavy rope, mass_per_length=10 kg/m"
"""The simulated chain, with 10 kg at its end."""
WINCH = {"limits": {"tension_high": "800 N", "speed": "0.5 m/s"}}


@pytest.fixture
def sim(sim_bench: SimBenchFixture) -> OpenedBench:
    """A winch with a chain, opened for a test."""
    return sim_bench(winches={"A": WINCH}, hidden=[CHAIN])


def test_the_speed_is_in_proportion_limited_and_zero_without_a_reading() -> None:
    """Plain arithmetic needs no bench."""
    assert speed_for(110.0, 100.0) == pytest.approx(0.1)
    assert speed_for(0.0, 1000.0) == -FASTEST
    assert speed_for(101.0, 100.0) == 0.0
    assert speed_for(float("nan"), 100.0) == 0.0


@pytest.mark.parametrize("change", [-20.0, 20.0])
def test_the_tension_comes_to_what_is_wanted(sim: OpenedBench, change: float) -> None:
    """In both directions; at 10 kg/m a newton more is 10 mm of chain."""
    wanted = sim.tension("A") + change
    hold(sim.bench, "A", wanted)
    sim.assert_tension("A", wanted, 3.0, within=8.0)
    sim.assert_moved("A", change / (10.0 * 9.80665), tolerance=0.04)


def test_a_silent_load_cell_stops_the_winch(sim: OpenedBench) -> None:
    """Silence of the cell trips the bench; the loop neither moves blindly nor starts again."""
    hold(sim.bench, "A", sim.tension("A") + 100.0)
    sim.assert_state("A", "operation enabled")
    sim.silence_cell("A")
    sim.assert_state("A", "switch on disabled")
    sim.recover()
    sim.mark()
    sim.clock.sleep(0.5)
    sim.assert_moved("A", 0.0, tolerance=1e-3)
    assert [trip.kind for trip in sim.bench.snapshot.tripped] == ["cell stale"]


def test_a_drive_fault_ends_it(sim: OpenedBench) -> None:
    """A faulty drive is disabled and stays so."""
    hold(sim.bench, "A", sim.tension("A") - 100.0)
    sim.assert_state("A", "operation enabled")
    sim.drive_fault("A", "over-temperature")
    sim.assert_state("A", "fault")
    assert sim.frames_of("A.emergency")[-1].values["code"] == 0x4310


def test_lost_frames_are_survived_and_a_cut_wire_is_not(sim: OpenedBench) -> None:
    """One frame in ten lost is no reason to stop; no frame at all is."""
    wanted = sim.tension("A") + 20.0
    mend = sim.drop("A.tpdo", share=0.1)
    hold(sim.bench, "A", wanted)
    sim.assert_tension("A", wanted, 4.0, within=8.0)
    mend()
    sim.cut_wire()
    sim.assert_state("A", "switch on disabled")
    assert sim.bench.snapshot.tripped
    sim.recover()
    sim.bench.reset()
    assert sim.state("A") == "switch on disabled"


def test_nothing_is_energised_after_the_stop(sim: OpenedBench) -> None:
    """What was sent is there to be looked at, frame by frame."""
    end = hold(sim.bench, "A", sim.tension("A") + 100.0)
    sim.assert_state("A", "operation enabled")
    end()
    stopped = sim.clock.now()
    sim.bench.stop_now()
    words = [frame.values["6040h"] for frame in sim.frames_of("A.rpdo1", stopped)]
    first = words.index(0x02)
    assert set(words[first:]) <= {0x00, 0x02}


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Path]:
    """A simulated bench in a process of its own; the bench file to connect to."""
    path = tmp_path / "bench.toml"
    command = ["sim", "serve", "spiral-bench", "--hidden", CHAIN, "--bench-file", str(path)]
    with subprocess.Popen(
        [sys.executable, "-m", "winchkit", *command],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        if not process.stdout.readline():
            reason = process.stderr.read()
            if "ip route add" in reason:
                pytest.skip(f"no route for multicast here: {reason}")
            pytest.fail(reason)
        yield path
        process.communicate("quit\n", timeout=20)


def test_the_programme_runs_against_another_process(served: Path) -> None:
    """The whole programme as its user starts it, with the bench elsewhere."""
    program = Path(__file__).with_name("tension_hold.py")
    done = subprocess.run(
        [sys.executable, str(program), str(served), "510", "--for", "4"],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert float(done.stdout.split(" N")[0]) == pytest.approx(510.0, abs=6.0)
