"""The commands that the page shows repeat its work, from the dropped files alone."""

from __future__ import annotations

import shlex
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("starlette")

from click.testing import CliRunner

from winchkit.cli import main
from winchkit.runs.read import read_run
from winchkit.web.examples import example_runs
from winchkit.web.workspace import DiagnoseView

PATIENCE = 300.0
DRAWING = {
    "drum.kind": "spiral",
    "drum.winding_radius": "60 mm",
    "drum.layer_growth": "0.08 mm",
    "gearbox.ratio": "20.4",
}
PULLEYS = ["40 mm, 90 deg", "40 mm, 60 deg"]
ANSWERS = {
    "columns": ["motor_angle=Winkel [deg]", "cable_length=Weg [mm]", "tension=Kraft [N]"],
    "load_mass": "10 kg",
}


def logged(folder: Path) -> list[Path]:
    """Two runs as another program writes them: semicolons, decimal commas, degrees."""
    paths = []
    for run in list(example_runs("demo-fat-drum").runs)[:2]:
        columns = [run.time, np.degrees(run["motor_angle"]), 1e3 * run["cable_length"]]
        rows = np.column_stack([*columns, run["tension"]])
        lines = [";".join(f"{value:.6f}".replace(".", ",") for value in row) for row in rows]
        paths.append(folder / f"{run.name} log.csv")
        paths[-1].write_text("\n".join(["t [s];Winkel [deg];Weg [mm];Kraft [N]", *lines]))
    return paths


@pytest.mark.slow
def test_the_commands_of_the_page_repeat_its_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("work", "again", "logger", "server"):
        (tmp_path / name).mkdir()
    logs = logged(tmp_path / "logger")
    monkeypatch.chdir(tmp_path / "work")
    server = tmp_path / "server"
    page = DiagnoseView(server, work=Path())
    page.new_profile("my winch", DRAWING, PULLEYS)
    for log in logs:
        kept = page.keep(log.name, log.read_bytes()).resolve()
        file = kept.relative_to(server.resolve()).as_posix()
        page.take(file, ANSWERS).result(PATIENCE)
    page.diagnose().result(PATIENCE)
    view = page.view()
    assert view["faults"] == []
    page.add("drum-radius").result(PATIENCE)
    commands = page.view()["commands"]
    made = [Path("my winch.toml"), *(Path("imported") / log.name for log in logs)]
    written = {path: path.read_bytes() for path in made}
    ledger = page.state.profile.read_bytes()
    page.close()

    monkeypatch.chdir(tmp_path / "again")
    for log in logs:
        Path(log.name).write_bytes(log.read_bytes())
    for command in commands:
        program, *words = shlex.split(command)
        assert program == "winchkit"
        found = CliRunner().invoke(main, words)
        assert found.exit_code == 0, (command, found.output)
    for path, content in written.items():
        if path.suffix == ".toml":
            assert path.read_bytes() == content
            continue
        run, other = read_run(path), read_run(tmp_path / "work" / path)
        assert run.metadata == other.metadata
        for channel in other:
            np.testing.assert_array_equal(run[channel], other[channel])
    better = Path(shlex.split(commands[-1])[-1])
    assert better.read_bytes() == ledger
