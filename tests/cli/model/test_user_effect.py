"""A user's own effect takes part in everything; its physics is hidden by changing recorded runs."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from command_line import done, invoke
from model_files import HEIGHT, KINK, SHIPPED, answer, kinked, record_files


@pytest.fixture
def profile(tmp_path: Path) -> Path:
    path = tmp_path / "mine.toml"
    shutil.copy(SHIPPED, path)
    return path


@pytest.fixture(scope="module")
def bent(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    return record_files(tmp_path_factory.mktemp("bent"), change=kinked)


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    path = tmp_path / "kink.py"
    path.write_text(KINK)
    return path


@pytest.mark.slow
def test_an_own_effect_is_found(bent: list[Path], mine: Path) -> None:
    found = answer("diagnose", *bent, "-p", "bench-spiral", "--effects", mine)
    assert found["verdict"] == "explained"
    (step,) = found["steps"]
    assert step["effects"] == ["kinked-rope"]
    estimate = step["parameters"]["kinked-rope"]["height"]
    assert estimate["unit"] == "m"
    assert abs(estimate["value"] - HEIGHT) < 5 * estimate["std"]
    assert "kinked-rope" in {item["effect"] for item in found["detectable"]}


@pytest.mark.slow
def test_an_own_effect_is_missed_without_its_file_and_nothing_is_named(bent: list[Path]) -> None:
    found = answer("diagnose", *bent, "-p", "bench-spiral")
    assert found["verdict"] in {"unknown", "partly"}
    assert found["steps"] == []


def test_an_own_effect_is_added_and_then_belongs_to_the_profile(
    bent: list[Path], mine: Path, profile: Path, tmp_path: Path
) -> None:
    new = tmp_path / "new.toml"
    arguments = ("-p", profile, "--effects", mine, "kinked-rope", "--fit", *bent, "-o", new)
    found = answer("add", *arguments)
    after = found["outputs"]["cable_length"]
    assert after["heldout_rms_after"] < 1.3 * after["noise_rms"]
    compared = answer("compare", *bent, "-p", new, "--effects", mine)["outputs"]
    assert compared["cable_length"]["rms"] == pytest.approx(after["rms_after"], rel=0.01)
    without = done("compare", *bent, "-p", new, code=3)
    assert without.stderr.startswith(f"{new}:")
    assert "no effect 'kinked-rope'" in without.stderr


def test_an_own_effect_that_cannot_be_loaded_says_where(bent: list[Path], tmp_path: Path) -> None:
    broken = tmp_path / "broken.py"
    for text, said in (
        ("def apply(:\n", f"{broken}:1: cannot be run: SyntaxError"),
        ("x = 1\n", f"{broken}: has no object of class winchkit.effects.effect.Effect"),
        ("import nothing_like_it\n", f"{broken}: cannot be run: ModuleNotFoundError"),
    ):
        broken.write_text(text)
        result = invoke("compare", *bent, "-p", "bench-spiral", "--effects", broken)
        assert (result.exit_code, result.stdout) == (3, "")
        assert said in result.stderr
