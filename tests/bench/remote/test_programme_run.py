"""A programme that a client lets the owner's process execute, in simulated time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from winchkit import catalog
from winchkit.bench.control.dead_man import LIFE_SIGN
from winchkit.bench.remote.identity import Client, LifeSign
from winchkit.bench.remote.station import LocalStation
from winchkit.errors import NotPermitted, UsageError
from winchkit.runs import read_run
from winchkit.schema.programme import Programme, ProgrammeStep
from winchkit.schema.read import read_simbench
from winchkit.schema.write import write_programme
from winchkit.testing.opened import OpenedBench

SPEED = 0.4


@dataclass
class Rig:
    """A bench with a client in another process."""

    sim: OpenedBench

    def __post_init__(self) -> None:
        self.bench, self.clock = self.sim.bench, self.sim.clock
        self.client = Client("page 1", life=LifeSign())
        self.station = LocalStation(self.bench, self.client)

    def state(self) -> dict[str, Any]:
        found = self.station.programme()
        assert found is not None
        return found

    def until(self, condition: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """Ask where the programme is, every 50 ms, until something holds of it."""
        for _ in range(1000):
            self.client.heard()
            if condition(state := self.state()):
                return state
            self.clock.sleep(0.05)
        raise AssertionError("it did not happen within 50 s")

    def start(self, folder: Path, *steps: ProgrammeStep) -> None:
        path = folder / "own.toml"
        write_programme(Programme("own", steps), path, replace=True)
        self.station.start_programme(str(path), str(folder / "runs"))

    @property
    def length(self) -> float:
        return float(self.sim.live.winches["A"].plant.cable_length)


@pytest.fixture(scope="module")
def sim() -> Iterator[OpenedBench]:
    with OpenedBench(read_simbench(catalog.find("sim", "demo-adequate"))) as opened:
        yield opened


@pytest.fixture
def rig(sim: OpenedBench) -> Iterator[Rig]:
    found = Rig(sim)
    yield found
    found.station.close()


def test_its_steps_its_question_and_its_files_are_reported(rig: Rig, tmp_path: Path) -> None:
    before = rig.length
    rig.start(
        tmp_path,
        ProgrammeStep(by=-0.02, speed=SPEED),
        ProgrammeStep(ask="look at it"),
        ProgrammeStep(hold=0.2),
    )
    assert rig.until(lambda state: state["step"] == 1)["does"] == "all winches by -0.02 m"
    with pytest.raises(UsageError, match="under way; end it first"):
        rig.start(tmp_path, ProgrammeStep(hold=0.1))
    rig.until(lambda state: state["asks"] == "look at it")
    assert rig.bench.snapshot.at_rest, "the winches are disabled while it asks"
    rig.clock.sleep(1.2 * LIFE_SIGN)  # a question needs no sign of life
    rig.station.answer_programme()
    state = rig.until(lambda state: state["ended"])
    assert state["error"] == ""
    assert [Path(path).name for path in state["files"]] == ["own-10kg-1.csv", "own-10kg-1b.csv"]
    assert all(len(read_run(path)) > 3 for path in state["files"])
    assert rig.length == pytest.approx(before - 0.02, abs=2e-3)
    with pytest.raises(UsageError, match="asks nothing"):
        rig.station.answer_programme()


@pytest.mark.parametrize("step", [ProgrammeStep(hold=5.0), ProgrammeStep(by=-1.0, speed=0.1)])
def test_it_ends_where_its_client_falls_silent(
    rig: Rig, tmp_path: Path, step: ProgrammeStep
) -> None:
    rig.start(tmp_path, step, ProgrammeStep(by=-0.1, speed=SPEED))
    rig.until(lambda state: state["step"] == 1)
    rig.clock.sleep(LIFE_SIGN + 0.6)
    state = rig.state()
    assert state["ended"]
    assert "no sign of life for 0.5 s" in state["error"] or "was silent" in state["error"]
    there = rig.length
    rig.clock.sleep(0.3)
    assert rig.length == pytest.approx(there, abs=1e-4), "no later step begins"
    assert rig.bench.snapshot.at_rest


@pytest.mark.parametrize("way", ["end_programme", "close", "stop"])
def test_it_is_ended_by_its_client_and_by_a_stop(rig: Rig, tmp_path: Path, way: str) -> None:
    rig.start(tmp_path, ProgrammeStep(by=-0.5, speed=0.2), ProgrammeStep(hold=0.5))
    begun = rig.length
    rig.until(lambda state: state["step"] == 1 and abs(rig.length - begun) > 0.005)
    getattr(rig.station, way)()
    assert rig.bench.snapshot.at_rest
    state = rig.until(lambda state: state["ended"])
    assert state["error"]
    there = rig.length
    rig.clock.sleep(0.3)
    assert rig.length == pytest.approx(there, abs=1e-4)


def test_another_clients_winch_and_an_unknown_file_are_refused(rig: Rig, tmp_path: Path) -> None:
    other = Client("jog")
    with rig.bench.commanders.acting(other):
        rig.bench.commanders.claim("A")
    with pytest.raises(NotPermitted, match="commanded by jog"):
        rig.start(tmp_path, ProgrammeStep(hold=0.1))
    rig.bench.commanders.leave(other)
    bench = tmp_path / "profile.toml"
    bench.write_text(Path(catalog.find("profiles", "bench-spiral")).read_text())
    with pytest.raises(UsageError, match="is no motion programme"):
        rig.station.start_programme(str(bench), str(tmp_path))
    assert rig.station.programme() is None
