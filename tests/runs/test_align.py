"""Signals brought to common moments: against numpy, and in pieces as at once."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit.runs.align import Aligner, SourceSeries, values_at
from winchkit.runs.layout import Layout, RowRule, SignalSource, SourceSignal

STEPS = st.lists(st.floats(1e-3, 0.2), min_size=2, max_size=40)
SHARES = st.lists(st.floats(-0.2, 1.2), min_size=1, max_size=30)


@given(steps=STEPS, shares=SHARES, gap=st.floats(1e-3, 0.3))
def test_values_are_numpys_between_near_neighbours_and_nan_elsewhere(
    steps: list[float], shares: list[float], gap: float
) -> None:
    times = np.cumsum(steps)
    values = np.column_stack([np.sin(times), np.cos(7 * times)])
    moments = times[0] + np.array(shares) * (times[-1] - times[0])
    found = values_at(times, values, moments, gap)
    for moment, row in zip(moments, found, strict=True):
        before, after = times[times <= moment], times[times >= moment]
        near = len(before) and len(after) and after[0] - before[-1] <= gap
        expected = [np.interp(moment, times, column) if near else math.nan for column in values.T]
        assert row == pytest.approx(expected, abs=1e-9, nan_ok=True)


def test_no_value_without_neighbours() -> None:
    series = SourceSeries(max_gap=0.1)

    def at(moment: float) -> float:
        return float(series.at(np.array([moment]))[0, 0])

    assert math.isnan(at(0.0))
    samples = np.array([(1.0, 1.0), (1.05, 2.0), (1.5, 3.0), (1.52, math.nan), (1.54, 5.0)])
    series.append(samples[:, 0], samples[:, 1:])
    series.append(np.array([1.5, 1.54]), np.array([[99.0], [99.0]]))
    assert math.isnan(at(0.9)), "before the first"
    assert at(1.0) == 1.0
    assert math.isnan(at(1.2)), "a gap is not bridged"
    assert at(1.5) == 3.0
    assert math.isnan(at(1.51)), "nor is a missing value"
    assert at(1.54) == 5.0, "what is not newer is left"
    assert math.isnan(at(1.6)), "after the last"
    assert not series.reaches(1.6)
    series.forget(1.53)
    assert math.isnan(at(1.0))
    assert at(1.54) == 5.0


def layout(period: float = 0.0, opened: float = 0.0) -> Layout:
    drive = SignalSource(
        "/A/drive",
        (
            SourceSignal("motor_angle", "rad", "motor_angle"),
            SourceSignal("motor_torque", "N m", "motor_torque"),
        ),
        0.1,
    )
    cell = SignalSource(
        "/A/cell", (SourceSignal("raw", "1"), SourceSignal("tension", "N", "tension")), 0.1
    )
    base = "/A/drive" if period else "/A/cell"
    return Layout((drive, cell), RowRule(base, opened, period))


def samples(rate: float, delay: float, duration: float = 3.0) -> tuple[np.ndarray, np.ndarray]:
    times = delay + np.arange(0.0, duration, 1 / rate)
    return times, np.column_stack([10 * times, -times])


@given(cuts=st.lists(st.floats(0.05, 2.9), max_size=8))
def test_rows_in_pieces_are_the_rows_at_once(cuts: list[float]) -> None:
    drive, cell = samples(250, 0.0), samples(100, 0.0137)
    whole = Aligner(layout())
    whole.add("/A/drive", *drive)
    whole.add("/A/cell", *cell)
    expected = whole.rows(3.1)
    live, pieces, begin = Aligner(layout()), [], 0.0
    for end in [*sorted(cuts), 3.1]:
        for topic, (times, values) in (("/A/drive", drive), ("/A/cell", cell)):
            part = (times >= begin) & (times < end)
            live.add(topic, times[part], values[part])
        pieces.append(live.rows(end))
        begin = end
    assert np.array_equal(np.concatenate(pieces), expected)
    assert expected[:, 1] == pytest.approx(10 * (expected[:, 0] + whole.start), abs=1e-9)
    assert expected[:, 3] == pytest.approx(-(expected[:, 0] + whole.start), abs=1e-9)


@given(
    cuts=st.lists(st.floats(0.05, 5.9), max_size=8),
    begin=st.floats(0.0, 5.0),
    length=st.floats(0.0, 5.0),
    which=st.sampled_from(["/A/cell", "/A/drive"]),
)
def test_rows_go_on_while_a_source_is_silent_however_they_are_written(
    cuts: list[float], begin: float, length: float, which: str
) -> None:
    sources = {"/A/drive": samples(250, 0.0, 6.0), "/A/cell": samples(100, 0.0137, 5.98)}
    times, values = sources[which]
    heard = (times < begin) | (times > begin + length)
    sources[which] = times[heard], values[heard]
    whole = Aligner(layout())
    for topic, (times, values) in sources.items():
        whole.add(topic, times, values)
    expected = whole.rows(6.0, ends=True)
    live, pieces, before = Aligner(layout()), [], 0.0
    for end in [*sorted(cuts), 6.0]:
        for topic, (times, values) in sources.items():
            part = (times >= before) & (times < end)
            live.add(topic, times[part], values[part])
        pieces.append(live.rows(end))
        before = end
    pieces.append(live.rows(6.02, ends=True))
    found = np.concatenate([piece for piece in pieces if len(piece)])
    assert np.array_equal(found, expected, equal_nan=True)
    assert (np.diff(found[:, 0]) > 0).all()
    moments = found[:, 0] + whole.start
    assert moments[-1] > 5.9
    # Within a silence of the cell rows come from the drive, a hundredth apart; none is invented.
    quiet = (moments > begin + 0.01) & (moments < begin + length - 0.01)
    if which == "/A/cell" and length > 1.2 and begin + length < 5.8 and begin > 0.02:
        assert np.count_nonzero(quiet) == pytest.approx(length / 0.012, abs=4)
        assert np.isnan(found[quiet, 3]).all()
        assert found[quiet, 1] == pytest.approx(10 * moments[quiet], abs=1e-9)


def test_a_run_begins_when_every_channel_has_come() -> None:
    aligner = Aligner(layout(opened=0.2))
    aligner.add("/A/cell", *samples(100, 0.0))
    times, values = samples(250, 0.4)
    values[:, 1] = math.nan
    aligner.add("/A/drive", times, values)
    rows = aligner.rows(3.5)
    assert aligner.start == pytest.approx(0.4), "the torque may lack, the angle not"
    assert rows[0, 0] == 0.0
    assert not np.isnan(rows[:, [1, 3]]).any()


def test_a_channel_that_never_comes_is_awaited_for_half_a_second() -> None:
    aligner = Aligner(layout(opened=0.2))
    aligner.add("/A/cell", *samples(100, 0.0))
    rows = aligner.rows(3.5)
    assert aligner.start == pytest.approx(0.7)
    assert np.isnan(rows[:, 1]).all()


def test_a_silent_source_holds_rows_up_no_longer_than_half_a_second() -> None:
    aligner = Aligner(layout())
    aligner.add("/A/cell", *samples(100, 0.0))
    aligner.add("/A/drive", *samples(250, 0.0, 1.0))
    assert aligner.rows(1.2)[-1, 0] == pytest.approx(0.99)
    later = aligner.rows(3.0)
    assert later[-1, 0] == pytest.approx(2.99)
    assert np.isnan(later[:, 1]).all()


def test_rows_of_a_bench_without_instruments_keep_their_distance() -> None:
    aligner = Aligner(layout(period=0.0095))
    aligner.add("/A/drive", *samples(1000, 0.0, 1.0))
    aligner.add("/A/cell", *samples(100, 0.0, 1.0))
    rows = aligner.rows(1.0)
    assert np.diff(rows[:, 0]) == pytest.approx(0.01)


def test_readings_out_of_order_make_no_rows() -> None:
    aligner = Aligner(layout())
    aligner.add("/A/drive", *samples(250, 0.0))
    times = np.array([0.1, 0.3, 0.2, 0.3, math.nan, 0.35])
    aligner.add("/A/cell", times, np.column_stack([times, times]))
    assert aligner.rows(0.6)[:, 0] == pytest.approx([0.0, 0.2, 0.25])


def test_the_end_of_a_log_waits_for_nothing_slower_than_its_rows() -> None:
    slow = SignalSource(
        "/A/temperature", (SourceSignal("temperature", "degC", "temperature"),), 1.0
    )
    made = layout()
    aligner = Aligner(Layout((*made.sources, slow), made.rule))
    aligner.add("/A/drive", *samples(250, 0.0))
    aligner.add("/A/cell", *samples(100, 0.0137, 2.99))
    aligner.add("/A/temperature", np.arange(0.0, 2.9, 0.25), np.full((12, 1), 20.0))
    before = aligner.rows(3.0)
    assert before[-1, 0] + aligner.start <= 2.75, "a row that may still be complete waits"
    rest = aligner.rows(3.0, ends=True)
    times = rest[:, 0] + aligner.start
    assert times[0] > 2.75
    assert times[-1] == pytest.approx(2.9937), "every sample of the cell that the drive reaches"
    assert np.diff(times) == pytest.approx(0.01)
    assert rest[:, 1] == pytest.approx(10 * times)
    assert np.isnan(rest[:, -1]).all(), "no temperature is invented"
    assert not len(aligner.rows(3.0, ends=True))


def test_the_end_of_a_log_keeps_the_rows_of_a_source_that_fell_silent_before_it() -> None:
    """An instrument that gave no reading in the last 0.2 s does not cost the others their rows."""
    length = SignalSource("/A/length", (SourceSignal("length", "m", "cable_length"),), 0.1)
    made = layout()
    aligner = Aligner(Layout((*made.sources, length), made.rule))
    aligner.add("/A/drive", *samples(250, 0.0))
    aligner.add("/A/cell", *samples(100, 0.0, 2.99))
    aligner.add("/A/length", np.arange(0.0, 2.8, 0.01), np.full((280, 1), 4.0))
    before = aligner.rows(3.0)
    assert before[-1, 0] <= 2.79, "a row that may still be complete waits"
    rest = aligner.rows(3.0, ends=True)
    assert rest[-1, 0] == pytest.approx(2.98), "every sample of the cell"
    assert rest[:, 1] == pytest.approx(10 * rest[:, 0])
    assert np.isnan(rest[:, -1]).all(), "no length is invented"
