"""``winchkit calibrate``: what it promises to others, and how it refuses."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import Result

from calibration_cases import EXACT, elastic_rows, rows
from command_line import done, invoke
from report_parsed import Page
from robot_poses.truth import Row, csv
from winchkit.catalog import find
from winchkit.runs.read import read_run
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.read import read_robot


def calibrate(*arguments: object, code: int = 0) -> Result:
    return done("calibrate", *arguments, code=code)


def answer(*arguments: object, code: int = 0) -> dict[str, Any]:
    result = calibrate(*arguments, "--json", code=code)
    found: dict[str, Any] = json.loads(result.stdout)
    return found


@pytest.fixture
def run(tmp_path: Path) -> Path:
    return file(tmp_path / "poses.csv", rows())


def file(path: Path, found: tuple[Row, ...], **columns: bool) -> Path:
    path.write_text(csv(found, **columns))
    return path


def test_json_has_what_is_promised(run: Path, tmp_path: Path) -> None:
    check = file(tmp_path / "check.csv", rows(20, 99, noise=EXACT), angles=True)
    found = answer("cabtive", run, "--validate", check, "-o", tmp_path / "new.toml")
    assert found["schema"] == 1
    assert found["rank"] == 65
    assert found["unobservable"] == []
    assert 0 < found["seconds"] < 60
    assert found["fit"]["rms_after"] < found["fit"]["rms_before"] / 20
    validation = found["validation"]
    assert validation["rms_after"] <= validation["max_after"]
    assert validation["rms_after"] < 2e-5
    assert validation["rotation_rms_after"] < 1e-3
    assert len(found["parameters"]) == 65
    entry = found["parameters"]["1.exit_point.x"]
    assert {"nominal", "value", "std", "unit"} <= set(entry)
    assert entry["nominal"] == pytest.approx(0.8611)
    assert entry["unit"] == "m"
    assert "layer_growth" in found["parameters"]


def test_the_profile_written_is_the_robot_calibrated(run: Path, tmp_path: Path) -> None:
    new = tmp_path / "new.toml"
    found = answer("cabtive", run, "-o", new)
    robot = read_robot(new)
    for name in ("1.exit_point.x", "8.anchor_point.z", "3.swivel_radius", "2.winding_radius"):
        line = robot.line[int(name[0]) - 1]
        assert isinstance(line.winch, WinchProfile)
        there = {
            "1.exit_point.x": line.exit_point[0],
            "8.anchor_point.z": line.anchor_point[2],
            "3.swivel_radius": line.swivel_radius,
            "2.winding_radius": line.winch.drum.winding_radius,
        }[name]
        assert there == pytest.approx(found["parameters"][name]["value"], abs=1e-9)
    assert robot.fitted.runs == ("poses.csv",)
    assert robot.fitted.poses == 81
    assert "1.exit_point.x" in robot.fitted.std
    again = answer(new, run, "-o", tmp_path / "again.toml")
    assert again["fit"]["rms_before"] == pytest.approx(found["fit"]["rms_after"], rel=1e-3)
    # What the user wrote stays: comments, priors, platform.
    assert "# S. Lessanibahri" in new.read_text()
    assert robot.prior == read_robot(find("profiles", "cabtive")).prior


def test_an_effect_is_written_and_read_again(tmp_path: Path) -> None:
    run = file(tmp_path / "pulled.csv", elastic_rows(90, 7), tension=True)
    new = tmp_path / "elastic.toml"
    found = answer("cabtive", run, "--effect", "cable-elongation-linear", "-o", new)
    name = "cable-elongation-linear.axial_stiffness"
    assert found["parameters"][name]["nominal"] is None
    assert found["parameters"][name]["value"] == pytest.approx(2e4, rel=0.02)
    again = answer(new, run, "-o", tmp_path / "again.toml")
    assert again["parameters"][name]["nominal"] == pytest.approx(
        found["parameters"][name]["value"], rel=1e-6
    )
    assert again["fit"]["rms_before"] == pytest.approx(found["fit"]["rms_after"], rel=1e-2)


def test_text_page_and_proposals(run: Path, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    result = calibrate("cabtive", run, "-o", tmp_path / "new.toml", "--next", 2, "--html", page)
    assert "position error" in result.stdout
    assert "measure next:" in result.stdout
    assert "fit: step 1" not in result.stderr, "with -v"
    read = Page(page.read_text())
    # Every pose is drawn before and after, fitted and held out, and has its name.
    tables = {name: read.figures[name] for name in ("pose-error-held-out", "pose-error-fitted")}
    assert sum(len(table["columns"][0]) for table in tables.values()) == 90
    for table in tables.values():
        assert table["head"] == ["pose", "before calibration [mm]", "after calibration [mm]"]
        assert all(v is not None for column in table["columns"] for v in column)
    names = [name for table in tables.values() for name in table["words"]]
    assert any(name.startswith(f"row 90 of {run}") for name in names)
    # One scale for both figures, so that they can be compared.
    text = page.read_text()
    heights = re.findall(r'y="([\d.]+)" text-anchor="end" class="f-tick">1</text>', text)
    assert len(heights) == 4
    assert len(set(heights[::2])) == 1
    assert not any("src" in own for _, own in read.elements)


def test_without_a_position_there_is_no_position_error(tmp_path: Path) -> None:
    run = file(tmp_path / "self.csv", rows(), position=False)
    found = answer("cabtive", run, "-o", tmp_path / "new.toml")
    assert found["fit"]["rms_after"] is None
    assert found["validation"]["max_after"] is None
    assert any("measure positions" in words for words in found["unobservable"])


def test_one_coordinate_of_the_position_is_used_and_reported(run: Path, tmp_path: Path) -> None:
    head, *lines = (line.split(",") for line in run.read_text().splitlines())
    height = tmp_path / "height.csv"
    at = [k for k, name in enumerate(head) if not name.startswith(("platform_x", "platform_y"))]
    cut = [",".join(cells[k] for k in at) for cells in (head, *lines)]
    height.write_text("\n".join(cut) + "\n")
    check = file(tmp_path / "check.csv", rows(20, 99, noise=EXACT), angles=True)
    found = answer("cabtive", height, "--validate", check, "-o", tmp_path / "new.toml")
    assert any("not platform_x, platform_y" in text for text in found["warnings"])
    assert found["fit"]["rms_after"] is None
    assert found["rank"] == 65
    # Without any position the frame is not known, and a third of the error stays.
    assert found["validation"]["rms_after"] < found["validation"]["rms_before"] / 5


@pytest.mark.slow
def test_gross_errors_are_named_and_poses_of_another_robot_rejected(
    run: Path, tmp_path: Path
) -> None:
    told = refused(3, "ipanema3", run, "-o", tmp_path / "new.toml")
    assert "poses-unlike: motor angles and positions are not those of this robot" in told
    assert not (tmp_path / "new.toml").exists()
    lines = run.read_text().splitlines()
    for k in (6, 41):
        cells = lines[k].split(",")
        lines[k] = ",".join([*cells[:9], repr(float(cells[9]) + 0.01), *cells[10:]])
    run.write_text("\n".join(lines) + "\n")
    found = answer("cabtive", run, "-o", tmp_path / "new.toml")
    (told,) = (text for text in found["warnings"] if "gross" in text)
    assert f"row 6 of {run}, row 41 of {run}: more than ten times" in told
    assert found["gross_errors"] == [f"row 6 of {run}", f"row 41 of {run}"]


def test_nominal_values_that_their_bounds_exclude_are_reported(run: Path, tmp_path: Path) -> None:
    text = find("profiles", "cabtive").read_text()
    odd = tmp_path / "odd.toml"
    odd.write_text(text.replace('bounds = ["59 mm", "61 mm"]', 'bounds = ["60.1 mm", "62 mm"]'))
    found = answer(odd, run, "-o", tmp_path / "new.toml")
    (told,) = (text for text in found["warnings"] if "outside their bounds" in text)
    assert told.count("winding_radius") == 8


def refused(code: int, *arguments: object) -> str:
    result = calibrate(*arguments, code=code)
    assert "Traceback" not in result.output
    assert result.stdout == ""
    return result.stderr


def test_wrong_columns_are_named(run: Path, tmp_path: Path) -> None:
    out = tmp_path / "new.toml"
    text = run.read_text()
    bad = tmp_path / "bad.csv"
    bad.write_text(text.replace("3.motor_angle", "C.motor_angle"))
    told = refused(3, "cabtive", bad, "-o", out)
    assert "'C.motor_angle' is of no line" in told
    assert "no column '3.motor_angle'" in told
    bad.write_text(text.replace("platform_z [m]", "platform_qz [1]"))
    assert "but not platform_qw" in refused(3, "cabtive", bad, "-o", out)
    bad.write_text("time [s],motor_angle [rad]\n0,1\n1,1\n")
    assert "no column '1.motor_angle'" in refused(3, "cabtive", bad, "-o", out)
    assert not out.exists()


def test_a_line_without_values_is_refused(run: Path, tmp_path: Path) -> None:
    head, *lines = run.read_text().splitlines()
    cut = [",".join([*line.split(",")[:3], "", *line.split(",")[4:]]) for line in lines]
    run.write_text("\n".join([head, *cut]) + "\n")
    told = refused(3, "cabtive", run, "-o", tmp_path / "new.toml")
    assert "'3.motor_angle' holds no value" in told


def test_rows_without_motor_angles_are_counted_and_left_out(run: Path, tmp_path: Path) -> None:
    lines = run.read_text().splitlines()
    cells = lines[5].split(",")
    lines[5] = ",".join([cells[0], *[""] * 8, *cells[9:]])
    cells = lines[9].split(",")
    lines[9] = ",".join([*cells[:9], "", "", ""])
    run.write_text("\n".join(lines) + "\n")
    found = answer("cabtive", run, "-o", tmp_path / "new.toml")
    assert any("1 rows without any motor angle" in text for text in found["warnings"])
    assert any("3 of 267 values of position" in text for text in found["warnings"])
    assert np.isfinite(found["validation"]["rms_after"])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--effect", "exit-pont"), "did you mean"),
        (("--effect", "cable-elongation-linear"), "tension"),
        (("--noise", "positon=1 mm"), "did you mean 'position'"),
        (("--noise", "position=1 kg"), "is not a length with its unit"),
        (("--noise", "position=0 mm"), "above zero"),
        (("--middle-force", "60"), "no unit"),
        (("--middle-force", "-5 N"), "above 0"),
        (("--noise", "closure"), "write KIND=VALUE"),
    ],
)
def test_options_that_cannot_be_meant(
    run: Path, tmp_path: Path, arguments: tuple[str, ...], words: str
) -> None:
    out = tmp_path / "new.toml"
    assert words in refused(2, "cabtive", run, "-o", out, *arguments)
    assert not out.exists()


def test_too_few_poses_and_files_that_are_not_there(tmp_path: Path) -> None:
    few = file(tmp_path / "few.csv", rows()[:2])
    out = tmp_path / "new.toml"
    assert "2 poses" in refused(2, "cabtive", few, "-o", out)
    assert "nowhere.csv" in refused(3, "cabtive", tmp_path / "nowhere.csv", "-o", out)
    assert "cabtiv" in refused(3, "cabtiv", few, "-o", out)
    assert "bench-spiral" in refused(3, "bench-spiral", few, "-o", out)
    run = file(tmp_path / "poses.csv", rows())
    assert "cannot be written" in refused(3, "cabtive", run, "-o", tmp_path / "no" / "new.toml")


def test_poses_come_from_runs_or_a_bench_or_a_simulated_robot(run: Path, tmp_path: Path) -> None:
    new = tmp_path / "new.toml"
    for given in (
        [],
        [run, "--sim", "cabtive-robot"],
        ["-b", "robot.toml", "--sim", "cabtive-robot"],
    ):
        refused = calibrate("cabtive", *given, "-o", new, code=2)
        assert "or --sim for a simulated robot" in refused.output
    calibrate("cabtive", "--sim", "winding-device-robot", "-o", new, code=2)
    assert not new.exists()


@pytest.mark.slow
def test_poses_before_a_trip_are_kept_and_the_command_that_fits_them_is_named(
    tmp_path: Path,
) -> None:
    """A drive goes silent after 40 s of simulated time: some poses are measured by then."""
    text = find("sim", "cabtive-robot").read_text().replace('"8 ms"', '"40 ms"')
    sim, new = tmp_path / "robot.toml", tmp_path / "new.toml"
    fault = '[[fault]]\ntime = "40 s"\ntarget = "3.servo"\nkind = "silence"\n'
    sim.write_text(f"{text}\n{fault}")
    stopped = calibrate(
        "cabtive", "--sim", sim, "--box", "20 mm", "--turn", "2 deg", "-o", new, code=5
    )
    assert "winch 3" in stopped.stderr.partition("winchkit: ")[2]
    assert not new.exists()
    poses = read_run(tmp_path / "new-fit.csv")
    assert f"new-fit.csv ({len(poses.time)} poses)" in stopped.stderr
    assert 10 <= len(poses.time) < 25
    # A pose takes the rest of 1 s, and a move of 20 mm at 0.3 m/s^2.
    assert np.all(np.diff(poses.time) > 1.0)
    suggested = stopped.stderr.partition("next: winchkit ")[2].splitlines()[0].split()
    assert suggested[:2] == ["calibrate", "cabtive"]
    again = invoke(*suggested)
    assert again.exit_code in (0, 1), again.output
    assert "position error" in again.stdout
