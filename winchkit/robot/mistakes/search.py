"""Search for the mistakes in a table of poses, alone and two at a time, by lengths and positions.

The poses that the cable lengths alone determine are computed for every mistake of the motor angles,
all at once. The positions are then registered on them by Umeyama's closed form, right- and
left-handed, with their scale free, and for every shift of the rows. The trials that fit best are
adjusted (:mod:`winchkit.robot.mistakes.adjustment`) with the geometry free, and compared by the
median of their absolute residuals. A mistake is named where that of the table as it is is larger by
a factor, and all that come near the best are named together.

Rotations are compared afterwards with those of the adjusted poses, under each convention.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np

from winchkit.arrays import Array
from winchkit.errors import Fault, RunError
from winchkit.model.rotation import (
    angles_of,
    mean_rotation,
    rotation_by,
    rotation_of,
    rotation_vector,
)
from winchkit.robot.files.poses import MeasuredPoses
from winchkit.robot.geometry.forward import forward
from winchkit.robot.geometry.kinematics import Pose, by_pose, lengths, linearised
from winchkit.robot.geometry.pose_estimation import Iteration, estimated_pose
from winchkit.robot.geometry.robot import Robot
from winchkit.robot.geometry.tracker import declared_tracker, reading_of, registered
from winchkit.robot.identification.bundle_adjustment import (
    BundleState,
    Weights,
    linearise,
    place,
)
from winchkit.robot.identification.equations import RobotEquations
from winchkit.robot.identification.instruments import InstrumentValues
from winchkit.robot.mistakes.adjustment import ANGLE, adjusted, adjustment_of, misfit
from winchkit.robot.mistakes.slips import slip_in, slip_mistake
from winchkit.robot.mistakes.table import (
    MIRRORED,
    MOST_ROWS,
    POSITION_UNITS,
    UNKNOWN,
    UNKNOWN_ROTATIONS,
    Mistake,
    axes_mistake,
    mended,
    motor_mistakes,
    rotation_mistakes,
    row_mistakes,
    unit_mistake,
)

_FEWEST = 12
"""Poses of a run below which none is judged: the adjustment has as many unknowns as equations."""
_SAMPLE = 20
"""Poses for the first comparison of thousands of trials."""
_MOST = 100
"""Poses of an adjustment."""
_SIGMA = 0.02
"""Standard deviation of an equation as a share of the rms motion of the cables: wide, so that the
priors hold the geometry where it would imitate a mistake."""
_USUAL, _POOR = 4e-3, 1e-2
"""Misfits as shares of the rms motion of the cables: below the first lengths and positions agree,
above the second two mistakes are looked for (rules of thumb: right ones end below the first, and
single mistakes above the second)."""
_FACTOR = 3.0
"""Ratio of two median residuals above which a mistake explains them; below it models that are
wrong alike differ (rule of thumb)."""
_NEAR = 1.6
"""Ratio of two median residuals below which two mistakes explain the same (rule of thumb)."""
_ADJUSTED = 6
"""Trials of a kind that are adjusted, the best of the first comparison first."""
_ALIKE = 0.1
"""Errors of a scale (a share) and of a direction within which a unit and an axis are meant."""
_ROTATION_FACTOR, _ROTATION_NEAR = 1.5, 1.15
"""The same two ratios of median angles, which the geometry hardly changes."""
_WRONG = 0.02
"""Misfit as a share of the motion above which lengths and positions are not of one robot (rule of
thumb: right ones are below a fifth of it, mistaken ones above)."""
_UNLIKE, _LEAST_ANGLE = 0.3, 0.01
"""Median angle as a share of the platform's turns, and in rad, above which rotations are not of
these poses (rules of thumb)."""
_ANGLE_NOISE = 3e-3
"""Median angle, rad, up to which rotations are those of the poses: twice the noise of camera
trackers (0.1 deg); a convention that changes no more is none of these mistakes."""
_REST_ANGLE = 0.1
"""Standard deviation, rad, of the rotation of a hanging platform about that in which it rests by
the geometry of the file: points some centimetres off tilt a platform of decimetres by as much."""
_CHANCE = 1e-6
"""Probability of a slip by chance above which none is named: few poses have nearly as many
parameters as equations, and a step explains any of them (rule of thumb)."""
_SLIPPING = 6
"""Adjustments with the length that slipped, each with what the one before left (rule of thumb)."""
_SETTLING = Iteration(damping=1e-6, relative_damping=1e-6, tolerance=1e-5, steps=25)


@dataclass(frozen=True)
class _Trial:
    """Mistakes, and how well lengths and positions agree without them."""

    mistakes: tuple[Mistake, ...]
    error: float
    """m, of the first comparison or of the adjustment."""


@dataclass(frozen=True)
class _Adjusted(_Trial):
    """A trial with the geometry free."""

    table: MeasuredPoses
    """Without the mistakes."""
    pose: Pose
    turned: Array
    """Turn of the tracker's frame, (3, 3)."""
    end: tuple[RobotEquations, BundleState] | None = None
    """Of the adjustment; None where lengths have no value."""


@dataclass(frozen=True)
class Named:
    """Mistakes of a table; each of the sets gives the same data."""

    sets: tuple[tuple[Mistake, ...], ...]
    before: float
    after: float
    unit: str
    """m or rad."""
    place: str

    @property
    def code(self) -> str:
        """Codes of the mistakes, joined by ``+``, and of the sets, by ``|``."""
        return " | ".join(" + ".join(m.code for m in mistakes) for mistakes in self.sets)

    def __str__(self) -> str:
        size, factor = ("mm", 1e3) if self.unit == "m" else ("deg", 180 / np.pi)
        what = "lengths and positions" if self.unit == "m" else "measured rotations and the poses"
        listed = ", or ".join(" and ".join(m.text for m in one) for one in self.sets)
        cures = dict.fromkeys(m.cure for one in self.sets[:1] for m in one)
        rest = f", and by {self.after * factor:.3g} {size} without that" if self.after else ""
        far = f"{self.before * factor:.3g} {size}" if np.isfinite(self.before) else "no finite size"
        return (
            f"{listed}: {what} differ by {far} as they are{rest} "
            f"(rms beside a free geometry); {'; '.join(cures)}"
        )


def refuse_slips(equations: RobotEquations, state: BundleState, weights: Weights) -> None:
    """Raise RunError where the slip of one cable explains what a fit leaves at these poses."""
    measured = equations.measured
    placed = place(equations, state, weights)
    sigma = weights.sigma.get("closure", np.inf)
    slip = slip_in(measured, linearise(equations, placed, weights), sigma)
    if slip is None or slip.chance > _CHANCE:
        return
    mistake = slip_mistake(equations.robot_at(state.values), measured, slip)
    left = next(c.residual for kind, c in equations.constraints(placed) if kind == "closure")
    before = float(np.sqrt(np.nanmean(left**2)))
    where = str(measured.place[slip.rows.start]).partition(" of ")[2]
    named = Named(((mistake,),), before, before * slip.left**0.5, "m", where)
    raise RunError([Fault(str(named), where, key=named.code)])


def refuse_mistakes(robot: Robot, measured: MeasuredPoses) -> None:
    """Raise RunError with the mistakes that the runs of these poses contain."""
    found = mistakes_in(robot, measured)
    if found:
        raise RunError([Fault(str(n), n.place, key=n.code) for n in found])


def mistakes_in(robot: Robot, measured: MeasuredPoses) -> tuple[Named, ...]:
    """Mistakes of each run of twelve poses or more; of a hanging platform where its weight is known
    and positions were measured, since its lengths alone contradict nothing."""
    out: list[Named] = []
    if robot.hangs and not (robot.platform.mass > 0 and np.any(np.isfinite(measured.position))):
        return ()
    for run in np.unique(measured.run):
        own = _whole(measured[measured.run == run])
        if len(own) >= _FEWEST:
            place = str(own.place[0]).partition(" of ")[2]
            out += _MistakeSearch(robot, own, place).found()
    return tuple(out)


def _whole(measured: MeasuredPoses) -> MeasuredPoses:
    """Rows with all motor angles, and with whole positions where there are any."""
    rows = np.all(np.isfinite(measured.motor_angle), axis=1)
    seen = np.all(np.isfinite(measured.position), axis=1)
    return measured[rows & (seen | ~np.any(seen))]


@dataclass(frozen=True)
class _MistakeSearch:
    """Search in one run."""

    robot: Robot
    measured: MeasuredPoses
    place: str

    @property
    def motion(self) -> float:
        """Rms motion of the cables about their mean, m; at most a fifth of the robot's size."""
        return self._motion_of(self.measured)

    def _motion_of(self, table: MeasuredPoses) -> float:
        moved = self.robot.lengths_at(table.motor_angle)
        spread = float(np.sqrt(np.mean(np.var(moved, axis=0))))
        return min(spread, 0.2 * self.robot.geometry.size)

    @property
    def has_positions(self) -> bool:
        return bool(np.all(np.isfinite(self.measured.position)))

    def found(self) -> Iterator[Named]:
        """Mistakes of motor angles, rows and positions, then those of the rotations."""
        usual = _USUAL * self.motion
        plain = self._adjusted(())
        best = [plain]
        if not plain.error <= usual:
            best = self._best(plain, usual)
            if best[0].mistakes:
                sets = tuple(trial.mistakes for trial in best)
                yield Named(sets, plain.error, best[0].error, "m", self.place)
            elif slipped := self._slipped(plain):
                best = [slipped]
                yield Named((slipped.mistakes,), plain.error, slipped.error, "m", self.place)
            elif plain.error > _WRONG * self.motion:
                yield Named(((UNKNOWN,),), plain.error, 0.0, "m", self.place)
        yield from self._of_rotations(best[0])

    def _slipped(self, plain: _Adjusted, *, turned: bool = False) -> _Adjusted | None:
        """The trial without the slip of a cable, where this explains the table."""
        best, slip = plain, None
        for _ in range(_SLIPPING if len(plain.table) == len(self.measured) else 0):
            assert best.end is not None, "lengths have values"
            sigma = _SIGMA * self.motion
            weights = Weights({"closure": sigma, "position": sigma, "rotation": ANGLE})
            found = slip_in(best.table, linearise(*best.end, weights), sigma, least=1.0)
            if found is None or (slip and (found.line, found.rows) != (slip.line, slip.rows)):
                break
            slip = replace(found, length=found.length + (slip.length if slip else 0.0))
            mistake = slip_mistake(self.robot, self.measured, slip)
            best = self._adjusted((mistake,), turned=turned)
        return best if best.error * _FACTOR < plain.error else None

    def _best(self, plain: _Adjusted, usual: float) -> list[_Adjusted]:
        """Trials that explain the table best, by the fewest mistakes; ``plain`` where none does."""
        best = [plain]
        for count in (1, 2) if plain.error > _POOR * self.motion else (1,):
            trials = [self._adjusted(t.mistakes) for t in self._compared(count)]
            # Motor angles in a smaller unit have a smaller misfit, whatever the positions are.
            trials = [t for t in trials if t.error <= _WRONG * self._motion_of(t.table)]
            trials.sort(key=lambda trial: trial.error)
            if trials and trials[0].error * _FACTOR < best[0].error:
                least = trials[0].error
                best = [trial for trial in trials if trial.error < _NEAR * least]
            if best[0].error <= usual:
                break
        return best

    def _compared(self, count: int) -> list[_Trial]:
        """Trials of ``count`` mistakes at most that agree better than the table, the best ones."""
        motors = list(motor_mistakes(self.robot))
        chosen: list[tuple[Mistake, ...]] = [(), *((mistake,) for mistake in motors)]
        if count > 1:
            chosen += permutations(motors, 2)
        rows = np.unique(np.linspace(3, len(self.measured) - 4, _SAMPLE).astype(int))
        sets: dict[bytes, tuple[Mistake, ...]] = {}
        angles = []
        for mistakes in chosen:
            angle = mended(self.measured, mistakes).motor_angle[rows]
            key = np.round(angle, 9).tobytes()
            if key not in sets:
                sets[key] = mistakes
                angles.append(angle)
        pose, closure = self._by_lengths(np.stack(angles))
        trials: list[_Trial] = []
        for number, mistakes in enumerate(sets.values()):
            own = Pose(pose.position[number], pose.rotation[number])
            trials += self._with_positions(mistakes, own, rows, float(closure[number]), count)
        plain = min(trial.error for trial in trials if not trial.mistakes)
        better = [trial for trial in trials if trial.mistakes and trial.error < plain]
        return sorted(better, key=lambda trial: trial.error)[: _ADJUSTED * count]

    def _by_lengths(self, angle: Array) -> tuple[Pose, Array]:
        """Poses (h, p) of motor angles (h, p, n) by the lengths alone, and median residuals (h,)
        but for a constant of each line, whose home length may be unknown."""
        many, count, lines = angle.shape
        shape = (many, count)
        geometry, home = self.robot.geometry, self.robot.home
        given = self.robot.lengths_at(angle.reshape(-1, lines))
        given = np.where(np.abs(given) < 10 * geometry.size, given, np.nan)
        if self.robot.hangs:
            found = forward(geometry, given, home, self.robot.platform)
            pose = Pose(
                found.pose.position.reshape(*shape, 3), found.pose.rotation.reshape(*shape, 3, 3)
            )
            enough = np.count_nonzero(found.converged.reshape(shape), axis=1) > count / 2
            return pose, np.where(enough, 0.0, np.inf)

        def whitened(pose: Pose) -> tuple[Array, Array]:
            length, by = linearised(geometry, pose.position, pose.rotation)
            residual, slope = length - given, by_pose(by)
            known = np.isfinite(residual) & np.all(np.isfinite(slope), axis=2)
            return np.where(known, residual, 0.0), np.where(known[..., None], slope, 0.0)

        start = Pose(
            np.repeat(home.position, many * count, axis=0),
            np.repeat(home.rotation, many * count, axis=0),
        )
        pose = estimated_pose(whitened, start, _SETTLING)
        residual = lengths(geometry, pose.position, pose.rotation) - given
        residual = np.where(np.isfinite(residual), residual, np.inf).reshape(many, count, lines)
        with np.errstate(invalid="ignore"):
            about = np.abs(residual - np.median(residual, axis=1, keepdims=True))
        error = np.median(about.reshape(many, -1), axis=1)
        pose = Pose(pose.position.reshape(*shape, 3), pose.rotation.reshape(*shape, 3, 3))
        return pose, np.where(np.isfinite(error), error, np.inf)

    def _with_positions(
        self, motors: tuple[Mistake, ...], pose: Pose, rows: Array, closure: float, most: int
    ) -> Iterator[_Trial]:
        """Trials with the mistakes of rows and positions that the registration finds."""
        if not motors:
            yield _Trial((), np.inf)
        if not np.isfinite(closure):
            return
        if not self.has_positions:
            yield _Trial(motors, closure)
            return
        shifts: list[tuple[int, tuple[Mistake, ...]]] = [(0, ())]
        furthest = MOST_ROWS if motors else max(MOST_ROWS, len(self.measured) // 3)
        shifts += [(int(m.code.partition(":")[2]), (m,)) for m in row_mistakes(furthest)]
        for shift, of_rows in shifts:
            if len(motors) + len(of_rows) > most:
                continue
            there = np.isin(rows - shift, np.arange(len(self.measured)))
            seen = self.measured.position[np.where(there, rows - shift, 0)]
            known = np.isfinite(pose.position[:, 0]) & there
            for left_handed in (False, True):
                turned, scale, error = _registration(
                    seen[known], pose.position[known], left_handed=left_handed
                )
                of_positions = self._of_positions(turned, scale, left_handed=left_handed)
                if of_positions is None:
                    continue
                mistakes = (*motors, *of_rows, *of_positions)
                if len(mistakes) <= most:
                    yield _Trial(mistakes, float(np.hypot(closure, error / scale)))

    def _of_positions(
        self, turned: Array, scale: float, *, left_handed: bool
    ) -> tuple[Mistake, ...] | None:
        """Mistakes that make this similarity of the positions; None for a scale of no unit."""
        units: tuple[Mistake, ...] = ()
        if abs(scale - 1) > _ALIKE:
            found = [u for u, (f, _) in POSITION_UNITS.items() if abs(scale * f - 1) < _ALIKE]
            if not found:
                return None
            units = tuple(map(unit_mistake, found))
        if not left_handed:
            return units
        if isinstance(self.robot.profile.instrument.tracker.frame, str):
            return (*units, MIRRORED)
        declared = rotation_by(declared_tracker(self.robot.profile).turn)
        axes = turned @ declared.T
        if np.all(np.abs(axes - np.round(axes)) < 2 * _ALIKE):
            return (*units, axes_mistake(axes))
        return (*units, MIRRORED)

    def _adjusted(self, mistakes: tuple[Mistake, ...], *, turned: bool = False) -> _Adjusted:
        """A trial with the geometry free; its error is the misfit, m. ``turned``: the measured
        rotations take part."""
        table = mended(self.measured, mistakes)
        if len(table) > _MOST:
            kept = np.zeros(len(table), dtype=bool)
            kept[np.linspace(0, len(table) - 1, _MOST).astype(int)] = True
            table = table[kept]
        pose, closure = self._by_lengths(table.motor_angle[None])
        start = Pose(pose.position[0], pose.rotation[0])
        tracker = declared_tracker(self.robot.profile)
        if not np.all(np.isfinite(closure)):
            return _Adjusted(mistakes, float("inf"), table, start, rotation_by(tracker.turn))
        if self.robot.hangs:
            found = np.isfinite(start.position[:, 0])
            table, start = table[found], start[found]
        free = {"frame", "mounting"} if turned else {"frame"}
        tracker = registered(tracker, start, table.position, table.angles, free)
        instruments = InstrumentValues(frozenset(), ("",), (tracker,))
        seen, angle = table, ANGLE
        if self.robot.hangs and not turned:
            shown = angles_of(reading_of(tracker, start).rotation)
            seen, angle, turned = replace(table, angles=shown), _REST_ANGLE, True
        equations = adjustment_of(self.robot, seen, instruments, turned=turned)
        sigma = _SIGMA * self.motion
        solution = adjusted(equations, start, sigma, angle)
        own = equations.instruments_at(solution.state.values)
        assert own is not None, "they have the tracker"
        frame = rotation_by(own.trackers[0].turn)
        error = misfit(equations, solution, sigma)
        end = equations, solution.state
        return _Adjusted(mistakes, error, table, solution.state.pose, frame, end)

    def _of_rotations(self, best: _Adjusted) -> Iterator[Named]:
        """Mistakes of the rotations beside the poses of the adjusted table."""
        if not np.all(np.isfinite(self.measured.angles)):
            return
        if not best.error <= _WRONG * self.motion:
            return
        codes = [m.code for m in best.mistakes]

        def compared(mistakes: tuple[Mistake, ...]) -> _Trial:
            rotation, frames = best.pose.rotation, [best.turned, np.eye(3)]
            shown = rotation_of(*mended(best.table, mistakes).angles.T)
            if "position-axes" in codes:
                # Rotations in a left-handed frame P are P R Pᵀ, which is (−P) R (−P)ᵀ.
                axes = best.mistakes[codes.index("position-axes")].axes
                frames.append(-axes @ best.turned)
            if "mirrored" in codes:
                frames.append(_frame_of(rotation, shown))
            return _Trial(mistakes, min(_angle(rotation, shown, f) for f in frames))

        plain, every = compared(()), list(rotation_mistakes())
        if plain.error <= _ANGLE_NOISE:
            return
        # Cables that run through the middle of a platform hardly hold its rotation.
        if self._adjusted(best.mistakes, turned=True).error < _NEAR * best.error:
            return
        best_set = [plain]
        units = [m for m in every if m.code.startswith("rotation-unit")]
        others = [m for m in every if m not in units]
        for chosen in ([(m,) for m in every], [(u, m) for u in units for m in others]):
            trials = sorted(map(compared, chosen), key=lambda trial: trial.error)
            if trials[0].error * _ROTATION_FACTOR < best_set[0].error:
                near = _ROTATION_NEAR * trials[0].error
                best_set = [trial for trial in trials if trial.error < near]
        spread = rotation_vector(best.pose.rotation @ mean_rotation(best.pose.rotation).T)
        turns = float(np.median(np.linalg.norm(spread, axis=1)))
        if not best_set[0].mistakes and plain.error > max(_UNLIKE * turns, _LEAST_ANGLE):
            whole = self._adjusted((), turned=True)
            if slipped := self._slipped(whole, turned=True):
                yield Named((slipped.mistakes,), whole.error, slipped.error, "m", self.place)
            else:
                yield Named(((UNKNOWN_ROTATIONS,),), plain.error, 0.0, "rad", self.place)
        if best_set[0].mistakes:
            sets = tuple(trial.mistakes for trial in best_set)
            yield Named(sets, plain.error, best_set[0].error, "rad", self.place)


def _registration(seen: Array, point: Array, *, left_handed: bool) -> tuple[Array, float, float]:
    """Rotation or rotary reflection (3, 3), scale and median distance, m, by Umeyama's closed
    form."""
    seen, point = seen - seen.mean(axis=0), point - point.mean(axis=0)
    left, size, right = np.linalg.svd(seen.T @ point)
    wanted = -1.0 if left_handed else 1.0
    sign = np.array([1.0, 1.0, wanted * (np.sign(np.linalg.det(left @ right)) or 1.0)])
    turned = left @ np.diag(sign) @ right
    scale = max(float(size @ sign) / max(float(np.sum(point**2)), 1e-12), 1e-12)
    rest = seen - scale * point @ turned.T
    return turned, scale, float(np.median(np.linalg.norm(rest, axis=1)))


def _angle(rotation: Array, shown: Array, frame: Array) -> float:
    """Median angle, rad, between rotations that are shown and frame @ rotation @ mounting."""
    back = frame.T @ shown
    mounting = mean_rotation(np.swapaxes(rotation, 1, 2) @ back)
    rest = rotation_vector(rotation @ mounting @ np.swapaxes(back, 1, 2))
    return float(np.median(np.linalg.norm(rest, axis=1)))


def _frame_of(rotation: Array, shown: Array) -> Array:
    """Frame in which rotations are shown, by their rotation vectors about the mean, (3, 3)."""
    first, second = (rotation_vector(r @ mean_rotation(r).T) for r in (shown, rotation))
    return _registration(first, second, left_handed=False)[0]
