"""A load that stands on the ground at one end of the travel, by a generator of its own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from winchkit.cli.files.check import command
from winchkit.diagnosis.data.preparation import prepare
from winchkit.runs.run import Channel, Run
from winchkit.runs.sanity.ground import ground_mask
from winchkit.runs.sanity.inspection import inspect_run
from winchkit.schema.profiles.axis import AxisProfile

MASS, RADIUS, GRAVITY = 20.0, 0.05, 9.80665
WEIGHT = MASS * GRAVITY * RADIUS
SEEDS = st.integers(0, 2**31)


def lifting(
    seed: int,
    *,
    ground: float = 0.0,
    friction: float = 0.3,
    inertia: float = 0.1,
    cell: bool = False,
) -> Run:
    """A mass on a drum, lifted and lowered; it stands on the ground below an angle.

    ``ground`` is the share of the stroke without a load; friction and inertial torque are shares
    of the weight's torque.
    """
    random = np.random.default_rng(seed)
    count, stroke = 2400, random.uniform(15.0, 40.0)
    time = np.arange(count) / 100
    omega = 2 * np.pi / random.uniform(8, 12)
    turned = stroke / 2 * (1 - np.cos(omega * time))
    rate = stroke / 2 * omega * np.sin(omega * time)
    acceleration = omega**2 * (stroke / 2 - turned)
    # It is put down over 2 % of the stroke.
    hanging = np.clip((turned / stroke - ground) / 0.02, 0.0, 1.0) if ground else np.ones(count)
    torque = WEIGHT * hanging + friction * WEIGHT * np.sign(rate)
    torque += inertia * WEIGHT * acceleration / np.abs(acceleration).max()
    torque += random.normal(0, 0.01 * WEIGHT, count)
    sign = random.choice([-1.0, 1.0])
    channels = {
        "motor_angle": Channel(sign * turned + random.uniform(-50, 50), "rad"),
        "motor_torque": Channel(sign * torque, "N m"),
    }
    if cell:
        tension = MASS * GRAVITY * hanging + random.normal(0, 0.5, count)
        channels["tension"] = Channel(tension, "N")
    return Run("lift", time, channels, metadata={"load_mass": f"{MASS} kg"})


@given(SEEDS, st.floats(0.02, 0.8), st.floats(0.0, 0.6), st.booleans())
@settings(max_examples=60, deadline=None)
def test_the_stretch_on_the_ground_is_found_and_no_more_than_is_put_down(
    seed: int, ground: float, friction: float, cell: bool
) -> None:
    run = lifting(seed, ground=ground, friction=friction, cell=cell)
    clean = lifting(seed, ground=0.0, friction=friction, cell=cell)
    mask = ground_mask(run)
    less = np.abs(run["motor_torque"] - clean["motor_torque"])
    assert mask[less > 0.1 * WEIGHT].all()
    # At most as many samples again as carry no whole load, and three groups.
    assert np.count_nonzero(mask & (less == 0)) <= 0.03 * len(run) + 24


@given(SEEDS, st.floats(0.0, 1.5), st.floats(0.0, 0.4), st.booleans())
@settings(max_examples=60, deadline=None)
def test_a_hanging_load_has_no_such_stretch(
    seed: int, friction: float, inertia: float, cell: bool
) -> None:
    assert not ground_mask(lifting(seed, friction=friction, inertia=inertia, cell=cell)).any()


@given(SEEDS, st.floats(0.6, 0.95), st.floats(2.2, 3.5))
def test_a_load_that_jams_at_the_top_hangs_below(seed: int, begins: float, times: float) -> None:
    run = lifting(seed, friction=0.1, cell=True)
    angle = np.abs(run["motor_angle"] - run["motor_angle"][0])
    jams = angle > begins * angle.max()
    tension = Channel(np.where(jams, times, 1.0) * run["tension"], "N")
    assert not ground_mask(replace(run, channels={**run.channels, "tension": tension})).any()


def test_an_eccentric_weight_stands_on_no_ground() -> None:
    """A mass on an arm that swings to both sides, and on one that goes up to the horizontal."""
    time = np.arange(0.0, 60.0, 0.02)
    both, up = 1.5 * np.sin(time), 0.75 * (1 - np.cos(time))
    for angle in (both, up):
        torque = WEIGHT * np.sin(angle) + 0.1 * WEIGHT * np.sign(np.gradient(angle))
        channels = {"motor_angle": Channel(angle, "rad"), "motor_torque": Channel(torque, "N m")}
        run = Run("swing", time, channels, metadata={"load_mass": f"{MASS} kg"})
        found = {f.code for f in inspect_run(run, has_cable=False).findings}
        assert "load-on-ground" not in found
        data = prepare([run], AxisProfile(name="arm"))
        assert "load-on-ground" not in {f.code for f in data.sanity}
        if angle is both:
            assert not ground_mask(run).any()


def test_without_a_known_mass_nothing_is_left_out() -> None:
    run = lifting(1, ground=0.3)
    assert ground_mask(run).any()
    assert not ground_mask(replace(run, metadata={})).any()


@pytest.mark.parametrize("cell", [True, False])
def test_the_finding_names_the_channel_and_the_share(cell: bool) -> None:
    run = lifting(2, ground=0.3, cell=cell)
    (finding,) = [f for f in inspect_run(run).findings if f.code == "load-on-ground"]
    assert finding.channel == ("tension" if cell else "motor_torque")
    assert finding.value == pytest.approx(float(np.mean(ground_mask(run))))


def test_check_says_it(tmp_path: Path) -> None:
    run, path = lifting(3, ground=0.2), tmp_path / "lift.csv"
    rows = np.column_stack([run.time, run["motor_angle"], run["motor_torque"]])
    head = f"# load_mass: {MASS} kg\ntime [s],motor_angle [rad],motor_torque [N m]\n"
    path.write_text(head + "\n".join(",".join(f"{x:.6f}" for x in row) for row in rows) + "\n")
    result = CliRunner().invoke(command, [str(path)])
    assert result.exit_code == 0, result.output
    assert "stands on the ground" in result.output
