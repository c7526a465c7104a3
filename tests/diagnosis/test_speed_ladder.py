"""A speed ladder, one constant speed a run: friction is not taken for offsets of the runs.

A joint with gravity, Coulomb friction, friction that saturates with speed, and inertia; the torque
of every run has another offset.
"""

from __future__ import annotations

import numpy as np
import pytest

from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.data.zeroing import is_setting
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.results import Diagnosis
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.axis import AxisProfile

JOINT = AxisProfile(name="joint")
GRAVITY, COULOMB, SATURATING, INERTIA, NOISE = 39.0, 8.0, 1.0, 2.0, 0.3
"""N m; kg m²."""
SPEEDS = (0.02, 0.06, 0.2, 0.5, 1.0)
"""rad/s."""


def ladder(
    repeats: int,
    offset: float,
    directions: tuple[int, ...] = (1,),
    speeds: tuple[float, ...] = SPEEDS,
    seed: int = 3,
) -> list[Run]:
    random, runs = np.random.default_rng(seed), []
    for repeat in range(repeats):
        for speed in speeds:
            for sign in directions:
                time = np.arange(0.0, 5.0, 0.02)
                rate = sign * speed * (1 - np.exp(-time / 0.15))
                angle = np.cumsum(rate) * 0.02
                friction = COULOMB + SATURATING * (1 - np.exp(-np.abs(rate) / 0.25))
                torque = GRAVITY * np.sin(angle + 0.07) + np.sign(rate) * friction
                torque += INERTIA * np.gradient(rate, time) + offset * random.standard_normal()
                torque += NOISE * random.standard_normal(len(time))
                channels = {
                    "motor_angle": Channel(angle, "rad"),
                    "motor_torque": Channel(torque, "N m"),
                }
                runs.append(Run(f"{sign * speed:g}-{repeat}", time, channels, {}))
    return runs


def found_in(runs: list[Run]) -> Diagnosis:
    found = diagnose(runs, JOINT).diagnosis
    assert found.verdict == "explained"
    assert found.run_offsets == ()
    gravity = next(s for s in found.steps if s.effects[0] == "joint-gravity")
    assert gravity.parameters["joint-gravity"]["amplitude"].value == pytest.approx(
        GRAVITY, rel=0.02
    )
    return found


@pytest.mark.parametrize("directions", [(1,), (1, -1)])
@pytest.mark.parametrize("repeats", [1, 2])
def test_friction_of_a_speed_ladder_is_no_offset_of_its_runs(
    repeats: int, directions: tuple[int, ...]
) -> None:
    found = found_in(ladder(repeats, 0.2, directions))
    friction = next(s for s in found.steps if "motor-coulomb" in s.effects)
    first = next(iter(friction.parameters[friction.effects[0]].values()))
    assert COULOMB - 0.5 < first.value < COULOMB + SATURATING + 0.5


def test_a_step_stays_whose_loss_groups_of_another_speed_do_not_show() -> None:
    """Each speed once: the fastest run alone determines the gravity, and left out nothing helps."""
    speeds = tuple(np.deg2rad((1.0, 3.0, 10.0, 20.0, 40.0, 60.0)).tolist())
    found = found_in(ladder(1, 0.0, speeds=speeds, seed=4))
    assert "motor-coulomb" in {effect for step in found.steps for effect in step.effects}
    assert found.outputs["motor_torque"].heldout_rms_after < 2 * NOISE


def test_what_the_friction_leaves_is_no_other_law_of_the_gravity() -> None:
    """The angle that a run reaches and what the friction leaves follow its speed."""
    found = found_in(ladder(2, 0.0, (1, -1), (*SPEEDS[:-1], 4.0)))
    gravity = next(s for s in found.steps if s.effects[0] == "joint-gravity")
    assert gravity.law == "established"
    torque = found.outputs["motor_torque"]
    assert torque.noise_rms is not None
    assert torque.heldout_rms_after > 1.1 * torque.noise_rms


def test_offsets_between_repeats_are_reported_with_their_size() -> None:
    found = found_in(ladder(2, 0.5))
    (offset,) = [f for f in found.sanity if f.code == "offset-as-noise"]
    assert offset.value == pytest.approx(0.5, rel=0.5)
    assert "counts as noise" in offset.text


def test_a_ladder_is_at_constant_speeds_and_a_move_there_and_back_is_not() -> None:
    assert is_setting([m.motor_rate for m in prepare(ladder(1, 0.0), JOINT).motions])
    time = np.arange(0.0, 10.0, 0.02)
    back = [
        Run(
            f"{size:g}",
            time,
            {
                "motor_angle": Channel(size * np.sin(2.0 * time), "rad"),
                "motor_torque": Channel(np.cos(time) + 0.1 * np.sin(71 * time), "N m"),
            },
            {},
        )
        for size in (0.5, 1.0)
    ]
    assert not is_setting([m.motor_rate for m in prepare(back, JOINT).motions])
