"""Control of the cable forces of a platform that balance each other, by its load cells.

Set-point f_s and readings f: the deviation P (f_s − f), with the projection P on the null space of
the structure matrix, is corrected by winding speeds in proportion to the force and inverse to the
stiffness k of each cable. The platform then keeps its pose, as far as the ratios of the stiffnesses
are right. A cable under load integrates its speed: the loop needs no integrator.

A change of the set-point is fed forward where the stiffnesses are known: the cables are wound by
P Δf / k on an S-curve of one duration for all, and the loop compares the readings with the
set-point that this ramp had when they were taken.

The friction of pulleys between cell and platform is removed from the readings by the effects of the
profile. Where their standard deviation is declared, deviations that it explains are not corrected:
the preload is not changed by what the cells do not know.

The rest of the deviation is a wrench, by which readings and weight contradict each other whatever
the preload is: a cell that jumps or stands still shows there (:mod:`.balance_check`). A cable that
breaks does not, since the platform moves to where the others balance: it is seen by its own force.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from winchkit.arrays import Array
from winchkit.bench.control.snapshot import Trip
from winchkit.bench.control.tension_control import LOOP
from winchkit.model.trajectory import Trajectory, plan
from winchkit.robot.bench.balance_check import MOST, BalanceCheck
from winchkit.robot.bench.correction import Latch
from winchkit.robot.bench.path_time import PathTime

_SLACK_TIME = 0.1
"""A swinging platform relieves a cable for less, s."""
_LOW_PASS = 0.1
"""Of the deviations that are compared with the weight, s: a platform that swings at 2 Hz or faster
shows less than two thirds of its acceleration, differences of the cells' delays are over."""
_EXPLAINED = 2.0
"""Standard deviations of the readings, by the friction that is not known, within which a deviation
is not corrected."""
_SHOWN = 50
"""Cycles whose mean deviation is reported: one has the noise of the cells."""
_FEED = 0.8
"""Share of speed and acceleration for the change of the set-point; the loop has the rest."""
_RISE = 0.05
"""Time in which the acceleration of that change builds up, s: the lag of a drive."""


@dataclass(frozen=True)
class ForceSetting:
    """Control of the forces of n cables, SI."""

    names: Sequence[str]
    force: Array
    """Wanted cable forces, (n,), N."""
    balanced: Array
    """Projection on the forces that balance each other, (n, n)."""
    stiffness: Array
    """Of the cables, (n,), N/m; upper bounds where they are not known."""
    known: bool
    """Whether the stiffnesses are known: changes are fed forward then."""
    delay: float
    """Longest of reading and drive together, s."""
    lag: float
    """Usual one, s."""
    speed: float
    """m/s."""
    acceleration: float
    """m/s^2."""
    unknown: Array
    """Standard deviation of the readings by the friction of the pulleys, as a share, (n,)."""
    slack: float
    """Force below which a cable that was taut is slack or broken, N."""
    check: BalanceCheck | None
    """By which readings that contradict the weight trip the bench; None where they do not."""


@dataclass(frozen=True)
class PathForces:
    """Planned cable forces along a motion, at k equal steps of time."""

    clock: PathTime
    step: float
    """s."""
    force: Array
    """(k, n), N."""
    balanced: Array
    """Projections on the forces that balance each other, (k, n, n)."""
    feeds: bool
    """Whether their elongation is to be fed forward: the motor angles of the plan have none."""

    @property
    def rate(self) -> Array:
        """Rate of the forces, (n,), N/s."""
        first = min(self.index(0.0), len(self.force) - 2)
        change = (self.force[first + 1] - self.force[first]) / self.step
        return np.asarray(change * (0.0 if self.clock.ended else self.clock.rate))

    def index(self, late: float) -> int:
        """Step of the present time along the motion, less ``late`` s."""
        index = int((self.clock.now - late * self.clock.rate) / self.step)
        return max(0, min(index, len(self.force) - 1))


class ForceLoop:
    """Winding speeds by the cable forces; a loop of a correction."""

    def __init__(
        self,
        setting: ForceSetting,
        readings: Callable[[float], Array],
        latch: Latch,
        path: PathForces | None = None,
    ) -> None:
        """Take ``readings`` of the forces at a time (s), (n,), NaN without a valid one; with a
        ``path`` the set-point is the planned one of the present place."""
        self.setting = setting
        self.force = setting.force
        """Set-point, (n,), N."""
        self._readings, self._latch, self._path = readings, latch, path
        self._aimed: Array | None = None
        self._change = np.zeros_like(setting.force)
        self._ramp: Trajectory | None = None
        self._begun = 0.0
        self.error = self._change
        """Missing forces that balance each other, beyond what friction explains, (n,), N."""
        self._errors: deque[Array] = deque(maxlen=_SHOWN)
        self._check = setting.check
        self._taut = np.zeros(len(setting.names), dtype=bool)
        self._slack_since = self._seen = math.inf
        self._deviation: Array | None = None

    @property
    def mean_error(self) -> Array:
        """Mean of the newest 50 of :attr:`error`, (n,); zero before the first."""
        return np.asarray(np.mean(list(self._errors) or [self.error], axis=0))

    def aim(self, force: Array, check: BalanceCheck | None = None) -> None:
        """Take a set-point, (n,), N, with its check from the next cycle on; from any thread."""
        self._check = check or self._check
        self.force = force

    def left(self, index: int) -> str:
        """Force that is missing in a cable."""
        return f"{self.error[index]:+.1f} N"

    def speeds(self, time: float, now: float, _wound: Array) -> Array | None:
        """Winding speeds (n,), m/s; None without all readings."""
        shown = self._readings(now)
        if not np.isfinite(shown).all():
            return None
        setting, force, projection, place = self.setting, self.force, self.setting.balanced, 0
        if self._path is not None:
            place = self._path.index(setting.lag)
            force, projection = self._path.force[place], self._path.balanced[place]
        elif force is not self._aimed:
            self._begin(time, force, shown)
        if self._check is not None:
            self._watch(now, self._check, place, shown, force)
        balanced = projection @ (force - shown)
        self.error = self._beyond(
            balanced - self._change * (1.0 - self._share(time - setting.lag)[0]), projection, shown
        )
        self._errors.append(self.error)
        feed = self._change * self._share(time)[1]
        if self._path is not None and self._path.feeds and setting.known:
            feed = self._path.rate
        return np.asarray((feed + LOOP / setting.delay * self.error) / setting.stiffness)

    def _begin(self, time: float, force: Array, shown: Array) -> None:
        """Plan the change from the forces of now."""
        setting = self.setting
        rest = self._change * (1.0 - self._share(time)[0])
        if self._aimed is None:
            change = setting.balanced @ (force - shown)
            change = self._beyond(change, setting.balanced, shown)
        else:
            change = setting.balanced @ (force - self._aimed)
        self._aimed, self._begun = force, time
        if not setting.known:
            return
        self._change = change + rest
        way = float(np.abs(self._change / setting.stiffness).max())
        if way > 0.0:
            acceleration = _FEED * setting.acceleration
            self._ramp = plan(way, _FEED * setting.speed, acceleration, acceleration / _RISE)

    def _beyond(self, error: Array, projection: Array, shown: Array) -> Array:
        """What of an error (n,) the friction of the pulleys does not explain, shortened by it."""
        variance = float(np.diag(projection) @ (self.setting.unknown * shown) ** 2)
        size = float(np.linalg.norm(error))
        return error * max(0.0, 1.0 - _EXPLAINED * variance**0.5 / size) if size else error

    def _share(self, time: float) -> tuple[float, float]:
        """Share of the change that is made at a time (s), and its rate, 1/s."""
        if self._ramp is None:
            return 1.0, 0.0
        way, speed, _ = self._ramp.at(max(0.0, time - self._begun))
        return float(way) / self._ramp.distance, float(speed) / self._ramp.distance

    def _watch(
        self, now: float, check: BalanceCheck, place: int, shown: Array, force: Array
    ) -> None:
        """Trip where readings contradict the weight, or a cable has become slack."""
        slack = self._taut & (shown < self.setting.slack)
        self._taut |= shown >= self.setting.slack
        self._slack_since = min(self._slack_since, now) if slack.any() else math.inf
        if now - self._slack_since >= _SLACK_TIME:
            worst = int(np.argmin(np.where(slack, shown, math.inf)))
            words = (
                f"the cable force is {shown[worst]:.1f} N, below {self.setting.slack:.1f} N (half "
                f"of the lower limit `tension` of [robot]) for {_SLACK_TIME:g} s, planned is "
                f"{force[worst]:.1f} N; look for a broken or slack cable and a wrong load cell, "
                "then reset"
            )
            self._latch(Trip("cable forces", check.names[worst], words, latches=True))
        deviation = shown - force
        low = deviation if self._deviation is None else self._deviation
        low = low + (1.0 - math.exp(min(0.0, self._seen - now) / _LOW_PASS)) * (deviation - low)
        self._deviation, self._seen = low, now
        if check.size(place, low) > MOST:
            name, found = check.words(place, deviation)
            words = f"{found}; look for it, then reset"
            self._latch(Trip("cable forces", name, words, latches=True))
