"""Clocks of a drive's log and a load cell's: friction is in the torque and not in the force."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from winchkit.runs.importing.answers import Answers
from winchkit.runs.importing.clocks.joint import Joint
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.session import guesses_of, runs_of

LAG_STEP = 0.02
"""Sampling interval of the cell, s."""


def moves(points: list[float], speed: float, ramp: float) -> list[float]:
    """Positions at 100 Hz of moves at a speed with a rest after each."""
    found: list[float] = []
    for start, end in pairwise(points):
        time = np.arange(0.0, abs(end - start) / speed + ramp, 0.01)
        rate = speed * np.clip(np.minimum(time, time[-1] - time) / ramp, 0.0, 1.0)
        way = np.cumsum(rate)
        found += [*(start + (end - start) * way / way[-1]), *[end] * 70]
    return found


def joined(folder: Path, friction: float, lag: float) -> Joint:
    """A load that grows with the travel; ``friction``: N m, beside 4 to 5.2 N m of the load."""
    random = np.random.default_rng(2)
    angle = np.array([*moves([0, 12, 3, 20, 0], 2.0, 0.2), *moves([0, 12, 3, 20, 0], 5.0, 0.5)])
    time = np.arange(len(angle)) / 100
    rate = np.gradient(angle, time)
    force = 80 + 1.2 * angle + 0.4 * np.gradient(rate, time)
    torque = 0.05 * force + friction * (np.tanh(rate / 0.05) + 0.1 * rate)
    torque += random.normal(0, 0.01, len(time))
    seen = np.arange(0.0, time[-1] - 3, LAG_STEP)
    cell = np.interp(seen + lag, time, force) + random.normal(0, 0.5, len(seen))
    head = ("time [s],angle [rad],torque [N m]", "time [s],force [N]")
    for name, title, columns in (
        ("drive.csv", head[0], (time, angle, torque)),
        ("cell.csv", head[1], (seen, cell)),
    ):
        rows = (",".join(f"{value:.6f}" for value in row) for row in zip(*columns, strict=True))
        (folder / name).write_text("\n".join([title, *rows]) + "\n")
    tables = [read_table(folder / name) for name in ("drive.csv", "cell.csv")]
    (joint,) = runs_of(guesses_of(tables, Answers())).joints
    return joint


@pytest.mark.parametrize("lag", [0.5, -1.3])
@pytest.mark.parametrize("friction", [0.0, 0.16, 0.4, 1.0])
def test_friction_does_not_shift_the_clocks(friction: float, lag: float, tmp_path: Path) -> None:
    assert joined(tmp_path, friction, lag).lag == pytest.approx(lag, abs=LAG_STEP / 2)
