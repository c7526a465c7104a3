"""What ``winchkit serve`` refuses before it serves, with its exit code."""

from __future__ import annotations

from pathlib import Path

import pytest

from command_line import done


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "runs").mkdir()
    (tmp_path / "drill.toml").write_text('schema = 1\nkind = "axis"\ndrill = 1\n')
    return tmp_path


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["nothing.csv"], 3, "nothing.csv: there is no such file"),
        (["runs"], 3, "runs: is a folder; name the files in it"),
        (["-p", "nothing"], 3, "there is no profile 'nothing'"),
        (["-p", "drill.toml"], 3, "drill.toml:3"),
        (["-b", "nothing.toml"], 3, "nothing.toml: there is no such file"),
        (["-b", "drill.toml"], 3, "drill.toml:2: kind"),
        (["--sim", "nothing"], 3, "there is no simulated bench 'nothing'"),
        (["--sim", "programme-demo"], 3, "programme-demo.toml:"),
        (["-b", "a.toml", "--sim", "demo-adequate"], 2, "--bench and --sim: choose one"),
        (["--folder", "nothing"], 2, "--folder nothing: is no folder"),
        (["--port", "70000"], 2, "--port 70000: choose 0 to 65535"),
        (["--allow-motion"], 2, "--allow-motion needs --bench or --sim"),
        (["-p", "bench-spiral", "--mystery", "1"], 2, "--mystery: opens runs and a profile of its"),
    ],
)
def test_a_wrong_input_ends_it_with_one_line(
    folder: Path, arguments: list[str], code: int, message: str
) -> None:
    result = done("serve", "--no-browser", *arguments, code=code)
    assert result.stdout == "", "no URL"
    (line,) = result.stderr.strip().splitlines()
    assert message in line
