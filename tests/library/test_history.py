"""History of a library: one set of effects for all sessions, the command, and its report."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from hypothesis import given
from hypothesis import strategies as st

import fleet_campaign
from winchkit import index_library, write_run
from winchkit.catalog import find
from winchkit.cli import main
from winchkit.diagnosis.fleet.history import fleet_history
from winchkit.diagnosis.fleet.sessions import SessionEstimate
from winchkit.library.history import common_effects
from winchkit.report.fleet_text import history_text

pytest.importorskip("pyarrow")
START = datetime(2026, 1, 5, 8, tzinfo=UTC)
WEEK = timedelta(weeks=1)
NAMES = st.sampled_from(["drum-radius", "gear-ratio", "cell-gain", "cell-offset"])


@given(st.lists(st.lists(NAMES, min_size=1, max_size=3, unique=True), max_size=12))
def test_every_set_has_one_of_the_common_effects(sets: list[list[str]]) -> None:
    chosen = common_effects(sets)
    assert all(set(chosen) & set(one) for one in sets)
    assert len(set(chosen)) == len(chosen)
    assert common_effects([list(reversed(one)) for one in reversed(sets)]) == chosen


def estimates(winch: str, values: Sequence[float], std: float) -> list[SessionEstimate]:
    return [
        SessionEstimate(
            winch,
            (START + number * WEEK).timestamp(),
            "cell-gain",
            "gain_error",
            value,
            std,
            "1",
            (),
            {"tension": 150.0},
        )
        for number, value in enumerate(values)
    ]


def test_the_report_says_when_how_much_what_it_costs_and_what_to_do() -> None:
    random = np.random.default_rng(2)
    known = []
    for winch in "ABCDEF":
        values = random.normal(0.01, 1e-4, 12)
        if winch == "C":
            values[7:] += 0.02
        known += estimates(winch, values.tolist(), 1e-4)
    text = " ".join(history_text(fleet_history(known)).split())
    assert text.startswith("winch C: the span of the load cell is wrong")
    assert "changed by 2" in text
    day = (START + 6.5 * WEEK).date()
    found = datetime.fromisoformat(text.partition("since ")[2][:10]).date()
    assert abs(found - day) <= timedelta(days=7)
    assert "costs 3" in text, "0.02 of 150 N are 3 N"
    assert "calibrate the load cell" in text
    assert "winch A:" not in text


def test_a_fleet_without_changes_has_none() -> None:
    random = np.random.default_rng(3)
    known = []
    for winch in "ABCDEF":
        known += estimates(winch, random.normal(0.01, 1e-4, 10).tolist(), 1e-4)
    assert history_text(fleet_history(known)).startswith("No change over time")


def run(*arguments: object) -> Result:
    return CliRunner().invoke(main, ["fleet", "trend", *map(str, arguments)])


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two winches over six weeks; the load cell of the first is 3 % off from the fourth on."""
    folder = tmp_path_factory.mktemp("library")
    fleet = fleet_campaign.draw_fleet(5, 6, 4, {k.effect: 1e-9 for k in fleet_campaign.KINDS})
    names = [n for n in fleet.radii if n not in (fleet.creeping, fleet.odd, *fleet.swapped)]
    names = [*names, fleet.odd]
    for session in fleet.sessions:
        if session.winch not in names:
            continue
        off = 0.03 if session.winch == names[0] and session.number >= 3 else 0.0
        values = {**session.values, "cell-gain": off}
        runs, _ = fleet_campaign.runs_of(replace(session, values=values))
        day = START + session.number * WEEK
        place = folder / session.winch / day.date().isoformat()
        place.mkdir(parents=True)
        for number, one in enumerate(runs):
            started = (day + timedelta(minutes=number)).isoformat()
            about = {**one.metadata, "started": started}
            write_run(replace(one, metadata=about), place / f"{one.name}-{number}.csv")
    index_library(folder)
    return folder


@pytest.mark.slow
def test_a_step_is_found_and_dated_on_the_command_line(library: Path) -> None:
    profile = find("profiles", "bench-spiral")
    result = run(library, "-p", profile, "--effect", "cell-gain", "--json")
    assert result.exit_code == 1, result.output
    found = json.loads(result.stdout)
    assert (found["effects"], found["sessions"]) == (["cell-gain"], 12)
    (parameter,) = found["parameters"]
    changed = [winch for winch in parameter["winches"] if winch["changed"]]
    assert len(changed) == 1
    assert changed[0]["change"]["size"] == pytest.approx(0.03, abs=0.003)
    edge = (START + 2.5 * WEEK).timestamp()
    assert abs(changed[0]["change"]["date"] - edge) <= WEEK.total_seconds()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["--effect", "cell-gian"], 2, "did you mean 'cell-gain'?"),
        (["--limit", "cell-gain=3"], 2, "write EFFECT.PARAMETER=VALUE"),
        (["--limit", "cell-gain.size=3"], 2, "cell-gain has gain_error"),
        ([], 2, "run 'winchkit fleet diagnose' first"),
    ],
)
def test_wrong_input(library: Path, arguments: list[str], code: int, words: str) -> None:
    result = run(library, "-p", find("profiles", "bench-spiral"), *arguments)
    assert result.exit_code == code, result.output
    assert words in result.stderr


def test_a_folder_without_an_index_is_refused(tmp_path: Path) -> None:
    result = run(tmp_path, "-p", "bench-spiral", "--effect", "cell-gain")
    assert result.exit_code == 3
    assert "winchkit library index" in result.stderr
