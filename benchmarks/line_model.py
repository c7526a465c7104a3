"""How long the line model takes for a million samples; prints JSON, exits 1 when too slow.

``python benchmarks/line_model.py``: the nominal line, and the line with effects that have no
memory, each on a spiral and on a grooved drum. The promise is 0.3 s for a prediction.
"""

from __future__ import annotations

import json
import sys
from math import pi
from time import perf_counter

import numpy as np

from winchkit.effects import Term, load_catalogue
from winchkit.model.line import Line
from winchkit.model.stages import Signals
from winchkit.schema.profiles.winch import (
    CableSpec,
    DrumSpec,
    GearboxSpec,
    PulleySpec,
    ReferenceSpec,
    WinchProfile,
)

SAMPLES = 1_000_000
LIMIT = 0.3
ROUNDS = 5
DRUMS = {
    "spiral": DrumSpec("spiral", 0.06),
    "grooved": DrumSpec("grooved", 0.06, groove_pitch=0.007),
}
EFFECTS = {
    "drum-radius": {"radius_error": 5e-4},
    "cable-elongation-linear": {"axial_stiffness": 2e5},
    "frame-compliance": {"stiffness": 2e5},
    "cell-gain": {"gain_error": 0.01},
    "torque-constant": {"gain_error": 0.02},
    "motor-viscous": {"viscosity": 1e-3},
}


def profile_with(drum: DrumSpec) -> WinchProfile:
    """A winch with two pulleys."""
    return WinchProfile(
        name="benchmark",
        drum=drum,
        gearbox=GearboxSpec(ratio=20.0),
        reference=ReferenceSpec(cable_length=10.0, wound_turns=4.0),
        cable=CableSpec(diameter=0.006, dead_length=1.5),
        pulley=(PulleySpec(0.04, pi / 2), PulleySpec(0.04, pi / 2)),
    )


def seconds_to_predict(line: Line, signals: Signals) -> float:
    """Fastest of several predictions along one run."""
    motion = line.motion(signals)
    rounds = []
    for _ in range(ROUNDS):
        start = perf_counter()
        line.predict(motion)
        rounds.append(perf_counter() - start)
    return min(rounds)


def main() -> int:
    """Measure, print, judge."""
    time = np.linspace(0.0, 4000.0, SAMPLES)
    signals = Signals(
        time=time,
        motor_angle=300.0 * np.sin(0.1 * time),
        load=200.0 + 20.0 * np.cos(0.1 * time),
    )
    catalogue = load_catalogue()
    terms = [Term(catalogue[name], values) for name, values in EFFECTS.items()]
    modifiers = tuple(term.modifier() for term in terms)
    seconds = {}
    for name, drum in DRUMS.items():
        profile = profile_with(drum)
        seconds[name] = seconds_to_predict(Line(profile), signals)
        seconds[f"{name}, {len(EFFECTS)} effects"] = seconds_to_predict(
            Line(profile, modifiers), signals
        )
    slowest = max(seconds.values())
    print(json.dumps({"schema": 1, "samples": SAMPLES, "limit": LIMIT, "seconds": seconds}))
    return 0 if slowest < LIMIT else 1


if __name__ == "__main__":
    sys.exit(main())
