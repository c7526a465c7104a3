"""Schedules and simulated runs of programmes: number of runs, and their content."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from plant_benches import GRAVITY, GROOVED, bench, hide, programme
from winchkit.cli.sim.group import command
from winchkit.errors import FileError, UsageError
from winchkit.runs import read_run
from winchkit.schema.bench import BenchSpec, LimitSpec
from winchkit.schema.programme import Programme, ProgrammeStep
from winchkit.schema.simbench import NoiseSpec, SimBench, WinchTruth
from winchkit.sim.record import simulate
from winchkit.sim.schedule import ASK_PAUSE, schedule

LIMITS = {"A": LimitSpec(speed=0.5, acceleration=1.0, length=(0.5, 5.0))}
UP_AND_DOWN = (
    ProgrammeStep(to=3.0, speed=0.5),
    ProgrammeStep(hold=0.2),
    ProgrammeStep(to=3.6, speed=0.5),
)
TWO_LOADS = (
    ProgrammeStep(ask="hang", load_mass=10.0),
    *UP_AND_DOWN,
    ProgrammeStep(ask="hang", load_mass=20.0),
    *UP_AND_DOWN,
)


def plans(motion: Programme, start: float = 4.0) -> list:
    return schedule(motion, LIMITS, {"A": start}, {"A": 10.0})


@pytest.mark.parametrize(
    "steps", [(ProgrammeStep(to=2.0),), (ProgrammeStep(by=0.0),), (ProgrammeStep(ask="hang"),)]
)
def test_a_programme_that_leaves_nothing_to_record_is_reported(
    steps: tuple[ProgrammeStep, ...],
) -> None:
    """Its repeats end where they start: without the error no file would be written."""
    with pytest.raises(FileError, match="neither a move nor a hold"):
        plans(programme(*steps, repeat=2))


def test_every_load_and_repeat_is_a_run() -> None:
    found = plans(programme(*TWO_LOADS, repeat=2))
    assert [plan.load_mass["A"] for plan in found] == [10.0, 20.0, 10.0, 20.0]
    assert {plan.start["A"] for plan in found} == {3.6}
    assert len({plan.duration for plan in found}) == 1
    assert found[1].elapsed == pytest.approx(2 * ASK_PAUSE + found[0].duration)


def test_relative_moves_start_where_the_winch_stands() -> None:
    (only,) = plans(programme(ProgrammeStep(by=-0.5, speed=0.3), ProgrammeStep(by=0.2, speed=0.3)))
    assert only.start["A"] == 4.0
    assert sum(leg.moves["A"].distance for leg in only.legs) == pytest.approx(-0.3)


def test_speed_is_limited_by_the_bench() -> None:
    (only,) = plans(programme(ProgrammeStep(by=-2.0, speed=9.0, acceleration=9.0)))
    move = only.legs[0].moves["A"]
    assert abs(move.at(move.duration / 2)[1]) == pytest.approx(0.5)


def test_a_move_to_where_it_stands_takes_no_time() -> None:
    (found,) = plans(programme(ProgrammeStep(to=4.0, speed=0.1), ProgrammeStep(hold=0.5)))
    assert found.duration == 0.5


@pytest.mark.parametrize(
    ("step", "message"),
    [
        (ProgrammeStep(winch="B", to=3.0, speed=0.1), r"no winch 'B'.*it has A"),
        (ProgrammeStep(to=9.0, speed=0.1), r"would be at 9 m, outside its limits 0.5 m to 5 m"),
    ],
)
def test_steps_that_do_not_fit(step: ProgrammeStep, message: str) -> None:
    with pytest.raises(FileError, match=message):
        plans(programme(step))


def test_a_run_shows_the_motion_and_the_load() -> None:
    runs = list(simulate(bench(), {"A": GROOVED}, programme(*TWO_LOADS, repeat=2), rate=50.0))
    assert [run.name for run in runs] == ["try-10kg-1", "try-20kg-1", "try-10kg-2", "try-20kg-2"]
    for run in runs:
        assert run.time == pytest.approx(np.arange(len(run)) / 50)
        assert run["cable_length"][0] == pytest.approx(3.6, abs=1e-6)
        assert run["cable_length"].min() == pytest.approx(3.0, abs=1e-3)
        assert run["cable_length"][-1] == pytest.approx(3.6, abs=2e-3)
        assert run["tension"][0] == pytest.approx(run.load_mass * GRAVITY, rel=1e-3)
        assert "load" not in run
    assert runs[0]["motor_angle"] == pytest.approx(runs[2]["motor_angle"])


def test_the_seed_is_all_that_differs() -> None:
    noisy = bench(noise=NoiseSpec(3e-4, 0.8, 5e-3, 0.8, 0.05))
    motion = programme(*UP_AND_DOWN, repeat=2)

    def tension(seed: int) -> list[np.ndarray]:
        return [run["tension"] for run in simulate(noisy, {"A": GROOVED}, motion, seed=seed)]

    first, again, other = tension(1), tension(1), tension(2)
    assert all(np.array_equal(a, b) for a, b in zip(first, again, strict=True))
    assert not np.array_equal(first[0], other[0])
    assert not np.array_equal(first[0], first[1])


def test_temperature_goes_on_from_run_to_run() -> None:
    warming = bench(truth={"A": WinchTruth(load_mass=10.0, temperature_drift=360.0)})
    runs = list(simulate(warming, {"A": GROOVED}, programme(*TWO_LOADS)))
    assert runs[0]["temperature"][0] == pytest.approx(20.0 + 0.1 * ASK_PAUSE, abs=0.01)
    gained = 0.1 * (runs[0].time[-1] + ASK_PAUSE)
    assert runs[1]["temperature"][0] - runs[0]["temperature"][0] == pytest.approx(gained, abs=0.01)


def test_memories_start_afresh_in_every_run() -> None:
    creeping = bench(truth={"A": WinchTruth(hidden=(hide("creeping rope"),), load_mass=10.0)})
    one, two = simulate(creeping, {"A": GROOVED}, programme(*UP_AND_DOWN, repeat=2))
    assert np.array_equal(one["cable_length"], two["cable_length"])


def test_two_winches_share_a_file() -> None:
    single = bench()
    wiring = {"A": single.bench.winch["A"], "B": single.bench.winch["A"]}
    pair = SimBench("pair", BenchSpec("pair", wiring, {}), dict.fromkeys("AB", single.truth["A"]))
    motion = programme(
        ProgrammeStep(winch="B", to=3.5, speed=0.5), ProgrammeStep(to=3.8, speed=0.2)
    )
    (run,) = simulate(pair, {"A": GROOVED, "B": GROOVED}, motion)
    assert run.winches() == ["A", "B"]
    a, b = run.of_winch("A")["cable_length"], run.of_winch("B")["cable_length"]
    assert a[0] == pytest.approx(b[0]) == pytest.approx(3.8)
    assert a[: len(a) // 4] == pytest.approx(3.8)
    assert b.min() == pytest.approx(3.5, abs=1e-3)
    assert run.load_mass == 10.0


def test_a_load_cell_at_the_platform_needs_no_declared_mass() -> None:
    plain = bench()
    wired = replace(plain.bench.winch["A"], load=plain.bench.winch["A"].cell, cell=None)
    celled = replace(plain, bench=replace(plain.bench, winch={"A": wired}))
    (run,) = simulate(celled, {"A": GROOVED}, programme(*UP_AND_DOWN))
    assert run.load_mass is None
    assert run["load"][0] == pytest.approx(10 * GRAVITY, rel=1e-3)
    assert "tension" not in run


@pytest.mark.parametrize("rate", [0.0, -5.0, 2000.0, float("nan")])
def test_a_rate_that_cannot_be(rate: float) -> None:
    with pytest.raises(UsageError, match="at most 1000 Hz"):
        list(simulate(bench(), {"A": GROOVED}, programme(*UP_AND_DOWN), rate=rate))


@pytest.mark.parametrize("suffix", ["csv", "mcap"])
def test_the_command_writes_runs_that_can_be_read(suffix: str, tmp_path: Path) -> None:
    motion = tmp_path / "short.toml"
    motion.write_text(
        'schema = 1\nkind = "programme"\nname = "short"\n'
        '[[step]]\nby = "-0.1 m"\nspeed = "0.2 m/s"\n[[step]]\nhold = "0.2 s"\n'
    )
    arguments = ["record", "spiral-bench", str(motion), "--out", str(tmp_path / "runs")]
    arguments += ["--format", suffix, "--hidden", "elastic rope, axial_stiffness=90 kN", "--json"]
    result = CliRunner().invoke(command, arguments, catch_exceptions=False)
    assert result.exit_code == 0
    (entry,) = json.loads(result.stdout)["runs"]
    run = read_run(entry["path"])
    assert len(run) == entry["rows"]
    assert run.load_mass == 10.0
    # The cable is longer than declared by what its load stretches it.
    assert run["cable_length"][0] == pytest.approx(4.0 + 10 * GRAVITY * 5.5 / 90e3, abs=2e-3)
    assert "hidden" not in Path(entry["path"]).read_bytes().decode("latin-1")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nothing", "programme-demo"], "no simulated bench 'nothing'"),
        (["spiral-bench", "programme-dem"], "did you mean 'programme-demo'"),
        (["spiral-bench", "programme-demo", "--hidden", "fat dum"], "did you mean 'fat drum'"),
        (["spiral-bench", "programme-demo", "--rate", "50"], "has no unit"),
    ],
)
def test_the_command_says_what_is_wrong(arguments: list[str], message: str, tmp_path: Path) -> None:
    out = tmp_path / "runs"
    result = CliRunner().invoke(command, ["record", *arguments, "--out", str(out)])
    assert isinstance(result.exception, FileError | UsageError)
    assert message in str(result.exception)
    assert not out.exists()


def test_the_command_lists_benches_and_physics() -> None:
    listed = CliRunner().invoke(command, ["list"], catch_exceptions=False).stdout
    assert "demo-elastic-rope" in listed
    assert "programme-demo" not in listed
    physics = CliRunner().invoke(command, ["list", "--physics", "--json"], catch_exceptions=False)
    assert any(row["name"] == "fat drum" for row in json.loads(physics.stdout)["physics"])
