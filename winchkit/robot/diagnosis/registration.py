"""Registration of a tracker before the selection, where its readings are far off.

The selection compares effects in a linearised model, to which a frame that is turned by tens of
degrees, or a reflector far from the origin, is no small change. Such readings are first registered
in closed form; frame and offset are then effects of the initial model, fitted beside everything
else, and reported as the first missing effects. Numbers that the robot's file declares unknown
start in the same way, and are not reported.
"""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass, replace

import numpy as np

from winchkit.arrays import Array
from winchkit.effects.catalogue import Catalogue
from winchkit.effects.term import Term
from winchkit.model.rotation import rotation_by, rotation_vector
from winchkit.robot.diagnosis.dataset import RobotDataset
from winchkit.robot.effects.term import robot_with_terms
from winchkit.robot.geometry.constraints import rotation_residual
from winchkit.robot.geometry.kinematics import Pose
from winchkit.robot.geometry.robot import Robot
from winchkit.robot.geometry.tracker import Tracker, declared_tracker, reading_of, registered
from winchkit.robot.identification.variance_components import START
from winchkit.schema.profiles.instruments import ImuSpec

_GROSS = 10e-3
"""Rms position error above which readings are registered first, m: with cables of 0.5 m the second
order of a length is then 0.1 mm, five times the noise of a tracker."""
_EXPLAINED = 0.3
"""Share of the position error that a registration may leave (rule of thumb: a tenth of χ²)."""
_AS_GOOD = 1.5
"""Ratio of errors within which the registration with fewer parts is taken (rule of thumb)."""
_FITS_BETTER = 2.0
"""Ratio of the mean squared rotation errors above which angles are not in the tracker's frame."""
_EFFECTS = {"frame": "tracker-frame", "reflector": "reflector-offset"}
_DELAY = "tracker-delay"
_SAME_AS = {
    "tracker-frame": "all exit points and the home pose moved together the other way",
    "reflector-offset": "all anchor points and the home pose moved together the other way",
}
_SUBSETS: tuple[frozenset[str], ...] = (
    frozenset({"frame"}),
    frozenset({"reflector"}),
    frozenset({"frame", "reflector"}),
)


@dataclass(frozen=True)
class Registration:
    """Effects of the tracker that the initial model has beside those of the robot's file."""

    dataset: RobotDataset
    """With a robot whose angles are declared those of an IMU where they do not turn with the
    tracker's frame."""
    found: tuple[Term, ...] = ()
    """Effects that the file does not declare, to be reported."""
    declared: tuple[Term, ...] = ()
    """Effects whose numbers the file declares unknown."""

    @property
    def terms(self) -> tuple[Term, ...]:
        """All effects of the registration, those to be reported first."""
        return (*self.found, *self.declared)


def registration_of(
    dataset: RobotDataset, own: tuple[Term, ...], catalogue: Catalogue
) -> Registration:
    """Register readings that are far off, and numbers that are declared unknown."""
    measured, names = dataset.measured, {term.effect.id for term in own}
    if not np.isfinite(measured.position).all(axis=1).any():
        return Registration(dataset)
    robot = robot_with_terms(dataset.robot, own)
    pose = _predicted(dataset, robot)
    start = robot.tracker or declared_tracker(dataset.robot)
    spec = dataset.robot.instrument.tracker
    declared = frozenset(
        name
        for name, value in (("frame", spec.frame), ("reflector", spec.reflector))
        if isinstance(value, str) and _EFFECTS[name] not in names
    )
    if declared:
        start = registered(start, pose, measured.position, measured.angles, declared)
    free = frozenset(
        name
        for name in ("frame", "reflector")
        if name not in declared and _EFFECTS[name] not in names
    )
    before = _error(start, pose, measured.position)
    found: frozenset[str] = frozenset()
    tracker = start
    if before > _GROSS:
        trials = [
            (subset, registered(start, pose, measured.position, measured.angles, subset | declared))
            for subset in _SUBSETS
            if subset <= free
        ]
        errors = [_error(trial, pose, measured.position) for _, trial in trials]
        least = min(errors, default=np.inf)
        if least < _EXPLAINED * before:
            found, tracker = next(
                trial
                for trial, error in zip(trials, errors, strict=True)
                if error <= _AS_GOOD * least
            )
    dataset = _with_imu(dataset, tracker, pose)
    base = robot.tracker or declared_tracker(dataset.robot)
    made = {name: _term(name, catalogue, base, tracker) for name in found | declared}
    delay = catalogue[_DELAY]
    late = dataset.moves and isinstance(spec.delay, str) and _DELAY not in names
    return Registration(
        dataset,
        tuple(made[name] for name in sorted(found)),
        (*(made[name] for name in sorted(declared)), *((Term(delay, delay.null),) if late else ())),
    )


def datum_notes(effects: Container[str]) -> list[str]:
    """The datum by which a named frame or offset is no effect of the robot, in words."""
    return [
        f"{effect}: datum is the robot's home pose with its points; {same} are the same to all "
        "measurements. Fixed points of the frame or the platform, measured with the tracker, "
        "distinguish the two"
        for effect, same in _SAME_AS.items()
        if effect in effects
    ]


def _predicted(dataset: RobotDataset, robot: Robot) -> Pose:
    """Poses by the motor angles alone; NaN where one was not found."""
    measured = dataset.measured
    tension = np.where(np.isfinite(measured.tension), measured.tension, 0.0)
    warm = np.where(np.isfinite(measured.temperature), measured.temperature, 20.0)
    if robot.hangs and not robot.platform.mass > 0:
        nothing = np.full((len(measured), 3), np.nan)
        return Pose(nothing, np.full((len(measured), 3, 3), np.nan))
    return robot.poses_at(
        measured.motor_angle,
        tension=tension,
        temperature=warm,
        tolerance=np.inf,
        search="outlying",
    ).pose


def _error(tracker: Tracker, pose: Pose, seen: Array) -> float:
    distance = np.linalg.norm(reading_of(tracker, pose).position - seen, axis=1)
    known = distance[np.isfinite(distance)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else 0.0


def _with_imu(dataset: RobotDataset, tracker: Tracker, pose: Pose) -> RobotDataset:
    """The data set with angles declared those of an IMU where this predicts them better."""
    measured, profile = dataset.measured, dataset.robot
    turned = tracker
    if not np.any(tracker.turn):
        # A small turn is found by the selection; whether angles turn with it is decided here.
        turned = registered(
            tracker, pose, measured.position, measured.angles, {"frame", "reflector"}
        )
    if profile.instrument.imu is not None or not np.isfinite(measured.angles).any():
        return dataset
    if dataset.moves and not np.any(tracker.turn):
        return dataset  # A delay shifts positions and rotations as a small frame does.
    squares = []
    for own in (turned, replace(turned, turns_rotation=False)):
        difference = rotation_residual(reading_of(own, pose).rotation, measured.angles)
        squares.append(float(np.nanmean(difference**2)))
    if not squares[0] > max(_FITS_BETTER * squares[1], START["rotation"] ** 2):
        return dataset
    note = (
        "roll, pitch and yaw do not turn with the tracker's frame: taken as those of an IMU "
        "([instrument.imu])"
    )
    instrument = replace(profile.instrument, imu=ImuSpec())
    return replace(
        dataset, robot=replace(profile, instrument=instrument), notes=(*dataset.notes, note)
    )


def _term(name: str, catalogue: Catalogue, base: Tracker, tracker: Tracker) -> Term:
    """The effect that changes the tracker of the file into the registered one."""
    effect = catalogue[_EFFECTS[name]]
    if name == "reflector":
        values = tracker.offset - base.offset
    else:
        turned = rotation_by(tracker.turn) @ rotation_by(base.turn).T
        shift = tracker.shift - turned @ base.shift
        values = np.concatenate([shift, rotation_vector(turned)])
    names = [parameter.name for parameter in effect.parameters]
    return Term(effect, dict(zip(names, values.tolist(), strict=True)))
