"""Quick-stop ramps with which all cables of a moving platform stop in the same time.

A quick stop of the drives decelerates each motor by its own 6085h. With ramps in proportion to the
largest speeds of a motion every cable comes to rest within the time that the fastest one needs.
"""

from __future__ import annotations

import numpy as np

from winchkit.arrays import Array
from winchkit.robot.bench.trajectory import PlatformTrajectory

_LEAST = 0.1
"""Ramp of a cable that hardly moves, as a share of that of the fastest."""


def quick_stop_ramps(planned: PlatformTrajectory, arms: Array, deceleration: float) -> Array:
    """Decelerations of the motors in a quick stop during a motion, (n,), rad/s^2.

    ``arms`` (n,): cable per motor angle, without sign, m/rad. ``deceleration``: of the fastest
    cable, m/s^2. Returns (n,): in proportion to the largest speeds of the cables; of a cable slower
    than a tenth of the fastest, as if it had this speed.

    Notes
    -----
    The speeds of the cables are not in the same proportion everywhere on a path: a cable at the
    share x of its largest speed rests after the share x of the common time.
    """
    rate = np.gradient(planned.motor_angle, planned.time, axis=0)
    speed = np.abs(rate).max(axis=0) * arms
    fastest = float(speed.max())
    share = speed / fastest if fastest > 0.0 else np.ones_like(speed)
    return np.asarray(deceleration * np.maximum(share, _LEAST) / arms)
