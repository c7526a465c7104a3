"""Values of effects refitted to the simulated motion by multiple shooting.

A prediction is of the torque of a given motion; a simulator needs values with which the measured
torque makes the measured motion. Each run is cut into pieces whose initial angle and speed are
unknowns, and a piece has to end where the next one begins: a start that is off diverges within one
piece only. The first state of a run is measured, with its noise. Runs of effects with memory, whose
states no instrument reads, are one piece.

References
----------
Bock, H. G., Plitt, K. J. (1984). A multiple shooting algorithm for direct solution of optimal
control problems. IFAC Proceedings 17, 1603-1608.
Efron, B., Tibshirani, R. J. (1993). An introduction to the bootstrap, ch. 6.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from winchkit.arguments import require_type, require_types
from winchkit.arrays import Array
from winchkit.dynamics.balance import ON_MOTION, Balance, balance
from winchkit.dynamics.comparison import SimulatedError, open_loop_error, smoothed
from winchkit.dynamics.drives import Inputs
from winchkit.dynamics.forward import Setup, driving_part, law_of, motion_of, setup_of
from winchkit.dynamics.torque_noise import noisy, spectrum, torque_left
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term
from winchkit.errors import UsageError
from winchkit.model.derivatives import SamplingTimes
from winchkit.runs.run import Run
from winchkit.runs.sanity.local_noise import local_noise
from winchkit.schema.profiles.winch import WinchProfile

_PIECES = 10
"""Pieces of a run; rule of thumb: an error of the start grows over a tenth of it only."""
_JOINED = 10.0
"""Weight of a gap between two pieces over that of an error as large at all of their samples; EMPS:
three and a hundred end at the same values within their standard deviations."""
_STEP = 1e-3
"""Relative change of a coordinate in a difference; above the error of the integration."""
_MOST = 20
"""Steps of the fit; computing cost: each simulates every run once for each value."""
_TOLERANCE = 1e-6
"""Relative error of a step of the integration, far below that of the model."""
_EXACT = 1e-12
"""SI: noise of a state that is given without any, so that it has a weight."""
_DRAWS = 50
"""Simulated motions of which a deviation is computed, to a tenth; computing cost: below that of a
third of the fit."""
_UNLIKELY = 0.05
"""Share of the draws whose errors are below those of the fit, at least; convention."""
_SETTLED = 0.1
"""Change of the sum of squares in units of its mean that ends the fit: a value that is off by its
standard deviation changes it by one."""


@dataclass(frozen=True)
class MotionFit:
    """Values refitted to the simulated motion, and its errors."""

    terms: tuple[Term, ...]
    """All effects, those between torque and motion with new values."""
    std: tuple[dict[str, float], ...]
    """Of the new values, SI; empty of an effect that does not act on the motion."""
    before: tuple[SimulatedError, ...]
    """Of each run simulated as a whole from the measured torque and initial state."""
    after: tuple[SimulatedError, ...]
    """The same from the initial state of the fit."""
    converged: bool
    """Whether the fit ended before the limit of its steps."""

    @property
    def unit(self) -> str:
        """Of the errors: ``rad``, or ``m`` on a linear axis."""
        return self.after[0].unit

    @property
    def rms_before(self) -> float:
        """Error of all runs."""
        return _rms(self.before)

    @property
    def rms_after(self) -> float:
        """The same with the new values."""
        return _rms(self.after)

    def to_json(self) -> dict[str, Any]:
        """The errors and the status, as the command prints them."""
        names = ("unit", "rms_before", "rms_after", "converged")
        runs = [error.to_json() for error in self.after]
        return {**{name: getattr(self, name) for name in names}, "runs": runs}


def _rms(errors: Sequence[SimulatedError]) -> float:
    squares = sum(error.rms**2 * len(error.time) for error in errors)
    return float((squares / sum(len(error.time) for error in errors)) ** 0.5)


def refit_to_motion(
    runs: Sequence[Run],
    profile: WinchProfile,
    terms: Sequence[Term],
    progress: Callable[[int], None] = lambda step: None,
) -> MotionFit:
    """Refit effects, from the values of ``terms``, so that the measured torque makes the measured
    motion; ``progress`` is called with the number of the step.

    Least squares of the position over all pieces. The standard deviations are those of values that
    are refitted to motions under another noise of the torque, with the spectrum of what the values
    leave of the measured torque. Raises RunError for a run without angle
    or torque, or with missing values; UsageError for effects without a step, where none acts on the
    motion, and as :func:`forward`.
    """
    require_types(runs, Run, "runs")
    require_type(profile, WinchProfile, "profile")
    fitted = tuple(index for index, term in enumerate(terms) if _acts_on_motion(term))
    if not fitted:
        raise UsageError("no effect acts between the motor's torque and its motion: nothing to fit")
    whole = tuple(_WholeRun.of(run, profile) for run in runs)
    pieces = tuple(piece for one in whole for piece in one.pieces(profile, terms))
    return _Shooting(profile, tuple(terms), fitted, whole, pieces).solved(progress)


def _acts_on_motion(term: Term) -> bool:
    """Whether an effect with fitted values is between the torque and the motion."""
    between = term.effect.stage in ON_MOTION or term.effect.undo is not None
    return between and len(Coordinates(term.effect)) > 0


@dataclass(frozen=True)
class _Piece:
    """A stretch of a run with its own initial state."""

    setup: Setup
    measured: Array
    """Motor angle at its times, (n,)."""
    noise: tuple[float, float] | None
    """Of the first piece of a run the noise of its measured angle and speed."""

    @property
    def is_first(self) -> bool:
        """Whether it begins a run."""
        return self.noise is not None


@dataclass(frozen=True)
class _WholeRun:
    """A whole run with the channels of the model."""

    run: Run
    setup: Setup
    rate: Array
    """Motor speed, (n,), rad/s."""
    noise: tuple[float, float]
    """Of the angle and the speed."""
    clock: SamplingTimes

    @classmethod
    def of(cls, run: Run, profile: WinchProfile) -> _WholeRun:
        """Raises RunError as :func:`forward`."""
        own = driving_part(run, profile, is_torque=True)
        clock = smoothed(own, profile)
        setup = setup_of(profile, run, None, float(clock.rate[0]), is_torque=True)
        noise = local_noise(own["motor_angle"]), clock.rate_noise
        return cls(own, setup, clock.rate, (max(noise[0], _EXACT), max(noise[1], _EXACT)), clock)

    def torque_noise(
        self,
        profile: WinchProfile,
        terms: Sequence[Term],
        moved: Sequence[Sequence[Term]],
        random: np.random.Generator,
    ) -> Array:
        """Deviations of the cosine transform of its torque's noise, (n,): of what the effects leave
        along the measured motion at any values, with one of them ``moved`` each, less what the
        noise of the angle adds to that."""
        channel = self.run.channels["motor_angle"]
        angle = channel.values
        other = angle + self.noise[0] * random.standard_normal(len(angle))
        channels = {**self.run.channels, "motor_angle": replace(channel, values=other)}
        clock = smoothed(replace(self.run, channels=channels), profile)
        left = torque_left(profile, terms, self.setup, angle, self.clock)
        seen = torque_left(profile, terms, self.setup, other, clock) - left
        near = [torque_left(profile, one, self.setup, angle, self.clock) - left for one in moved]
        columns = np.array([one / max(float(np.linalg.norm(one)), 1e-300) for one in near]).T
        left = left - columns @ np.linalg.lstsq(columns, left)[0]
        return spectrum(left, seen, len(moved))

    def pieces(self, profile: WinchProfile, terms: Sequence[Term]) -> Iterator[_Piece]:
        """Stretches that are fitted: one where effects have states that no instrument reads."""
        whole, angle = self.setup, self.run["motor_angle"]
        law = balance(profile, terms, whole.load_mass, is_load_known="load" in whole.inputs.signals)
        count = 1 if law.states else _PIECES
        ends = np.linspace(0, len(whole.time) - 1, count + 1).round().astype(int)
        for begin, end in pairwise(ends.tolist()):
            there = slice(begin, end + 1)
            signals = {name: values[there] for name, values in whole.inputs.signals.items()}
            time = whole.time[there]
            setup = replace(
                whole,
                time=time,
                angle=float(angle[begin]),
                speed=float(self.rate[begin]),
                inputs=Inputs(time, signals),
            )
            yield _Piece(setup, angle[there], self.noise if begin == 0 else None)


@dataclass(frozen=True)
class _Shooting:
    """Least-squares problem over the coordinates of the effects and the states of the pieces."""

    profile: WinchProfile
    terms: tuple[Term, ...]
    fitted: tuple[int, ...]
    """Effects between the torque and the motion."""
    whole: tuple[_WholeRun, ...]
    pieces: tuple[_Piece, ...]

    @cached_property
    def start(self) -> Array:
        """Coordinates of the effects, (p,)."""
        own = [self.terms[index] for index in self.fitted]
        return np.concatenate([np.zeros(0), *(Coordinates(t.effect).vector(t.values) for t in own)])

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper coordinates, (p,) each."""
        own = [Coordinates(self.terms[index].effect).bounds() for index in self.fitted]
        low, high = (np.concatenate(side) for side in zip(*own, strict=True))
        return low, high

    def terms_at(self, x: Array) -> tuple[Term, ...]:
        """All effects, the fitted ones at coordinates (p,)."""
        out, place = list(self.terms), 0
        for index in self.fitted:
            term = self.terms[index]
            count = len(own := Coordinates(term.effect))
            values = own.values(x[place : place + count], term.values)
            out[index], place = Term(term.effect, values), place + count
        return tuple(out)

    def states_at(self, x: Array) -> Array:
        """Initial angle and speed of every piece, (pieces, 2)."""
        return x[len(self.start) :].reshape(-1, 2)

    @cached_property
    def first(self) -> Array:
        """Unknowns at which the fit begins."""
        start = np.clip(self.start, *self.bounds)
        return np.concatenate([start, self.states_of_data.ravel()])

    def at(self, x: Array) -> tuple[tuple[Term, ...], Array]:
        """Effects and initial states at unknowns."""
        return self.terms_at(x[: len(self.start)]), self.states_at(x)

    def ends(self, terms: Sequence[Term], states: Array) -> list[tuple[Array, float]]:
        """Angle of every piece at its times, and its last speed."""
        out, laws = [], dict[tuple[float | None, bool], Balance]()
        for piece, (angle, speed) in zip(self.pieces, states.tolist(), strict=True):
            setup = replace(piece.setup, angle=angle, speed=speed)
            load = setup.load_mass, "load" in setup.inputs.signals
            if load not in laws:  # tracing the effects takes as long as a piece
                laws[load] = law_of(self.profile, terms, setup)
            motion = motion_of(self.profile, terms, setup, _TOLERANCE, laws[load])
            out.append((motion.angle, float(motion.speed[-1])))
        return out

    @cached_property
    def _last(self) -> dict[bytes, list[tuple[Array, float]]]:
        return {}

    def ends_at(self, x: Array) -> list[tuple[Array, float]]:
        """The same at unknowns; kept, since derivatives begin where the last residual was."""
        key = x.tobytes()
        if key not in self._last:
            found = self.ends(*self.at(x))
            self._last.clear()
            self._last[key] = found
        return self._last[key]

    def residual(self, ends: Sequence[tuple[Array, float]], states: Array) -> Array:
        """Errors of the angle at all samples, and weighted gaps between the pieces."""
        errors, gaps = [], []
        off = states - self.states_of_data
        for k, (piece, (angle, speed)) in enumerate(zip(self.pieces, ends, strict=True)):
            errors.append(angle - piece.measured)
            if piece.noise is not None:
                gaps.append(self.error * off[k] / piece.noise)
            if self._joins(k):
                weight = _JOINED * len(angle) ** 0.5
                lasts = float(piece.setup.time[-1] - piece.setup.time[0])
                gap = np.array([angle[-1], speed]) - states[k + 1]
                gaps.append(weight * gap * (1.0, lasts))
        return np.concatenate([*errors, *gaps])

    def solved(self, progress: Callable[[int], None]) -> MotionFit:
        """The least-squares fit."""
        count, trials = len(self.start), [0]
        # Raises what is missing where the start cannot be simulated.
        rows = len(self._residual_at(self.first))

        def residual(x: Array) -> Array:
            try:
                return self._residual_at(x)
            except UsageError:
                # No motion at these values: the solver goes back and takes a shorter step.
                return np.full(rows, np.nan)

        def jacobian(x: Array) -> Array:
            trials[0] += 1
            progress(trials[0])
            return self._jacobian_at(x)

        free = np.full(2 * len(self.pieces), np.inf)
        low, high = self.bounds
        found = least_squares(
            residual, self.first, jacobian, (np.append(low, -free), np.append(high, free)),
            x_scale="jac", max_nfev=_MOST,
            ftol=_SETTLED / sum(len(piece.measured) for piece in self.pieces),
        )  # fmt: skip
        terms, states = self.at(found.x)
        deviations = self._deviations(np.asarray(found.jac), found.fun, found.x)
        fitted_speeds = deviations[count + 1 :: 2]
        std, place = list[dict[str, float]](), 0
        for index, term in enumerate(self.terms):
            own = Coordinates(term.effect)
            if index not in self.fitted:
                std.append({})
                continue
            part = slice(place, place + len(own))
            std.append(own.deviations(found.x[part], deviations[part], term.values))
            place += len(own)
        return MotionFit(
            terms, tuple(std), self.errors(self.terms, self.states_of_data),
            self.errors(terms, states, fitted_speeds), found.status > 0,
        )  # fmt: skip

    @cached_property
    def error(self) -> float:
        """Error of the pieces at the first values, from the measured states, rms."""
        ends = self.ends_at(self.first)
        off = [angle - p.measured for p, (angle, _) in zip(self.pieces, ends, strict=True)]
        return float(np.sqrt(np.mean(np.concatenate(off) ** 2)))

    @cached_property
    def states_of_data(self) -> Array:
        """Initial angle and speed of every piece as measured, (pieces, 2)."""
        return np.array([(piece.setup.angle, piece.setup.speed) for piece in self.pieces])

    def errors(
        self, terms: Sequence[Term], states: Array, speed_std: Array | None = None
    ) -> tuple[SimulatedError, ...]:
        """Errors of the whole runs simulated from the states (pieces, 2) at their beginnings, whose
        speeds have the deviations ``speed_std`` (pieces,) or those of the measurement."""
        first = [k for k, piece in enumerate(self.pieces) if piece.is_first]
        return tuple(
            open_loop_error(
                self.profile, terms, one.run,
                replace(one.setup, angle=float(states[k, 0]), speed=float(states[k, 1])),
                one.noise[1] if speed_std is None else float(speed_std[k]),
            )
            for one, k in zip(self.whole, first, strict=True)
        )  # fmt: skip

    def _residual_at(self, x: Array) -> Array:
        return self.residual(self.ends_at(x), self.states_at(x))

    def _jacobian_at(self, x: Array) -> Array:
        """Differences: each value changes all pieces, a state changes its own one."""
        count, ends, (terms, states) = len(self.start), self.ends_at(x), self.at(x)
        here = self.residual(ends, states)
        out = np.zeros((len(here), len(x)))
        for j, moved in enumerate(self._moved(x)):
            there = self.residual(self.ends(self.terms_at(moved), states), states)
            out[:, j] = (there - here) / (moved[j] - x[j])
        for which in range(2):
            step = _STEP * max(float(np.std(states[:, which])), 1e-3)
            shifted = states.copy()
            shifted[:, which] += step
            moved_ends = self.ends(terms, shifted)
            for k, moved_end in enumerate(moved_ends):
                own, own_states = list(ends), states.copy()
                own[k], own_states[k] = moved_end, shifted[k]
                out[:, count + 2 * k + which] = (self.residual(own, own_states) - here) / step
        return out

    def _moved(self, x: Array) -> Iterator[Array]:
        """Coordinates (p,) of unknowns, each time another one moved by a step."""
        count, (_, high) = len(self.start), self.bounds
        for j in range(count):
            step = _STEP * max(abs(float(x[j])), 0.1)
            moved = x[:count].copy()
            moved[j] += step if x[j] + step <= high[j] else -step
            yield moved

    def _deviations(self, jacobian: Array, residual: Array, x: Array) -> Array:
        """Standard deviations of the unknowns: how they follow a motion that is simulated under
        another noise of the torque and seen with the noise of the instruments (parametric
        bootstrap, one step of the fit each), of which one in 20 at least has errors after it as
        small as those of the fit: what is left of a torque has noise of the acceleration too. A
        draw whose motion ends, as by a slack cable, is left out; NaN where all end."""
        terms, states = self.at(x)
        near = [self.terms_at(moved) for moved in self._moved(x)]
        scale = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
        unit, random = jacobian / scale, np.random.default_rng(0)
        follow = np.linalg.pinv(unit.T @ unit, hermitian=True) @ unit.T
        first = [states[k].tolist() for k, piece in enumerate(self.pieces) if piece.is_first]
        runs = []
        for one, (angle, speed) in zip(self.whole, first, strict=True):
            setup = replace(one.setup, angle=angle, speed=speed)
            law = law_of(self.profile, terms, setup)
            known = motion_of(self.profile, terms, setup, _TOLERANCE, law).angle
            spread = one.torque_noise(self.profile, terms, near, random)
            runs.append((setup, law, known, spread))
        samples = sum(len(piece.measured) for piece in self.pieces)
        moved, left = [], []
        for _ in range(_DRAWS):
            try:
                changes = [
                    motion_of(
                        self.profile, terms, noisy(setup, spread, random), _TOLERANCE, law
                    ).angle
                    - known
                    for setup, law, known, spread in runs
                ]
            except UsageError:
                continue
            seen = self._seen(changes, random)
            found = follow @ seen
            moved.append(found / scale)
            left.append(float(np.sum((seen - unit @ found)[:samples] ** 2)))
        if not moved:
            return np.full(len(scale), np.nan)
        least = float(np.quantile(left, _UNLIKELY))
        level = min(1.0, float(np.sum(residual[:samples] ** 2)) / least)
        return np.asarray(np.sqrt(level * np.mean(np.square(moved), axis=0)))

    def _seen(self, changes: Sequence[Array], random: np.random.Generator) -> Array:
        """Rows of the residual that changes of the motion of each run (n,) make, with noise."""
        rows, gaps, which = [], [], iter(zip(self.whole, changes, strict=True))
        for k, piece in enumerate(self.pieces):
            if piece.is_first:
                one, change = next(which)
                gaps.append(self.error * random.standard_normal(2))
            own = np.interp(piece.setup.time, one.setup.time, change)
            rows.append(own + one.noise[0] * random.standard_normal(len(own)))
            gaps.append(np.zeros(2 * self._joins(k)))
        return np.concatenate([*rows, *gaps])

    def _joins(self, k: int) -> bool:
        """Whether a piece has to end where the next one begins."""
        return k + 1 < len(self.pieces) and not self.pieces[k + 1].is_first
