"""``winchkit import`` as a user gives it: by pipes, on a terminal, with a mapping."""

from __future__ import annotations

import json
import os
import select
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result

from command_line import done
from logger_layouts import COUNTS, LAYOUTS, RATED, motion
from winchkit.runs import read_run

HEAD = "time [s],position [deg],speed [rpm],torque [%],force [N]"


def command(*arguments: str | Path, code: int = 0) -> Result:
    return done("import", *arguments, code=code)


def log(path: Path, head: str = HEAD) -> Path:
    m = motion()
    columns = (
        m.time,
        np.degrees(m.angle),
        m.velocity * 9.549297,
        100 * m.torque / RATED,
        m.tension,
    )
    rows = (",".join(f"{v:.10g}" for v in row) for row in zip(*columns, strict=True))
    path.write_text("\n".join([head, *rows]) + "\n")
    return path


def test_without_an_output_it_only_looks(tmp_path: Path) -> None:
    result = command(log(tmp_path / "log.csv"))
    assert "motor_velocity  rpm   0.10472    named" in result.stdout
    assert "? 'torque' is in %: of which torque?: --rated-torque \"2.4 N m\"" in result.stdout
    assert os.listdir(tmp_path) == ["log.csv"]


def test_without_a_terminal_every_answer_is_named(tmp_path: Path) -> None:
    path = log(tmp_path / "log.csv", HEAD.replace("force [N]", "cell [mV/V]"))
    result = command(path, "-o", tmp_path / "runs", code=2)
    for option in ("--rated-torque", "--sensitivity", "--capacity"):
        assert option in result.stderr
    assert not (tmp_path / "runs").exists()


def test_the_angle_of_a_recording_of_the_velocity_is_its_integral(tmp_path: Path) -> None:
    """Known motion: θ = 9 (1 − cos 1.25 t), ω = 11.25 sin 1.25 t; its unit is that of the file."""
    t = np.arange(400) / 100
    omega, angle = 11.25 * np.sin(1.25 * t), 9 - 9 * np.cos(1.25 * t)
    lines = [f"{a:.2f},{b * 9.549297:.9g},{1 + 0.1 * b:.9g}" for a, b in zip(t, omega, strict=True)]
    path = tmp_path / "drive.csv"
    path.write_text("\n".join(["time [s],speed [rpm],torque [Nm]", *lines]) + "\n")
    refused = command(path, "-o", tmp_path / "runs", code=2)
    assert "integral of motor_velocity" in refused.stderr
    result = command(path, "-o", tmp_path / "runs", "--yes")
    assert "an offset of the velocity is a drift" in result.stderr
    run = read_run(tmp_path / "runs" / "drive.csv")
    # The trapezoidal rule errs by the span times h²/12 of the second derivative of ω.
    assert run["motor_angle"] == pytest.approx(angle, abs=4 * 1e-4 / 12 * 11.25 * 1.25**2 * 2)
    again = read_run(path, mapping=tmp_path / "runs" / "mapping.toml")
    assert np.array_equal(again["motor_angle"], run["motor_angle"])


def test_two_recordings_of_the_velocity_are_two_runs(tmp_path: Path) -> None:
    paths = []
    for name, first in (("a", 5), ("b", 6)):
        rows = (f"{k / 100},{first + k % 3},{k % 5}" for k in range(100))
        paths.append(tmp_path / f"{name}.csv")
        paths[-1].write_text("\n".join(["time [s],speed [rpm],torque [Nm]", *rows]) + "\n")
    command(*paths, "-o", tmp_path / "runs", "--yes")
    assert sorted(os.listdir(tmp_path / "runs")) == ["a.csv", "b.csv", "mapping.toml"]


def test_a_certain_guess_needs_no_consent_and_the_mapping_makes_the_next_import_silent(
    tmp_path: Path,
) -> None:
    path, runs = log(tmp_path / "log.csv"), tmp_path / "runs"
    first = command(path, "-o", runs, "--rated-torque", "2.4 N m", "--load-mass", "15 kg")
    assert first.stdout == f"{runs / 'log.csv'}\n"
    run = read_run(runs / "log.csv")
    assert run.load_mass == 15.0
    assert run.metadata["imported_from"] == "log.csv"
    assert run["motor_torque"] == pytest.approx(motion().torque, rel=1e-9)
    again = command(path, "-o", tmp_path / "again", "--mapping", runs / "mapping.toml")
    assert "confidence" not in again.stderr
    same = read_run(tmp_path / "again" / "log.csv")
    assert np.array_equal(same["motor_torque"], run["motor_torque"])
    assert same.metadata["imported_mapping"] == run.metadata["imported_mapping"]
    by_python = read_run(path, mapping=runs / "mapping.toml")
    assert np.array_equal(by_python["motor_angle"], run["motor_angle"])


def test_a_lost_sign_is_not_accepted_by_yes(tmp_path: Path) -> None:
    """A servo's load of ±300 in 11 bits, of which the highest is the sign."""
    loads = [round(300 * np.sin(k / 9)) for k in range(300)]
    rows = (f"{k / 100},{k}.5,{v if v >= 0 else 1024 - v}" for k, v in enumerate(loads))
    path = tmp_path / "servo.csv"
    path.write_text("time [s],position [deg],torque [mN m]\n" + "\n".join(rows) + "\n")
    refused = command(path, "-o", tmp_path / "runs", "--yes", code=2)
    assert "11 bits stored without a sign (sign and magnitude" in refused.stderr
    assert '--unsigned "torque"' in refused.stderr
    assert not (tmp_path / "runs").exists()
    command(path, "-o", tmp_path / "runs", "--yes", "--unsigned", "torque")


def test_a_file_without_a_motor_angle_is_reported_when_it_is_looked_at(tmp_path: Path) -> None:
    rows = (f"{k / 100},{50 + k % 7}" for k in range(100))
    path = tmp_path / "cell.csv"
    path.write_text("time [s],force [N]\n" + "\n".join(rows) + "\n")
    looked = command(path)
    assert "no column is the motor angle or velocity: a run of a load cell alone" in looked.stdout
    command(path, "-o", tmp_path / "alone")
    assert list(read_run(tmp_path / "alone" / "cell.csv")) == ["tension"]
    found = json.loads(command(path, "--json").stdout)["files"][0]
    assert any("motor_angle=COLUMN" in note for note in found["notes"])
    drive = log(tmp_path / "drive.csv", HEAD.replace("[%]", "[Nm]"))
    assert "a load cell alone" not in command(path, drive).stdout
    rows = (f"{k / 100},{k % 9}.5,{k % 7}.5,{k % 5}" for k in range(100))
    path.write_text("time [s],position [deg],position [rad],force [N]\n" + "\n".join(rows) + "\n")
    asked = command(path).stdout
    assert "which column is motor_angle?" in asked
    assert "without which" not in asked


def test_quiet_prints_no_table(tmp_path: Path) -> None:
    path = log(tmp_path / "log.csv", "t,q,dq [rpm],tau,force [N]")
    quiet = command(path, "-o", tmp_path / "runs", "-q", "-y")
    assert quiet.stdout == f"{tmp_path / 'runs' / 'log.csv'}\n"
    assert "confidence" not in quiet.stderr
    assert "confidence" in command(path, "-q").stdout, "without -o the table is the result"


def test_quiet_prints_what_was_changed_as_warnings(tmp_path: Path) -> None:
    m = motion()
    rows = (
        f"{a:.4f},{b:.6f},{-c:.6f}" for a, b, c in zip(m.time, m.angle, m.velocity, strict=True)
    )
    path = tmp_path / "log.csv"
    path.write_text("t [s],angle [rad],speed [rad/s]\n" + "\n".join(rows) + "\n")
    quiet = command(path, "-o", tmp_path / "runs", "-q", "-y")
    assert "its sign is changed (warning)" in quiet.stderr


def test_an_assumed_unit_needs_consent(tmp_path: Path) -> None:
    path = log(tmp_path / "log.csv", "t,q,dq [rpm],tau,force [N]")
    refused = command(path, "-o", tmp_path / "runs", code=2)
    assert "accept the guess by --yes" in refused.stderr
    assert "'tau' as motor_torque [N m] is assumed" in refused.stderr
    command(path, "-o", tmp_path / "runs", "--yes")


def test_json_is_complete(tmp_path: Path) -> None:
    path = log(tmp_path / "log.csv")
    result = command(path, "--json", "-o", tmp_path / "runs", "--rated-torque", "2.4 N m")
    found = json.loads(result.stdout)
    assert found["schema"] == 1
    (file,) = found["files"]
    columns = {item["source"]: item for item in file["columns"]}
    assert columns["torque"]["channel"] == "motor_torque"
    assert columns["torque"]["factor"] == pytest.approx(0.024)
    assert columns["torque"]["confidence"] == "given"
    (run,) = found["runs"]
    assert run["summary"]["rows"] == len(motion().time)
    assert found["mapping"] == str(tmp_path / "runs" / "mapping.toml")
    opened = command(path, "--json", "-o", tmp_path / "other", code=2)
    (question,) = json.loads(opened.stdout)["files"][0]["questions"]
    assert question["options"][0] == '--rated-torque "2.4 N m"'


def test_findings_on_the_runs_are_reported(tmp_path: Path) -> None:
    m = motion()
    path = tmp_path / "log.csv"
    kept = [k for k in range(len(m.time)) if not 100 <= k < 150]
    rows = (f"{m.time[k]:.4f},{m.angle[k]:.6f},{m.tension[k]:.6f}\n" for k in kept)
    path.write_text("t [s],angle [rad],force [N]\n" + "".join(rows))
    result = command(path, "-o", tmp_path / "runs", "--json")
    found = {item["code"]: item for item in json.loads(result.stdout)["sanity"]}
    assert found["gap"]["channel"] == "time"
    assert found["gap"]["text"] in result.stderr


def test_a_drive_and_a_cell_with_clocks_of_their_own_become_one_run(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    t, u = np.arange(0, 30, 0.004), np.arange(0, 25, 0.02)

    def angle(x: np.ndarray) -> np.ndarray:
        return 20 * np.sin(0.31 * x) + 4 * np.sin(1.7 * x + 0.4) + 0.8 * x

    length = 0.06 * angle(u + 2.5) + 0.0003 * rng.standard_normal(len(u))
    drive, laser = tmp_path / "drive.csv", tmp_path / "laser.txt"
    drive.write_text(
        "t [s],angle [rad]\n"
        + "".join(f"{a:.4f},{b:.6f}\n" for a, b in zip(t, angle(t), strict=True))
    )
    laser.write_text(
        "Zeit [ms]\tSeillänge [mm]\n"
        + "".join(f"{1e3 * a:.1f}\t{1e3 * b:.4f}\n" for a, b in zip(u, length, strict=True))
    )
    result = command(drive, laser, "-o", tmp_path / "runs", "--json")
    (joint,) = json.loads(result.stdout)["joints"]
    assert joint["method"] == "cross-correlation"
    assert joint["agreement"]["lag"] == pytest.approx(2.5, abs=2e-3)
    run = read_run(tmp_path / "runs" / "drive.csv")
    slope = np.polyfit(run["motor_angle"], run["cable_length"], 1)[0]
    assert slope == pytest.approx(0.06, rel=1e-3)
    assert "cross-correlation" in run.metadata["joined"]
    command(drive, laser, "-o", tmp_path / "more", "--mapping", tmp_path / "runs" / "mapping.toml")


def test_recordings_are_never_written_over(tmp_path: Path) -> None:
    path = log(tmp_path / "log.csv")
    before = path.read_bytes()
    rated = ("--rated-torque", "2.4 N m")
    result = command(path, "-o", tmp_path, *rated, "--replace", code=2)
    assert "would replace the imported file" in result.stderr
    assert path.read_bytes() == before
    command(path, "-o", tmp_path / "runs", *rated)
    twice = command(path, "-o", tmp_path / "runs", *rated, code=2)
    assert "--replace" in twice.stderr
    command(path, "-o", tmp_path / "runs", *rated, "--replace")


def test_files_of_one_name_become_different_runs(tmp_path: Path) -> None:
    for folder, unit in (("a", "[Nm]"), ("b", "[mNm]")):
        (tmp_path / folder).mkdir()
        log(tmp_path / folder / "log.csv", HEAD.replace("[%]", unit))
    command(tmp_path / "a/log.csv", tmp_path / "b/log.csv", "-o", tmp_path / "runs")
    assert sorted(os.listdir(tmp_path / "runs")) == ["log-2.csv", "log.csv", "mapping.toml"]


def test_faults_of_all_files_are_reported_at_once(tmp_path: Path) -> None:
    good = log(tmp_path / "log.csv")
    result = command(good, tmp_path / "none.csv", tmp_path, "-o", tmp_path / "runs", code=3)
    assert "none.csv: there is no such file" in result.stderr
    assert "folder" in result.stderr


def test_a_file_that_a_mapping_does_not_fit_is_refused(tmp_path: Path) -> None:
    path, runs = log(tmp_path / "log.csv", HEAD.replace("[%]", "[Nm]")), tmp_path / "runs"
    command(path, "-o", runs)
    other = log(tmp_path / "other.csv", "t [s],pos [deg],speed [rpm],torque [Nm],force [N]")
    result = command(other, "-o", tmp_path / "more", "--mapping", runs / "mapping.toml", code=3)
    assert "it lacks the columns 'time', 'position'" in result.stderr


def test_check_reads_a_mapping_with_every_fault(tmp_path: Path) -> None:
    mapping = tmp_path / "mapping.toml"
    text = (
        'schema = 1\nkind = "mapping"\n[[log]]\nname = "a"\n[[log.column]]\nsource = "x"\n'
        'channel = "tenson"\nunit = "N"\n[[log.column]]\nsource = "y"\nchannel = "motor_angle"\n'
        'unit = "furlong"\n'
    )
    mapping.write_text(text)
    result = done("check", mapping, code=3)
    assert "mapping.toml:7: log[1].column[1].channel: 'tenson' is no channel" in result.stderr
    assert (
        "mapping.toml:12: log[1].column[2].unit: 'furlong' has no known SI value" in result.stderr
    )


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("--rated-torque", "2 kg"), "is not a torque with its unit"),
        (("--counts-per-turn", "-3"), "must be above 0"),
        (("--column", "tenson=x"), "did you mean 'tension'?"),
        (("--load-mass", "1 kg", "--load-mass", "2 kg"), "2 --load-mass for 1 files"),
        (("--column", "tension=nowhere"), "there is no column 'nowhere'"),
        (("--yes", "--unsigned", "nowhere"), "--unsigned: there is no column 'nowhere'; there are"),
    ],
)
def test_invalid_options_are_refused_in_words(
    arguments: Sequence[str], text: str, tmp_path: Path
) -> None:
    path = log(tmp_path / "log.csv", HEAD.replace("[%]", "[Nm]"))
    result = command(path, "-o", tmp_path / "runs", *arguments, code=2)
    assert text in result.stderr


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="pseudo-terminals are of POSIX")
def test_on_a_terminal_it_asks_and_writes(tmp_path: Path) -> None:
    layout = next(item for item in LAYOUTS if item.name == "epos-studio")
    path = tmp_path / "epos.txt"
    layout.write(path)
    lines = path.read_text(encoding="utf-8").replace("Velocity actual value [rpm]", "Aux input")
    path.write_text(lines, encoding="utf-8")
    shown = _on_terminal(
        ["import", str(path), "-o", str(tmp_path / "runs")],
        [("how many in a motor turn?", f"{COUNTS}\n"), ("of which torque?", "2.4 kg\n"),
         ("not of torque", "2.4 N m\n")],
    )  # fmt: skip
    assert "Aux input" in shown
    run = read_run(tmp_path / "runs" / "epos.csv")
    assert run["motor_angle"] == pytest.approx(motion().angle, abs=1e-4)
    assert run["motor_torque"] == pytest.approx(motion().torque, rel=1e-6)


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="pseudo-terminals are of POSIX")
def test_on_a_terminal_an_assumed_unit_is_confirmed(tmp_path: Path) -> None:
    path = log(tmp_path / "log.csv", "t,q,dq [rpm],tau,force [N]")
    arguments = ["import", str(path), "-o", str(tmp_path / "runs")]
    shown = _on_terminal(arguments, [("Import as shown?", "y\n")])
    assert "assumed" in shown
    assert (tmp_path / "runs" / "log.csv").exists()


@pytest.mark.skipif(os.name != "posix", reason="pseudo-terminals are of POSIX")
def test_on_a_terminal_the_axes_of_a_long_table_are_separated(tmp_path: Path) -> None:
    m = motion()
    rows = [
        f"{time:.10g},{name},{sign * angle:.10g},{sign * torque:.10g}"
        for time, angle, torque in zip(m.time, np.degrees(m.angle), m.torque, strict=True)
        for name, sign in (("A", 1), ("B", -1))
    ]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["time [s],winch,position [deg],torque [N m]", *rows]) + "\n")
    _on_terminal(
        ["import", str(path), "-o", str(tmp_path / "runs")],
        [("which column 'winch' names (A, B)", "1\n")],
    )
    run = read_run(tmp_path / "runs" / "log.csv")
    assert run["A.motor_angle"] == pytest.approx(m.angle)
    assert run["B.motor_angle"] == pytest.approx(-m.angle)
    command(path, "-o", tmp_path / "again", "--axis", "winch")
    assert (tmp_path / "again" / "log.csv").read_bytes().count(b"\n") > len(m.time)


def test_columns_of_which_nothing_is_decided_are_shown_with_their_values(tmp_path: Path) -> None:
    """A table of four axes without a header, of more columns than are listed when not used."""
    m = motion()
    rows = [
        ",".join(f"{v:.10g}" for v in (time, axis, angle + axis, *range(20, 30)))
        for time, angle in zip(m.time, m.angle, strict=True)
        for axis in range(4)
    ]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(rows) + "\n")
    shown = command(path).stdout
    assert "which column '2' names (0, 1, 2, 3)" in shown
    assert "  13      —                                   29 29 29" in shown
    assert "not used" not in shown


def test_a_file_of_times_alone_says_so(tmp_path: Path) -> None:
    path = tmp_path / "time.txt"
    path.write_text("".join(f"{time:.6f}\n" for time in motion().time))
    shown = command(path).stdout
    assert "no column is a channel of a run by its name: the file has times only" in shown


@pytest.mark.parametrize("angle", ["q_deg", "(q_deg+q_deg)/2"])
def test_a_column_is_named_as_in_the_file_with_its_unit(angle: str, tmp_path: Path) -> None:
    """``q_deg`` is read as the name q and the unit deg; a user types what the file has."""
    path = log(tmp_path / "log.csv", "t_s,q_deg,spare,M_VOLT,force [N]")
    given = ("-c", f"motor_angle={angle}", "-c", "motor_torque=M_VOLT*2", "-c", "tension=")
    command(path, "-o", tmp_path / "runs", "-y", *given)
    run, m = read_run(tmp_path / "runs" / "log.csv"), motion()
    assert run["motor_angle"] == pytest.approx(m.angle)
    assert run["motor_torque"] == pytest.approx(200 * m.torque / RATED)


def _on_terminal(arguments: Sequence[str], talk: Sequence[tuple[str, str]]) -> str:
    """Output of a command on a pseudo-terminal, with the answer to each prompt."""
    import pty

    host, guest = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "winchkit", *arguments],
        stdin=guest,
        stdout=guest,
        stderr=guest,
        close_fds=True,
    )
    os.close(guest)
    shown, answers, end = "", list(talk), time.monotonic() + 60
    answered_at = 0
    while time.monotonic() < end:
        ready, _, _ = select.select([host], [], [], 0.5)
        if ready:
            try:
                piece = os.read(host, 4096)
            except OSError:
                break
            if not piece:
                break
            shown += piece.decode(errors="replace")
        if (
            answers
            and answers[0][0] in shown[answered_at:]
            and shown.rstrip().endswith((":", "]:"))
        ):
            answered_at = len(shown)
            os.write(host, answers.pop(0)[1].encode())
        elif not ready and process.poll() is not None:
            break
    os.close(host)
    assert process.wait(10) == 0, shown
    assert not answers, shown
    return shown


def test_a_sample_rate_is_that_of_the_file_without_times(tmp_path: Path) -> None:
    """A controller that writes no times beside an instrument that has its own."""
    t, seen = np.arange(0, 30, 0.01), np.arange(2.0, 25.0, 1 / 120)

    def angle(time: np.ndarray) -> np.ndarray:
        return np.asarray(5 * np.sin(0.4 * time) + 2 * np.sin(1.7 * time + 0.3) + 0.3 * time)

    (tmp_path / "drive.csv").write_text(
        "position [rad]\n" + "".join(f"{value:.5f}\n" for value in angle(t))
    )
    rows = (f"{a - 2.0:.6f},{0.06 * b:.6f}\n" for a, b in zip(seen, angle(seen), strict=True))
    (tmp_path / "laser.csv").write_text("time [s],cable length [m]\n" + "".join(rows))
    files = tmp_path / "drive.csv", tmp_path / "laser.csv"
    out = tmp_path / "out"
    own = "--sample-rate", "100 Hz", "--column", "motor_angle=position [rad]"
    command(*files, "--join", *own, "--yes", "-o", out)
    run = read_run(out / "drive.csv")
    inside = np.isfinite(run["cable_length"])
    assert run["cable_length"][inside] == pytest.approx(0.06 * run["motor_angle"][inside], abs=2e-3)


def test_a_number_is_no_column_of_a_file_beside_one_that_has_it_as_a_name(tmp_path: Path) -> None:
    """A log without a header, whose columns are numbers, beside a table with one."""
    times = np.arange(0, 5, 0.01)
    (tmp_path / "log.txt").write_text("".join(f"{t:.2f} {7 * t:.4f}\n" for t in times))
    rows = (f"{t:.2f},{100 - t:.3f}\n" for t in times)
    (tmp_path / "cell.csv").write_text("time [s],tension [N]\n" + "".join(rows))
    files = tmp_path / "cell.csv", tmp_path / "log.txt"
    own = "--column", "time=1 [s]", "--column", "motor_angle=2 [rad]"
    command(*files, *own, "--lag", "0 s", "--yes", "-o", tmp_path / "out")
    run = read_run(tmp_path / "out" / "log.csv")
    assert run["motor_angle"] == pytest.approx(7 * run.time, abs=1e-3)
    assert run["tension"] == pytest.approx(100 - run.time, abs=1e-2)
