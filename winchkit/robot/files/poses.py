"""Measured poses of a robot's runs: one row per pose, NaN where nothing was measured.

Readings are those of instruments whose known numbers (``[instrument]`` of the robot's file: cell
gains, scales of length counters, zeros of swivels) are corrected.

A log, whose rows are samples in time, has a pose per hold (:mod:`winchkit.robot.files.holds`): the
mean of what was measured there. Its rows in motion are left out. :func:`read_trajectory` keeps all
rows of logs with few holds.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from winchkit.arguments import require_type, require_types
from winchkit.arrays import Array
from winchkit.errors import Fault, RunError, suggest
from winchkit.model.rotation import angles_of, rotation_from_quaternion
from winchkit.robot.files.holds import averaged, holds_of, is_log
from winchkit.runs.run import Run
from winchkit.schema.profiles.instruments import TrackerSpec
from winchkit.schema.profiles.robot import RobotProfile
from winchkit.schema.profiles.winch import WinchProfile

_POSITION = ("platform_x", "platform_y", "platform_z")
_QUATERNION = ("platform_qw", "platform_qx", "platform_qy", "platform_qz")
_ANGLES = ("platform_roll", "platform_pitch", "platform_yaw")
_TRACKED = ("tracker_x", "tracker_y", "tracker_z")
_TRACKED_QUATERNION = ("tracker_qw", "tracker_qx", "tracker_qy", "tracker_qz")


@dataclass(frozen=True)
class MeasuredPoses:
    """Measurements at p poses of a robot with n lines."""

    motor_angle: Array
    """(p, n), rad."""
    position: Array
    """Of the platform's origin in the base frame, (p, 3), m."""
    angles: Array
    """Roll, pitch, yaw, (p, 3), rad."""
    swivel: Array
    """(p, n), rad, each line with a zero of its own."""
    cable_length: Array
    """By an instrument at the cable, (p, n), m, each with an offset of its own."""
    tension: Array
    """(p, n), N."""
    temperature: Array
    """Of the cables, (p, n), degrees Celsius."""
    run: NDArray[np.intp]
    """Index of the run of each pose, (p,)."""
    place: NDArray[np.str_]
    """Text with the run and the row of each pose, (p,)."""
    length_zeroed: bool = False
    """Whether the length instruments have no offset."""
    session_of_run: tuple[str, ...] = ()
    """Session of each run, in which the instruments were set up once; by default each is one."""
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.motor_angle)

    @property
    def sessions(self) -> tuple[str, ...]:
        """Name of the session of each run."""
        count = int(self.run.max()) + 1 if len(self.run) else 0
        return self.session_of_run or tuple(f"run {n + 1}" for n in range(count))

    def __getitem__(self, rows: NDArray[np.bool_]) -> MeasuredPoses:
        """The poses of a mask."""
        return replace(self, **{name: getattr(self, name)[rows] for name in _ARRAYS})


class MotionSamples(NamedTuple):
    """Rows of logs of a robot in motion."""

    measured: MeasuredPoses
    """(p,) rows of all runs."""
    time: Array
    """Since each run's start, (p,), s."""


_FEWEST_HOLDS = 10
"""Holds of logs from which they are poses: fewer are no diagnosis of poses."""
_REST = 0.25
"""Share of the rows at rest from which holds are poses (rule of thumb): a motion through many
points stops at each for less."""
_LEAST_TURN = 2e-3
"""Turn of a drum below which poses are the same, rad: 0.1 mm of cable on a radius of 50 mm."""
_AS_BASE = (
    "positions are tracker_x, tracker_y, tracker_z, taken as those in the base frame: where the "
    'tracker stands in another one, write [instrument.tracker] frame = "unknown" into the profile'
)
_SCALARS = {"length_zeroed", "session_of_run", "notes"}
_CIRCULAR = frozenset({"angles", "swivel"})
"""Whose mean over a hold is the circular one."""
_ARRAYS = tuple(field.name for field in fields(MeasuredPoses) if field.name not in _SCALARS)


def read_poses(runs: Sequence[Run], profile: RobotProfile) -> MeasuredPoses:
    """Poses of all runs.

    Parameters
    ----------
    runs : sequence of Run
        Runs of the robot, a row per pose.
    profile : RobotProfile
        The robot.

    Returns
    -------
    MeasuredPoses
        Rows without a motor angle are left out and noted.

    Raises
    ------
    RunError
        With the faults of all runs: unknown lines, lines without motor angles, incomplete
        quaternions.
    """
    require_types(runs, Run, "runs")
    require_type(profile, RobotProfile, "profile")
    if not runs:
        raise RunError("no run given")
    faults: list[Fault] = []
    parts: list[MeasuredPoses] = []
    for run in runs:
        found = _faults(run, profile)
        faults += found
        if not found:
            parts.append(_of_run(run, profile, len(parts)))
    if faults:
        raise RunError(faults)
    poses = joined(parts)
    if len(poses) > 1 and _stands_still(poses, profile):
        place = ", ".join(run.path or run.name for run in runs)
        raise RunError(
            Fault(
                f"all {len(poses)} rows are one pose: every drum turns by less than "
                f"{_LEAST_TURN:g} rad; record different poses",
                place,
            )
        )
    again = copies(poses)
    if not again.any():
        return poses
    note = f"{of_poses(again)} copies of other rows, equal in every number; left out"
    return replace(poses[~again], notes=(*poses.notes, note))


def copies(poses: MeasuredPoses, of: MeasuredPoses | None = None) -> NDArray[np.bool_]:
    """Rows that equal an earlier one, or one of other poses, in every number, (p,). Two
    measurements of one pose differ by their noise: a copy, held out, would be a pose that was
    fitted."""
    seen = set() if of is None else set(_numbers(of))
    out = np.zeros(len(poses), dtype=bool)
    for row, numbers in enumerate(_numbers(poses)):
        out[row] = numbers in seen
        if of is None:
            seen.add(numbers)
    return out


def _numbers(poses: MeasuredPoses) -> Iterator[bytes]:
    """All numbers of each pose."""
    table = [getattr(poses, name) for name in _ARRAYS if name not in {"run", "place"}]
    for row in np.hstack(table):
        yield np.asarray(row + 0.0).tobytes()


def held_unmeasured(measured: MeasuredPoses, profile: RobotProfile) -> NDArray[np.bool_]:
    """Coordinates of a position that guides hold and nothing measured, (3,): in no distance."""
    seen = np.any(np.isfinite(measured.position), axis=0)
    return np.asarray(~seen & (np.array(profile.platform.free[:3]) == 0))


def of_poses(mask: NDArray[np.bool_]) -> str:
    """Number of poses of a mask, with their verb."""
    count = int(mask.sum())
    return f"{count} of {len(mask)} poses {'is' if count == 1 else 'are'}"


def read_trajectory(runs: Sequence[Run], profile: RobotProfile) -> MotionSamples | None:
    """Rows of logs of a robot in motion; None where the runs are poses: a row each, also along a
    path with a time of each, or logs with at least ten holds that have a quarter of the rows."""
    faults = [fault for run in runs for fault in _faults(run, profile)]
    if faults:
        raise RunError(faults)
    parts, times, count, rest = [], [], 0, 0
    for number, run in enumerate(runs):
        rows, notes = _rows_of(run, profile, number)
        is_numbered = run.metadata.get("time") == _NUMBERED
        if is_numbered or run.interval > _SLOWEST or not is_log(rows.motor_angle):
            return None
        holds = holds_of(rows.motor_angle) or []
        count, rest = count + len(holds), rest + sum(hold.stop - hold.start for hold in holds)
        parts.append(replace(rows, notes=tuple(f"{run.path or run.name}: {n}" for n in notes)))
        moved = np.any(np.isfinite(_motor_angles(run, profile)), axis=1)
        times.append((run.time - run.time[0])[moved])
    if count >= _FEWEST_HOLDS and rest >= _REST * sum(map(len, times)):
        return None
    return MotionSamples(joined(parts), np.concatenate(times))


_SLOWEST = 0.5
"""s: rows further apart are poses at rest, each measured by itself. A robot's moves take seconds;
of a motion so sampled no acceleration is known."""
_NUMBERED = "row number"
"""Metadata ``time`` of a run whose file has none."""


def _stands_still(measured: MeasuredPoses, profile: RobotProfile) -> bool:
    """Whether all rows are one pose."""
    ratio = [
        line.winch.gearbox.ratio if isinstance(line.winch, WinchProfile) else 1.0
        for line in profile.line
    ]
    known = np.isfinite(measured.motor_angle)
    low = np.min(np.where(known, measured.motor_angle, np.inf), axis=0)
    high = np.max(np.where(known, measured.motor_angle, -np.inf), axis=0)
    return bool(np.all(high - low < _LEAST_TURN * np.array(ratio)))


def joined(parts: Sequence[MeasuredPoses]) -> MeasuredPoses:
    """Concatenated poses of several parts."""
    arrays: dict[str, Any] = {
        name: np.concatenate([getattr(part, name) for part in parts]) for name in _ARRAYS
    }
    notes = tuple(note for part in parts for note in part.notes)
    return MeasuredPoses(
        **arrays,
        length_zeroed=all(part.length_zeroed for part in parts),
        session_of_run=tuple(name for part in parts for name in part.session_of_run),
        notes=notes,
    )


def _faults(run: Run, profile: RobotProfile) -> list[Fault]:
    names, place = [line.name for line in profile.line], run.path or run.name
    there = [name for name in run.winches() if name]
    if not there:
        message = (
            f"no column '{names[0]}.motor_angle'; a robot's run has one for each of its lines "
            f"{', '.join(names)}"
        )
        return [Fault(message, place)]
    faults = [
        Fault(
            f"column '{name}.motor_angle' is of no line of the robot '{profile.name}'; its lines "
            f"are {', '.join(names)}{suggest(name, names)}",
            place,
        )
        for name in there
        if name not in names
    ]
    if missing := [name for name in names if name not in there]:
        columns = ", ".join(f"'{name}.motor_angle'" for name in missing)
        faults.append(Fault(f"no column {columns}; every line of the robot needs its own", place))
    faults += [
        Fault(f"column '{name}.motor_angle' holds no value", place)
        for name in names
        if name in there and not np.any(np.isfinite(run[f"{name}.motor_angle"]))
    ]
    given, lacking = _present(run, _quaternion_columns(run))
    if given and lacking:
        faults.append(Fault(f"has {', '.join(given)} but not {', '.join(lacking)}", place))
    return faults


def _present(run: Run, names: Sequence[str]) -> tuple[list[str], list[str]]:
    """Those of the columns that the run has, and those that it lacks."""
    given = [name for name in names if name in run]
    return given, [name for name in names if name not in given]


def _of_run(run: Run, profile: RobotProfile, number: int) -> MeasuredPoses:
    rows, messages = _rows_of(run, profile, number)
    poses, of_log = _of_holds(rows, run)
    notes = [f"{run.path or run.name}: {note}" for note in (*messages, *of_log)]
    return replace(poses, notes=tuple(notes))


def _motor_angles(run: Run, profile: RobotProfile) -> Array:
    return np.stack([_column(run, f"{line.name}.motor_angle") for line in profile.line], axis=1)


def _rows_of(run: Run, profile: RobotProfile, number: int) -> tuple[MeasuredPoses, list[str]]:
    """Rows with a motor angle, and notes on what is missing."""
    names = [line.name for line in profile.line]

    def per_line(kind: str) -> Array:
        return np.stack([_column(run, f"{name}.{kind}") for name in names], axis=1)

    own = profile.instrument

    def known(values: Mapping[str, float] | str) -> Array:
        return np.array([0.0 if isinstance(values, str) else values.get(n, 0.0) for n in names])

    found = MeasuredPoses(
        motor_angle=per_line("motor_angle"),
        position=np.stack([_column(run, name) for name in _position_columns(run)], axis=1),
        angles=_angles(run),
        swivel=per_line("swivel") - known(own.swivels.zero),
        cable_length=per_line("cable_length") / (1 + known(own.length_counters.scale)),
        tension=per_line("tension") / (1 + known(own.cells.gain)),
        temperature=_temperature(run, names),
        run=np.full(len(run), number, dtype=np.intp),
        place=np.array([f"row {n} of {run.path or run.name}" for n in range(1, len(run) + 1)]),
        length_zeroed=run.length_zeroed,
        session_of_run=(run.metadata.get("session", "").strip() or run.path or run.name,),
    )
    moved = np.any(np.isfinite(found.motor_angle), axis=1)
    notes = [*_partly(run, profile), *_gaps(found, moved, profile)]
    is_base = _position_columns(run) is _TRACKED and own.tracker.frame == TrackerSpec.frame
    if is_base and np.any(np.isfinite(found.position)):
        notes.append(_AS_BASE)
    return found[moved], notes


def _position_columns(run: Run) -> tuple[str, ...]:
    """Columns of a position: of the platform, else a bench's log of its tracker."""
    if any(name in run for name in (*_POSITION, *_QUATERNION, *_ANGLES)):
        return _POSITION
    return _TRACKED


def _quaternion_columns(run: Run) -> tuple[str, ...]:
    return _QUATERNION if _position_columns(run) is _POSITION else _TRACKED_QUATERNION


def _of_holds(rows: MeasuredPoses, run: Run) -> tuple[MeasuredPoses, list[str]]:
    """A pose per hold of a log; the rows themselves where each is a pose."""
    holds = holds_of(rows.motor_angle)
    if holds is None:
        return rows, []
    means: dict[str, Any] = {
        name: averaged(getattr(rows, name), holds, angles=name in _CIRCULAR)
        for name in _ARRAYS
        if name not in ("run", "place")
    }
    sizes = [hold.stop - hold.start for hold in holds]
    first = [rows.place[hold.start].split(" ")[1] for hold in holds]
    last = [rows.place[hold.stop - 1].split(" ")[1] for hold in holds]
    places = [f"rows {a}-{b} of {run.path or run.name}" for a, b in zip(first, last, strict=True)]
    found = replace(
        rows, **means, run=rows.run[[hold.start for hold in holds]], place=np.array(places)
    )
    note = (
        f"a log of {len(rows)} rows in time: {len(holds)} holds of {min(sizes)} to {max(sizes)} "
        f"rows, in which no winch moves beyond its noise, are the poses; "
        f"{len(rows) - sum(sizes)} rows in motion were left out"
    )
    return found, [note]


def _partly(run: Run, profile: RobotProfile) -> list[str]:
    """Notes on incomplete groups of columns, which are valid but often a misspelling."""
    columns = zip(_position_columns(run), profile.platform.free, strict=False)
    given, lacking = _present(run, [name for name, free in columns if free or name in run])
    if not given or not lacking:
        return []
    return [
        f"has {', '.join(given)} but not {', '.join(lacking)}: fitted so; distances from measured "
        "positions are not known"
    ]


def _gaps(found: MeasuredPoses, moved: NDArray[np.bool_], profile: RobotProfile) -> Iterator[str]:
    if left := int(np.count_nonzero(~moved)):
        yield f"{left} rows without any motor angle were left out"
    kept = found[moved]
    position = kept.position[:, ~held_unmeasured(kept, profile)]
    for name, values in (("motor_angle", kept.motor_angle), ("position", position)):
        missing = int(np.count_nonzero(np.isnan(values)))
        if 0 < missing < values.size:
            yield f"{missing} of {values.size} values of {name} are missing"


def _temperature(run: Run, names: Sequence[str]) -> Array:
    """Temperature per line where it was measured so, else one for all lines."""
    common = _column(run, "temperature")
    own = [_column(run, f"{name}.temperature") for name in names]
    return np.stack([np.where(np.isfinite(t), t, common) for t in own], axis=1)


def _column(run: Run, name: str) -> Array:
    return run[name] if name in run else np.full(len(run), np.nan)


def _angles(run: Run) -> Array:
    angles = np.stack([_column(run, name) for name in _ANGLES], axis=1)
    quaternion = np.stack([_column(run, name) for name in _quaternion_columns(run)], axis=1)
    whole = np.linalg.norm(quaternion, axis=1) > 0.5
    angles[whole] = angles_of(rotation_from_quaternion(quaternion[whole]))
    return angles
