"""Plans of the next run; what running them decides is test_whole_procedure.py's."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import pytest

from command_line import done, invoke
from model_files import answer, record_files, write_runs
from winchkit.catalog import find
from winchkit.cli.model.plan import suggest_run
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.design.plan import programme_of
from winchkit.diagnosis.design.programmes import CANDIDATE_PROGRAMMES, usual_temperature
from winchkit.runs import read_run
from winchkit.schema.programme import Programme
from winchkit.schema.read import read_profile, read_programme, read_simbench
from winchkit.sim.bench import profiles_of
from winchkit.sim.live.bench_file import write_bench
from winchkit.sim.record import simulate

BENCH = read_simbench(find("sim", "demo-fat-drum"))
PROFILE = find("profiles", "bench-spiral")


def recorded(programme: Programme, folder: Path) -> list[Path]:
    return write_runs(folder, simulate(BENCH, profiles_of(BENCH), programme, seed=0))


@pytest.fixture(scope="module")
def fat(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("fat")
    names = ("programme-demo-fast", "programme-demo-slow")
    return [path for n in names for path in recorded(read_programme(find("sim", n)), folder)]


def test_the_plan_is_a_programme_that_distinguishes_them(fat: list[Path], tmp_path: Path) -> None:
    before = answer("diagnose", *fat, "-p", "bench-spiral")
    (step,) = before["steps"]
    assert "drum-radius" in step["effects"]
    assert len(step["effects"]) > 1
    next_file = tmp_path / "next.toml"
    told = answer("plan", *fat, "-p", "bench-spiral", "-o", next_file)
    best = told["offers"][0]
    assert {name for pair in best["separates"] for name in pair["effects"]} == set(step["effects"])

    def separated(offer: dict[str, Any]) -> int:
        return sum(pair["power"] >= 0.9 for pair in offer["separates"])

    assert separated(best) == max(map(separated, told["offers"])) > 0
    programme = read_programme(next_file)
    assert programme.repeat == 1, "the runs so far have repeats"
    reached = [step.to for step in programme.step if step.to is not None]
    assert min(reached) == pytest.approx(1.5, abs=0.01)
    assert 1.6 < max(reached) < 2.81, "the range of the runs"
    assert invoke("check", next_file).exit_code == 0


def test_where_nothing_is_to_be_distinguished_it_shows_something_new(tmp_path: Path) -> None:
    runs = record_files(tmp_path)
    told = answer("plan", *runs, "-p", "bench-spiral")
    assert told["programme"] is None
    best = told["offers"][0]
    assert best["separates"] == []
    assert best["shows"]
    rates = [len(offer["shows"]) / offer["minutes"] for offer in told["offers"]]
    assert rates == sorted(rates, reverse=True)
    # Warming a machine through takes an operator a third of an hour.
    minutes = {offer["kind"]: offer["minutes"] for offer in told["offers"]}
    assert minutes["full stroke, warmed up by 15 K"] > 20
    assert minutes["full stroke"] < 2
    text = invoke("plan", *runs, "-p", "bench-spiral").stdout
    assert text.startswith(f"Run next: {best['kind']}, {best['minutes']:.1f} minutes.")
    for offer in told["offers"]:
        assert f"\n  {offer['kind']}  " in text


def test_a_place_that_cannot_be_written_is_a_bad_file(fat: list[Path]) -> None:
    result = done("plan", *fat, "-p", "bench-spiral", "-o", "/no/such/folder/next.toml", code=3)
    assert "cannot be written" in result.stderr


def test_with_a_bench_the_plan_uses_the_room_that_its_limits_leave(
    fat: list[Path], tmp_path: Path
) -> None:
    bench = write_bench(BENCH.bench, tmp_path / "bench.toml")
    next_file = tmp_path / "wide.toml"
    done("plan", *fat, "-p", "bench-spiral", "-b", bench, "-o", next_file)
    limits = BENCH.bench.winch["A"].limits
    assert limits.length is not None
    programme = read_programme(next_file)
    reached = [step.to for step in programme.step if step.to is not None]
    span = limits.length[1] - limits.length[0]
    assert min(reached) == pytest.approx(limits.length[0] + 0.05 * span, abs=1e-3)
    assert max(reached) == pytest.approx(limits.length[1] - 0.05 * span, abs=1e-3)
    assert max(step.speed or 0.0 for step in programme.step) <= limits.speed
    loads = [step.load_mass for step in programme.step if step.load_mass is not None]
    assert all(load * 9.80665 < (limits.tension_high or 0.0) for load in loads)
    wrong = done("plan", *fat, "-p", "bench-spiral", "-b", bench, "--winch", "B", code=2)
    assert "has no winch 'B'; it has A" in wrong.stderr


def test_a_warmed_programme_asks_for_temperatures_that_a_simulation_obeys(tmp_path: Path) -> None:
    dataset = prepare([read_run(p) for p in record_files(tmp_path)], read_profile(PROFILE))
    warmed = next(kind for kind in CANDIDATE_PROGRAMMES if kind.temperature_rise)
    programme = programme_of(dataset, warmed, "warm")
    asked = [step.temperature for step in programme.step if step.temperature is not None]
    usual = usual_temperature(dataset)
    assert usual is not None
    assert asked == [pytest.approx(usual + 15.0, abs=0.5)]
    runs = list(simulate(BENCH, profiles_of(BENCH), programme, rate=10.0))
    assert len(runs) == 2
    means = [float(run["temperature"].mean()) for run in runs]
    assert means == pytest.approx(asked * 2, abs=0.1)


def test_the_suggested_run_names_a_bench_or_its_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    with click.Context(click.Command("plan")):
        suggest_run(Path("next.toml"), None)
        suggest_run(Path("next.toml"), "b.toml")
        (tmp_path / "bench.toml").write_text('schema = 1\nkind = "bench"\n')
        suggest_run(Path("next.toml"), None)
    assert capsys.readouterr().err.splitlines() == [
        "on a bench: winchkit run next.toml -b BENCH.toml",
        "next: winchkit run next.toml -b b.toml",
        "next: winchkit run next.toml",
    ]
