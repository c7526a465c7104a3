"""The fleet of the Library view: deviations, changes, and the runs behind an estimate."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("pyarrow")

from winchkit.errors import UsageError
from winchkit.fleet import index_library
from winchkit.fleet.diagnosis.history import fleet_history
from winchkit.fleet.diagnosis.sessions import SessionEstimate
from winchkit.fleet.library.history import LibraryHistory
from winchkit.fleet.web import fleet as fleet_view
from winchkit.fleet.web.fleet import Fleet
from winchkit.fleet.web.runs import Library

START = datetime(2026, 1, 5, 8, tzinfo=UTC).timestamp()
WEEK = 7 * 86400.0
STD = 1e-3


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One winch with two runs in one session."""
    found = tmp_path_factory.mktemp("library")
    for number in range(2):
        path = found / "A" / "2026-01-05" / f"{number}.csv"
        path.parent.mkdir(parents=True, exist_ok=True)
        rows = [f"{0.1 * i:.1f},{i},{i % 5 + number}" for i in range(20)]
        path.write_text("\n".join(["time [s],motor_angle [rad],tension [N]", *rows, ""]))
    index_library(found)
    return found


def history(size: float) -> LibraryHistory:
    """Five winches of which B has a step at the ninth of twelve sessions, and E is far off."""
    random = np.random.default_rng(5)
    known = []
    for winch in "ABCDE":
        for number in range(12):
            value = random.normal(0.01, STD) + (0.5 if winch == "E" else 0.0)
            value += size if winch == "B" and number >= 8 else 0.0
            about = (winch, START + number * WEEK, "cell-gain", "gain_error", value, STD, "1")
            known.append(SessionEstimate(*about, (), {"tension": 150.0}))
    return LibraryHistory(("cell-gain",), 60, fleet_history(known), {}, {})


def test_a_grid_shows_steps_and_odd_winches(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fleet_view, "library_history", lambda *_, **__: history(0.02))
    fleet = Fleet(Library(folder))
    assert fleet.view()["fitted"] is None
    fleet.fit("bench-spiral", ["cell-gain"], lambda what, share: None)
    (parameter,) = fleet.view()["fitted"]["parameters"]
    assert parameter["unit"] == "%"
    winches = {own["winch"]: own for own in parameter["winches"]}
    for name in "ACD":
        assert max(map(abs, winches[name]["deviations"])) < 5.0
        assert winches[name]["change"] is None
    step = winches["B"]["deviations"]
    assert max(map(abs, step[:8])) < 5.0 < 10.0 < min(step[8:]), "one odd winch moves no colour"
    change = winches["B"]["change"]
    assert abs(change["date"] - (START + 7.5 * WEEK)) < WEEK
    assert change["after"] - change["before"] == pytest.approx(2.0, abs=0.3)
    assert any("costs 3" in text for text in winches["B"]["texts"]), "0.02 of 150 N are 3 N"
    assert winches["E"]["odd"]


def test_values_have_the_prefix_of_the_fleet() -> None:
    random = np.random.default_rng(6)
    known = [
        SessionEstimate(
            winch,
            START + week * WEEK,
            "drum-radius",
            "radius_error",
            random.normal(49e-6, 50e-6),
            50e-6,
            "m",
            (),
            {"tension": 150.0},
        )
        for winch in "ABCDE"
        for week in range(12)
    ]
    (own,) = map(fleet_view.parameter_json, fleet_history(known).parameters)
    assert (own["name"], own["unit"]) == ("Winding radius of the drum", "µm")
    values = np.array([one["values"] for one in own["winches"]])
    assert own["common"] == pytest.approx(49.0, abs=25.0)
    assert values.std() == pytest.approx(50.0, rel=0.3)


def test_a_cell_leads_to_its_runs(folder: Path) -> None:
    fleet = Fleet(Library(folder))
    view = fleet.view()
    assert (view["indexed"], view["sessions"], view["fitted"]) == (True, 1, None)
    (session,) = fleet_view.winch_sessions(Library(folder).tables)  # type: ignore[arg-type]
    found = fleet.runs("A", session.time.timestamp())
    assert found["runs"] == ["A/2026-01-05/0.csv", "A/2026-01-05/1.csv"]
    assert [fleet.library.run(name).path.is_file() for name in found["runs"]] == [True, True]
    with pytest.raises(UsageError, match="no session of winch 'Z'"):
        fleet.runs("Z", START)
