"""``winchkit check`` and ``winchkit export``; no command replaces an earlier file by itself."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from command_line import done, invoke
from winchkit.runs import read_run

ROOT = Path(__file__).parents[3]
PROGRAMME = 'schema = 1\nkind = "programme"\nname = "short"\n[[step]]\nhold = "1 s"\n'
WINCH = """\
schema = 1
kind = "winch"
[drum]
kind = "grooved"
winding_radius = "60 mm"
groove_pitch = "5 mm"
[gearbox]
ratio = 20
[reference]
"""
RUN = "time [s],A.motor_angle [deg],B.motor_angle [rad],A.tension [kN]\n"
RUN += "".join(f"{n / 10},{n},{n},{'' if n == 2 else n}\n" for n in range(5))


@pytest.fixture
def programme(tmp_path: Path) -> Path:
    file = tmp_path / "p.toml"
    file.write_text(PROGRAMME)
    return file


@pytest.fixture
def run(tmp_path: Path) -> Path:
    file = tmp_path / "lift.csv"
    file.write_text(RUN)
    return file


def test_check_says_what_a_file_is(programme: Path, run: Path) -> None:
    result = done("check", programme, run)
    assert result.stdout.splitlines() == [
        f"{programme}: ok (programme 'short')",
        f"{run}: ok (run 'lift', 5 rows, 0.4 s at 10 Hz, no gaps, NaN: A.tension 1)",
    ]
    assert result.stderr == ""


def test_a_shipped_declaration_is_checked_by_its_name() -> None:
    result = done("check", "bench-spiral", "demo-fat-drum", "generic-cia402")
    assert "bench-spiral.toml: ok (winch 'bench-spiral')" in result.stdout


def test_a_new_profile_without_an_ending_is_no_fault_of_an_option(tmp_path: Path) -> None:
    result = done("profile", "new", tmp_path / "mine", code=2)
    assert "a profile is a .toml file; name one" in result.stderr
    assert "-o " not in result.stderr


def test_check_goes_on_after_a_bad_file(programme: Path, run: Path, tmp_path: Path) -> None:
    bad = tmp_path / "bad.toml"
    bad.write_text(PROGRAMME.replace('"1 s"', '"1 m"') + 'speed = "1 m/s"\nextra = 1\n')
    result = done("check", bad, tmp_path / "none.csv", programme, code=3)
    assert result.stdout == f"{programme}: ok (programme 'short')\n"
    assert [line.split(":")[1] for line in result.stderr.splitlines()[:2]] == ["5", "7"]
    assert "none.csv: there is no such file" in result.stderr


def test_check_in_json_is_complete(programme: Path, tmp_path: Path) -> None:
    bad = tmp_path / "bad.csv"
    bad.write_text("time [s],motor_angle [kg]\n0,0\n1,1\n")
    result = done("check", programme, bad, "--json", code=3)
    first, second = json.loads(result.stdout)["files"]
    assert first == {
        "path": str(programme),
        "ok": True,
        "kind": "programme",
        "name": "short",
        "details": [],
        "drive": None,
        "faults": [],
        "warnings": [],
    }
    assert second["ok"] is False
    (fault,) = second["faults"]
    assert fault["line"] == 1
    assert "a unit of mass, not of angle" in fault["message"]


def test_check_binds_the_effects_of_a_profile(tmp_path: Path) -> None:
    file = tmp_path / "w.toml"
    effect = '[[effect]]\nid = "drum-radius"\nradius_error = "1 mm"\n'
    file.write_text(WINCH + effect)
    assert invoke("check", file).exit_code == 0
    file.write_text(WINCH + effect.replace("drum-radius", "drum-radus"))
    result = done("check", file, code=3)
    assert result.stderr.startswith(f"{file}:10: ")
    assert "did you mean 'drum-radius'?" in result.stderr


def test_check_of_a_bench_looks_into_its_profiles(tmp_path: Path) -> None:
    (tmp_path / "w.toml").write_text(WINCH.replace('"60 mm"', '"60 kg"'))
    bench = tmp_path / "bench.toml"
    bench.write_text(
        'schema = 1\nkind = "bench"\n[bus.c]\nkind = "can"\ninterface = "virtual"\nchannel = "c"\n'
        '[winch.A]\nprofile = "w"\nservo = { device = "generic-cia402", bus = "c", node = 1 }\n'
        'limits = { speed = "0.5 m/s" }\n'
    )
    result = done("check", bench, code=3)
    assert f"{tmp_path / 'w.toml'}:5: drum.winding_radius" in result.stderr


def test_check_warns_and_is_content(tmp_path: Path) -> None:
    file = tmp_path / "w.toml"
    file.write_text(WINCH + '[guide]\nscrew_lead = "4 mm"\n')
    result = done("check", file)
    assert f"{file}:10: guide: " in result.stderr
    assert "(warning)" in result.stderr
    assert "ok (winch 'w')" in result.stdout


@pytest.mark.parametrize("name", ["notes.txt", "noext"])
def test_check_of_a_file_of_no_kind(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("hello")
    result = done("check", tmp_path / name, code=3)
    assert "is none of .toml, .eds, .dcf, .xdd, .xdc, .csv, .mcap" in result.stderr


@pytest.mark.slow
def test_everything_that_ships_is_without_fault() -> None:
    files = [
        path
        for folder in ("devices", "examples", "profiles", "sim")
        for path in (ROOT / folder).rglob("*.toml")
    ]
    result = done("check", *files)
    assert result.stdout.count(": ok (") == len(files)


@pytest.mark.parametrize("suffix", ["csv", "mcap"])
def test_export_in_si_with_a_summary(run: Path, tmp_path: Path, suffix: str) -> None:
    copy = tmp_path / f"copy.{suffix}"
    result = done("export", run, "-o", copy)
    assert result.stdout == ""
    assert result.stderr == f"{copy}: 5 rows, 0.4 s at 10 Hz, no gaps, NaN: A.tension 1\n"
    assert read_run(copy)["A.tension"][1] == 1000.0
    assert list(read_run(copy)) == list(read_run(run))


def test_export_of_one_winch(run: Path, tmp_path: Path) -> None:
    copy = tmp_path / "a.csv"
    result = invoke("export", run, "-o", copy, "--winch", "A", "--json")
    assert copy.read_text().splitlines()[0] == "time [s],motor_angle [rad],tension [N]"
    summary = json.loads(result.stdout)["summary"]
    assert summary["missing"] == {"motor_angle": 0, "tension": 1}


def test_what_export_refuses(run: Path, tmp_path: Path) -> None:
    for arguments, code, part in (
        ((run, "-o", tmp_path / "a.txt"), 2, "no format of a run"),
        ((run, "-o", tmp_path / "none" / "a.csv"), 3, "cannot be written"),
        ((run, "-o", tmp_path / "a.csv", "--winch", "C"), 3, "its winches are A, B"),
        ((tmp_path / "none.csv", "-o", tmp_path / "a.csv"), 3, "no such file"),
        ((run,), 2, "Missing option"),
    ):
        result = done("export", *arguments, code=code)
        assert part in result.stderr
    assert not (tmp_path / "a.csv").exists()


MOTION = """\
schema = 1
kind = "programme"
name = "m"

[[step]]
winch = "A"
by = "-0.1 m"
speed = "0.2 m/s"
acceleration = "0.5 m/s^2"
"""
ROWS = "\n".join(f"{k / 100},{k % 50},{k % 7}" for k in range(120))


def test_simulated_runs_of_another_seed_replace_none(tmp_path: Path) -> None:
    motion = tmp_path / "m.toml"
    motion.write_text(MOTION)
    words = ("sim", "record", "spiral-bench", motion, "--rate", "10 Hz", "-o", tmp_path / "runs")
    assert invoke(*words).exit_code == 0
    [run] = (tmp_path / "runs").glob("*.csv")
    first = run.read_bytes()
    refused = done(*words, "--seed", "1", code=2)
    assert f"{run} contains a log already" in refused.stderr
    assert "--replace" in refused.stderr
    assert run.read_bytes() == first
    assert invoke(*words, "--seed", "1", "--replace").exit_code == 0
    assert run.read_bytes() != first


def test_a_mapping_of_other_columns_is_not_replaced(tmp_path: Path) -> None:
    """A further file of the same columns keeps the mapping that is there."""
    one, two, other = (tmp_path / name for name in ("one.csv", "two.csv", "other.csv"))
    for path in (one, two):
        path.write_text(f"time [s],motor angle [deg],torque [Nm]\n{ROWS}\n")
    other.write_text(f"time [s],motor angle [rad],torque [mNm]\n{ROWS}\n")
    runs = tmp_path / "runs"
    assert invoke("import", one, "-o", runs, "-y").exit_code == 0
    mapping = (runs / "mapping.toml").read_text()
    assert invoke("import", two, "-o", runs, "-y").exit_code == 0
    assert (runs / "mapping.toml").read_text() == mapping
    refused = done("import", other, "-o", runs, "-y", code=2)
    assert "mapping.toml exists already, with other columns or units" in refused.stderr
    assert not (runs / "other.csv").exists()
    own = tmp_path / "own.toml"
    assert invoke("import", other, "-o", runs, "-y", "--save-mapping", own).exit_code == 0
    assert own.exists()
    assert (runs / "mapping.toml").read_text() == mapping


@pytest.mark.parametrize(
    "words",
    [
        ("export-model", "bench-spiral", "--to", "c", "-o"),
        ("plan", "none.csv", "-p", "bench-spiral", "-o"),
    ],
)
def test_an_output_is_refused_before_the_work(words: tuple[str, ...], tmp_path: Path) -> None:
    there = tmp_path / "there.toml"
    there.write_text("mine")
    refused = done(*words, there, code=2)
    assert "there.toml exists already" in refused.stderr
    assert there.read_text() == "mine"
