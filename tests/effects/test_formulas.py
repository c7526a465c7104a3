"""Every effect against its closed form, written a second time and with plain loops here."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, exp, pi, sin
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import brentq

from effect_lines import CATALOGUE, IDS, predict
from winchkit.effects.reference_motion import STANDARD_PROFILE, standard_motion
from winchkit.effects.term import Term, modifiers_of
from winchkit.model.line import Line

G = 9.80665
RADIUS, GROWTH, RATIO, DEAD, LENGTH, TURNS = 0.06, 0.006, 20.4, 1.5, 6.0, 4.3
WRAPS, PULLEY = (pi / 2, pi), 0.04
INCLINATION = pi / 3
PAYLOAD = 5.0


def _state() -> SimpleNamespace:
    """What the formulas are written in, worked out here from the motor angle and the load."""
    motion = standard_motion()
    theta, time = motion.at.motor_angle, motion.at.time
    phi = theta / RATIO
    speed = -np.gradient(LENGTH - (_wound(phi) - _wound(np.zeros(1))), time)
    rate = np.gradient(theta, time)
    free = LENGTH - (_wound(phi) - _wound(np.zeros(1)))
    return SimpleNamespace(
        t=time,
        theta=theta,
        phi=phi,
        Phi=2 * pi * TURNS + phi,
        free=free,
        stressed=free + DEAD,
        T=motion.load,
        v=speed,
        s=np.sign(speed),
        a=np.gradient(speed, time),
        rate=rate,
        sm=np.sign(rate),
        alpha=np.gradient(rate, time),
        warm=motion.at.temperature - 20.0,
        arm=_radius(phi) / RATIO,
    )


def _wound(phi: np.ndarray, radius: float = RADIUS, growth: float = GROWTH) -> np.ndarray:
    """Cable on a spiral drum: whole turns summed one by one, then the incomplete turn."""
    out = np.empty_like(phi)
    for i, angle in enumerate((2 * pi * TURNS + phi).tolist()):
        turns = int(angle // (2 * pi))
        full = sum(2 * pi * (radius + k * growth) for k in range(turns))
        out[i] = full + (angle - 2 * pi * turns) * (radius + turns * growth)
    return out


def _radius(phi: np.ndarray, radius: float = RADIUS, growth: float = GROWTH) -> np.ndarray:
    return radius + growth * np.floor((2 * pi * TURNS + phi) / (2 * pi))


X = _state()
KNOWN = (np.abs(X.rate) > 0.5) | (X.rate == 0.0)
"""Samples at rest, or faster than any noise: between them the model has an expected direction."""
START = _wound(np.zeros(1))


def _lag(x: np.ndarray, tau: float, start: float) -> np.ndarray:
    """y' = (x − y)/τ, x linear between samples: the exact step, one at a time."""
    y, out = start, [start]
    for k in range(1, len(x)):
        h = X.t[k] - X.t[k - 1]
        slope = (x[k] - x[k - 1]) / h
        particular = x[k - 1] - slope * tau
        y = particular + slope * h + (y - particular) * exp(-h / tau)
        out.append(y)
    return np.array(out)


def _dahl(position: np.ndarray, limit: np.ndarray, stiffness: float) -> np.ndarray:
    force, out = 0.0, []
    last = position[0]
    for x, most in zip(position.tolist(), limit.tolist(), strict=True):
        sign = float(np.sign(x - last))
        if sign:
            force = sign * most + (force - sign * most) * exp(-stiffness * abs(x - last) / most)
        out.append(force)
        last = x
    return np.array(out)


def _loop(x: np.ndarray, share: float, stiffness: float) -> np.ndarray:
    """Dahl's loop of a limit that is a share of ``x``, which turns at the crests of parabolas."""
    walked, own = [x[0]], [0]
    for before, now, after in zip(x[:-2], x[1:-1], x[2:], strict=True):
        bend = np.polyfit([-1.0, 0.0, 1.0], [before, now, after], 2)
        crest = -bend[1] / (2 * bend[0]) if (now - before) * (after - now) < 0 else 0.0
        top = [np.polyval(bend, crest)] if crest else []
        walked += [*top, now] if crest < 0 else [now, *top]
        own.append(len(walked) - 1 - (len(top) if crest > 0 else 0))
    walked.append(x[-1])
    path = np.array(walked)
    return _dahl(path, share * path, stiffness)[[*own, len(walked) - 1]]


def _play(x: np.ndarray, gap: float) -> np.ndarray:
    y, out = x[0], []
    for now in x.tolist():
        y = min(max(y, now - gap / 2), now + gap / 2)
        out.append(y)
    return np.array(out)


def _bearing(mu: np.ndarray) -> np.ndarray:
    """Both pulleys, from the platform to the drum, T1 − T0 = μ N(T0, T1) by fixed-point."""
    out = X.T
    for wrap in reversed(WRAPS):
        before, after = out, out.copy()
        for _ in range(60):
            after = before + mu * np.sqrt(before**2 - 2 * before * after * cos(wrap) + after**2)
        out = after
    return out


def _by_angle(phi: np.ndarray) -> dict[str, np.ndarray]:
    """Length and torque with another drum angle under the same slope."""
    return {
        "cable_length": LENGTH - (_wound(phi) - START),
        "motor_torque": X.T * _radius(phi) / RATIO,
    }


def _tension(tension: np.ndarray) -> dict[str, np.ndarray]:
    return {"tension": tension, "motor_torque": tension * X.arm}


def _longer(strain: np.ndarray) -> dict[str, np.ndarray]:
    return {"cable_length": X.free + X.stressed * strain}


def _torque(extra: np.ndarray) -> dict[str, np.ndarray]:
    return {"motor_torque": X.T * X.arm + extra}


def _ratio_error() -> dict[str, np.ndarray]:
    phi = X.theta / (RATIO * 1.01)
    length = LENGTH - (_wound(phi) - START)
    return {"cable_length": length, "motor_torque": X.T * _radius(phi) / (RATIO * 1.01)}


def _radius_error() -> dict[str, np.ndarray]:
    start = _wound(np.zeros(1), RADIUS + 1e-3)
    return {
        "cable_length": LENGTH - (_wound(X.phi, RADIUS + 1e-3) - start),
        "motor_torque": X.T * _radius(X.phi, RADIUS + 1e-3) / RATIO,
    }


def _thickness_error() -> dict[str, np.ndarray]:
    growth = GROWTH - 2e-4
    start = _wound(np.zeros(1), growth=growth)
    return {
        "cable_length": LENGTH - (_wound(X.phi, growth=growth) - start),
        "motor_torque": X.T * _radius(X.phi, growth=growth) / RATIO,
    }


def _backlash() -> dict[str, np.ndarray]:
    phi = _play(X.phi, 0.01)
    # Nearer than a fiftieth of the way to a flank bears: an encoder's noise is as much.
    meshes = np.isclose(np.abs(phi - X.phi), 0.005, rtol=0, atol=0.005 / 50)
    assert np.count_nonzero(~meshes) > 20
    predicted = _by_angle(phi)
    return predicted | {"motor_torque": predicted["motor_torque"] * meshes}


def _smooth_step(x: np.ndarray) -> np.ndarray:
    return np.where(x <= 0, 0.0, np.where(x >= 1, 1.0, 3 * x**2 - 2 * x**3))


def _eccentricity() -> dict[str, np.ndarray]:
    wave = 3e-4 * (np.sin(X.phi - 0.7) + sin(0.7))
    slope = 3e-4 * np.cos(X.phi - 0.7) / RATIO
    return {"cable_length": X.free - wave, "motor_torque": X.T * (X.arm + slope)}


def _roundness() -> dict[str, np.ndarray]:
    wave = 3e-4 * (np.sin(2 * X.phi - 0.7) + sin(0.7))
    slope = 6e-4 * np.cos(2 * X.phi - 0.7) / RATIO
    return {"cable_length": X.free - wave, "motor_torque": X.T * (X.arm + slope)}


def _pulley_runout() -> dict[str, np.ndarray]:
    turned = (LENGTH - X.free) / PULLEY - 0.7
    arm = X.arm * (1 + 3e-4 / PULLEY * np.cos(turned))
    return {"cable_length": X.free - 3e-4 * (np.sin(turned) + sin(0.7)), "motor_torque": X.T * arm}


def _transmission_error() -> dict[str, np.ndarray]:
    phi = X.phi + 3e-4 * np.sin(3 * X.theta + 0.4)
    slope = 1 / RATIO + 9e-4 * np.cos(3 * X.theta + 0.4)
    return {
        "cable_length": LENGTH - (_wound(phi) - START),
        "motor_torque": X.T * _radius(phi) * slope,
    }


def _guide() -> dict[str, np.ndarray]:
    aside = 0.02 - 1e-3 * X.Phi / (2 * pi)
    reach = np.sqrt(0.4**2 + aside**2)
    slope = aside / reach * -1e-3 / (2 * pi) / RATIO
    return {"cable_length": X.free - (reach - 0.4), "motor_torque": X.T * (X.arm + slope)}


def _quartic() -> dict[str, np.ndarray]:
    def law(strain: float) -> float:
        return strain + 60 * strain**2 + 2e4 * strain**3 + 5e6 * strain**4

    strain = [brentq(lambda e, y=y: law(e) - y, 0, 1, xtol=1e-15) for y in X.T / 1.5e5]
    return _longer(np.array(strain))


Case = tuple[dict[str, float], Callable[[], dict[str, np.ndarray]]]
CASES: dict[str, Case] = {
    "drum-radius": ({"radius_error": 1e-3}, _radius_error),
    "gear-ratio": ({"ratio_error": 0.01}, _ratio_error),
    "layer-thickness": ({"thickness_error": -2e-4}, _thickness_error),
    "drum-eccentricity": ({"eccentricity": 3e-4, "phase": 0.7}, _eccentricity),
    "drum-roundness": ({"amplitude": 3e-4, "phase": 0.7, "lobes": 2}, _roundness),
    "pulley-eccentricity": ({"amplitude": 3e-4, "phase": 0.7, "pulley": 2}, _pulley_runout),
    "gear-backlash": ({"gap": 0.01, "held": 0.0}, _backlash),
    "gear-transmission-error": ({"amplitude": 3e-4, "phase": 0.4, "order": 3}, _transmission_error),
    "encoder-slip": (
        {"step": 0.05, "time": 40.1},
        lambda: _by_angle(X.phi + 0.05 * _smooth_step((X.t - 40.1) / 0.4)),
    ),
    "guide-offset": ({"offset": 0.02, "mismatch": -1e-3}, _guide),
    "cable-elongation-linear": ({"axial_stiffness": 1.5e5}, lambda: _longer(X.T / 1.5e5)),
    "cable-elongation-quartic": ({"k1": 1.5e5, "b2": 60, "b3": 2e4, "b4": 5e6}, _quartic),
    "cable-elongation-exponential": (
        {"strain_scale": 2e-3, "force_scale": 90},
        lambda: _longer(2e-3 * np.log((X.T + 90) / 90)),
    ),
    "cable-hysteresis": (
        {"stiffness": 1e5, "fraction": 0.08},
        lambda: _longer(-_loop(X.T, 0.08, 0.5) / 1e5),
    ),
    "cable-creep": (
        {"creep_stiffness": 8e5, "time_constant": 25, "start": 0.3},
        lambda: _longer(_lag(X.T / 8e5, 25, 0.3 * X.T[0] / 8e5)),
    ),
    "cable-thermal": ({"expansion": -1.2e-5}, lambda: _longer(-1.2e-5 * X.warm)),
    "cable-sag": (
        {"mass_per_length": 0.3},
        lambda: {
            "cable_length": X.free
            - (0.3 * G) ** 2 * X.free**3 * cos(INCLINATION) ** 2 / (24 * X.T**2)
        },
    ),
    "frame-compliance": ({"stiffness": 5e4}, lambda: {"cable_length": X.free + X.T / 5e4}),
    "pulley-coulomb": ({"friction": 0.05}, lambda: _tension(_bearing(0.05 * X.s))),
    "pulley-viscous": ({"viscosity": 7}, lambda: _tension(X.T + 14 * X.v)),
    "pulley-stribeck": (
        {"coulomb": 0.02, "static": 0.05, "stribeck_speed": 0.03},
        lambda: _tension(_bearing(X.s * (0.02 + 0.03 * np.exp(-((X.v / 0.03) ** 2))))),
    ),
    "pulley-capstan": ({"friction": 0.03}, lambda: _tension(X.T * np.exp(0.03 * X.s * sum(WRAPS)))),
    "pulley-inertia": ({"equivalent_mass": 0.7}, lambda: _tension(X.T + 1.4 * X.a)),
    "cable-weight": (
        {"mass_per_length": 0.2},
        lambda: _tension(X.T + 0.2 * G * X.free * sin(INCLINATION)),
    ),
    "cell-gain": ({"gain_error": -0.02}, lambda: {"tension": 0.98 * X.T}),
    "cell-offset": ({"offset": -4}, lambda: {"tension": X.T - 4}),
    "cell-nonlinearity": ({"quadratic": 6}, lambda: {"tension": X.T + 6 * X.T**2 / 2.5e5}),
    "cell-drift": ({"drift": 0.03}, lambda: {"tension": X.T + 0.03 * X.t}),
    "cell-thermal": ({"sensitivity": 0.4}, lambda: {"tension": X.T + 0.4 * X.warm}),
    "cell-lag": ({"time_constant": 0.1}, lambda: {"tension": _lag(X.T, 0.1, X.T[0])}),
    "cell-hysteresis": ({"fraction": 0.01}, lambda: {"tension": X.T - _loop(X.T, 0.01, 0.1)}),
    "cell-creep": (
        {"fraction": 0.002, "time_constant": 50},
        lambda: {"tension": X.T + 0.002 * _lag(X.T, 50, 0.0)},
    ),
    "torque-constant": ({"gain_error": 0.05}, lambda: {"motor_torque": 1.05 * X.T * X.arm}),
    "torque-saturation": (
        {"cubic": 0.2},
        lambda: {"motor_torque": X.T * X.arm * (1 + 0.2 * (X.T * X.arm) ** 2)},
    ),
    "viscous-thermal": (
        {"viscosity_change": -2e-4},
        lambda: _torque(-2e-5 * (X.warm - 20.0) * X.rate),
    ),
    "gear-efficiency": (
        {"efficiency": 0.8},
        lambda: {"motor_torque": X.T * X.arm * np.exp(-X.s * np.log(0.8))},
    ),
    "motor-coulomb": ({"torque": 0.03}, lambda: _torque(0.03 * X.sm)),
    "motor-coulomb-asymmetry": ({"offset": 0.01}, lambda: _torque(np.full_like(X.t, 0.01))),
    "motor-viscous": ({"viscosity": 2e-3}, lambda: _torque(2e-3 * X.rate)),
    "motor-viscous-asymmetry": (
        {"viscosity_difference": 2e-3},
        lambda: _torque(2e-3 * np.abs(X.rate)),
    ),
    "motor-stribeck": (
        {"torque": 0.03, "stribeck_speed": 20},
        lambda: _torque(0.03 * X.sm * np.exp(-(X.rate**2) / 400)),
    ),
    "motor-cogging": (
        {"amplitude": 0.02, "phase": -1, "order": 6},
        lambda: _torque(0.02 * np.sin(6 * X.theta - 1)),
    ),
    "rotor-inertia": ({"inertia": 2e-4}, lambda: _torque(2e-4 * X.alpha)),
    "torque-lag": (
        {"time_constant": 0.1},
        lambda: {"motor_torque": _lag(X.T * X.arm, 0.1, (X.T * X.arm)[0])},
    ),
    "joint-gravity": (
        {"amplitude": 0.6, "phase": 0.4},
        lambda: _torque(0.6 * (cos(0.4) * np.sin(X.phi) + sin(0.4) * np.cos(X.phi))),
    ),
    "joint-payload": (
        {"lever": 0.4, "phase": 0.4},
        lambda: _torque(
            PAYLOAD * (G * 0.4 * np.sin(X.phi + 0.4) + 0.4**2 * X.alpha / RATIO) / RATIO
        ),
    ),
    "drum-unbalance": (
        {"amplitude": 0.02, "phase": -0.4},
        lambda: _torque(0.02 * np.cos(X.phi - 0.4 - pi / 2)),
    ),
    "length-gain": ({"gain_error": 0.02}, lambda: {"cable_length": 1.02 * X.free}),
    "load-gain": ({"gain_error": 0.02}, lambda: _tension(1.02 * X.T)),
    "load-offset": ({"mass": 0.9}, lambda: _tension(X.T * (1 + 0.9 / PAYLOAD))),
    "load-lever": (
        {"amplitude": 0.05, "phase": 0.2},
        lambda: _tension(X.T * (1 + 0.05 * np.cos(X.phi + 0.2 - pi / 2))),
    ),
    "spring-balancer": (
        {"stiffness": 2e-3, "torque": -0.03},
        lambda: _torque(2e-3 * X.theta / RATIO - 0.03),
    ),
    "torque-ripple": (
        {"amplitude": 0.04, "phase": 0.3, "order": 5},
        lambda: {"motor_torque": X.T * X.arm * (1 + 0.04 * np.sin(5 * X.theta + 0.3))},
    ),
    "friction-of-load": ({"share": 0.2}, lambda: _torque(0.2 * X.sm * X.T * X.arm)),
    # The profile of the tests has no inertia: in test_inertia_of_the_profile_is_transmitted.
    "friction-of-transmission": (
        {"share": 0.2, "inertia_share": 0.5},
        lambda: _torque(0.2 * X.sm * X.T * X.arm),
    ),
    "friction-of-torque": (
        {"share": 0.2},
        # τ_m = τ + s μ τ_m under a positive torque.
        lambda: {"motor_torque": X.T * X.arm / (1 - 0.2 * X.sm)},
    ),
    "stribeck-of-load": (
        {"share": 0.2, "stribeck_speed": 20},
        lambda: _torque(0.2 * X.sm * X.T * X.arm * np.exp(-(X.rate**2) / 400)),
    ),
    "friction-growth": ({"rate": 3e-4}, lambda: _torque(3e-4 * X.t * X.sm)),
    "friction-at-place": (
        {"torque": 0.05, "place": 3.0, "width": 2.0},
        lambda: _torque(0.05 * X.sm * np.exp(-((X.phi - 3.0) ** 2) / 4.0)),
    ),
    "load-viscous": ({"viscosity": 7}, lambda: _tension(X.T + 7 * X.v)),
    "load-coulomb": ({"force": 20.0}, lambda: _tension(X.T + 20.0 * X.s)),
    "load-friction-at-place": (
        {"force": 20.0, "place": 3.0, "width": 0.5},
        lambda: _tension(X.T + 20.0 * X.s * np.exp(-((X.free - 3.0) ** 2) / 0.25)),
    ),
    "cell-crosstalk": ({"share": 3.0}, lambda: {"tension": X.T + 3.0 * X.T * X.arm}),
    "cell-clipping": ({"share": 1.0, "limit": 300.0}, lambda: {"tension": np.minimum(X.T, 300.0)}),
}
OWN_TESTS = {
    "gear-dahl",
    "pulley-dahl",
    "motor-dahl",
    "length-time-offset",
    "drum-winding-tension",
    "torque-lead",
    "prediction-delay",
}


def test_every_effect_is_tested_here() -> None:
    assert set(IDS) == set(CASES) | OWN_TESTS


@pytest.mark.slow
@pytest.mark.parametrize("effect_id", CASES)
def test_effect_agrees_with_its_closed_form(effect_id: str) -> None:
    values, closed_form = CASES[effect_id]
    effect = CATALOGUE[effect_id]
    predicted = predict(STANDARD_PROFILE, standard_motion(), effect, values)
    expected = closed_form()
    assert set(expected) == set(effect.outputs)
    for name, wanted in expected.items():
        assert np.mean(KNOWN) > 0.9
        assert np.allclose(predicted[name][KNOWN], wanted[KNOWN], rtol=1e-10, atol=1e-10), name


def test_a_wrong_torque_constant_scales_the_motors_own_torque_as_well() -> None:
    constant = Term(CATALOGUE["torque-constant"], {"gain_error": 0.05})
    inertia = Term(CATALOGUE["rotor-inertia"], {"inertia": 2e-3})
    true, shown = (
        Line(STANDARD_PROFILE, modifiers_of(terms)).predict(standard_motion())["motor_torque"]
        for terms in ([inertia], [inertia, constant])
    )
    assert np.allclose(shown, 1.05 * true, rtol=1e-12)
