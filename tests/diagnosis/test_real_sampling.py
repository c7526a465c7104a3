"""Recordings of others with uneven stamps, gaps and few samples per cogging period.

The data are no part of the project: they are looked for in the folder that WINCHKIT_REAL names, and
beside the checkout in ``shared/data/real``; the tests are skipped where there are none.
"""

from __future__ import annotations

import numpy as np
import pytest

from recordings_of_others import folder
from winchkit.diagnosis.data.dataset import Dataset
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.data.standstill import standstill_mask
from winchkit.runs import read_run
from winchkit.schema.read import read_profile

VARIABLE = "WINCHKIT_REAL"
DATA = folder(VARIABLE, "real", "openarm-j4/collect.csv")
pytestmark = pytest.mark.skipif(
    DATA is None, reason=f"the recordings are not here; {VARIABLE} names the folder that has them"
)


def dataset(machine: str, pattern: str = "*.csv") -> Dataset:
    assert DATA is not None
    paths = sorted((DATA / machine).glob(pattern))
    return prepare([read_run(p) for p in paths], read_profile(DATA / machine / "profile.toml"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("machine", "pattern"),
    [
        ("openarm-j4", "*.csv"),
        ("franka-q2", "*.csv"),
        ("odrive-cogging", "map-*.csv"),
        ("odrive-cogging", "slow2-*.csv"),
    ],
)
def test_nine_tenths_of_the_samples_are_used(machine: str, pattern: str) -> None:
    """But for standstills at which static friction determines the torque: 95 % of the arm's."""
    prepared = dataset(machine, pattern)
    left_out = [
        np.mean(standstill_mask(r.measured["motor_torque"], r.nominal["motor_torque"], r.raw))
        for r in prepared.recordings
    ]
    assert prepared.used_share["motor_torque"] + np.mean(left_out) >= 0.9
    assert (np.mean(left_out) > 0.9) == (machine == "openarm-j4")


def test_all_orders_of_the_cogging_maps_are_within_the_band() -> None:
    """84 periods per turn of 512 stations, 3 s each; a tenth of the rate is 51 periods."""
    recording = dataset("odrive-cogging", "map-*.csv").recordings[0]
    cut_off = recording.bands["motor_torque"].cut_off
    assert cut_off is not None
    assert cut_off > 84 / (512 * 3)
