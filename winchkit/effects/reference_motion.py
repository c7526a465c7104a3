"""The standard motion: a winch and a run that excite every effect of the catalogue.

The run has a fast and a slow stroke under a light and then a heavy load, at rising temperature. The
signatures of cards are computed on it.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from math import pi

import numpy as np

from winchkit.arrays import Array
from winchkit.model.line import Line, Motion
from winchkit.model.stages import Signals
from winchkit.model.trajectory import plan
from winchkit.schema.profiles.winch import (
    CableSpec,
    DrumSpec,
    GearboxSpec,
    GuideSpec,
    PathSpec,
    PulleySpec,
    ReferenceSpec,
    WinchProfile,
)
from winchkit.units import GRAVITY

STANDARD_PROFILE = WinchProfile(
    name="standard",
    drum=DrumSpec(kind="spiral", winding_radius=0.06),
    gearbox=GearboxSpec(ratio=20.4),
    reference=ReferenceSpec(cable_length=6.0, wound_turns=4.3),
    cable=CableSpec(diameter=0.006, dead_length=1.5),
    path=PathSpec(inclination=pi / 3),
    guide=GuideSpec(screw_lead=0.006),
    pulley=(PulleySpec(0.04, pi / 2), PulleySpec(0.04, pi)),
)
_STEP = 0.02
"""s: 50 Hz, the usual rate of a cell's log; several samples in the shortest phase of the motion."""
_STROKE = 3.0
"""m: eight turns of the standard drum (0.38 m each), so that layers and turns show."""
_HOLD = 4.0
"""s at rest after a stroke: long enough for creep of seconds to show."""
_SPEEDS = 0.5, 0.12
"""m/s: a fast and a slow stroke, a factor of four apart, to separate viscous from Coulomb."""
_MASSES = 15.0, 45.0
"""kg: a third and the whole load, to separate errors in proportion to the load."""
_PAYLOAD = 5.0
"""kg on an axis without a cable: that of a small robot's arm."""
_WARM_FROM, _WARM_TO = 18.0, 26.0
"""Degrees Celsius: a morning in an unheated hall."""


@cache
def standard_motion() -> Motion:
    """The nominal line along the standard motion, sampled at 50 Hz."""
    length, mass = _ride()
    line = Line(STANDARD_PROFILE)
    time: Array = _STEP * np.arange(len(length), dtype=np.float64)
    unique, place = np.unique(length, return_inverse=True)
    angle = np.array([line.motor_angle(x) for x in unique.tolist()])[place]
    acceleration = np.gradient(np.gradient(length, time), time)
    signals = Signals(
        time=time,
        motor_angle=angle,
        load=mass * (GRAVITY - acceleration),
        payload=_PAYLOAD,
        temperature=np.linspace(_WARM_FROM, _WARM_TO, len(time)),
    )
    torque = line.predict(line.motion(signals))["motor_torque"]
    return line.motion(replace(signals, motor_torque=torque))


def _ride() -> tuple[Array, Array]:
    """Cable length and mass of the load per sample; the mass changes at standstill."""
    pieces: list[Array] = []
    here = STANDARD_PROFILE.reference.cable_length or 0.0
    for speed in _SPEEDS:
        for distance in (-_STROKE, _STROKE):
            move = plan(distance, speed, 0.5, 5.0)
            pieces.append(here + move.at(np.arange(0.0, move.duration + _HOLD, _STEP))[0])
            here += distance
    once = np.concatenate(pieces)
    samples = np.arange(2 * len(once)) - len(once)
    mass = np.interp(samples * _STEP, [-_HOLD / 2, 0.0], _MASSES)
    return np.tile(once, 2), mass
