"""Calibration of a four-cable hanging robot from a log in time, without a tracker."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from model_files import answer
from robot_poses.hanging import Hanging
from winchkit.schema.read import read_robot

pytestmark = pytest.mark.slow
RATIO, GAIN = (1.0, 1.0, 1.06, 1.0), (1.0, 1.03, 1.0, 1.0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Profile with points 2 mm off, and two logs at the same 36 poses."""
    place = tmp_path_factory.mktemp("hanging")
    right = Hanging()
    poses = right.poses(36, 11)
    (place / "robot.toml").write_text(right.profile_text(offset=2e-3, seed=1))
    (place / "right.csv").write_text(right.log(poses, 12))
    wrong = replace(right, ratio=RATIO, gain=GAIN)
    (place / "wrong.csv").write_text(wrong.log(poses, 13))
    return place


def calibrated(folder: Path, log: str) -> dict[str, Any]:
    out = folder / f"new-{log}.toml"
    return answer("calibrate", folder / "robot.toml", folder / log, "-o", out)


def test_ratio_and_gain_are_found_with_their_lines(folder: Path) -> None:
    found = calibrated(folder, "wrong.csv")
    assert found["ratios"]["named"] == ["3"]
    told = [text for text in found["warnings"] if "the cable per motor turn differs" in text]
    assert [text.partition(" by −")[0] for text in told] == [
        "line 3: the cable per motor turn differs"
    ]
    (line,) = (each for each in found["ratios"]["lines"] if each["named"])
    assert abs(line["change"] - (1 / 1.06 - 1)) < 4 * line["std"]
    assert line["std"] < 1e-3
    assert found["instruments"]["undeclared"] == ["cell_gain"]
    gains = [found["parameters"][f"{i}.cell_gain"] for i in "1234"]
    for gain, true in zip(gains, GAIN, strict=True):
        assert abs(gain["value"] - (true - 1)) < 4 * gain["std"]
    written = read_robot(folder / "new-wrong.csv.toml")
    assert not isinstance(written.line[2].winch, str)
    assert written.line[2].winch.gearbox.ratio == pytest.approx(1.06, abs=0.02)
    assert not isinstance(written.instrument.cells.gain, str)
    assert written.instrument.cells.gain["2"] == pytest.approx(0.03, abs=2e-3)


def test_nothing_is_named_where_all_is_right(folder: Path) -> None:
    found = calibrated(folder, "right.csv")
    assert found["ratios"]["named"] == []
    assert not any("the cable per motor turn differs" in text for text in found["warnings"])
    assert found["instruments"] == {}
    assert found["validation"]["length_rms_after"] < found["validation"]["length_rms_before"]
    assert found["fit"]["poses"] == 33
    assert any("36 holds" in text for text in found["warnings"])
