"""Cable length and arm from the motor angle, fast enough for every control cycle."""

from __future__ import annotations

from math import isfinite, nan
from typing import NamedTuple

from winchkit.errors import FileError
from winchkit.estimation.cable_state import CableEstimator, Sample
from winchkit.model.line import Line

_FAR = 5e-3
"""Change of the cable length after which length and arm are computed again, m."""
_SOON = 0.02
"""Time after which tension and memory effects are computed again, s."""

_NEVER = (nan, (nan, nan))


class _Linearisation(NamedTuple):
    """Linearisation of the cable length at one motor angle."""

    angle: float = nan
    length: float = nan
    arm: float = nan


class _Evaluation(NamedTuple):
    """Contributions of the effects at their last evaluation."""

    time: float = nan
    angle: float = nan
    length: float = nan
    tension: float = nan


class CableMap:
    """Cable length, arm and tension near the last angle; a line model of its own.

    On the bare profile length and arm are renewed after every 5 mm of cable, within which the arm
    of a drum changes by far less than a thousandth. Where the profile has effects (``now``), they
    are evaluated with tension and history every 20 ms or 5 mm, whichever comes first.
    """

    def __init__(self, line: Line, now: CableEstimator | None = None) -> None:
        self._line, self._now = line, now
        self._nearby = _Linearisation()
        self._asked = _NEVER
        """The motor angle that :meth:`at` was asked for last, and its answer: several ask for the
        same in a cycle."""
        self._evaluated = _Evaluation()
        self.correction = 0.0
        """Tension at the platform end less the reading of the cell, N."""
        self.has_effects = now is not None
        """Whether effects of the profile are to be evaluated in every cycle."""
        self.failure: FileError | None = None
        """Fault of an effect of the profile; None while all can be evaluated."""

    @classmethod
    def of(cls, now: CableEstimator) -> CableMap:
        """The map of a profile with its effects, if it has any that control can use."""
        return cls(now.at_rest, None if now.trivial else now)

    @property
    def yields(self) -> bool:
        """Whether the length depends on more than the motor angle."""
        return self._now is not None and self._now.yields

    def update(self, sample: Sample) -> None:
        """Take the measurements of this cycle."""
        if self._now is None or not isfinite(sample.motor_angle):
            return
        last = self._evaluated
        moved = abs((sample.motor_angle - last.angle) * self._nearby.arm)
        if sample.time - last.time < _SOON and moved < _FAR:
            return
        try:
            state = self._now.update(sample)
        except FileError as error:
            self.failure = error
            return
        if not isfinite(state.length):
            self.failure = FileError(
                "the effects of the profile give no cable length (NaN) at motor angle "
                f"{sample.motor_angle:g} rad, {sample.cell:g} N; mend them or leave them out"
            )
            return
        arm = self._nearby.arm
        if not moved < _FAR:
            arm = self._line.arm(sample.motor_angle)
        self._evaluated = _Evaluation(sample.time, sample.motor_angle, state.length, state.tension)
        self.correction = state.correction
        self._nearby = _Linearisation(sample.motor_angle, state.length, arm)
        self._asked = _NEVER

    def at(self, motor_angle: float) -> tuple[float, float]:
        """Cable length (m) and arm (m/rad) at a motor angle (rad)."""
        asked, answer = self._asked
        if motor_angle == asked:
            return answer
        angle, length, arm = self._nearby
        change = (motor_angle - angle) * arm
        if -_FAR < change < _FAR or (self._now is not None and isfinite(change)):
            answer = (length - change, arm)
        else:
            answer = self._line.cable_length(motor_angle), self._line.arm(motor_angle)
            if self._now is None:
                self._nearby = _Linearisation(motor_angle, *answer)
        self._asked = (motor_angle, answer)
        return answer

    def cable_length(self, motor_angle: float) -> float:
        """Length at a motor angle under the present tension, m."""
        return self._pulled(motor_angle) + self._remembered()

    def motor_angle(self, cable_length: float) -> float:
        """Motor angle (rad) for a length under the present tension."""
        if self._now is None:
            return self._line.motor_angle(cable_length)
        return self._now.at_rest.motor_angle(cable_length - self._remembered(), self._force())

    def arm(self, motor_angle: float) -> float:
        """Cable wound in per motor angle, m/rad; that of an angle within 5 mm of cable."""
        angle, _, arm = self._nearby
        return arm if abs((motor_angle - angle) * arm) < _FAR else self._line.arm(motor_angle)

    def _pulled(self, motor_angle: float) -> float:
        if self._now is None:
            return self._line.cable_length(motor_angle)
        return self._now.at_rest.cable_length(motor_angle, self._force())

    def _force(self) -> float:
        return self._evaluated.tension if isfinite(self._evaluated.tension) else 0.0

    def _remembered(self) -> float:
        """Contribution of memory effects and temperature to the length, m."""
        last = self._evaluated
        return last.length - self._pulled(last.angle) if isfinite(last.length) else 0.0
