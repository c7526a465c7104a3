"""Instruments of a robot's calibration: which of their numbers are unknown, and their parameters.

A tracker that was set up anew has another frame, one per session, a reflector elsewhere on the
platform, a scale that is off by some ppm, a target at an angle (:mod:`winchkit.robot.geometry.
tracker`). These numbers start from the closed-form registration of the measured poses on those that
the starting values predict from the motor angles alone.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from winchkit.robot.files.poses import MeasuredPoses
from winchkit.robot.geometry.constraints import rotation_residual
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.geometry.robot import Robot
from winchkit.robot.geometry.tracker import Tracker, declared_tracker, reading_of, registered

LARGEST_SCALE = 0.01
"""Largest relative error of a tracker's scale that is fitted: a hundred times that of a camera
system in good order; beyond it units are wrong."""
NUMBERS = ("frame", "reflector", "scale", "mounting")
"""Numbers of a tracker that may be unknown."""
OF_LINES = ("cell_gain", "length_scale")
"""Numbers of each line's load cell and length counter that may be unknown."""


@dataclass(frozen=True)
class InstrumentValues:
    """Numbers of instruments: those that are estimated, and the values of the tracker's."""

    free: frozenset[str]
    """Of :data:`NUMBERS` and :data:`OF_LINES`; the latter start at zero."""
    sessions: tuple[str, ...]
    """Names of sessions, each with a frame of its own."""
    trackers: tuple[Tracker, ...]
    """One per session; they differ in the frame alone."""

    @property
    def is_trivial(self) -> bool:
        """Whether the tracker shows the platform's pose in the base frame and nothing is free."""
        if self.free:
            return False
        return all(tracker.is_trivial for tracker in self.trackers)

    def session_of(self, measured: MeasuredPoses) -> NDArray[np.intp]:
        """Index of the session of each pose, (p,); −1 where it is another session."""
        index = {name: n for n, name in enumerate(self.sessions)}
        of_run = [index.get(name, -1) for name in measured.sessions]
        if len(of_run) == 1:
            return np.full(len(measured), of_run[0], dtype=np.intp)
        return np.array(of_run, dtype=np.intp)[measured.run]

    def at(self, measured: MeasuredPoses) -> Tracker:
        """The tracker with a frame per pose; that of the first session for other sessions."""
        which = np.maximum(self.session_of(measured), 0)
        shift = np.stack([t.shift for t in self.trackers])[which]
        turn = np.stack([t.turn for t in self.trackers])[which]
        return replace(self.trackers[0], shift=shift, turn=turn)


def declared_instruments(robot: Robot, measured: MeasuredPoses) -> InstrumentValues:
    """Instruments as the robot's file declares them."""
    spec = robot.profile.instrument
    tracker = robot.tracker or declared_tracker(robot.profile)
    free = {
        name
        for name, value in (
            ("frame", spec.tracker.frame),
            ("reflector", spec.tracker.reflector),
            ("scale", spec.tracker.scale),
            ("mounting", spec.imu.mounting if spec.imu else spec.tracker.mounting),
            ("cell_gain", spec.cells.gain),
            ("length_scale", spec.length_counters.scale),
        )
        if isinstance(value, str)
    }
    for values, names in (
        (measured.position, {"frame", "reflector", "scale"}),
        (measured.angles, {"mounting"}),
        (measured.tension, {"cell_gain"}),
        (measured.cable_length, {"length_scale"}),
    ):
        if not np.any(np.isfinite(values)):
            free -= names
    sessions = tuple(dict.fromkeys(measured.sessions[run] for run in np.unique(measured.run)))
    return InstrumentValues(frozenset(free), sessions, (tracker,) * len(sessions))


def registered_instruments(
    instruments: InstrumentValues,
    free: Collection[str],
    predicted: Pose,
    measured: MeasuredPoses,
    *,
    imu: bool,
) -> InstrumentValues:
    """Instruments with these numbers free, at the values of the registration on poses by the motor
    angles alone. Rotations not of an ``imu`` are in the tracker's frame if the registration fits
    them better so."""
    variants = [False] if imu or "frame" not in free else [True, False]
    found = [
        _registered(instruments, frozenset(free), predicted, measured, turns) for turns in variants
    ]
    if not np.any(np.isfinite(measured.angles)):
        return found[0]
    return min(found, key=lambda own: _misfit_of_rotation(own, predicted, measured))


def _registered(
    instruments: InstrumentValues,
    free: frozenset[str],
    predicted: Pose,
    measured: MeasuredPoses,
    turns: bool,
) -> InstrumentValues:
    """Common numbers from all sessions at once, then a frame per session."""
    first = replace(
        instruments.trackers[0],
        turns_rotation=turns if "frame" in free else instruments.trackers[0].turns_rotation,
    )
    which = instruments.session_of(measured)
    common = free - {"frame"} if len(instruments.sessions) > 1 else free
    largest = int(np.argmax(np.bincount(which[which >= 0], minlength=len(instruments.sessions))))
    rows = which == largest
    whole = registered(
        first,
        predicted[rows],
        measured.position[rows],
        measured.angles[rows],
        free,
    )
    if common == free:
        return InstrumentValues(free, instruments.sessions, (whole,) * len(instruments.sessions))
    trackers = []
    for number in range(len(instruments.sessions)):
        rows = which == number
        own = predicted[rows]
        trackers.append(
            registered(whole, own, measured.position[rows], measured.angles[rows], free & {"frame"})
        )
    return InstrumentValues(free, instruments.sessions, tuple(trackers))


def _misfit_of_rotation(
    instruments: InstrumentValues, predicted: Pose, measured: MeasuredPoses
) -> float:
    shown = reading_of(instruments.at(measured), predicted)
    difference = rotation_residual(shown.rotation, measured.angles)
    return float(np.nanmean(difference**2))
