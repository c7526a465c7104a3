"""Prediction of one run for many hypotheses, with a cache of the stages that they share.

An effect on the motor torque leaves the cable's path unchanged, and a derivative by one unknown
changes one part of the line: every stage is cached by the effects that act on it.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.data.dataset import Recording
from winchkit.diagnosis.data.spectrum import to_frequency
from winchkit.effects.term import Term, modifiers_of
from winchkit.model.line import Line, Motion
from winchkit.model.stages import Stage, WinchKinematics
from winchkit.schema.profiles.winch import WinchProfile

Part = TypeVar("Part")
Correction = float | None
"""Discretisation correction of a known weight's force; None for no correction."""
_KEPT = 3
"""Entries per stage: the present hypothesis, the one of a derivative, and the previous one."""
_KINEMATICS = (Stage.DRUM_ANGLE, Stage.DRUM, Stage.WOUND)
_FORCE = (Stage.CABLE_WEIGHT, Stage.PULLEY)
_INDICATED = {
    "cable_length": (Stage.CABLE, Stage.FRAME, Stage.LENGTH_INSTRUMENT),
    "tension": (Stage.CELL,),
    "motor_torque": (Stage.GEARBOX, Stage.MOTOR, Stage.TORQUE_CONSTANT, Stage.TORQUE_SIGNAL),
}


class Predictor:
    """Change of the outputs of one run by the effects of a hypothesis."""

    def __init__(self, profile: WinchProfile, recording: Recording) -> None:
        self._profile = profile
        self._recording = recording
        self._kept: dict[str, OrderedDict[Hashable, Any]] = {}
        # A measured load does not depend on the cable's path; a known weight's force does.
        moved = _FORCE if recording.smooth.load_mass is None else _KINEMATICS + _FORCE
        source = (Stage.CELL if recording.smooth.at.reads_cell else Stage.LOAD,)
        kinematics, force = source + _KINEMATICS, source + moved
        self._stages: dict[str, tuple[Stage, ...]] = {
            "motion": (),
            "nominal": (),
            "kinematics": kinematics,
            "force": force,
            "cable_length": kinematics + _INDICATED["cable_length"],
            "tension": force + _INDICATED["tension"],
            "motor_torque": kinematics + force + _INDICATED["motor_torque"],
        }

    def outputs_of(self, stage: Stage) -> set[str]:
        """Outputs that a stage acts on."""
        return {output for output in _INDICATED if stage in self._stages[output]}

    def change(self, output: str, terms: Sequence[Term], correction: Correction = None) -> Array:
        """Coefficients of the change of an output, shape (n_kept,); zero where not compared."""

        def compute() -> Array:
            moved = self._shown(output, terms, correction) - self._nominal(correction)[output]
            return masked(self._recording, output, moved)

        return self._cached(output, terms, correction, compute)

    def _motion(self, correction: Correction) -> Motion:
        smooth = self._recording.smooth
        if correction is None:
            return smooth
        return self._cached("motion", (), correction, lambda: _corrected(smooth, correction))

    def _nominal(self, correction: Correction) -> Mapping[str, Array]:
        if correction is None:
            return self._recording.nominal_smooth

        def compute() -> Mapping[str, Array]:
            return self._line(()).predict(self._motion(correction))

        return self._cached("nominal", (), correction, compute)

    def _shown(self, output: str, terms: Sequence[Term], correction: Correction) -> Array:
        line, at, kinematics = (
            self._line(terms),
            self._motion(correction).at,
            self._kinematics(terms),
        )
        if output == "cable_length":
            return line.indicated_length(at, kinematics)
        if output == "tension":
            return line.indicated_tension(at, self._force(terms, correction))
        return line.indicated_torque(at, kinematics, self._force(terms, correction))

    def _kinematics(self, terms: Sequence[Term]) -> WinchKinematics:
        def compute() -> WinchKinematics:
            return self._line(terms).kinematics(self._recording.smooth.at)

        return self._cached("kinematics", terms, None, compute)

    def _force(self, terms: Sequence[Term], correction: Correction) -> Array:
        def compute() -> Array:
            return self._line(terms).drum_side(self._motion(correction), self._kinematics(terms))

        return self._cached("force", terms, correction, compute)

    def _line(self, terms: Sequence[Term]) -> Line:
        return Line(self._profile, modifiers_of(terms))

    def _cached(
        self, part: str, terms: Sequence[Term], correction: Correction, compute: Callable[[], Part]
    ) -> Part:
        """A part of the prediction from the terms that act on it, computed or kept."""
        stages = self._stages[part]
        own = (
            (term.effect.id, *term.values.items()) for term in terms if term.effect.stage in stages
        )
        key = (correction, *own)
        kept = self._kept.setdefault(part, OrderedDict())
        if key not in kept:
            kept[key] = compute()
            if len(kept) > _KEPT:
                kept.popitem(last=False)
        kept.move_to_end(key)
        value: Part = kept[key]
        return value


def masked(recording: Recording, output: str, signal: Array) -> Array:
    """Coefficients of a signal within its band, zero where not compared, shape (n_kept,)."""
    return to_frequency(np.where(recording.valid[output], signal, 0.0), recording.bands[output])


def _corrected(motion: Motion, correction: float) -> Motion:
    """Motion with the discretisation error of a known weight's force corrected, on which hysteresis
    depends: the branch changes where the tension has its extremum."""
    if motion.load is None or motion.discretization is None:
        return motion
    load = motion.load + correction * motion.discretization
    # The error of a second difference over a span is span²/12 of the fourth derivative; that of a
    # simulation that differentiates twice over steps h is h²/3, the most that the line adds.
    if motion.clock.spline is not None:
        return replace(motion, at=replace(motion.at, tension=load), load=load)
    twice = 1 / (3 * motion.clock.reach**2)
    smoothed = float(np.clip((correction + 1 / 12) / twice, 0.0, 1.0))
    return replace(motion, at=replace(motion.at, tension=load), load=load, smoothed_share=smoothed)
