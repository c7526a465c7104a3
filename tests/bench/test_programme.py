"""A motion programme, and a held tension, that somebody stops, in simulated time."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from winchkit import catalog
from winchkit.bench.control.snapshot import BenchSnapshot
from winchkit.bench.programme import run_programme
from winchkit.errors import MotionError, NotPermitted
from winchkit.runs import read_run
from winchkit.schema.programme import Programme, ProgrammeStep
from winchkit.schema.read import read_simbench
from winchkit.testing.opened import OpenedBench


@pytest.fixture(scope="module")
def sim() -> Iterator[OpenedBench]:
    with OpenedBench(read_simbench(catalog.find("sim", "demo-adequate"))) as opened:
        yield opened


def test_a_stop_during_a_hold_ends_the_programme_and_keeps_its_log(
    sim: OpenedBench, tmp_path: Path
) -> None:
    """The winch stands then, so that the stop ends no motion; the next one must not begin."""
    bench = sim.bench
    steps = (
        ProgrammeStep(by=-0.1, speed=0.4),
        ProgrammeStep(hold=2.0),
        ProgrammeStep(by=-0.5, speed=0.4),
    )
    plant, places = sim.live.winches["A"].plant, []

    def stop(_repeat: int, _number: int, step: ProgrammeStep) -> None:
        if step.hold is not None:
            places.append(plant.cable_length)
            bench.stop_now()

    with pytest.raises(MotionError, match="stopped the bench between two motions"):
        run_programme(bench, Programme("held", steps), tmp_path, lambda _step: None, progress=stop)
    bench.clock.sleep(0.5)
    assert bench.snapshot.at_rest
    assert plant.cable_length == pytest.approx(places[0], abs=1e-3)
    assert len(read_run(tmp_path / "held-10kg-1.csv")) > 5


def test_a_programme_that_is_refused_writes_no_file(
    sim: OpenedBench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An empty run would have to be removed before the next attempt."""
    bench = sim.bench
    monkeypatch.setattr(bench, "not_commissioned", "there is no commissioning record")
    steps = (ProgrammeStep(by=-0.1, speed=0.4),)
    begun = []
    with pytest.raises(NotPermitted, match="no commissioning record"):
        run_programme(
            bench,
            Programme("refused", steps),
            tmp_path / "runs",
            lambda _step: None,
            progress=lambda *place: begun.append(place),
        )
    assert begun == []
    assert not (tmp_path / "runs").exists()


def test_a_quick_stop_ends_a_held_tension(sim: OpenedBench) -> None:
    """And whoever goes on refreshing it is refused."""
    bench, winch, plant = sim.bench, sim.bench.winch["A"], sim.live.winches["A"].plant
    wanted = winch.snapshot.load_tension + 30.0  # the load hangs free: the winch winds in

    def stop(snapshot: BenchSnapshot) -> None:
        if snapshot.winch["A"].cable_speed < -2e-3:
            remove()
            bench.stop_now(wait=False)

    remove = bench.on_cycle(stop)
    with pytest.raises(MotionError, match=r"was stopped by .* before its motion was finished"):
        winch.hold_tension(wanted, duration=2.0, stiffness=1e3)
    with pytest.raises(MotionError, match="was stopped by"):
        winch.refresh()
    bench.wait_at_rest("A")
    place = plant.cable_length
    bench.clock.sleep(0.5)
    assert bench.snapshot.at_rest
    assert plant.cable_length == pytest.approx(place, abs=1e-4)
