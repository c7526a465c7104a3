"""What every effect of the catalogue does to predictions, and what it must not do."""

from __future__ import annotations

from dataclasses import fields, is_dataclass

import numpy as np
import pytest

from effect_lines import DRUMS, EFFECTS, IDS, predict, profile_with, standard_on
from winchkit.effects import Effect, Term
from winchkit.effects.card import signature, usual_values
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.reference_motion import STANDARD_PROFILE, standard_motion
from winchkit.model.line import Line
from winchkit.model.stages import Modifier, Signals

NO_SLOPE_AT_NULL = {
    "gear-backlash",
    "guide-offset",
    "cable-elongation-quartic",
    "cable-hysteresis",
    "cable-sag",
}
LINEAR = {
    "layer-thickness",
    "drum-radius",
    "drum-eccentricity",
    "cable-elongation-linear",
    "cable-elongation-exponential",
    "cable-creep",
    "cable-thermal",
    "drum-winding-tension",
    "frame-compliance",
    "pulley-viscous",
    "pulley-inertia",
    "cable-weight",
    "cell-gain",
    "cell-offset",
    "cell-nonlinearity",
    "cell-drift",
    "cell-thermal",
    "cell-hysteresis",
    "cell-creep",
    "torque-constant",
    "motor-coulomb",
    "motor-coulomb-asymmetry",
    "motor-viscous",
    "motor-viscous-asymmetry",
    "motor-stribeck",
    "motor-dahl",
    "motor-cogging",
    "rotor-inertia",
    "joint-gravity",
    "drum-unbalance",
    "length-gain",
    "load-gain",
    "load-offset",
    "torque-saturation",
    "viscous-thermal",
    "load-lever",
    "spring-balancer",
    "torque-ripple",
    "friction-growth",
    "friction-at-place",
    "load-friction-at-place",
    "cell-crosstalk",
    "cell-clipping",
    "friction-of-transmission",
}

every_effect = pytest.mark.parametrize("effect", EFFECTS, ids=IDS)


@pytest.mark.parametrize("drum", DRUMS)
@every_effect
def test_it_vanishes_exactly_at_its_null(effect: Effect, drum: str) -> None:
    line, motion = standard_on(drum)
    bare = line.predict(motion)
    shapes = [{}, *Coordinates(effect).grid()]
    shapes += [{p.name: p.typical} for p in effect.parameters if p.role != "amplitude"]
    for shape in shapes:
        predicted = predict(line.profile, motion, effect, shape)
        for name, values in bare.items():
            assert np.array_equal(predicted[name], values), (name, shape)


@every_effect
def test_it_vanishes_exactly_under_a_known_weight_too(effect: Effect) -> None:
    line, motion = standard_on("spiral", load=None, load_mass=20.0)
    bare = line.predict(motion)
    predicted = predict(line.profile, motion, effect, {})
    for name, values in bare.items():
        assert np.array_equal(predicted[name], values), name


@every_effect
def test_it_changes_the_outputs_that_it_declares_and_no_other(effect: Effect) -> None:
    assert set(signature(effect).changes) == set(effect.outputs)


@every_effect
def test_it_changes_nothing_that_it_is_handed(effect: Effect) -> None:
    motion = standard_motion()
    seen: list[bool] = []

    def apply(value: object, at: object) -> object:
        for thing in (value, at):
            _freeze(thing)
        seen.append(True)
        return effect.apply(value, at, usual_values(effect))  # type: ignore[arg-type]

    modifier = Modifier(effect.stage, apply, effect.order)
    Line(STANDARD_PROFILE, (modifier,)).predict(motion)
    assert seen


def _freeze(thing: object) -> None:
    if isinstance(thing, np.ndarray):
        thing.setflags(write=False)
    elif is_dataclass(thing):
        for field in fields(thing):
            _freeze(getattr(thing, field.name))


@every_effect
def test_its_slope_at_null_agrees_with_its_secant(effect: Effect) -> None:
    """Linear ones exactly, other smooth ones in shape; the rest have probes."""
    line, motion = standard_on("archimedean")
    bare = line.predict(motion)
    coordinates = Coordinates(effect)
    smooth = effect.id not in NO_SLOPE_AT_NULL
    assert smooth == (not effect.probes)
    if not smooth:
        return
    base = effect.null | {p.name: p.typical for p in effect.parameters if p.role == "shape"}
    for usual_step in coordinates.usual_steps():
        whole = coordinates.vector(base | usual_step)
        null = coordinates.vector(base)
        step = 1e-3
        slightly = coordinates.values(null + step * (whole - null), base)
        near = predict(line.profile, motion, effect, slightly)
        far = predict(line.profile, motion, effect, base | usual_step)
        for name in effect.outputs:
            slope = (near[name] - bare[name]) / step
            chord = far[name] - bare[name]
            if effect.id in LINEAR:
                size = np.max(np.abs(chord))
                rounding = 1e-12 * np.max(np.abs(bare[name])) / step
                assert np.allclose(slope, chord, rtol=0, atol=1e-6 * size + rounding), name
            else:
                cosine = slope @ chord / np.sqrt((slope @ slope) * (chord @ chord))
                assert cosine > 0.9, (name, cosine)


@every_effect
def test_probes_and_secants_change_the_first_output(effect: Effect) -> None:
    motion = standard_motion()
    bare = Line(STANDARD_PROFILE).predict(motion)
    for probe in Coordinates(effect).usual_steps():
        predicted = predict(STANDARD_PROFILE, motion, effect, probe)
        assert np.any(predicted[effect.outputs[0]] != bare[effect.outputs[0]]), probe


@pytest.mark.parametrize("effect", [e for e in EFFECTS if e.memory], ids=lambda e: e.id)
def test_memory_starts_at_the_given_state(effect: Effect) -> None:
    start = effect.parameter("start")
    assert (start.role, start.null) == ("fixed", 0.0)
    motion = standard_motion()
    values = usual_values(effect)
    for other in (start.low, start.high):
        first = predict(STANDARD_PROFILE, motion, effect, values)[effect.outputs[0]]
        moved = predict(STANDARD_PROFILE, motion, effect, values | {"start": other})
        assert moved[effect.outputs[0]][0] != first[0]


def test_only_effects_with_memory_have_a_start() -> None:
    for effect in EFFECTS:
        assert effect.memory == any(p.name == "start" for p in effect.parameters)


@every_effect
def test_it_works_without_temperature_unless_it_needs_it(effect: Effect) -> None:
    line, motion = standard_on("spiral", temperature=None)
    predicted = predict(line.profile, motion, effect, usual_values(effect))
    first = predicted[effect.outputs[0]]
    assert np.all(np.isfinite(first)) == ("temperature" not in effect.needs)


@every_effect
def test_it_works_on_a_bare_drive_without_any_force(effect: Effect) -> None:
    line, motion = standard_on("spiral", load=None)
    predicted = predict(line.profile, motion, effect, usual_values(effect))
    assert "tension" not in predicted
    for values in predicted.values():
        assert np.all(np.isfinite(values))
    bare = line.predict(motion)
    blind = {"load", "cable_force"} & set(effect.needs)
    assert not blind or all(np.array_equal(predicted[name], bare[name]) for name in bare)


@pytest.mark.parametrize(
    "effect", [e for e in EFFECTS if "cable_length" in e.outputs], ids=lambda e: e.id
)
def test_length_and_its_inverse_at_rest(effect: Effect) -> None:
    values = usual_values(effect)
    values |= {"time": 1e4} if effect.id == "encoder-slip" else {}
    line = Line(profile_with("archimedean"), (Term(effect, values).modifier(),))
    for length in (1.5, 4.0, 5.9):
        angle = line.motor_angle(length, tension=200.0)
        assert line.cable_length(angle, tension=200.0) == pytest.approx(length, abs=1e-9)


def test_one_sample_and_two_samples_are_runs_too() -> None:
    for effect in EFFECTS:
        time = np.array([0.0, 0.02])
        signals = Signals(time, np.array([0.0, 0.1]), load=np.array([100.0, 101.0]), payload=5.0)
        motion = Line(STANDARD_PROFILE).motion(signals)
        predicted = predict(STANDARD_PROFILE, motion, effect, usual_values(effect))
        assert all(values.shape == (2,) for values in predicted.values())
