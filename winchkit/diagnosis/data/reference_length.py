"""Free length of a profile that does not state it, from runs that measure it.

The free cable where the motor angle is zero decides how much cable stretches. A profile may leave
it out (``reference.cable_length``); the offset of the length instrument, which is fitted in any
case, would then leave the free length at zero there, and an elastic cable would need a compliant
frame beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from winchkit.model.line import Line, Motion
from winchkit.runs.run import Run
from winchkit.schema.profiles.axis import AxisProfile
from winchkit.schema.profiles.winch import WinchProfile


def with_measured_length(
    profile: WinchProfile, line: Line, runs: Sequence[Run], motions: Sequence[Motion]
) -> WinchProfile:
    """The profile with the measured free length where it has none; else as it is.

    It is the median over the runs of measured less predicted length. An instrument that was zeroed
    on the way, so that a length is negative, does not measure the free length.
    """
    measured = [run["cable_length"] for run in runs if "cable_length" in run]
    if (
        isinstance(profile, AxisProfile)
        or profile.reference.cable_length is not None
        or not measured
        or any(run.length_zeroed for run in runs)
        or any(np.nanmin(length) < 0 for length in measured)
    ):
        return profile
    offsets = [
        np.nanmedian(run["cable_length"] - line.predict(motion)["cable_length"])
        for run, motion in zip(runs, motions, strict=True)
        if "cable_length" in run
    ]
    free = max(0.0, float(np.median(offsets)))
    return replace(profile, reference=replace(profile.reference, cable_length=free))
