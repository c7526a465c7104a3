"""Cut-off of the torque's low-pass, and what it removes, on signals of known frequencies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from winchkit.arrays import Array
from winchkit.diagnosis.data.low_pass import UnfilteredOutput, removed_by_low_pass, torque_cut_off
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.diagnose import diagnose
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.axis import AxisProfile

RATE = 500.0
SPEED = 40.0
"""rad/s: order 12 is at 76 Hz."""


def fast_motor(seed: int, ripple: float, *, seconds: float = 4.0, noise: float = 1e-3) -> Run:
    """Motor at 40 rad/s: an offset of 5 mN m, a torque of order 12, white noise of 1 mN m."""
    random, time = np.random.default_rng(seed), np.arange(0, seconds, 1 / RATE)
    rate = SPEED + 4 * np.sin(2.0 * time + 0.4 * seed)
    angle = np.cumsum(rate) / RATE
    torque = 5e-3 + ripple * np.sin(12 * angle + 0.7) + noise * random.standard_normal(len(time))
    return Run(
        f"roll{seed}",
        time,
        {
            "motor_angle": Channel(angle, "rad"),
            "motor_velocity": Channel(rate, "rad/s"),
            "motor_torque": Channel(torque, "N m"),
        },
    )


def compared(run: Run) -> UnfilteredOutput:
    return UnfilteredOutput(run["motor_angle"], run["motor_torque"], run["motor_torque"], RATE)


def cut_off(errors: Sequence[Array], rate: float, speed: float = 1e3) -> float:
    """Cut-off where these errors are the torque itself."""
    return torque_cut_off([UnfilteredOutput(e, e, e, rate) for e in errors], speed)


def noisy(seed: int, count: int = 4000) -> Array:
    return np.random.default_rng(seed).standard_normal(count)


def test_white_noise_is_compared_up_to_20_hz_or_a_tenth_of_the_rate() -> None:
    assert cut_off([1e-3 * noisy(1)], 1000.0) == 20.0
    assert cut_off([1e-3 * noisy(1)], 50.0) == 5.0


def test_the_cut_off_follows_cogging_that_a_tenth_of_the_rate_would_filter_away() -> None:
    """A sine of a fifth of the slow residual's amplitude, at 4 Hz of 25 Hz."""
    time = np.arange(4000) / 25
    slow = np.sin(2 * np.pi * 0.05 * time) + 0.05 * noisy(1)
    assert cut_off([slow, slow], 25.0) == 2.5
    cogging = slow + 0.2 * np.sin(2 * np.pi * 4.0 * time)
    assert 4.0 < cut_off([slow, cogging], 25.0) < 5.0
    assert cut_off([cogging + 0.2 * np.sin(2 * np.pi * 12.0 * time)], 25.0) == 10.0


def test_noise_alone_raises_the_cut_off_in_few_of_many_cases() -> None:
    """White noise in four short runs: nominally 1 %, of 1000 other cases 1.7 %."""
    random = np.random.default_rng(2)
    raised = [cut_off(list(random.standard_normal((4, 1500))), 20.0) for _ in range(300)]
    assert np.count_nonzero(np.array(raised) > 2.0) <= 12


def test_noise_of_the_predicted_inertial_torque_raises_no_cut_off() -> None:
    """Second differences of white noise have most of their power at the highest frequencies."""
    inertial = np.diff(noisy(1, 4002), 2)
    assert (
        torque_cut_off([UnfilteredOutput(inertial, noisy(2), noisy(2) + inertial, 200.0)], 1e3)
        == 20.0
    )


def test_the_highest_order_at_the_highest_speed_bounds_the_cut_off() -> None:
    """1.5 · 36 turns at 2π rad/s; a weak sine beside a strong slow signal is no white noise."""
    time = np.arange(8000) / 1000
    slow = np.sin(2 * np.pi * 0.3 * time) + 0.01 * noisy(1, 8000)
    weak = slow + 0.02 * np.sin(2 * np.pi * 97 * time)
    assert 97 < cut_off([weak], 1000.0, 50.0) < 110
    assert cut_off([weak], 1000.0, 2 * np.pi) == pytest.approx(54.0)
    assert cut_off([weak], 1000.0, 0.1) == 20.0


def test_what_the_low_pass_removes_is_reported_with_its_size_and_its_order() -> None:
    """Rms of a sine of 3 mN m and of white noise above 20 of 250 Hz."""
    runs = [fast_motor(1, 3e-3), fast_motor(2, 3e-3)]
    found = removed_by_low_pass([compared(run) for run in runs], "motor_torque", 20.0)
    assert found.rms == pytest.approx(np.hypot(3e-3 / np.sqrt(2), 1e-3 * np.sqrt(0.92)), rel=0.02)
    assert found.order == 12
    assert found.amplitude == pytest.approx(3e-3, rel=0.05)
    assert [finding.code for finding in found.findings] == ["low-passed"]
    noise = removed_by_low_pass([compared(fast_motor(3, 0.0))], "motor_torque", 20.0)
    assert noise.rms == pytest.approx(1e-3 * np.sqrt(0.92), rel=0.05)
    assert noise.order is None
    assert noise.findings == ()
    assert "white noise" in noise.text


def test_cogging_of_a_fast_motor_is_found_above_20_hz() -> None:
    """Order 12 at 76 Hz, 1 mN m beside a noise of 1 mN m: 95 % interval and the file's order."""
    answer = diagnose([fast_motor(seed, 1e-3) for seed in (1, 2)], AxisProfile(name="motor"))
    steps = {step.effects[0]: step for step in answer.diagnosis.steps}
    values = steps["motor-cogging"].parameters["motor-cogging"]
    assert values["order"].value == 12
    assert values["amplitude"].value == pytest.approx(1e-3, abs=4 * values["amplitude"].std)
    assert values["amplitude"].std < 1e-4
    assert answer.diagnosis.verdict == "explained"


def thinned(run: Run, step: int) -> Run:
    """Every ``step``-th sample."""
    channels = {
        name: replace(channel, values=channel.values[::step])
        for name, channel in run.channels.items()
    }
    return replace(run, name=f"{run.name}-slow", time=run.time[::step], channels=channels)


def test_a_slow_logger_does_not_lower_the_cut_off_of_a_fast_one() -> None:
    """At 50 Hz order 12 is seen beside its mirror images: the fast run shows which it is."""
    runs = [fast_motor(1, 3e-3), thinned(fast_motor(2, 3e-3, seconds=8.0), 10)]
    data = prepare(runs, AxisProfile(name="motor"))
    fast, slow = (recording.bands["motor_torque"].cut_off for recording in data.recordings)
    assert fast is not None
    assert slow is not None
    assert fast > 76.0
    assert slow <= 20.0
    (step,) = (
        s
        for s in diagnose(runs, AxisProfile(name="motor")).diagnosis.steps
        if s.effects[0] == "motor-cogging"
    )
    assert step.parameters["motor-cogging"]["order"].value == 12


@pytest.mark.parametrize(("ripple", "filtered"), [(3e-3, False), (0.0, True)])
def test_an_order_above_the_highest_cut_off_is_compared(ripple: float, filtered: bool) -> None:
    """Order 12 at 76 Hz of a logger at 167 Hz: 0.4 of the rate are 67 Hz, half of it 83 Hz."""
    slow = [thinned(fast_motor(seed, ripple, seconds=20.0), 3) for seed in range(2)]
    dataset = prepare(slow, AxisProfile(name="axis"))
    assert {r.bands["motor_torque"].cut_off is not None for r in dataset.recordings} == {filtered}
