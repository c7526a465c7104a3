"""A profile remembers how it grew, and every step can be taken back."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from command_line import done, invoke
from model_files import SHIPPED, answer, record_files
from winchkit.schema.read import read_profile


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    return record_files(tmp_path_factory.mktemp("ledger"), "motor drag")[:4]


@pytest.fixture
def declared(tmp_path: Path) -> Path:
    """A shipped profile with comments and a shorthand of the user's own."""
    path = tmp_path / "mine.toml"
    shutil.copy(SHIPPED, path)
    text = path.read_text().replace("[cable]", '[cable]   # ours\naxial_stiffness = "500 kN"')
    path.write_text(text)
    return path


@pytest.mark.slow
def test_every_step_is_noted_and_taken_back(
    runs: list[Path], declared: Path, tmp_path: Path
) -> None:
    first, second, third = (tmp_path / f"{n}.toml" for n in (1, 2, 3))
    one = answer("add", "motor-coulomb", "-p", declared, "--fit", *runs, "-o", first)
    answer("add", "cell-gain", "-p", first, "--fit", *runs, "-o", second)
    gone = answer("remove", "motor-coulomb", "-p", second, "--fit", *runs, "-o", third)
    steps = answer("ledger", "-p", third)["steps"]
    assert [(s["did"], s["effect"]) for s in steps] == [
        ("add", "motor-coulomb"), ("add", "cell-gain"), ("remove", "motor-coulomb"),
    ]  # fmt: skip
    torque = one["outputs"]["motor_torque"]
    assert steps[0]["before"]["motor_torque"] == pytest.approx(torque["heldout_rms_before"])
    assert steps[0]["after"]["motor_torque"] == pytest.approx(torque["heldout_rms_after"])
    assert steps[2]["after"]["motor_torque"] > 2 * steps[1]["after"]["motor_torque"]
    assert "motor-coulomb" not in gone["parameters"]
    assert read_profile(declared).cable.axial_stiffness == 500e3
    assert read_profile(first).cable.axial_stiffness != 500e3
    for path, before in ((third, second), (second, first), (first, declared)):
        assert invoke("undo", "-p", path).exit_code == 0
        restored, was = read_profile(path), read_profile(before)
        assert restored.cable == was.cable
        assert [(t.id, t.values) for t in restored.effect] == [(t.id, t.values) for t in was.effect]
        assert restored.ledger == was.ledger
        before.write_text(path.read_text())
    assert first.read_text().split() == declared.read_text().split()
    nothing = done("undo", "-p", first, code=3)
    assert "nothing to undo" in nothing.stderr


def test_an_effect_goes_without_runs_too(runs: list[Path], declared: Path, tmp_path: Path) -> None:
    added, less = tmp_path / "added.toml", tmp_path / "less.toml"
    declared.write_text(
        declared.read_text().replace("ratio = 20.4", "ratio = 20.4\nefficiency = 0.9")
    )
    answer("add", "motor-coulomb", "-p", declared, "--fit", *runs, "-o", added)
    assert invoke("remove", "motor-coulomb", "-p", added, "-o", less).exit_code == 0
    assert read_profile(less).effect == ()
    assert read_profile(less).gearbox.efficiency == pytest.approx(1.0, abs=0.02)
    shown = invoke("ledger", "-p", less).stdout
    assert "+ motor-coulomb" in shown
    assert "− motor-coulomb" in shown
    assert "—" in shown
    assert invoke("remove", "gear-efficiency", "-p", less, "-o", less).exit_code == 0
    assert read_profile(less).gearbox.efficiency is None
    before = added.read_bytes()
    for words in (
        ("remove", "gear-efficiency"),
        ("add", "cell-gain", "--fit", *runs),
        ("undo",),
    ):
        refused = done(*words, "-p", less, "-o", added, code=2)
        assert "exists already" in refused.stderr
        assert added.read_bytes() == before
    assert invoke("undo", "-p", less, "-o", added, "--replace").exit_code == 0
    assert read_profile(added).gearbox.efficiency == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (("undo", "-p", "bench-spiral"), 2, "ships with winchkit"),
        (("remove", "cell-gain", "-p", "bench-spiral", "-o", "x.toml"), 3, "no effect 'cell-gain'"),
        (("ledger", "-p", "no-such"), 3, "no-such"),
    ],
)
def test_what_cannot_be_is_said(arguments: tuple[str, ...], code: int, words: str) -> None:
    result = done(*arguments, code=code)
    assert words in result.stderr
    assert not Path("x.toml").exists()


def test_a_bare_profile_has_an_empty_ledger() -> None:
    assert json.loads(invoke("ledger", "-p", "bench-spiral", "--json").stdout)["steps"] == []
