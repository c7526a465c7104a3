"""Every effect of the catalogue keeps what an effect promises."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from math import inf
from typing import get_args

import numpy as np
import pytest
from effect_lines import CATALOGUE, DRUMS, EFFECTS, IDS, predict, profile_with, standard_on

from winchkit.effects import Effect, Term
from winchkit.effects.card import signature, usual_values
from winchkit.effects.coordinates import Coordinates
from winchkit.effects.effect import Need
from winchkit.effects.standard import STANDARD_PROFILE, standard_motion
from winchkit.model.line import Line, Modifier, Signals
from winchkit.units import dimension_of

# Parameters with unit and null as the interface has them; "shape" where null is a default.
SHAPE = "shape"
INTERFACE: dict[str, dict[str, tuple[str, float | str]]] = {
    "drum-radius": {"radius_error": ("m", 0)},
    "gear-ratio": {"ratio_error": ("1", 0)},
    "layer-thickness": {"thickness_error": ("m", 0)},
    "drum-eccentricity": {"eccentricity": ("m", 0), "phase": ("rad", SHAPE)},
    "gear-backlash": {"gap": ("rad", 0)},
    "gear-transmission-error": {
        "amplitude": ("rad", 0),
        "phase": ("rad", SHAPE),
        "order": ("1", SHAPE),
    },
    "encoder-slip": {"step": ("rad", 0), "time": ("s", SHAPE)},
    "guide-offset": {"offset": ("m", 0), "mismatch": ("m", 0)},
    "cable-elongation-linear": {"axial_stiffness": ("N", inf)},
    "cable-elongation-quartic": {
        "k1": ("N", inf),
        "b2": ("1", 0),
        "b3": ("1", 0),
        "b4": ("1", 0),
    },
    "cable-elongation-exponential": {"strain_scale": ("1", 0), "force_scale": ("N", SHAPE)},
    "cable-hysteresis": {"stiffness": ("N", SHAPE), "fraction": ("1", 0)},
    "cable-creep": {"creep_stiffness": ("N", inf), "time_constant": ("s", SHAPE)},
    "cable-thermal": {"expansion": ("1/K", 0)},
    "cable-sag": {"mass_per_length": ("kg/m", 0)},
    "drum-winding-tension": {"fraction": ("1", 0)},
    "frame-compliance": {"stiffness": ("N/m", inf)},
    "length-time-offset": {"delay": ("s", 0)},
    "pulley-coulomb": {"friction": ("1", 0)},
    "pulley-viscous": {"viscosity": ("N s/m", 0)},
    "pulley-stribeck": {
        "coulomb": ("1", 0),
        "static": ("1", 0),
        "stribeck_speed": ("m/s", SHAPE),
    },
    "pulley-dahl": {"friction": ("1", 0), "stiffness": ("N/m", SHAPE), "shape": ("1", 1)},
    "pulley-capstan": {"friction": ("1", 0)},
    "pulley-inertia": {"equivalent_mass": ("kg", 0)},
    "cable-weight": {"mass_per_length": ("kg/m", 0)},
    "cell-gain": {"gain_error": ("1", 0)},
    "cell-offset": {"offset": ("N", 0)},
    "cell-nonlinearity": {"quadratic": ("N", 0)},
    "cell-drift": {"drift": ("N/s", 0)},
    "cell-thermal": {"sensitivity": ("N/K", 0)},
    "cell-lag": {"time_constant": ("s", 0)},
    "cell-hysteresis": {"fraction": ("1", 0)},
    "cell-creep": {"fraction": ("1", 0), "time_constant": ("s", SHAPE)},
    "torque-constant": {"gain_error": ("1", 0)},
    "gear-efficiency": {"efficiency": ("1", 1)},
    "motor-coulomb": {"torque": ("N m", 0)},
    "motor-coulomb-asymmetry": {"offset": ("N m", 0)},
    "motor-viscous": {"viscosity": ("N m s", 0)},
    "motor-stribeck": {"torque": ("N m", 0), "stribeck_speed": ("rad/s", SHAPE)},
    "motor-cogging": {
        "amplitude": ("N m", 0),
        "phase": ("rad", SHAPE),
        "order": ("1", SHAPE),
    },
    "rotor-inertia": {"inertia": ("kg m^2", 0)},
    "torque-lag": {"time_constant": ("s", 0)},
}
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
    "motor-stribeck",
    "motor-cogging",
    "rotor-inertia",
}

every_effect = pytest.mark.parametrize("effect", EFFECTS, ids=IDS)


def test_the_catalogue_has_every_effect_of_the_interface_and_no_other() -> None:
    assert set(IDS) == set(INTERFACE)
    assert len(IDS) == len(set(IDS))


@every_effect
def test_parameters_have_the_names_units_and_nulls_of_the_interface(effect: Effect) -> None:
    found = {p.name: p for p in effect.parameters if p.name != "start"}
    wanted = INTERFACE[effect.id]
    assert set(found) == set(wanted)
    for name, (unit, null) in wanted.items():
        assert found[name].unit == unit
        if null != SHAPE:
            assert found[name].null == null


@every_effect
def test_numbers_of_parameters_are_sane(effect: Effect) -> None:
    for p in effect.parameters:
        assert dimension_of(p.unit) is not None
        assert p.low <= p.null <= p.high
        assert p.low <= p.typical <= p.high
        assert 0 < abs(p.typical) < inf
        assert p.typical != p.null or p.role != "amplitude"
        assert p.reciprocal == (p.null == inf)
        assert all(p.low <= x <= p.high for x in p.grid)
        assert len(p.grid) == 0 or p.role == "shape"
        if p.whole:
            assert p.grid
            assert all(x == int(x) >= 1 for x in p.grid)
    for probe in effect.probes:
        for name, value in probe.items():
            assert effect.parameter(name).low <= value <= effect.parameter(name).high
    assert any(p.role == "amplitude" for p in effect.parameters)


@pytest.mark.parametrize(
    "chain",
    [
        "cell-gain cell-offset cell-nonlinearity cell-drift cell-thermal cell-lag",
        "gear-ratio gear-backlash encoder-slip",
        "pulley-coulomb cell-gain",
        "gear-efficiency torque-constant motor-coulomb torque-lag",
        "cable-elongation-linear frame-compliance length-time-offset",
    ],
)
def test_effects_act_in_the_order_of_the_interface(chain: str) -> None:
    places = [(CATALOGUE[name].stage, CATALOGUE[name].order) for name in chain.split()]
    assert places == sorted(set(places))


@every_effect
def test_words_are_complete(effect: Effect) -> None:
    for text in (effect.what, effect.looks_like, effect.told_apart):
        assert text[0].isupper()
        assert text.endswith(".")
    assert effect.formula
    assert effect.source
    assert set(effect.needs) <= set(get_args(Need))
    assert effect.id not in effect.confused_with
    assert all(name in CATALOGUE for name in effect.confused_with)
    for name in effect.contains:
        assert effect.family
        assert CATALOGUE[name].family == effect.family
    assert effect.repeatable == any(p.whole for p in effect.parameters)
    if effect.polar:
        size, phase = map(effect.parameter, effect.polar)
        assert size.low == 0.0
        assert phase.unit == "rad"


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
    for secant in coordinates.secants():
        whole = coordinates.vector(base | secant)
        null = coordinates.vector(base)
        step = 1e-3
        slightly = coordinates.values(null + step * (whole - null), base)
        near = predict(line.profile, motion, effect, slightly)
        far = predict(line.profile, motion, effect, base | secant)
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
    for probe in Coordinates(effect).secants():
        predicted = predict(STANDARD_PROFILE, motion, effect, probe)
        assert np.any(predicted[effect.outputs[0]] != bare[effect.outputs[0]]), probe


@every_effect
def test_coordinates_and_values_are_inverse(effect: Effect) -> None:
    coordinates = Coordinates(effect)
    values = effect.null | {
        p.name: p.typical for p in effect.parameters if p.role != "fixed" and not p.whole
    }
    back = coordinates.values(coordinates.vector(values), values)
    for name, value in values.items():
        assert back[name] == pytest.approx(value, rel=1e-12)
    nothing = coordinates.values(coordinates.vector(effect.null), effect.null)
    for p in coordinates.amplitudes:
        if not effect.polar or p.name not in effect.polar:
            assert nothing[p.name] == p.null
    low, high = coordinates.bounds()
    assert np.all(low <= coordinates.vector(effect.null))
    assert np.all(coordinates.vector(effect.null) <= high)


@pytest.mark.parametrize("effect", [e for e in EFFECTS if e.memory], ids=lambda e: e.id)
def test_memory_starts_where_it_is_told(effect: Effect) -> None:
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
    blind = {"load", "rope_force"} & set(effect.needs)
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
        signals = Signals(time, np.array([0.0, 0.1]), load=np.array([100.0, 101.0]))
        motion = Line(STANDARD_PROFILE).motion(signals)
        predicted = predict(STANDARD_PROFILE, motion, effect, usual_values(effect))
        assert all(values.shape == (2,) for values in predicted.values())
