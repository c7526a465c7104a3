"""A force of the cable that both instruments see, and errors of one of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis_runs import GROOVED, Ride, made, with_channel
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.residuals.common_force import COMMON_FORCE
from winchkit.report.words.sentence import changes_text
from winchkit.runs.run import Run

ARM = float(np.hypot(0.06, 0.005 / (2 * np.pi))) / 20.4
"""Of the motor at the grooved drum, by virtual work, m."""


def swaying(seed: int, in_torque: float) -> Run:
    """A load whose force sways by 6 N at a frequency and phase of its own; ``in_torque`` is the
    share of it that the motor has."""
    run = made(seed, ride=Ride(samples=800))
    random = np.random.default_rng(100 + seed)
    time = run.time
    sway = 6.0 * np.sin(2 * np.pi * random.uniform(0.4, 0.7) * time + random.uniform(0, 6))
    run = with_channel(run, "tension", run["tension"] + sway)
    return with_channel(run, "motor_torque", run["motor_torque"] + in_torque * ARM * sway, "N m")


@pytest.mark.parametrize(("in_torque", "common"), [(1.0, True), (0.4, False), (0.0, False)])
def test_instruments_that_agree_against_the_load_are_right(in_torque: float, common: bool) -> None:
    runs = [replace(swaying(seed, in_torque), name=f"run-{seed}") for seed in range(3)]
    found = diagnose(runs, GROOVED).diagnosis
    assert [f.channel for f in found.sanity if f.code == COMMON_FORCE] == ["motor_torque"] * common
    assert ("without 'load_mass' and 'load'" in changes_text(found)) == common
    if common:
        known = [replace(r, metadata={}) for r in runs]
        assert diagnose(known, GROOVED).diagnosis.verdict == "adequate"
