"""Common force: an error of the tension that the motor torque has too, at the drum's arm.

Two instruments that agree with each other and not with the stated load show that the force in the
cable is another one, as of a load that sways or bounces: no error of either instrument.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.data.spectrum import to_frequency, to_time
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.model.line import Line
from winchkit.runs.sanity.finding import Finding
from winchkit.runs.sanity.finding import share as percent

COMMON_FORCE = "common-force"
"""Code of the finding."""
_LEAST_SHARE = 0.8
"""Share of the torque's squared error that the tension's explains; rule of thumb."""
_EQUAL = 0.1
"""Largest difference of the factor between the two from one; losses of a gearbox are less."""


def common_force(regression: TimeSeriesRegression, residual: Array) -> tuple[Finding, ...]:
    """Finding that a residual (n_rows,) of the tension explains that of the torque, within the band
    of the torque; none otherwise.
    """
    parts = list(_parts(regression, residual))
    if not parts:
        return ()
    torque, by_tension = (np.concatenate(each) for each in zip(*parts, strict=True))
    across, size = float(by_tension @ torque), float(by_tension @ by_tension)
    if not size or abs(across / size - 1) > _EQUAL:
        return ()
    share = across**2 / size / float(torque @ torque)
    if share < _LEAST_SHARE:
        return ()
    text = (
        f"tension and motor torque have the same error ({percent(share)} of the torque's), so that "
        "the force in the cable is not that of the stated load, as where it sways or bounces; "
        "without 'load_mass' and 'load' the cell's reading is the load"
    )
    return (Finding(COMMON_FORCE, "", "motor_torque", share, text),)


def _parts(regression: TimeSeriesRegression, residual: Array) -> Iterator[tuple[Array, Array]]:
    """Residual of the torque, and that which the tension's would be, per run."""
    line = Line(regression.dataset.profile)
    of = {(segment.run, segment.output): segment for segment in regression.segments}
    for run, recording in enumerate(regression.dataset.recordings):
        tension, torque = of.get((run, "tension")), of.get((run, "motor_torque"))
        if tension is None or torque is None or recording.raw.load is None:
            continue
        force = to_time(residual[tension.rows], tension.band)
        moved = line.predict(replace(recording.raw, load=recording.raw.load + force))
        change = moved["motor_torque"] - recording.nominal["motor_torque"]
        kept = recording.valid["motor_torque"] & recording.valid["tension"]
        yield residual[torque.rows], to_frequency(np.where(kept, change, 0.0), torque.band)
