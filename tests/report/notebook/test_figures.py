"""Figures of results: what is drawn is what was measured, with a unit on every axis."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calibration_cases import held, measured, robot, rows
from report_answers import answer_of, recorded
from robot_poses.truth import csv
from winchkit.catalog import find
from winchkit.diagnosis.compare import compare
from winchkit.diagnosis.diagnose import WinchAnswer
from winchkit.diagnosis.residuals.traces import PoseTrace
from winchkit.diagnosis.results import Comparison, OutputError
from winchkit.errors import UsageError
from winchkit.robot.calibration.calibrate import Calibrated, calibrate
from winchkit.schema.profiles.axis import AxisProfile
from winchkit.schema.read import read_profile, read_robot

mpl = pytest.importorskip("matplotlib")


@pytest.fixture(scope="module")
def comparison() -> Comparison:
    runs = recorded("demo-fat-drum")
    return compare(runs, read_profile(find("profiles", "bench-spiral")))


@pytest.fixture(scope="module")
def answer() -> WinchAnswer:
    return answer_of("demo-fat-drum")


@pytest.fixture(scope="module")
def calibration() -> Calibrated:
    return calibrate(robot(), measured(csv(rows())), held())


def curve(axis: Any, label: str) -> Any:
    return next(line for line in axis.lines if line.get_label() == label)


def test_the_measured_length_is_drawn_as_it_was_recorded(comparison: Comparison) -> None:
    run = recorded("demo-fat-drum")[0]
    upper, _ = comparison.plot(output="cable_length", run=run.name).axes
    line = curve(upper, "measured")
    assert line.get_xdata() == pytest.approx(run.time - run.time[0])
    assert line.get_ydata() == pytest.approx(run["cable_length"])
    assert upper.get_ylabel() == "Cable length\n[m]"


def test_the_residual_has_the_rms_of_the_comparison_and_lies_over_the_noise(
    comparison: Comparison,
) -> None:
    """Measured less predicted of all runs, in millimetres."""
    _, lower = comparison.plot(output="cable_length").axes
    drawn = [line for line in lower.lines if len(line.get_xdata()) > 10]
    values = np.concatenate([line.get_ydata() for line in drawn])
    error = comparison.outputs["cable_length"]
    assert lower.get_ylabel() == "Residual\n[mm]"
    assert np.sqrt(np.nanmean(values**2)) == pytest.approx(error.rms * 1e3, rel=1e-6)
    assert error.noise_rms is not None
    (band,) = lower.patches
    height = band.get_height()
    assert height == pytest.approx(2e3 * error.noise_rms)


def test_measured_less_predicted_is_the_residual_of_the_table(comparison: Comparison) -> None:
    pytest.importorskip("pandas")
    table = comparison.to_pandas()
    assert np.nanmax(np.abs(table.measured - table.predicted - table.residual)) < 1e-12
    for output, error in comparison.outputs.items():
        own = table.loc[output].residual
        assert np.sqrt(np.nanmean(own**2)) == pytest.approx(error.rms, rel=1e-6)
        assert np.nanmean(own) == pytest.approx(error.bias, abs=1e-6 * error.rms)
    assert table.attrs["metadata"]["units"]["tension"] == "N"


def test_a_diagnosis_shows_the_model_before_and_after(answer: WinchAnswer) -> None:
    figure = answer.plot()
    assert len(figure.axes) == 6
    upper, lower = figure.axes[:2]
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert names == [
        "measured", "predicted by the profile", "with the named effects", "noise, ± rms",
    ]  # fmt: skip
    before, after = (
        np.concatenate([line.get_ydata() for line in lower.lines if line.get_color() == color])
        for color in ("#D55E00", "#0072B2")
    )
    ratio = np.sqrt(np.nanmean(after**2) / np.nanmean(before**2))
    output = answer.diagnosis.outputs["cable_length"]
    assert ratio == pytest.approx(output.rms_after / output.rms_before, rel=0.02)
    assert all("[" in axis.get_ylabel() for axis in figure.axes)
    assert upper.get_title() == ""


def test_channels_of_a_run_are_drawn_in_their_units(tmp_path: Path) -> None:
    run = recorded("demo-fat-drum")[0]
    figure = run.plot(channels=["tension", "motor_angle"], figsize=(5.0, 3.0))
    tension, angle = figure.axes
    assert tension.get_ylabel() == "Tension\n[N]"
    assert angle.get_ylabel() == "Motor angle\n[rad]"
    assert tension.lines[0].get_ydata() == pytest.approx(run["tension"])
    assert angle.get_xlabel() == "time [s]"
    for suffix in ("png", "svg", "pdf"):
        file = tmp_path / f"run.{suffix}"
        figure.savefig(file)
        assert file.stat().st_size > 1000


def test_pose_errors_of_a_calibration(calibration: Calibrated) -> None:
    figure = calibration.plot()
    fitted = figure.axes[0]
    drawn = curve(fitted, "after calibration").get_ydata()
    assert drawn == pytest.approx(calibration.fit_after.distance * 1e3)
    assert fitted.get_ylabel() == "Position error [mm]"
    assert fitted.get_yscale() == "log"


def test_errors_of_a_robot_are_drawn_by_pose() -> None:
    errors = np.array([[1e-3, -2e-3], [0.5e-3, np.nan]])
    trace = PoseTrace("cable_length", "m", ("1", "2"), errors)
    error = OutputError("m", 3, None, 1.0, 1e-3, 2e-3, 0.0, 0.2e-3, ())
    result = Comparison({"cable_length": error}, None, traces=(trace,))
    (axis,) = result.plot().axes
    first, second = (line for line in axis.lines if line.get_marker() == ".")
    assert first.get_ydata() == pytest.approx([1.0, 0.5])
    assert second.get_ydata()[0] == pytest.approx(-2.0)
    assert axis.get_ylabel() == "Cable length:\nresidual [mm]"
    assert len(result.to_arrow()) == 4


def test_a_winch_and_a_robot_are_drawn_from_their_profiles() -> None:
    """A spiral drum gains the layer growth per turn: its arm falls as the cable is paid out."""
    profile = read_profile(find("profiles", "bench-spiral"))
    turns, arm = profile.plot().axes
    lengths, values = arm.lines[0].get_data()
    assert (lengths[0], lengths[-1]) == (0.0, profile.reference.cable_length)
    wound = profile.reference.wound_turns
    assert values[-1] == pytest.approx(60.0 + 0.08 * wound, abs=0.05)
    # Stepwise, by a layer per drum turn.
    drum_turns = np.ptp(turns.lines[0].get_ydata()) / profile.gearbox.ratio
    assert values[0] - values[-1] == pytest.approx(0.08 * drum_turns, abs=0.081)
    (space,) = read_robot(find("profiles", "cabtive")).plot().axes
    x, y, z = (
        line for line in space.lines if line.get_label() == "exit points"
    ).__next__().get_data_3d()
    assert (x[0], y[0], z[0]) == pytest.approx((0.8611, 1.0583, 1.0971))
    with pytest.raises(UsageError, match="no cable to draw"):
        AxisProfile("joint").plot()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"output": "tenson"}, "no output 'tenson' to draw.*did you mean 'tension'"),
        ({"run": "nothing"}, "no run 'nothing' to draw; there are demo-10kg-1"),
    ],
)
def test_an_unknown_name_is_refused(
    options: dict[str, str], message: str, comparison: Comparison
) -> None:
    with pytest.raises(UsageError, match=message):
        comparison.plot(**options)


def test_without_matplotlib_the_line_that_installs_it_is_named(
    comparison: Comparison, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(UsageError, match=r"pip install 'winchkit\[plot\]'"):
        comparison.plot()
