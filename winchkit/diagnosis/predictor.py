"""Predicts one run for many hypotheses: what one shares with the last few is not computed again.

A candidate on the motor's torque leaves the rope's way as it is, and a derivative by one unknown
moves one part of the line only. So every part is kept with the terms that it came from.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from winchkit.diagnosis.dataset import Recording
from winchkit.diagnosis.spectrum import to_frequency
from winchkit.effects.bind import Term, modifiers_of
from winchkit.model.derivatives import span_of
from winchkit.model.line import Line, Motion
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
        self._kept: dict[str, OrderedDict[Hashable, Any]] = {}
        # A measured load does not care how the rope is paid out; a known weight does.
        force = _FORCE if recording.smooth.load_mass is None else _WAY + _FORCE
        self._stages: dict[str, tuple[Stage, ...]] = {
            "nominal": (),
            "way": _WAY,
            "force": force,
            "cable_length": _WAY + _SHOWN["cable_length"],
            "tension": force + _SHOWN["tension"],
            "motor_torque": _WAY + force + _SHOWN["motor_torque"],
        }

    def change(self, output: str, terms: Sequence[Term], sharper: float | None = None) -> Array:
        """Coefficients of what the terms change in an output, (kept,); zero where not compared.

        ``sharper`` is the share of its rounding that a known weight's force is given back: a loop
        that turns around where the rope is quickest to speed up depends on it.
        """

        def compute() -> Array:
            recording = self._recording
            motion = self._motion(sharper)
            moved = self._shown(output, motion, terms, sharper)
            return masked(recording, output, moved - self._nominal(motion, sharper)[output])

        return self._remembered(output, terms, sharper, compute)

    def _motion(self, sharper: float | None) -> Motion:
        smooth = self._recording.smooth
        if sharper is None or smooth.load is None or smooth.rounding is None:
            return smooth
        load = smooth.load + sharper * smooth.rounding
        # Differences of differences round by h²/3 of the fourth derivative, those here by span²/12.
        time = smooth.at.time
        most = (float(np.median(np.diff(time))) / span_of(time)) ** 2 / 3
        rounded = float(np.clip((sharper + 1 / 12) / most, 0.0, 1.0))
        return replace(smooth, at=replace(smooth.at, tension=load), load=load, rounded=rounded)

    def _nominal(self, motion: Motion, sharper: float | None) -> Mapping[str, Array]:
        def compute() -> Mapping[str, Array]:
            if motion is self._recording.smooth:
                return self._recording.nominal_smooth
            return self._line(()).predict(motion)

        return self._remembered("nominal", (), sharper, compute)

    def _shown(self, output: str, motion: Motion, terms: Sequence[Term], sharper: float | None) -> Array:
        line, at, way = self._line(terms), motion.at, self._way(terms)
        if output == "cable_length":
            return line.shown_length(at, way)
        if output == "tension":
            return line.shown_tension(at, self._force(motion, terms, sharper))
        return line.shown_torque(at, way, self._force(motion, terms, sharper))

    def _way(self, terms: Sequence[Term]) -> Way:
        def compute() -> Way:
            return self._line(terms).way(self._recording.smooth.at)

        return self._remembered("way", terms, None, compute)

    def _force(self, motion: Motion, terms: Sequence[Term], sharper: float | None) -> Array:
        def compute() -> Array:
            return self._line(terms).drum_side(motion, self._way(terms))

        return self._remembered("force", terms, sharper, compute)

    def _line(self, terms: Sequence[Term]) -> Line:
        return Line(self._profile, modifiers_of(terms))

    def _remembered(
        self, part: str, terms: Sequence[Term], sharper: float | None, compute: Callable[[], Part]
    ) -> Part:
        """A part of the prediction from the terms that act on it, computed or kept."""
        stages = self._stages[part]
        own = (
            (term.effect.id, *term.values.items()) for term in terms if term.effect.stage in stages
        )
        key = (sharper, *own)
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
