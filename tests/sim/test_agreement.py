"""Two implementations of one physics: the plant in time steps, the catalogue over arrays.

Each piece of the plant's physics that the catalogue knows is predicted by the catalogue's effect
with the same numbers; what is left must lie far below the bench's noise.
"""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from winchkit.catalog import find
from winchkit.effects.catalogue import load_catalogue
from winchkit.effects.term import Term, modifiers_of
from winchkit.model.line import Line
from winchkit.model.stages import Signals
from winchkit.schema.read import read_programme, read_simbench
from winchkit.schema.simbench import NoiseSpec
from winchkit.sim.bench import hiding, profiles_of, programme_path
from winchkit.sim.physics.parameters import number_names
from winchkit.sim.physics.table import PHYSICS
from winchkit.sim.record import simulate

LEFT = 0.3
"""Rms that may be left, in units of the noise."""
OUTPUTS = ("cable_length", "tension", "motor_torque")


@dataclass(frozen=True)
class Pair:
    """A piece of physics and the effect that describes it."""

    physics: str
    effect: str
    bench: str = "spiral-bench"
    names: dict[str, str] = field(default_factory=dict)
    shows: float = 0.7
    """Rms of what the nominal model leaves, in units of the noise, at least."""


PAIRS = [
    Pair("fat drum", "drum-radius"),
    Pair("wrong ratio", "gear-ratio"),
    Pair("thick layers", "layer-thickness", names={"growth_error": "thickness_error"}),
    Pair("slip", "encoder-slip"),
    Pair("eccentric drum", "drum-eccentricity"),
    Pair("guide offset", "guide-offset", bench="grooved-bench"),
    Pair("elastic rope", "cable-elongation-linear"),
    Pair("soft frame", "frame-compliance"),
    Pair("creeping rope", "cable-creep"),
    Pair("lagging rope", "cable-hysteresis", names={"axial_stiffness": "stiffness"}, shows=0.2),
    Pair("warm rope", "cable-thermal", shows=0.3),
    Pair("heavy rope", "cable-weight"),
    Pair("sticky pulleys", "pulley-coulomb"),
    Pair("presliding pulleys", "pulley-dahl"),
    Pair("viscous pulleys", "pulley-viscous"),
    Pair("creep-sticky pulleys", "pulley-stribeck"),
    Pair("heavy pulleys", "pulley-inertia"),
    Pair("stretched cell", "cell-gain"),
    Pair("shifted cell", "cell-offset"),
    Pair("bent cell", "cell-nonlinearity"),
    Pair("drifting cell", "cell-drift"),
    Pair("warm cell", "cell-thermal"),
    Pair("slow cell", "cell-lag"),
    Pair("lossy gear", "gear-efficiency"),
    Pair("motor drag", "motor-coulomb"),
    Pair("motor grease", "motor-viscous"),
    Pair("one-way grease", "motor-viscous-asymmetry"),
    Pair("motor stiction", "motor-stribeck"),
    Pair("presliding motor", "motor-dahl"),
    Pair("cogging", "motor-cogging"),
    Pair("heavy rotor", "rotor-inertia"),
    Pair("weak motor", "torque-constant"),
    Pair("slow torque", "torque-lag"),
    Pair("unbalanced drum", "drum-unbalance"),
    Pair("hanging joint", "joint-gravity"),
    Pair("balancer", "spring-balancer"),
    Pair("growing drag", "friction-growth"),
    Pair("rough place", "friction-at-place"),
    Pair("sticky place", "load-friction-at-place", names={"at": "place"}),
    Pair("rippled motor", "torque-ripple"),
    Pair("load lever", "load-lever"),
    Pair("leaking current", "cell-crosstalk"),
    Pair("clipping cell", "cell-clipping"),
    Pair("late length", "length-time-offset"),
]


def has_known_direction(rate: np.ndarray) -> np.ndarray:
    """Samples at rest or above 1 rad/s of the motor.

    Between them the plant knows the direction, and a run of finite rate only about when it changes.
    """
    return (np.abs(rate) > 1.0) | (np.abs(rate) < 1e-6)


def misses(pair: Pair) -> tuple[dict[str, float], dict[str, float]]:
    """Rms of the error in units of the noise, of the nominal model and with the effect."""
    bench = read_simbench(find("sim", pair.bench))
    noise = bench.noise
    warming = {"A": replace(bench.truth["A"], temperature_drift=600.0)}
    bench = hiding(replace(bench, noise=NoiseSpec(), truth=warming), [pair.physics])
    profiles = profiles_of(bench)
    programme = replace(read_programme(programme_path("programme-demo")), repeat=1)
    runs = list(simulate(bench, profiles, programme))
    kind = PHYSICS[pair.physics]
    numbers = {pair.names.get(name, name): getattr(kind(), name) for name in number_names(kind)}
    effect = load_catalogue()[pair.effect]
    assert set(numbers) <= set(effect.null)
    modifiers = modifiers_of([Term(effect, effect.null | numbers)])
    found = []
    for line in (Line(profiles["A"]), Line(profiles["A"], modifiers)):
        errors: dict[str, list[np.ndarray]] = {name: [] for name in OUTPUTS}
        for run in runs:
            signals = Signals(
                run.time,
                run["motor_angle"],
                load_mass=run.load_mass,
                temperature=run["temperature"],
                motor_torque=run["motor_torque"],
            )
            motion = line.motion(signals)
            predicted = line.predict(motion)
            sure = has_known_direction(motion.at.motor_rate)
            for name in OUTPUTS:
                errors[name].append((run[name] - predicted[name])[sure])
        found.append(
            {
                name: float(np.std(np.concatenate(error)) / getattr(noise, name))
                if name == "cable_length"
                else float(np.sqrt(np.mean(np.concatenate(error) ** 2)) / getattr(noise, name))
                for name, error in errors.items()
            }
        )
    return found[0], found[1]


@pytest.mark.slow
@pytest.mark.parametrize("pair", PAIRS, ids=lambda pair: pair.physics)
def test_the_catalogue_describes_the_plant(pair: Pair) -> None:
    before, after = misses(pair)
    assert max(before.values()) >= pair.shows
    assert max(after.values()) <= LEFT
    assert max(after.values()) < max(before.values())
