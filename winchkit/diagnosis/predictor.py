"""Predicts one run for many hypotheses: what one shares with the last few is not computed again.

A candidate on the motor's torque leaves the rope's way as it is, and a derivative by one unknown
moves one part of the line only. So every part is kept with the terms that it came from.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from winchkit.diagnosis.dataset import Recording
from winchkit.diagnosis.spectrum import to_frequency
from winchkit.effects.bind import Term, modifiers_of
from winchkit.model.line import Line
from winchkit.model.stages import Stage, Way
from winchkit.schema.winch import WinchProfile

__all__ = ["Predictor", "masked"]

Array = NDArray[np.float64]
Part = TypeVar("Part")
_KEPT = 3
"""The hypothesis at hand, the one moved from it, and the one it came from."""
_WAY = (Stage.DRUM_ANGLE, Stage.DRUM, Stage.WOUND)
_FORCE = (Stage.ROPE_WEIGHT, Stage.PULLEY)
_SHOWN = {
    "cable_length": (Stage.ROPE, Stage.FRAME, Stage.LENGTH_INSTRUMENT),
    "tension": (Stage.CELL,),
    "motor_torque": (Stage.GEARBOX, Stage.TORQUE_CONSTANT, Stage.MOTOR, Stage.TORQUE_SIGNAL),
}


class Predictor:
    """What hypotheses change in the outputs of one recording."""

    def __init__(self, profile: WinchProfile, recording: Recording) -> None:
        self._profile = profile
        self._recording = recording
        self._motion = recording.smooth
        self._kept: dict[str, OrderedDict[Hashable, Any]] = {}
        # A measured load does not care how the rope is paid out; a known weight does.
        force = _FORCE if self._motion.load_mass is None else _WAY + _FORCE
        self._stages = {
            "way": _WAY,
            "force": force,
            "cable_length": _WAY + _SHOWN["cable_length"],
            "tension": force + _SHOWN["tension"],
            "motor_torque": _WAY + force + _SHOWN["motor_torque"],
        }

    def change(self, output: str, terms: Sequence[Term]) -> Array:
        """Coefficients of what the terms change in an output, (kept,); zero where not compared."""

        def compute() -> Array:
            recording = self._recording
            moved = self._shown(output, terms) - recording.nominal_smooth[output]
            return masked(recording, output, moved)

        return self._remembered(output, terms, compute)

    def _shown(self, output: str, terms: Sequence[Term]) -> Array:
        line, at, way = self._line(terms), self._motion.at, self._way(terms)
        if output == "cable_length":
            return line.shown_length(at, way)
        if output == "tension":
            return line.shown_tension(at, self._force(terms))
        return line.shown_torque(at, way, self._force(terms))

    def _way(self, terms: Sequence[Term]) -> Way:
        def compute() -> Way:
            return self._line(terms).way(self._motion.at)

        return self._remembered("way", terms, compute)

    def _force(self, terms: Sequence[Term]) -> Array:
        def compute() -> Array:
            return self._line(terms).drum_side(self._motion, self._way(terms))

        return self._remembered("force", terms, compute)

    def _line(self, terms: Sequence[Term]) -> Line:
        return Line(self._profile, modifiers_of(terms))

    def _remembered(self, part: str, terms: Sequence[Term], compute: Callable[[], Part]) -> Part:
        """A part of the prediction from the terms that act on it, computed or kept."""
        stages = self._stages[part]
        key = tuple(
            (term.effect.id, *term.values.items()) for term in terms if term.effect.stage in stages
        )
        kept = self._kept.setdefault(part, OrderedDict())
        if key not in kept:
            kept[key] = compute()
            if len(kept) > _KEPT:
                kept.popitem(last=False)
        kept.move_to_end(key)
        found: Part = kept[key]
        return found


def masked(recording: Recording, output: str, signal: Array) -> Array:
    """Coefficients of a signal within its band, zero where the output is not compared, (kept,)."""
    return to_frequency(np.where(recording.valid[output], signal, 0.0), recording.bands[output])
