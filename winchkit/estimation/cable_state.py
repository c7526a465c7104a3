"""State of the cable sample by sample: true length and tension from a winch's signals, for control.

The effects of a profile are functions of whole runs. Here each is evaluated on two samples, the
previous and the new one; an effect with memory starts in the state at the end of the previous
sample (``Effect.carry``). Each formula is written once, and both evaluations agree.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from math import exp, isfinite, isnan, nan
from typing import Any

import numpy as np

from winchkit.effects.term import Term, act, modifiers_of
from winchkit.model.line import Line
from winchkit.model.stages import At, Modifier, Stage
from winchkit.schema.profiles.winch import WinchProfile

_LOW_PASS = 0.2
"""Time constant of the low-pass of the tension, s: well below the period of a swinging load."""
_DEAD_BAND = 3e-3
"""Dead band of the tension as a share of it: friction with hysteresis is erased by noise."""
_SHORTEST = 1e-4
"""Least step in time, s."""
_JUMP = 1.0
"""Change of the motor angle that its rate does not explain: a new zero instead of motion, rad."""
_USUAL = 20.0
"""Temperature where none is measured, at which every thermal effect is zero, °C."""
_CLOSE_ENOUGH = 1e-3
"""Tolerance of the cell's reading when solving for the tension, N."""


@dataclass(frozen=True, slots=True)
class Sample:
    """Signals of a winch at one time; SI, NaN where there is no instrument."""

    time: float
    motor_angle: float
    motor_rate: float
    cell: float = nan
    load: float = nan
    temperature: float = nan


@dataclass(frozen=True, slots=True)
class CableState:
    """Estimated state of the cable."""

    length: float
    """True cable length, m."""
    tension: float
    """At the platform end, low-passed, N; the last known one without an instrument."""
    correction: float
    """Tension at the platform end less the cell's reading, N; 0 where the cell is not corrected."""


@dataclass
class _TermWithMemory:
    """A term with the state of its memory, by pulley."""

    term: Term
    start: dict[int, float] = field(default_factory=dict)
    end: dict[int, float] = field(default_factory=dict)

    def modifier(self) -> Modifier:
        return Modifier(self.term.effect.stage, self._apply, self.term.effect.order)

    def _apply(self, value: Any, at: At) -> Any:
        effect, values = self.term.effect, self.term.values
        if effect.carry is None:
            return act(effect, values, value, at)
        begun = self.start.get(at.pulley, effect.rested)
        values = {**values, "start": begun}
        after = act(effect, values, value, at)
        self.end[at.pulley] = effect.carry(after, value, at, values)
        return after

    def take_over(self) -> None:
        """Take over the state at the end of this sample as the start of the next."""
        self.start.update(self.end)


def _on_length(term: Term) -> bool:
    return term.effect.stage <= Stage.FRAME


class CableEstimator:
    """State of the cable of one winch, updated sample by sample."""

    def __init__(
        self, profile: WinchProfile, terms: Iterable[Term], weight: float | None = None
    ) -> None:
        """Take a profile and its effects.

        ``weight``: load where no instrument measures one, N.
        """
        used = [term for term in terms if not term.effect.not_in_control]
        self.at_rest = Line(profile, modifiers_of(t for t in used if not t.effect.memory))
        """The line without effects that have a memory, for planning."""
        self.yields = any(
            _on_length(t) and (t.effect.memory or t.effect.stage >= Stage.CABLE) for t in used
        )
        """Whether the length depends on more than the motor angle."""
        self._terms = [_TermWithMemory(term) for term in used]
        self._line = Line(profile, tuple(item.modifier() for item in self._terms))
        self._on_tension = any(Stage.CABLE_WEIGHT <= t.effect.stage <= Stage.CELL for t in used)
        self.trivial = not (self.yields or self._on_tension)
        """Whether ``at_rest`` is exact: length by the motor angle alone, cell not corrected."""
        self._weight = weight or 0.0
        self._last: Sample | None = None
        self._low_passed = self._reading = nan
        self._tension = nan

    def update(self, sample: Sample) -> CableState:
        """Update with one sample.

        Returns: True length, tension and correction of the cell.
        """
        before = self._before(sample)
        step = max(sample.time - before.time, _SHORTEST)
        measured = sample.load if isfinite(sample.load) else sample.cell
        reading = self._filtered(measured, step)
        last = self._tension if isfinite(self._tension) else nan
        correction = 0.0
        if isnan(reading):
            tension = self._weight
        elif isfinite(sample.load) or not self._on_tension:
            tension = reading
        else:
            tension = self._at_platform(self._moments(before, sample, step, last, reading), reading)
            correction = tension - reading
        at = self._moments(before, sample, step, last, tension)
        length = float(self._line.lengths(at)[-1])
        for item in self._terms:
            item.take_over()
        self._last, self._tension, self._reading = sample, tension, reading
        return CableState(length, tension, correction)

    def _before(self, sample: Sample) -> Sample:
        """Previous sample; a restart where the motor angle jumped without motion."""
        last = self._last
        if last is None:
            return sample
        turned = (sample.time - last.time) * (sample.motor_rate + last.motor_rate) / 2
        missing = abs(sample.motor_angle - last.motor_angle - turned)
        if missing <= _JUMP + abs(turned):
            return last
        return Sample(last.time, sample.motor_angle, sample.motor_rate)

    def _filtered(self, measured: float, step: float) -> float:
        """Low-passed reading with a dead band."""
        if not isfinite(measured):
            return self._reading
        if isnan(self._low_passed):
            self._low_passed = measured
            return measured
        self._low_passed += (measured - self._low_passed) * (1 - exp(-step / _LOW_PASS))
        moved = abs(self._low_passed - self._reading) > _DEAD_BAND * abs(self._low_passed)
        return self._low_passed if moved or isnan(self._reading) else self._reading

    def _at_platform(self, at: At, reading: float) -> float:
        """Tension at the platform end at a ``reading`` of the cell, by two secant steps."""
        begun = isfinite(self._tension) and isfinite(self._reading)
        guess = self._tension + reading - self._reading if begun else reading
        shown = self._shown(at, guess)
        miss = reading - shown
        if abs(miss) < _CLOSE_ENOUGH:
            return guess
        slope = (self._shown(at, guess + miss) - shown) / miss
        solved = guess + miss / slope if slope > 0 else guess + miss
        self._shown(at, solved)
        return solved

    def _shown(self, at: At, load: float) -> float:
        first = self._tension if isfinite(self._tension) else load
        return float(self._line.readings(np.array([first, load]), at)[-1])

    def _moments(
        self, before: Sample, sample: Sample, step: float, last: float, tension: float
    ) -> At:
        first = tension if isnan(last) else last
        warm = sample.temperature if isfinite(sample.temperature) else _USUAL
        return self._line.moments(
            np.array([0.0, step]),
            np.array([before.motor_angle, sample.motor_angle]),
            np.array([sample.motor_rate, sample.motor_rate]),
            np.array([first, tension]),
            np.array([warm, warm]),
        )
