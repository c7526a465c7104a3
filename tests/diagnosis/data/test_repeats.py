"""Which runs repeat each other, and how their clocks line up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from diagnosis_runs import GROOVED, Array, Ride, made, with_channel
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.data.repeats import Repeats, find_repeats, mean_load
from winchkit.model.stages import Signals
from winchkit.runs.run import Run


def signals(
    time: Array, clock: float = 0.0, stroke: float = 400.0, load: float | None = 100.0
) -> Signals:
    """A ride read at times, shown by a clock that is ahead."""
    phase = np.clip(2 * np.pi * (time - 1.0) / 6, 0.0, 2 * np.pi)
    angle = stroke / 2 * (1 - np.cos(phase)) + 20 * np.sin(phase) ** 3
    return Signals(time + clock, angle, load=None if load is None else np.full_like(time, load))


EVEN = np.arange(400) / 50


def aligned(group: Repeats, *runs: Signals) -> tuple[Array, ...]:
    return tuple(
        runs[index].motor_angle[rows] for index, rows in zip(group.runs, group.rows, strict=True)
    )


@settings(max_examples=30, deadline=None)
@given(
    st.floats(-100, 100),
    st.integers(0, 40),
    st.integers(0, 30),
    st.sets(st.integers(5, 390), max_size=12),
)
def test_repeats_line_up_whatever_their_clocks_starts_ends_and_gaps(
    clock: float, late: int, short: int, lost: set[int]
) -> None:
    second = np.delete(EVEN, sorted(lost))
    second = second[(second >= late / 50) & (second <= EVEN[-1] - short / 50)]
    runs = signals(EVEN), signals(second, clock)
    (group,) = find_repeats(list(runs))
    assert group.runs == (0, 1)
    first, other = aligned(group, *runs)
    shared = np.count_nonzero((second[0] <= EVEN) & (second[-1] >= EVEN))
    assert len(first) == len(other) >= shared - 1
    exact = np.isclose(first, other, atol=1e-6)
    # Only what a gap swallowed has no partner of its own.
    assert np.count_nonzero(~exact) <= len(lost) + 2


def test_a_log_that_began_in_motion_is_a_repeat() -> None:
    runs = signals(EVEN), signals(EVEN[EVEN >= 2.0])
    (group,) = find_repeats(list(runs))
    assert np.allclose(*aligned(group, *runs))


def test_three_repeats_share_what_all_of_them_have() -> None:
    runs = signals(EVEN), signals(EVEN[30:], 5.0), signals(EVEN[:-50], -3.0)
    (group,) = find_repeats(list(runs))
    a, b, c = aligned(group, *runs)
    assert len(a) == 320
    assert np.allclose(a, b)
    assert np.allclose(a, c)


@pytest.mark.parametrize(
    ("other", "same"),
    [
        (signals(EVEN, load=101.5), True),
        (signals(EVEN, load=103.0), False),
        (signals(EVEN, load=None), False),
        (signals(EVEN, stroke=404.0), True),
        (signals(EVEN, stroke=430.0), False),
        (signals(EVEN[:200]), True),
        (signals(np.arange(200) / 25), False),
        (signals(EVEN + 0.5), True),
        (replace(signals(EVEN), motor_angle=-signals(EVEN).motor_angle), False),
        (replace(signals(EVEN), motor_angle=np.ones(400)), False),
    ],
    ids=[
        "load 1.5 % more",
        "load 3 % more",
        "load unknown",
        "1 % wider",
        "7 % wider",
        "cut short",
        "half the rate",
        "half a second early",
        "the other way",
        "stands still",
    ],
)
def test_what_is_a_repeat(other: Signals, same: bool) -> None:
    groups = find_repeats([signals(EVEN), other])
    assert [group.runs for group in groups] == ([(0, 1)] if same else [(0,), (1,)])


def test_the_load_comes_from_the_cell_beside_the_weight() -> None:
    plain = signals(EVEN, load=None)
    assert mean_load(plain) is None
    assert mean_load(replace(plain, tension=np.full(400, 90.0))) == pytest.approx(90.0)
    known_weight = replace(plain, tension=np.full(400, 90.0), load_mass=10.0)
    assert mean_load(known_weight) == pytest.approx(98.0665)
    assert mean_load(replace(known_weight, load=np.full(400, 95.0))) == pytest.approx(95.0)


def test_noise_of_the_encoder_breaks_no_repeat() -> None:
    random = np.random.default_rng(4)
    runs = [
        replace(run, motor_angle=run.motor_angle + 0.05 * random.standard_normal(400))
        for run in (signals(EVEN), signals(EVEN, 12.3))
    ]
    assert [group.runs for group in find_repeats(runs)] == [(0, 1)]


def test_a_dataset_sorts_runs_into_groups() -> None:
    slow = Ride(period=8.0)
    runs = [
        made(0),
        made(1, load_mass=20.0),
        made(2),
        made(3, ride=slow),
        made(4, load_mass=20.0),
        with_channel(made(5), "motor_angle", made(5)["motor_angle"] * 1.2, "rad"),
    ]
    dataset = prepare(runs[:5], GROOVED)
    assert [group.runs for group in dataset.repeats] == [(0, 2), (1, 4), (3,)]
    assert [group.runs for group in dataset.repeated] == [(0, 2), (1, 4)]


def test_a_recording_in_two_files_repeats_the_whole_one_by_one_of_them() -> None:
    """Both halves overlap the whole, and not each other: no sample is common to the three."""
    whole, other = made(1, load_mass=10.0), made(2, load_mass=10.0)
    half = len(whole) // 2
    parts = [piece(whole, 0, half), piece(whole, half, len(whole))]
    for runs in ([other, *parts], [*parts, other]):
        groups = prepare(runs, GROOVED).repeats
        assert sorted(run for group in groups for run in group.runs) == [0, 1, 2]
        assert all(len(rows) > 0 for group in groups for rows in group.rows)


def piece(run: Run, start: int, stop: int) -> Run:
    channels = {n: replace(c, values=c.values[start:stop]) for n, c in run.channels.items()}
    return Run(f"{run.name}-{start}", run.time[start:stop], channels, run.metadata)
