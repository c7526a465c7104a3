"""Recordings of a load cell alone, made from known noise, spikes, hum, drift and temperature."""

from __future__ import annotations

import os
import re
from pathlib import Path

import numpy as np
import pytest

from winchkit.calibration.cell.health import is_wrong
from winchkit.calibration.cell.recordings import CellFindings, recorded_cell_health
from winchkit.errors import RunError

FOLDER = Path(os.environ.get("WINCHKIT_INPUTS", Path(__file__).parents[4] / "shared/data/inputs"))
RATE, NOISE = 160.0, 40.0
"""Hz, counts."""


def signal(seconds: float = 20.0, level: float = 50_000.0, seed: int = 0) -> tuple[np.ndarray, ...]:
    time = np.arange(0, seconds, 1 / RATE)
    noise = np.random.default_rng(seed).normal(0, NOISE, len(time))
    return time, np.round(level + noise)


def findings(
    path: Path,
    time: np.ndarray,
    value: np.ndarray,
    head: str = "time [s],cell [counts]",
    **more: np.ndarray,
) -> CellFindings:
    columns = (time, value, *more.values())
    head = ",".join([head, *more])
    rows = (",".join(f"{cell:.12g}" for cell in row) for row in zip(*columns, strict=True))
    path.write_text("\n".join([head, *rows]) + "\n")
    (found,) = recorded_cell_health(path)
    return found


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "cell.csv"


def test_noise_and_rate_are_those_of_the_cell(path: Path) -> None:
    found = findings(path, *signal())
    assert found.unit == "counts"
    assert found.health.noise == pytest.approx(np.hypot(NOISE, 12**-0.5), rel=0.05)
    assert found.health.rate == pytest.approx(RATE, rel=1e-3)
    assert found.health.usable == found.health.readings == 3200
    assert not found.spikes
    assert not found.remarks


@pytest.mark.parametrize("head", ["time [s],cell [kg]", "t,reading", "Zeit [s];Kraft [N]"])
def test_any_unit_or_none_is_that_of_the_figures(path: Path, head: str) -> None:
    time, value = signal()
    if ";" in head:
        rows = (f"{t:.5f};{v:.0f}".replace(".", ",") for t, v in zip(time, value, strict=True))
        path.write_text("\n".join([head, *rows]) + "\n")
        (found,) = recorded_cell_health(path)
    else:
        found = findings(path, time, value, head)
    assert found.health.noise == pytest.approx(NOISE, rel=0.05)
    assert found.unit in head


@pytest.mark.parametrize(("bits", "offset"), [(24, 1500), (16, 20)])
def test_spikes_at_the_end_of_the_converter_are_counted_and_left_out(
    path: Path, bits: int, offset: int
) -> None:
    time, value = signal(level=9000.0)
    at = np.array([300, 1200, 1202, 2900])
    value[at] = -(2 ** (bits - 1)) + offset
    found = findings(path, time, value)
    assert found.spikes == 4
    assert found.largest_spike == pytest.approx(2 ** (bits - 1) - offset + 9000, rel=0.01)
    assert found.health.noise == pytest.approx(NOISE, rel=0.05)
    assert f"converter of {bits} bits" in found.remarks[0]


def test_hum_and_drift_have_their_size(path: Path) -> None:
    time, value = signal()
    value = value + 60 * np.sin(2 * np.pi * 50 * time + 0.3) + 20 * time
    found = findings(path, time, np.round(value))
    hum = next(one for one in found.health.hum if one.frequency == 50)
    assert hum.amplitude == pytest.approx(60, abs=4 * hum.std)
    assert hum.there
    assert found.health.drift == pytest.approx(20, abs=4 * found.health.drift_std)
    assert any("hum of the mains at 50 Hz" in text for text in found.remarks)
    assert any("drifted" in text for text in found.remarks)


def test_a_temperature_that_the_reading_follows_is_named(path: Path) -> None:
    time, value = signal()
    temperature = 25 + 2 * np.sin(2 * np.pi * time / 7)
    found = findings(
        path, time, np.round(value + 35 * temperature), **{"temperature [degC]": temperature}
    )
    assert found.temperature_slope == pytest.approx(35, abs=4 * found.temperature_slope_std)
    assert any("follows the temperature" in text for text in found.remarks)
    still = findings(path, time, value, **{"temperature [degC]": temperature})
    assert not any("follows" in text for text in still.remarks)


def test_a_stuck_stretch_and_held_words_are_distinguished(path: Path) -> None:
    time, value = signal()
    stuck = value.copy()
    stuck[1000:1060] = stuck[1000]
    found = findings(path, time, stuck)
    assert found.health.longest_still == pytest.approx(60 / RATE, abs=2 / RATE)
    assert any("stood still for 0.3" in text for text in found.remarks)
    held = np.repeat(value[::4], 4)[: len(value)]
    found = findings(path, time, held)
    rates = [re.search(r"instrument has about ([\d.]+) Hz", text) for text in found.remarks]
    # Two conversions in a hundred are equal by chance, which lowers the rate of changes.
    assert [float(one[1]) for one in rates if one] == [pytest.approx(40, rel=0.02)]
    assert not any("stood still" in text for text in found.remarks)


def test_a_gap_is_no_standstill(path: Path) -> None:
    time, value = signal()
    time = np.where(np.arange(len(time)) < 1000, time, time + 1.5)
    found = findings(path, time, value)
    assert found.health.longest_still < 0.1
    assert any("1 gap" in text for text in found.remarks)
    assert not any("stood still" in text for text in found.remarks)


def test_hum_above_half_the_rate_may_be_a_vibration(path: Path) -> None:
    time, value = signal()
    value = np.round(value + 300 * np.sin(2 * np.pi * 50 * time))
    whole, slow = (findings(path, time[::n], value[::n]) for n in (1, 5))
    assert any("50 Hz: check" in text for text in whole.remarks)
    assert any("50 Hz, or a vibration of 14 Hz" in text for text in slow.remarks)


@pytest.mark.parametrize("swing", [0.0, 3000.0])
def test_saturated_readings_are_wrong_and_left_out(path: Path, swing: float) -> None:
    time, value = signal()
    cut = np.minimum(value + swing * np.sin(2 * np.pi * time / 9), 52_000)
    cut[1000:1100] = 52_000
    found = findings(path, time, cut)
    at_end = int(np.count_nonzero(cut == 52_000))
    assert (found.health.saturated, found.health.usable) == (at_end, len(cut) - at_end)
    assert swing or found.health.noise == pytest.approx(NOISE, rel=0.05)
    assert is_wrong(found.health)
    assert any(text.endswith("the logger saturates") for text in found.remarks)


def test_rows_without_times_have_the_rate_that_is_given(path: Path) -> None:
    _, value = signal()
    path.write_text("\n".join(f"{reading:.0f}" for reading in value) + "\n")
    with pytest.raises(RunError, match="--sample-rate"):
        recorded_cell_health(path)
    (found,) = recorded_cell_health(path, sample_rate=RATE)
    assert found.health.rate == pytest.approx(RATE)
    assert found.health.noise == pytest.approx(NOISE, rel=0.05)


def test_figures_are_of_the_longest_stretch_and_creep_of_the_largest_change(path: Path) -> None:
    time, value = signal(60)
    value[3000:] += 20_000
    since = np.maximum(time - time[3000], 1e-3)
    value[3000:] += 100 * np.log(since[3000:] / 0.5)
    found = findings(path, time, np.round(value))
    creep = found.health.creep
    assert creep.step == pytest.approx(20_000, rel=0.05)
    assert creep.change == pytest.approx(100 * np.log(30), abs=4 * creep.std)
    assert found.health.low > 60_000


def test_other_columns_of_a_file_with_motion_are_not_asked_for(path: Path) -> None:
    time, value = signal()
    beside = {"position": np.sin(time), "torque [%]": np.cos(time)}
    found = findings(path, time, value, **beside)
    assert found.name == "cell"


@pytest.mark.parametrize(
    ("content", "column", "said"),
    [
        ("time [s],a,b\n" + "".join(f"{k},{k % 3},{k % 5}\n" for k in range(40)), None, "--column"),
        ("time [s],cell\n0,1\n1,2\n", None, "at least 20"),
        ("cell [counts]\n" + "".join(f"{k % 7}\n" for k in range(40)), None, "has no times"),
        ("time [s],cell\n0,1\n1,2\n", "force", "there is no column 'force'"),
    ],
)
def test_what_cannot_be_examined_is_refused(
    path: Path, content: str, column: str | None, said: str
) -> None:
    path.write_text(content)
    with pytest.raises(RunError, match=said):
        recorded_cell_health(path, column)


@pytest.mark.skipif(not FOLDER.is_dir(), reason="the inputs are not on this computer")
def test_a_cell_with_glitches() -> None:
    (found,) = recorded_cell_health(FOLDER / "cell_only_glitches.csv")
    assert found.health.readings == 600
    assert found.health.rate == pytest.approx(10)
    assert found.spikes == 4
    assert found.health.noise == pytest.approx(45, rel=0.15)
