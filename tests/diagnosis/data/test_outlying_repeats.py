"""A run made under another unrecorded condition is found among its repeats."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from winchkit.arrays import Array
from winchkit.diagnosis.data.dataset import SEPARATED
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.data.repeats import Repeats, outlying_repeat, separated, step_of
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.axis import AxisProfile

TURN = np.linspace(0, 2 * np.pi, 512)
COGGING = np.sin(7 * TURN) + 0.5 * np.sin(14 * TURN)
HALF_A_TURN_ON = -np.sin(7 * TURN) + 0.5 * np.sin(14 * TURN)


@pytest.mark.parametrize("place", range(4))
def test_a_run_with_another_zero_of_the_angle_is_found(place: int) -> None:
    random = np.random.default_rng(place)
    clean = [COGGING] * 4
    clean[place] = HALF_A_TURN_ON
    found = outlying_repeat(np.array(clean) + 0.1 * random.standard_normal((4, 512)))
    assert found is not None
    assert found.index == place
    assert found.rms == pytest.approx(np.sqrt(2), rel=0.05)
    assert found.usual == pytest.approx(0.1 * np.sqrt(2), rel=0.15)


def test_a_noisier_run_and_one_with_another_offset_are_repeats() -> None:
    random = np.random.default_rng(5)
    runs = COGGING + 0.05 * random.standard_normal((4, 512))
    runs[2] += 0.15 * random.standard_normal(512)
    runs[1] += 3.0
    assert outlying_repeat(runs) is None


@pytest.mark.parametrize("colour", [0.0, 0.9])
def test_noise_alone_is_seldom_outlying(colour: float) -> None:
    """A level of 1e-3 at a ratio of at least four: none of 300."""
    random = np.random.default_rng(6)
    found = 0
    for _ in range(300):
        noise = lfilter([1.0], [1.0, -colour], random.standard_normal((4, 600)), axis=1)
        found += outlying_repeat(noise) is not None
    assert found == 0


def test_two_repeats_show_that_they_differ_and_not_which_one_is_wrong() -> None:
    assert outlying_repeat(np.array([COGGING, HALF_A_TURN_ON])) is None


def sets_of(runs: Array) -> list[list[int]]:
    rows = np.arange(runs.shape[1])
    group = Repeats(tuple(range(len(runs))), (rows,) * len(runs))
    return [list(part.runs) for part in separated(group, runs)]


@pytest.mark.parametrize("order", [(0, 1, 2, 3, 4, 5), (0, 2, 4, 1, 3, 5)])
def test_repeats_of_three_weights_are_three_sets(order: tuple[int, ...]) -> None:
    random = np.random.default_rng(7)
    runs = np.repeat([1.0, 2.0, 4.0], 2)[:, None] * COGGING + 0.1 * random.standard_normal((6, 512))
    found = [{order[i] for i in part} for part in sets_of(runs[list(order)])]
    assert sorted(map(sorted, found)) == [[0, 1], [2, 3], [4, 5]]


@pytest.mark.parametrize("colour", [0.0, 0.9])
def test_noise_alone_is_seldom_separated(colour: float) -> None:
    random = np.random.default_rng(8)
    for _ in range(300):
        noise = lfilter([1.0], [1.0, -colour], random.standard_normal((6, 600)), axis=1)
        assert len(sets_of(noise)) == 1


def test_a_drift_that_the_profile_leaves_many_times_over_separates_nothing() -> None:
    random = np.random.default_rng(9)
    runs = 10 * COGGING + 0.1 * random.standard_normal((4, 512))
    runs[2:] += HALF_A_TURN_ON
    assert sets_of(runs) == [[0, 1, 2, 3]]


def swings(masses: tuple[float, ...], *, stated: bool) -> list[Run]:
    """Swings of a pendulum with a weight, that stand still now and then; noise 0.02 N m."""
    random, time = np.random.default_rng(10), np.arange(0.0, 20.0, 0.01)
    angle = 1.5 * np.clip(1.3 * np.sin(time), -1.0, 1.0)
    runs = []
    for number, mass in enumerate(masses):
        torque = 2.4 * mass * np.sin(angle) + 0.2 * np.sign(np.cos(time))
        torque += 0.3 * np.sin(40 * time) * (np.abs(angle) > 1.4999)
        channels = {
            "motor_angle": Channel(angle + 1e-4 * random.standard_normal(len(time)), "rad"),
            "motor_torque": Channel(torque + 0.02 * random.standard_normal(len(time)), "N m"),
        }
        metadata = {"load_mass": f"{mass} kg"} if stated else {}
        runs.append(Run(f"swing-{number}", time, channels, metadata))
    return runs


@pytest.mark.parametrize("stated", [True, False])
def test_the_noise_of_an_axis_is_that_of_runs_under_one_weight(stated: bool) -> None:
    data = prepare(swings((0.5, 0.5, 3.0, 3.0), stated=stated), AxisProfile(name="pendulum"))
    assert [group.runs for group in data.repeats] == [(0, 1), (2, 3)]
    assert any(finding.code == SEPARATED for finding in data.sanity) != stated


def test_repeats_exclude_the_same_samples() -> None:
    data = prepare(swings((3.0, 3.0), stated=True), AxisProfile(name="pendulum"))
    (group,) = data.repeated
    own = [
        data.recordings[run].valid["motor_torque"][rows]
        for run, rows in zip(group.runs, group.rows, strict=True)
    ]
    assert not own[0].all()
    assert (own[0] == own[1]).all()


@pytest.mark.parametrize("index", [0, 2])
def test_a_step_is_found_where_it_is_all_of_the_difference(index: int) -> None:
    runs = np.random.default_rng(3).standard_normal((3, 400))
    runs[index, 250:] += 6.0
    at, size = step_of(runs, index)
    assert abs(at - 250) <= 2
    assert size == pytest.approx(6.0, abs=0.3)


@pytest.mark.parametrize("shape", [np.linspace(0.0, 6.0, 400), np.full(400, 6.0)])
def test_a_drift_or_another_zero_is_no_step(shape: np.ndarray) -> None:
    runs = np.random.default_rng(4).standard_normal((3, 400))
    runs[1] += shape
    assert step_of(runs, 1) is None


def test_repeats_without_common_samples_show_no_step() -> None:
    runs = np.random.default_rng(5).standard_normal((3, 300))
    for run, own in enumerate(np.array_split(np.arange(300), 3)):
        runs[run, own] = np.nan
    assert step_of(runs, 1) is None
