"""Recordings that others made: where they are, and files as a reader of the pages has them.

The data carry no licence of ours and are no part of the project. WINCHKIT_EMPS and WINCHKIT_REAL
name the folders, else ``shared/data`` beside the checkout.
"""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.io import savemat

from winchkit.runs import read_run

GAIN = 35.15065
"""Force over the drive's signal of EMPS, N/V, published with the data."""
_EMPS = {"train.csv": "DATA_EMPS.mat", "test.csv": "DATA_EMPS_PULSES.mat"}


def folder(variable: str, name: str, *contents: str) -> Path | None:
    """Where the data are, with all of these contents, if they are anywhere."""
    beside = [parent / "shared" / "data" / name for parent in Path(__file__).resolve().parents]
    named = os.environ.get(variable)
    places = [Path(named)] if named else beside
    found = (p for p in places if p.is_dir() and all((p / one).exists() for one in contents))
    return next(found, None)


def emps_variables(path: Path) -> dict[str, NDArray[np.float64] | float]:
    """Variables of the authors' file, from a run."""
    run = read_run(path)
    columns = {
        "t": run.time,
        "qm": run["motor_angle"],
        "qg": run["motor_angle"] + 1e-5,
        "vir": run["motor_torque"] / GAIN,
    }
    return {name: column.reshape(-1, 1) for name, column in columns.items()} | {"gtau": GAIN}


def lay_out(recording: str, target: Path) -> None:
    """Put the files of a recording into a reader's folder; skip where they are absent."""
    if recording == "emps":
        source = folder("WINCHKIT_EMPS", "emps")
        if source is None:
            pytest.skip("the EMPS data are not here; WINCHKIT_EMPS names the folder that has them")
        for name, file in _EMPS.items():
            savemat(target / file, emps_variables(source / name))
        return
    source = folder("WINCHKIT_REAL", "real")
    if source is None or not (source / recording).is_dir():
        pytest.skip("the recordings are not here; WINCHKIT_REAL names the folder that has them")
    for path in sorted((source / recording).glob("*.csv")):
        shutil.copy(path, target)
