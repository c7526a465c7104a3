"""Which bench and which profile a command takes where none is given."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import Result

from command_line import done
from declared import ONE_WINCH
from winchkit.cli import SECTIONS


def stop(*arguments: str, code: int = 0, **environment: str) -> Result:
    """A command about a bench that opens nothing."""
    return done("stop", "--dry-run", *arguments, code=code, env=environment)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_only_bench_file_of_the_folder(folder: Path) -> None:
    (folder / "lab.toml").write_text(ONE_WINCH)
    (folder / "other.toml").write_text('schema = 1\nkind = "programme"\n')
    result = stop()
    assert result.stderr.splitlines()[0] == "bench: lab.toml"


def test_none_is_chosen_of_two(folder: Path) -> None:
    for name in ("left.toml", "right.toml"):
        (folder / name).write_text(ONE_WINCH)
    result = stop(code=2)
    assert "no bench is given: this folder has left.toml, right.toml" in result.stderr
    assert "WINCHKIT_BENCH" in result.stderr


def test_none_without_a_bench_file(folder: Path) -> None:
    result = stop(code=2)
    assert "this folder has no bench file" in result.stderr


def test_the_variable_of_all_commands(folder: Path) -> None:
    (folder / "there").mkdir()
    (folder / "there" / "lab.toml").write_text(ONE_WINCH)
    stop(WINCHKIT_BENCH="there/lab.toml")
    wrong = stop(WINCHKIT_BENCH="there/lab.toml", WINCHKIT_STOP_BENCH="nowhere.toml", code=3)
    assert wrong.stderr.splitlines()[0] == "bench: nowhere.toml (WINCHKIT_STOP_BENCH)"
    stop("--bench", "there/lab.toml", WINCHKIT_BENCH="nowhere.toml")


def test_a_bench_of_the_variable_that_is_not_there_is_named_with_the_variable(folder: Path) -> None:
    result = stop(WINCHKIT_BENCH="nowhere.toml", code=3)
    assert result.stderr.splitlines()[0] == "bench: nowhere.toml (WINCHKIT_BENCH)"
    assert (
        "(WINCHKIT_BENCH)"
        not in stop("-b", "nowhere.toml", code=3, WINCHKIT_BENCH="other.toml").stderr
    )


def test_the_variable_of_a_profile() -> None:
    result = done("ledger", env={"WINCHKIT_PROFILE": "bench-spiral"})
    assert "bench-spiral" in result.stdout


@pytest.mark.parametrize(
    ("arguments", "variable"),
    [(["ledger"], "WINCHKIT_PROFILE"), (["compare", "a.csv"], "WINCHKIT_PROFILE"),
     (["stop"], "WINCHKIT_BENCH"), (["scan"], "WINCHKIT_BENCH")],
)  # fmt: skip
def test_a_missing_profile_or_bench_names_its_variable(
    folder: Path, arguments: list[str], variable: str
) -> None:
    result = done(*arguments, code=2)
    said = result.stderr or str(result.exception)
    assert f"set {variable}" in said


def test_an_option_without_a_variable_of_all_commands_names_none() -> None:
    result = done("add", "drum-radius", code=2)
    assert "WINCHKIT" not in result.stderr


def test_help_groups_commands_by_subject() -> None:
    lines = done("--help").stdout.splitlines()
    at = [lines.index(f"{title}:") for title in SECTIONS]
    assert at == sorted(at)
