"""Every effect of the catalogue keeps what an effect promises."""

from __future__ import annotations

from math import inf
from typing import get_args

import numpy as np
import pytest

from effect_lines import CATALOGUE, EFFECTS, IDS
from winchkit.effects import Effect
from winchkit.effects.effect import Need
from winchkit.effects.parametrization import Coordinates
from winchkit.units import dimension_of

# Parameters with unit and null as the interface has them; "shape" where null is a default.
SHAPE = "shape"
INTERFACE: dict[str, dict[str, tuple[str, float | str]]] = {
    "drum-radius": {"radius_error": ("m", 0)},
    "gear-ratio": {"ratio_error": ("1", 0)},
    "layer-thickness": {"thickness_error": ("m", 0)},
    "drum-eccentricity": {"eccentricity": ("m", 0), "phase": ("rad", SHAPE)},
    "drum-roundness": {"amplitude": ("m", 0), "phase": ("rad", SHAPE), "lobes": ("1", SHAPE)},
    "pulley-eccentricity": {"amplitude": ("m", 0), "phase": ("rad", SHAPE), "pulley": ("1", SHAPE)},
    "gear-backlash": {"gap": ("rad", 0), "held": ("1", 1)},
    "gear-transmission-error": {
        "amplitude": ("rad", 0),
        "phase": ("rad", SHAPE),
        "order": ("1", SHAPE),
    },
    "encoder-slip": {"step": ("rad", 0), "time": ("s", SHAPE)},
    "guide-offset": {"offset": ("m", 0), "mismatch": ("m", 0)},
    "cable-elongation-linear": {"axial_stiffness": ("N", inf)},
    "cable-elongation-quartic": {"k1": ("N", inf), "b2": ("1", 0), "b3": ("1", 0), "b4": ("1", 0)},
    "cable-elongation-exponential": {"strain_scale": ("1", 0), "force_scale": ("N", SHAPE)},
    "cable-hysteresis": {"stiffness": ("N", SHAPE), "fraction": ("1", 0)},
    "cable-creep": {"creep_stiffness": ("N", inf), "time_constant": ("s", SHAPE)},
    "cable-thermal": {"expansion": ("1/K", 0)},
    "cable-sag": {"mass_per_length": ("kg/m", 0)},
    "drum-winding-tension": {"fraction": ("1", 0)},
    "frame-compliance": {"stiffness": ("N/m", inf)},
    "length-time-offset": {"delay": ("s", 0)},
    "length-gain": {"gain_error": ("1", 0)},
    "load-offset": {"mass": ("kg", 0)},
    "torque-saturation": {"cubic": ("N m", 0)},
    "viscous-thermal": {"viscosity_change": ("N m s", 0)},
    "load-gain": {"gain_error": ("1", 0)},
    "pulley-coulomb": {"friction": ("1", 0), "transition": ("m/s", 0)},
    "pulley-viscous": {"viscosity": ("N s/m", 0)},
    "pulley-stribeck": {
        "coulomb": ("1", 0),
        "static": ("1", 0),
        "stribeck_speed": ("m/s", SHAPE),
        "transition": ("m/s", 0),
    },
    "pulley-dahl": {"friction": ("1", 0), "stiffness": ("N/m", SHAPE), "shape": ("1", 1)},
    "pulley-capstan": {"friction": ("1", 0), "transition": ("m/s", 0)},
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
    "gear-efficiency": {"efficiency": ("1", 1), "transition": ("m/s", 0)},
    "gear-dahl": {"efficiency": ("1", 1), "distance": ("rad", SHAPE)},
    "motor-coulomb": {"torque": ("N m", 0), "transition": ("rad/s", 0)},
    "motor-coulomb-asymmetry": {"offset": ("N m", 0)},
    "motor-viscous": {"viscosity": ("N m s", 0)},
    "motor-viscous-asymmetry": {"viscosity_difference": ("N m s", 0)},
    "motor-stribeck": {
        "torque": ("N m", 0),
        "stribeck_speed": ("rad/s", SHAPE),
        "transition": ("rad/s", 0),
    },
    "motor-dahl": {"torque": ("N m", 0), "distance": ("rad", SHAPE)},
    "motor-cogging": {"amplitude": ("N m", 0), "phase": ("rad", SHAPE), "order": ("1", SHAPE)},
    "rotor-inertia": {"inertia": ("kg m^2", 0)},
    "torque-lag": {"time_constant": ("s", 0)},
    "torque-lead": {"lead": ("s", 0)},
    "prediction-delay": {"delay": ("s", 0)},
    "joint-gravity": {"amplitude": ("N m", 0), "phase": ("rad", SHAPE)},
    "joint-payload": {"lever": ("m", 0), "phase": ("rad", SHAPE)},
    "drum-unbalance": {"amplitude": ("N m", 0), "phase": ("rad", SHAPE)},
    "load-lever": {"amplitude": ("1", 0), "phase": ("rad", SHAPE)},
    "spring-balancer": {"stiffness": ("N m/rad", 0), "torque": ("N m", 0)},
    "torque-ripple": {"amplitude": ("1", 0), "phase": ("rad", SHAPE), "order": ("1", SHAPE)},
    "friction-growth": {"rate": ("N m/s", 0), "transition": ("rad/s", 0)},
    "friction-of-load": {"share": ("1", 0), "transition": ("rad/s", 0)},
    "friction-of-torque": {"share": ("1", 0), "transition": ("rad/s", 0)},
    "friction-of-transmission": {
        "share": ("1", 0),
        "inertia_share": ("1", SHAPE),
        "transition": ("rad/s", 0),
    },
    "stribeck-of-load": {
        "share": ("1", 0),
        "stribeck_speed": ("rad/s", SHAPE),
        "transition": ("rad/s", 0),
    },
    "friction-at-place": {
        "torque": ("N m", 0),
        "place": ("rad", SHAPE),
        "width": ("rad", SHAPE),
        "transition": ("rad/s", 0),
    },
    "load-viscous": {"viscosity": ("N s/m", 0)},
    "load-coulomb": {"force": ("N", 0), "transition": ("m/s", 0)},
    "load-friction-at-place": {
        "force": ("N", 0),
        "place": ("m", SHAPE),
        "width": ("m", SHAPE),
        "transition": ("m/s", 0),
    },
    "cell-crosstalk": {"share": ("N/(N m)", 0)},
    "cell-clipping": {"share": ("1", 0), "limit": ("N", SHAPE)},
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
        "prediction-delay joint-gravity friction-of-load motor-coulomb",
        "spring-balancer stribeck-of-load rotor-inertia",
        "gear-efficiency motor-coulomb torque-constant torque-lag",
        "cable-elongation-linear frame-compliance length-gain length-time-offset",
        "load-gain cable-weight load-lever load-friction-at-place pulley-coulomb",
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
    assert effect.repeatable == any(p.whole and p.name == "order" for p in effect.parameters)
    if effect.polar:
        size, phase = map(effect.parameter, effect.polar)
        assert size.low == 0.0
        assert phase.unit == "rad"


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
