"""What compare, diagnose and add promise to others: keys, units, nulls, exit codes, streams."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from command_line import done, invoke
from model_files import SHIPPED, answer, record_files, side_by_side
from winchkit.runs import read_run, write_run
from winchkit.schema.read import read_profile

UNITS = {"cable_length": "m", "tension": "N", "motor_torque": "N m"}
BOTH = "motor drag, torque=30 mN m", "stretched cell, gain_error=0.02"


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """With two effects hidden."""
    return record_files(tmp_path_factory.mktemp("both"), *BOTH)


@pytest.fixture(scope="module")
def fat(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Of runs whose drum is fat, which a ratio imitates."""
    files = record_files(tmp_path_factory.mktemp("fat"), "fat drum", bench="grooved-bench")
    return answer("diagnose", *files, "--profile", "bench-grooved")


@pytest.fixture
def profile(tmp_path: Path) -> Path:
    path = tmp_path / "mine.toml"
    shutil.copy(SHIPPED, path)
    return path


def numbers(value: object) -> Iterator[float]:
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list):
        for item in value:
            yield from numbers(item)
    elif isinstance(value, float):
        yield value


def test_compare_has_every_key(runs: list[Path]) -> None:
    found = answer("compare", *runs, "--profile", "bench-spiral")
    assert found["schema"] == 1
    assert {name: output["unit"] for name, output in found["outputs"].items()} == UNITS
    for name, output in found["outputs"].items():
        assert set(output) >= {
            "unit", "samples", "band", "signal_rms", "rms", "max", "bias", "noise_rms", "follows",
        }  # fmt: skip
        if name == "motor_torque":  # At 50 Hz: from a tenth of the rate to 0.4 times the rate.
            assert 5.0 * (1 - 1e-9) <= output["band"] <= 20.0
        else:
            assert output["band"] is None
        assert output["rms"] <= output["max"]
        assert abs(output["bias"]) <= output["rms"]
        assert output["samples"] > 1000
        for follow in output["follows"]:
            assert set(follow) == {"variable", "share"}
            assert 0 < follow["share"] <= 1
    torque = found["outputs"]["motor_torque"]
    assert torque["rms"] > 3 * torque["noise_rms"]
    assert torque["follows"][0]["variable"] in {"direction", "speed"}


def test_diagnose_has_every_key(fat: dict[str, Any]) -> None:
    assert set(fat) >= {
        "schema", "verdict", "outputs", "steps", "candidates", "detectable", "unexplained",
        "next_runs",
    }  # fmt: skip
    assert fat["schema"] == 1
    assert fat["verdict"] == "explained"
    assert {name: output["unit"] for name, output in fat["outputs"].items()} == UNITS
    for output in fat["outputs"].values():
        assert set(output) >= {
            "unit", "band", "signal_rms", "rms_before", "rms_after", "heldout_rms_before",
            "heldout_rms_after", "noise_rms",
        }  # fmt: skip
    for item in fat["candidates"]:
        assert set(item) == {"effect", "score", "heldout_rms"}
        assert set(item["heldout_rms"]) <= set(UNITS)
    for item in fat["detectable"]:
        assert set(item) == {"effect", "parameter", "smallest", "unit"}
    assert set(fat["unexplained"]) == {"share", "where", "empirical"}
    for run in fat["next_runs"]:
        assert set(run) == {"separates", "programme", "power"}
        assert len(run["separates"]) == 2


def test_a_step_of_a_set_holds_a_value_and_a_deviation_of_every_member(fat: dict[str, Any]) -> None:
    (step,) = fat["steps"]
    assert set(step) >= {"effects", "parameters", "heldout_gain"}
    assert set(step["effects"]) >= {"drum-radius", "gear-ratio"}
    assert list(step["parameters"]) == step["effects"]
    deviations = []
    for values in step["parameters"].values():
        for estimate in values.values():
            assert set(estimate) >= {"value", "std", "unit"}
            deviations.append(estimate["std"])
    assert all(std > 0 for std in deviations)
    assert step["parameters"]["drum-radius"]["radius_error"]["unit"] == "m"
    assert 0 < step["heldout_gain"] < 1


def test_numbers_are_numbers(fat: dict[str, Any]) -> None:
    """The reader refuses NaN and Infinity, which are no JSON."""
    assert len(list(numbers(fat))) > 50


def test_a_page_goes_to_its_file_and_says_so_elsewhere(runs: list[Path], tmp_path: Path) -> None:
    page = tmp_path / "report.html"
    found = answer("diagnose", *runs[:2], "-p", "bench-spiral", "--band", 2, "--html", page)
    assert found["outputs"]["motor_torque"]["band"] == 2.0
    assert found["verdict"] in {"explained", "partly"}
    assert page.read_text(encoding="utf-8").lstrip().lower().startswith("<!doctype html>")


def test_add_fits_writes_and_is_reproduced(runs: list[Path], profile: Path, tmp_path: Path) -> None:
    better = tmp_path / "better.toml"
    found = answer("add", "motor-coulomb", "--profile", profile, "--fit", *runs, "-o", better)
    assert found["schema"] == 1
    for output in found["outputs"].values():
        assert set(output) >= {
            "rms_before", "rms_after", "heldout_rms_before", "heldout_rms_after", "noise_rms",
        }  # fmt: skip
    estimate = found["parameters"]["motor-coulomb"]["torque"]
    assert set(estimate) >= {"value", "std", "unit"}
    assert estimate["unit"] == "N m"
    assert abs(estimate["value"] - 0.03) < 5 * estimate["std"]
    torque = found["outputs"]["motor_torque"]
    assert torque["rms_after"] < 0.5 * torque["rms_before"]
    assert torque["heldout_rms_after"] < 1.3 * torque["noise_rms"]
    checked = done("check", better)
    assert checked.stderr == ""


def test_compare_reproduces_what_add_said(runs: list[Path], profile: Path, tmp_path: Path) -> None:
    better = tmp_path / "better.toml"
    found = answer("add", "motor-coulomb", "-p", profile, "--fit", *runs[:4], "-o", better)
    compared = answer("compare", *runs[:4], "-p", better)["outputs"]
    assert set(compared) == set(UNITS)
    for output, error in compared.items():
        said = found["outputs"][output]["rms_after"]
        assert error["rms"] == pytest.approx(said, rel=0.01), output


def test_add_builds_on_itself_and_keeps_the_users_words(
    runs: list[Path], profile: Path, tmp_path: Path
) -> None:
    first, second = tmp_path / "first.toml", tmp_path / "second.toml"
    answer("add", "motor-coulomb", "-p", profile, "--fit", *runs, "-o", first)
    found = answer("add", "cell-gain", "-p", first, "--fit", *runs, "-o", second)
    assert list(found["parameters"]) == ["motor-coulomb", "cell-gain"]
    text, written = SHIPPED.read_text(), second.read_text()
    assert written.startswith(text.rstrip("\n"))
    for line in text.splitlines():
        assert line in written.splitlines()
    effects = read_profile(second).effect
    assert [table.id for table in effects] == ["motor-coulomb", "cell-gain"]
    for table in effects:
        fitted = table.values["fitted"]
        assert fitted["runs"] == [path.name for path in runs]
        assert set(fitted) == {"runs", "date", "std"}
    assert invoke("check", second).exit_code == 0
    assert profile.read_text() == text
    after = answer("diagnose", *runs, "-p", second)
    assert after["verdict"] == "adequate"
    assert after["steps"] == []


def test_add_refits_what_is_there(runs: list[Path], profile: Path, tmp_path: Path) -> None:
    first, second = tmp_path / "first.toml", tmp_path / "second.toml"
    answer("add", "motor-coulomb", "-p", profile, "--fit", *runs[:4], "-o", first)
    right = first.read_text()
    wrong = right.replace(read_profile(first).effect[0].values["torque"], "55 mN m")
    assert wrong != right
    first.write_text(wrong)
    told = answer("add", "motor-coulomb", "-p", first, "--fit", *runs[:4], "-o", second)
    torque = told["outputs"]["motor_torque"]
    assert torque["heldout_rms_after"] < 0.8 * torque["heldout_rms_before"]
    (table,) = read_profile(second).effect
    assert table.id == "motor-coulomb"
    assert table.values["torque"] != "55 mN m"


def test_add_may_write_over_its_source(runs: list[Path], profile: Path) -> None:
    answer("add", "motor-coulomb", "-p", profile, "--fit", *runs[:4], "-o", profile)
    assert [table.id for table in read_profile(profile).effect] == ["motor-coulomb"]


@pytest.mark.parametrize(
    "order",
    [
        "EFFECT --fit RUNS -o NEW -p P",
        "--fit RUNS -o NEW -p P EFFECT",
        "--json EFFECT -o NEW --fit RUN --fit RUN -p P",
        "--fit=RUN EFFECT --fit RUN -o NEW --profile=P",
    ],
)
def test_options_of_add_come_in_any_order(
    order: str, runs: list[Path], profile: Path, tmp_path: Path
) -> None:
    new, left = tmp_path / "new.toml", iter(runs[:2])
    arguments: list[str] = []
    for word in order.split():
        if word == "RUNS":
            arguments += [str(run) for run in left]
        elif word.endswith("RUN"):
            arguments.append(word.replace("RUN", str(next(left))))
        else:
            words = {"EFFECT": "motor-coulomb", "NEW": str(new), "P": str(profile)}
            arguments.append(words.get(word, word.replace("=P", f"={profile}")))
    done("add", *arguments)
    fitted = read_profile(new).effect[0].values["fitted"]
    assert fitted["runs"] == [run.name for run in runs[:2]]


def test_the_band_is_the_users(runs: list[Path]) -> None:
    default = answer("compare", *runs[:4], "-p", "bench-spiral")["outputs"]
    narrow = answer("compare", *runs[:4], "-p", "bench-spiral", "--band", "2")["outputs"]
    assert 5.0 * (1 - 1e-9) <= default["motor_torque"]["band"] <= 20.0
    assert narrow["motor_torque"]["band"] == 2.0
    assert narrow["motor_torque"]["noise_rms"] < default["motor_torque"]["noise_rms"]
    assert narrow["tension"] == default["tension"]


def test_one_winch_of_several(runs: list[Path], tmp_path: Path) -> None:
    both = tmp_path / "both.csv"
    write_run(side_by_side(read_run(runs[0]), read_run(runs[2])), both)
    result = done("compare", both, "-p", "bench-spiral", "--json", code=2)
    assert result.stdout == ""
    assert "has the winches A, B; choose one with --winch" in result.stderr
    one = answer("compare", both, "-p", "bench-spiral", "--winch", "A")["outputs"]
    alone = answer("compare", runs[0], "-p", "bench-spiral")["outputs"]
    assert one["tension"]["rms"] == pytest.approx(alone["tension"]["rms"], rel=1e-6)
    assert one != answer("compare", both, "-p", "bench-spiral", "--winch", "B")["outputs"]
    wrong = done("compare", both, "-p", "bench-spiral", "--winch", "C", code=2)
    assert "no winch 'C'; it has A, B" in wrong.stderr
    other = invoke("compare", runs[0], "-p", "bench-spiral", "--winch", "B")
    assert (other.exit_code, other.stdout) == (2, ""), "its metadata name winch A"
    assert "no winch 'B'; it has A" in other.stderr


@pytest.fixture(scope="module")
def both(runs: list[Path], tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Two winches in one recording, and its repeat."""
    folder = tmp_path_factory.mktemp("winches")
    out = [folder / "both-1.csv", folder / "both-2.csv"]
    for path, (first, second) in zip(out, ((0, 2), (1, 3)), strict=True):
        write_run(side_by_side(read_run(runs[first]), read_run(runs[second])), path)
    return out


def test_all_winches_of_a_recording_each_by_itself(both: list[Path]) -> None:
    each = answer("diagnose", *both, "-p", "bench-spiral", "--winch", "all")
    assert each["schema"] == 1
    assert list(each["winches"]) == ["A", "B"]
    alone = answer("diagnose", *both, "-p", "bench-spiral", "--winch", "B")
    assert alone == each["winches"]["B"] != each["winches"]["A"]
    assert set(each["shared"]) == {"effects", "alarms"}
    for one in each["shared"]["effects"]:
        told = [*one["winches"], *one["without"], *one["unsure"]]
        assert sorted(told) == ["A", "B"]
        for name in one["winches"]:
            steps = each["winches"][name]["steps"]
            assert any(one["effects"][0] in step["effects"] for step in steps)


def test_all_winches_in_text_and_on_pages(both: list[Path], tmp_path: Path) -> None:
    page = tmp_path / "p.html"
    told = done("diagnose", *both, "-p", "bench-spiral", "--winch", "all", "--html", page)
    lines = told.stdout.splitlines()
    assert [line for line in lines if line.startswith("winch ")] == ["winch A", "winch B"]
    assert lines.index("all 2 winches") > lines.index("winch B")
    assert told.stderr == f"report: {page}\n"
    written = page.read_text(encoding="utf-8")
    for name in "AB":
        assert f'<a href="p-{name}.html">{name}</a>' in written
        own = (tmp_path / f"p-{name}.html").read_text(encoding="utf-8")
        # Its commands repeat that winch alone.
        assert f"--winch {name} " in own
        assert "--winch all" not in own


def test_errors_of_all_winches(both: list[Path], tmp_path: Path) -> None:
    asked = ("compare", *both, "-p", "bench-spiral", "--winch", "all")
    each = answer(*asked)
    assert list(each["winches"]) == ["A", "B"]
    for name, found in each["winches"].items():
        assert found == answer("compare", *both, "-p", "bench-spiral", "--winch", name)
    assert set(each["shared"]["outputs"]) == set(UNITS)
    for output, error in each["shared"]["outputs"].items():
        own = [found["outputs"][output]["rms"] for found in each["winches"].values()]
        assert error["rms"] ** 2 == pytest.approx(sum(x**2 for x in own) / 2)
        assert error["winches"]["A"] == pytest.approx(own[0] ** 2 / sum(x**2 for x in own))
        for follow in error["follows"]:
            assert set(follow) == {"variable", "share", "common", "apart"}
            assert 0 <= follow["common"] <= follow["share"] <= 1
    # The motor's drag is the same in both, whatever each of them carries.
    torque = {f["variable"]: f for f in each["shared"]["outputs"]["motor_torque"]["follows"]}
    assert torque["direction"]["common"] > 0.9 * torque["direction"]["share"]
    page = tmp_path / "c.html"
    told = done(*asked, "--html", page)
    assert "share of the errors' variance explained by" in told.stdout
    assert '<a href="c-B.html">B</a>' in page.read_text(encoding="utf-8")
    assert (tmp_path / "c-B.html").is_file()


def test_winches_whose_pages_would_be_one(runs: list[Path], tmp_path: Path) -> None:
    run = side_by_side(read_run(runs[0]), read_run(runs[2]))
    odd = {name.replace("A.", "x y.").replace("B.", "x-y."): c for name, c in run.channels.items()}
    path = tmp_path / "odd.csv"
    write_run(replace(run, channels=odd), path)
    asked = ("compare", path, "-p", "bench-spiral", "--winch", "all")
    refused = done(*asked, "--html", tmp_path / "o.html", code=2)
    assert "no page for each of the winches" in refused.stderr
    assert list(answer(*asked)["winches"]) == ["x y", "x-y"]


def test_all_winches_of_a_run_that_names_none(runs: list[Path]) -> None:
    alone = invoke("compare", *runs[:2], "-p", "bench-spiral")
    each = done("compare", *runs[:2], "-p", "bench-spiral", "--winch", "all")
    assert each.stdout == alone.stdout
