"""A run that does not belong to the others, and errors in proportion to the load."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis_runs import GROOVED, Ride, made, term, with_channel
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.residuals.outlying_run import OUTLYING
from winchkit.report.words.sentence import changes_text


@pytest.mark.parametrize("exchanged", [True, False])
def test_the_torque_of_another_run_is_found_by_its_error(exchanged: bool) -> None:
    runs = [made(k, load_mass=10.0, ride=Ride(stroke=200.0 + 60 * k)) for k in range(4)]
    if exchanged:
        # Of a machine whose load swings: the mean is right, the rest is another motion.
        torque = runs[2]["motor_torque"]
        strange = torque + 0.15 * np.sin(5.1 * runs[2].time)
        runs[2] = with_channel(runs[2], "motor_torque", strange, "N m")
    found = diagnose(runs, GROOVED).diagnosis
    wanted = [("run-2", "motor_torque")] * exchanged
    assert [(f.run, f.channel) for f in found.sanity if f.code == OUTLYING] == wanted
    assert ("Motor torque of run-2: its error is" in changes_text(found)) == exchanged


def test_an_effect_of_the_heaviest_load_is_no_outlying_run() -> None:
    hidden = [term("cell-nonlinearity", quadratic=40.0)]
    runs = [made(k, terms=hidden, load_mass=m) for k, m in enumerate((8.0, 12.0, 20.0, 40.0))]
    found = diagnose(runs, GROOVED).diagnosis
    assert not [f for f in found.sanity if f.code == OUTLYING]
