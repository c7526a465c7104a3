"""History of a library: one set of effects for all sessions, the command, and its report."""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result
from hypothesis import given
from hypothesis import strategies as st

from command_line import done
from winchkit import write_run
from winchkit.catalog import find
from winchkit.effects.term import Term
from winchkit.fleet import index_library
from winchkit.fleet.diagnosis.history import fleet_history
from winchkit.fleet.diagnosis.sessions import SessionEstimate
from winchkit.fleet.library.history import common_effects
from winchkit.fleet.report.text import history_text
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.winch import WinchProfile

pytest.importorskip("pyarrow")
START = datetime(2026, 1, 5, 8, tzinfo=UTC)
WEEK = timedelta(weeks=1)
NAMES = st.sampled_from(["drum-radius", "gear-ratio", "cell-gain", "cell-offset"])


@given(st.lists(st.lists(NAMES, min_size=1, max_size=3, unique=True), max_size=12))
def test_every_set_has_one_of_the_common_effects(sets: list[list[str]]) -> None:
    chosen = common_effects(sets)
    assert all(set(chosen) & set(one) for one in sets)
    assert len(set(chosen)) == len(chosen)
    assert common_effects(list(reversed(sets))) == chosen


def test_of_effects_in_equally_many_sets_the_named_one_is_followed() -> None:
    assert common_effects([["gear-ratio", "drum-radius"]]) == ("gear-ratio",)
    sets = [["gear-ratio", "drum-radius"]] * 2 + [["drum-radius", "gear-ratio"]]
    assert common_effects(sets) == ("gear-ratio",)
    assert common_effects([["gear-ratio", "drum-radius"], ["drum-radius"]]) == ("drum-radius",)


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
    assert history_text(fleet_history(known)).startswith("No change over time, and no winch")


def test_what_too_few_winches_or_sessions_leave_open_is_not_denied() -> None:
    values = [0.01, 0.011, 0.0105, 0.0102, 0.0107]
    few = [one for winch in "ABC" for one in estimates(winch, values, 1e-4)]
    said = history_text(fleet_history(few))
    assert said.startswith("No change over time. Not tested: a winch that differs")
    once = [one for winch in "AB" for one in estimates(winch, values[:1], 1e-4)]
    assert history_text(fleet_history(once)).startswith("Nothing was tested: a change over time")


def run(*arguments: object, code: int = 0) -> Result:
    return done("fleet", "trend", *arguments, code=code)


def test_a_step_is_found_and_dated_on_the_command_line(tmp_path: Path) -> None:
    """Two axes over six weeks; the viscous friction of the first is greater from the fourth on."""
    library, ticks, random = (
        tmp_path / "library",
        np.arange(0.0, 6.0, 0.01),
        np.random.default_rng(4),
    )
    speed = 2.0 * np.sin(2.0 * ticks) + np.cos(5.0 * ticks)
    angle = 1.0 - np.cos(2.0 * ticks) + 0.2 * np.sin(5.0 * ticks)
    for winch, week, number in product(("e1", "e2"), range(6), range(2)):
        viscosity = 0.05 if winch == "e1" and week >= 3 else 0.04
        torque = viscosity * speed + random.normal(0.0, 1e-3, ticks.size)
        channels = {"motor_angle": Channel(angle, "rad"), "motor_torque": Channel(torque, "N m")}
        started = START + week * WEEK + timedelta(minutes=number)
        place = library / winch / started.date().isoformat() / f"{number}.csv"
        place.parent.mkdir(parents=True, exist_ok=True)
        write_run(Run("x", ticks, channels, {"started": started.isoformat()}), place)
    index_library(library)
    profile = tmp_path / "elbow.toml"
    profile.write_text('schema = 1\nkind = "axis"\n')
    result = run(library, "-p", profile, "--effect", "motor-viscous", "--json", code=1)
    found = json.loads(result.stdout)
    assert (found["effects"], found["sessions"]) == (["motor-viscous"], 12)
    (parameter,) = found["parameters"]
    changed = [winch for winch in parameter["winches"] if winch["changed"]]
    assert len(changed) == 1
    assert changed[0]["change"]["size"] == pytest.approx(0.01, abs=0.001)
    edge = (START + 2.5 * WEEK).timestamp()
    assert abs(changed[0]["change"]["date"] - edge) <= WEEK.total_seconds()


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Eight winches over six weeks, of which nothing but the files is known; their profiles."""
    folder = tmp_path_factory.mktemp("small")
    ticks, shipped = np.linspace(0.0, 1.9, 20), find("profiles", "bench-spiral").read_text()
    (folder / "profiles").mkdir()
    for winch, radius in enumerate(RADII):
        own = shipped.replace("60 mm", f"{radius:.4f} mm")
        assert own != shipped
        (folder / "profiles" / f"W{winch}.toml").write_text(own)
        for week in range(6):
            place = folder / f"W{winch}" / f"{(START + week * WEEK).date()}.csv"
            place.parent.mkdir(exist_ok=True)
            angle = np.random.default_rng([winch, week]).normal(size=20).cumsum()
            write_run(Run("x", ticks, {"motor_angle": Channel(angle, "rad")}, {}), place)
    index_library(folder)
    return folder


RADII = 60.0 + np.random.default_rng(5).normal(0.0, 0.3, 8)
"""Of the profiles, mm."""


@pytest.fixture
def fits(monkeypatch: pytest.MonkeyPatch) -> None:
    """Estimates that are given: W1 and W4 have each other's profiles, the cell of W2 creeps."""
    true = RADII.copy()
    true[[1, 4]] = RADII[[4, 1]]

    def given(
        _: object,
        profile: WinchProfile,
        terms: Sequence[Term],
        *,
        winch: str,
        time: float,
        **__: object,
    ) -> tuple[SessionEstimate, ...]:
        number, week = int(winch[1:]), (time - START.timestamp()) / WEEK.total_seconds()
        noise = np.random.default_rng([number, round(week)]).normal(0.0, 1.0, 2)
        radius = 1e-3 * true[number] + 2e-6 * noise[0] - profile.drum.winding_radius
        gain = 1e-4 * noise[1] + (0.003 * week if number == 2 else 0.0)
        known = {"drum-radius": (radius, 2e-6), "cell-gain": (gain, 1e-4)}
        return tuple(
            SessionEstimate(
                winch, time, term.effect.id, term.effect.parameters[0].name,
                *map(float, known[term.effect.id]), "1", (1.0,) * len(terms), {"tension": 150.0},
            )
            for term in terms
        )  # fmt: skip

    monkeypatch.setattr("winchkit.fleet.diagnosis.sessions.fit_session", given)


FOLLOWED = ("--effect", "drum-radius", "--effect", "cell-gain")


@pytest.mark.usefixtures("fits")
def test_a_folder_of_profiles_shows_which_were_exchanged_and_a_trend_its_limit(
    small: Path, tmp_path: Path
) -> None:
    page = tmp_path / "page.html"
    wanted = (small, "-p", small / "profiles", *FOLLOWED)
    limit = ("--limit", "cell-gain.gain_error=2 %")
    result = run(*wanted, *limit, "--html", page, code=1)
    text = " ".join(result.stdout.split())
    assert "winches W1 and W4 have exchanged profiles: W1 fits that of W4" in text
    assert "winch W2: the span of the load cell is wrong" in text
    # 0.3 % a week from week 0 reach 2 % after 6 2/3 weeks.
    day = datetime.fromisoformat(text.partition("reaches the limit of 2 % on ")[2][:10])
    assert abs(day.replace(tzinfo=UTC) - START - 6.67 * WEEK) < timedelta(days=3)
    content = page.read_text(encoding="utf-8").replace("\u00a0", " ")
    assert "W1 and W4 have exchanged profiles" in content
    assert "reaches the limit of 2 %" in content


@pytest.mark.usefixtures("fits")
def test_one_profile_of_all_winches_cannot_be_exchanged(small: Path) -> None:
    result = run(small, "-p", small / "profiles" / "W0.toml", *FOLLOWED, "--json", code=1)
    found = json.loads(result.stdout)
    assert (found["sessions"], found["swapped"], found["failures"]) == (48, [], {})


@pytest.mark.usefixtures("fits")
def test_a_winch_without_a_profile_costs_its_sessions_only(small: Path, tmp_path: Path) -> None:
    shutil.copytree(small / "profiles", tmp_path / "own")
    (tmp_path / "own" / "W3.toml").unlink()
    result = run(small, "-p", tmp_path / "own", *FOLLOWED, "--json", code=1)
    found = json.loads(result.stdout)
    assert (found["sessions"], len(found["failures"])) == (42, 6)
    assert "W3.toml" in found["failures"][f"W3 {START.date()}"]


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["-p", "nosuch"], 3, "there is no profile 'nosuch'"),
        (["--effect", "cell-gian"], 2, "did you mean 'cell-gain'?"),
        (["--limit", "cell-gain=3"], 2, "write EFFECT.PARAMETER=VALUE"),
        (["--limit", "cell-gain.size=3"], 2, "cell-gain has gain_error"),
        (["--limit", "cell-gain.gain_error=0"], 2, "above or below 0"),
        (["--limit", "cable-elongation-linear.axial_stiffness=-1 kN"], 2, "it is above 0"),
        ([], 2, "run 'winchkit fleet diagnose' first"),
    ],
)
def test_wrong_input(small: Path, arguments: list[str], code: int, words: str) -> None:
    result = run(small, "-p", find("profiles", "bench-spiral"), *arguments, code=code)
    assert words in result.stderr


def test_a_folder_without_an_index_is_refused(tmp_path: Path) -> None:
    wanted = ("-p", "bench-spiral", "--effect", "cell-gain")
    result = run(tmp_path, *wanted, code=3)
    assert "winchkit library index" in result.stderr
    result = run(tmp_path / "nowhere", *wanted, code=3)
    assert "no such folder" in result.stderr
    assert "library index" not in result.stderr
