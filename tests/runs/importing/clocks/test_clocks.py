"""Two files are joined by time stamps or by cross-correlation, or refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from winchkit.arrays import Array
from winchkit.errors import RunError
from winchkit.runs.importing.clocks.joint import agreement_of, joined
from winchkit.runs.importing.streams import Stream, Streams

LAG, DRIFT = 3.2173, 80e-6
"""Clock of the first file less that of the second, s, and its growth."""


def lift(t: Array) -> Array:
    """A motion that does not repeat itself."""
    return 5 * np.sin(0.4 * t) + 2 * np.sin(1.7 * t + 0.3) + 0.3 * t


def file(
    name: str,
    time: Array,
    channels: dict[str, Array],
    *,
    origin: float = 0.0,
    is_absolute: bool = False,
) -> Streams:
    stream = Stream(time, channels, np.arange(len(time)))
    return Streams(name, (stream,), origin, is_absolute, True, lambda _row: None)


def pair(
    seed: int, lag: float = LAG, drift: float = DRIFT, *, absolute: bool = False
) -> tuple[Streams, Streams]:
    """A drive's log at 250 Hz, and a length instrument's at 50 Hz on a clock of its own."""
    rng = np.random.default_rng(seed)
    ours, theirs = np.arange(0, 60, 0.004), np.arange(0, 50, 0.02)
    angle = lift(ours) + 0.01 * rng.standard_normal(len(ours))
    length = 0.06 * lift(theirs * (1 + drift) + lag) + 0.3
    length += 0.0006 * rng.standard_normal(len(theirs))
    start = 1.7e9 if absolute else 0.0
    return (
        file("drive.csv", ours, {"motor_angle": angle}, origin=start, is_absolute=absolute),
        file("laser.csv", theirs, {"cable_length": length}, origin=start, is_absolute=absolute),
    )


@pytest.mark.parametrize("seed", range(8))
def test_lag_and_drift_are_found_with_honest_uncertainties(seed: int) -> None:
    found = agreement_of(*pair(seed))
    assert found is not None
    assert found.is_known
    assert abs(found.correlation) > 0.99
    # The true lag at the time for which the lag is given.
    true = LAG + DRIFT * found.reference
    assert found.lag_std < 1e-3
    assert found.lag == pytest.approx(true, abs=4 * found.lag_std)
    assert found.drift == pytest.approx(DRIFT, abs=4 * found.drift_std)
    assert found.drift_std < 30e-6


def test_joined_channels_are_at_the_same_times() -> None:
    first, second = pair(0)
    whole, (joint,) = joined([first, second])
    assert joint.method == "cross-correlation"
    assert joint.drift == pytest.approx(DRIFT, rel=0.5)
    length = next(item for item in whole.streams if "cable_length" in item.channels)
    expected = 0.06 * lift(length.time) + 0.3
    assert length.channels["cable_length"] == pytest.approx(expected, abs=4e-3)
    assert np.std(length.channels["cable_length"] - expected) < 8e-4


def test_a_negative_lag_is_found() -> None:
    found = agreement_of(*pair(1, lag=-2.5, drift=0.0))
    assert found is not None
    assert found.lag == pytest.approx(-2.5, abs=4 * found.lag_std)


def test_a_periodic_motion_is_refused() -> None:
    first, second = pair(0)
    ours, theirs = first.streams[0].time, second.streams[0].time
    noise = np.random.default_rng(2).standard_normal(len(theirs))
    one = file("drive.csv", ours, {"motor_angle": np.sin(2 * ours)})
    two = file("laser.csv", theirs, {"cable_length": np.sin(2 * theirs + 0.6) + 0.01 * noise})
    with pytest.raises(RunError, match=r"several lags fit equally.*--lag"):
        joined([one, two])


def test_unrelated_signals_are_not_joined() -> None:
    """Random walks have large spurious correlations; the share that is taken for known is small."""
    rng = np.random.default_rng(3)
    taken = 0
    for _ in range(150):
        time = np.arange(0, 40, 0.05)
        walks = rng.standard_normal((2, len(time))).cumsum(axis=1)
        one = file("a.csv", time, {"motor_angle": walks[0]})
        two = file("b.csv", time, {"cable_length": walks[1]})
        found = agreement_of(one, two)
        taken += found is not None and found.is_known
    assert taken <= 3


def test_files_without_common_quantities_need_the_lag() -> None:
    first, second = pair(0)
    stream = second.streams[0]
    warm = replace(second, streams=(replace(stream, channels={"temperature": stream.time}),))
    with pytest.raises(RunError, match="do not follow each other"):
        joined([first, warm])
    whole, (joint,) = joined([first, warm], lag=0.5)
    assert joint.method == "given lag"
    assert whole.streams[1].time[0] == pytest.approx(0.5)
    with pytest.raises(RunError, match="does not overlap"):
        joined([first, warm], lag=900.0)


def test_absolute_clocks_that_agree_are_kept() -> None:
    first, second = pair(4, lag=0.004, drift=0.0, absolute=True)
    whole, (joint,) = joined([first, second])
    assert joint.method == "time stamps"
    assert "agree to" in joint.text
    assert whole.streams[1].time[0] == 0.0


def test_absolute_clocks_that_differ_are_corrected_and_reported() -> None:
    first, second = pair(4, lag=0.31, drift=0.0, absolute=True)
    whole, (joint,) = joined([first, second])
    assert joint.method == "cross-correlation"
    assert joint.lag == pytest.approx(0.31, abs=2e-3)
    assert "time stamps differ from it by 0.31" in joint.text
    assert whole.streams[1].time[0] == pytest.approx(0.31, abs=2e-3)


def test_a_channel_of_two_files_is_that_of_the_first() -> None:
    first, second = pair(0)
    both = replace(
        first.streams[0],
        channels={**first.streams[0].channels, "cable_length": first.streams[0].time},
    )
    whole, _ = joined([replace(first, streams=(both,)), second], lag=0.0)
    assert [name for item in whole.streams for name in item.channels].count("cable_length") == 1
    assert any("cable_length left out" in note for note in whole.notes)


def robot(seed: int, turn: float) -> tuple[Streams, Streams]:
    """A planar robot of four cables, and a tracker that stands in another frame.

    The platform tilts by up to ``turn`` rad; lengths are from distances of points.
    """
    rng = np.random.default_rng(seed)

    def pose(t: Array) -> tuple[Array, Array]:
        place = np.stack(
            [
                1.4 + 0.7 * np.sin(0.61 * t) + 0.2 * np.sin(1.9 * t + 1),
                1.2 + 0.6 * np.sin(0.47 * t + 2) + 0.2 * np.cos(2.3 * t),
                np.zeros(len(t)),
            ],
            axis=1,
        )
        return place, turn * np.sin(1.3 * t)

    ours, theirs = np.arange(0, 30, 0.01), np.arange(0, 25, 1 / 120)
    place, tilt = pose(ours)
    exits = np.array([[2.9, 0.0], [2.9, 2.3], [0.0, 2.3], [0.0, 0.0]])
    angles = {}
    for n, point in enumerate(exits):
        corner = 0.06 * np.sign(point - 1.2)
        reach = np.stack([np.cos(tilt), -np.sin(tilt), np.sin(tilt), np.cos(tilt)], axis=1)
        anchor = place[:, :2] + reach.reshape(-1, 2, 2) @ corner
        length = np.linalg.norm(anchor - point, axis=1) + 0.001 * rng.standard_normal(len(ours))
        angles[f"{n + 1}.motor_angle"] = (length - 1.7) / 0.0127
    seen = pose(theirs * (1 + DRIFT) + LAG)[0] @ np.linalg.qr(rng.standard_normal((3, 3)))[0]
    seen += 0.0005 * rng.standard_normal(seen.shape)
    return (
        file("robot.csv", ours, angles),
        file("tracker.csv", theirs, {f"platform_{x}": seen[:, i] for i, x in enumerate("xyz")}),
    )


@pytest.mark.parametrize("turn", [0.0, 0.1])
@pytest.mark.parametrize("seed", range(3))
def test_a_tracker_is_joined_by_all_lines_of_a_robot(seed: int, turn: float) -> None:
    """One line alone follows a coordinate with a correlation of 0.9, and is largest elsewhere."""
    lines, tracker = robot(seed, turn)
    for first, second, sign in ((lines, tracker, 1.0), (tracker, lines, -1.0)):
        found = agreement_of(first, second)
        assert found is not None
        assert found.is_known
        assert found.correlation > 0.995
        true = sign * (LAG + DRIFT * (found.reference if sign > 0 else found.reference - LAG))
        assert found.lag == pytest.approx(true, abs=max(4 * found.lag_std, 0.002))
        assert found.drift == pytest.approx(sign * DRIFT, abs=max(4 * found.drift_std, 1e-4))
        assert "4 lines" in found.text


def test_the_same_circle_again_and_again_has_no_lag() -> None:
    time, turn = np.arange(0, 30, 0.01), 2 * np.pi / 3
    circle = {f"{n}.motor_angle": np.sin(turn * time + n) for n in range(1, 5)}
    seen = np.arange(0, 25, 1 / 120)
    same = {"platform_x": np.cos(turn * seen), "platform_y": np.sin(turn * seen)}
    found = agreement_of(file("robot.csv", time, circle), file("tracker.csv", seen, same))
    assert found is not None
    assert not found.is_known
