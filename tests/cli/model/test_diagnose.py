"""What ``winchkit diagnose`` prints: one screen, more with --verbose, and the next command."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from report_answers import recorded
from winchkit.cli import main
from winchkit.runs import write_run


def call(*arguments: object) -> Result:
    result = CliRunner().invoke(main, [str(argument) for argument in arguments])
    assert result.exit_code == 0, result.output
    return result


@pytest.fixture(scope="module")
def elastic(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Runs of a bench with an elastic cable."""
    folder = tmp_path_factory.mktemp("elastic")
    files = []
    for run in recorded("demo-elastic-rope"):
        files.append(folder / Path(run.name).with_suffix(".csv").name)
        write_run(run, files[-1])
    return files


def test_the_answer_with_the_next_command_is_one_screen(elastic: list[Path]) -> None:
    result = call("diagnose", *elastic, "-p", "bench-spiral")
    lines = [*result.stdout.splitlines(), *result.stderr.splitlines()]
    assert len(lines) <= 30
    assert lines[0] == "EXPLAINED"
    assert lines[1].startswith("The cable is elastic. With it, the cable length error falls from")
    assert "power" not in result.stdout
    assert "next: winchkit add cable-elongation-linear --fit" in result.stderr


def test_verbose_adds_how_it_was_reached(elastic: list[Path]) -> None:
    short = call("diagnose", *elastic, "-p", "bench-spiral").stdout
    long = call("diagnose", *elastic, "-p", "bench-spiral", "-v").stdout
    assert long.startswith(short.splitlines()[0])
    for part in ("detectable with these runs (90 % power)", "highest evidence", "correlation"):
        assert part in long
        assert part not in short


def test_a_wrong_value_of_the_profile_is_a_step_with_the_value_of_the_file(
    elastic: list[Path], tmp_path: Path
) -> None:
    profile = tmp_path / "stiff.toml"
    call("add", "cable-elongation-linear", "--fit", elastic[0], "-p", "bench-spiral", "-o", profile)
    lines = profile.read_text().splitlines()
    lines = [x for x in lines if not x.startswith("fitted = ")]
    lines = ['axial_stiffness = "100 kN"' if x.startswith("axial_stiff") else x for x in lines]
    profile.write_text("\n".join(lines))
    result = call("diagnose", *elastic, "-p", profile)
    assert result.stdout.splitlines()[0] == "EXPLAINED"
    assert "kN instead of 100 kN in the profile. Corrected, the" in " ".join(result.stdout.split())
    assert "next: winchkit add cable-elongation-linear" in result.stderr
