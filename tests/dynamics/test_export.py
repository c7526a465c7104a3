"""The exported C, Python and JSON are the line model to rounding."""

from __future__ import annotations

import json
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from numpy.typing import NDArray

from simulated_profiles import AXIS, profile_of
from winchkit import load_catalogue
from winchkit.dynamics.c_code import as_json, c_header, identifier
from winchkit.dynamics.mjcf import mjcf
from winchkit.dynamics.python_code import python_module
from winchkit.dynamics.step import INPUTS, OUTPUTS
from winchkit.effects import Effect, Values
from winchkit.effects.bind import terms_of
from winchkit.effects.term import Term, modifiers_of
from winchkit.errors import UsageError
from winchkit.estimation.cable_state import CableEstimator, Sample
from winchkit.model.line import Line
from winchkit.model.stages import At
from winchkit.schema.profiles.winch import WinchProfile

GCC = shutil.which("gcc")
FLAGS = ["-std=c99", "-O1", "-Wall", "-Wextra", "-Werror", "-fsanitize=address,undefined"]
MAIN = """\
#include "model.h"
#include <stdio.h>
#include <stdlib.h>

int main(void)
{
    size_t count;
    if (fread(&count, sizeof count, 1, stdin) != 1)
        return 1;
    NAME_input *inputs = malloc(count * sizeof *inputs);
    NAME_output *outputs = malloc(count * sizeof *outputs);
    if (!inputs || !outputs || fread(inputs, sizeof *inputs, count, stdin) != count)
        return 1;
    NAME_state state;
    NAME_start(&state);
    NAME_batch(&state, inputs, outputs, count);
    for (size_t i = 0; i < count; ++i)
        inputs[i].time = NAME_motor_angle(outputs[i].cable_length, inputs[i].load);
    fwrite(outputs, sizeof *outputs, count, stdout);
    fwrite(inputs, sizeof *inputs, count, stdout);
    free(inputs);
    free(outputs);
    return 0;
}
"""
ROOMS = {
    "spiral": 'kind = "spiral"\nwinding_radius = "60 mm"\nlayer_growth = "0.4 mm"',
    "archimedean": 'kind = "archimedean"\nwinding_radius = "60 mm"\nlayer_growth = "0.4 mm"',
    "grooved": 'kind = "grooved"\nwinding_radius = "60 mm"\ngroove_pitch = "5 mm"',
    "squared": 'kind = "squared"\nwinding_radius = "60 mm"\nbuild_up = "0.1 mm"',
}
MACHINE = """\
schema = 1
kind = "winch"
name = "machine"

[drum]
{drum}

[gearbox]
ratio = 10

[guide]
screw_lead = "4 mm"

[cable]
diameter = "4 mm"
dead_length = "1 m"

[[pulley]]
radius = "40 mm"
wrap = "90 deg"

[[pulley]]
radius = "40 mm"
wrap = "60 deg"

[reference]
cable_length = "4 m"
wound_turns = 6.0
"""
REFUSED = {
    "cable-elongation-quartic", "cell-lag", "drum-winding-tension", "length-time-offset",
    "torque-lag", "torque-lead", "prediction-delay", "joint-payload", "load-offset",
}  # fmt: skip
"""Effects of the catalogue whose function is none of one sample, or of the load of a run."""
BETWEEN = {"cable-hysteresis", "cell-hysteresis", "pulley-inertia"}
"""Effects that use samples on both sides in a run, and differ from it by their step."""


SIZES = {"cable-elongation-quartic": {"b2": 100.0}, "torque-saturation": {"cubic": 1e-6}}
"""Where the typical size is no small change of the random states: 50 N m and more."""


def used(effect: Effect) -> Term:
    """An effect of its typical size, with memory at a third of its range."""
    values = {p.name: p.typical if p.role == "amplitude" else p.null for p in effect.parameters}
    values.update(SIZES.get(effect.id, {}))
    return Term(effect, values | ({"start": 0.3} if "start" in values else {}))


EFFECTS = {e.id: e for e in load_catalogue().of_winches()}


def random_states(count: int, seed: int) -> NDArray[np.float64]:
    random = np.random.default_rng(seed)
    time = np.cumsum(random.uniform(1e-3, 2e-2, count))
    low_high = [(-150, 150), (-40, 40), (-50, 50), (20, 400), (0, 40), (-2, 2)]
    return np.column_stack([time, *(random.uniform(a, b, count) for a, b in low_high)])


def as_float(states: NDArray[np.float64]) -> NDArray[np.float64]:
    """The states that a float can have."""
    return states.astype(np.float32).astype(float)


def predicted(
    profile: WinchProfile, terms: list[Term], states: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The line along the states as one run, from a sample 0.1 ms before the first."""
    rows = np.vstack([states[:1], states])
    rows[0, 0] -= 1e-4
    time, angle, rate, acceleration, load, temperature, torque = rows.T
    line = Line(profile, modifiers_of(terms))
    at = line.moments(time, angle, rate, load, temperature)
    at = replace(at, motor_acceleration=acceleration, motor_torque=torque)
    kinematics = line.kinematics(at)
    drum_side = line.drum_tension(load, at)
    out = [line.indicated_length(at, kinematics), line.indicated_tension(at, drum_side),
           line.indicated_torque(at, kinematics, drum_side), kinematics.arm]  # fmt: skip
    return np.column_stack(out)[1:]


def by_c(
    folder: Path, profile: WinchProfile, terms: list[Term], states: NDArray[np.float64],
    real: str = "double", flags: list[str] = FLAGS,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:  # fmt: skip
    """Outputs of the compiled header, and the motor angles at their lengths."""
    (folder / "model.h").write_text(c_header(profile, terms))
    (folder / "main.c").write_text(MAIN.replace("NAME", identifier(profile.name)))
    defined = ["-DWINCHKIT_FLOAT"] if real == "float" else []
    command = ["gcc", *flags, *defined, "main.c", "-lm", "-o", "model"]
    subprocess.run(command, cwd=folder, check=True)
    kind = np.dtype(np.float32 if real == "float" else np.float64)
    count = len(states).to_bytes(8, "little")
    sent = count + states.astype(kind).tobytes()
    found = subprocess.run([folder / "model"], input=sent, capture_output=True, check=True)
    numbers = np.frombuffer(found.stdout, kind).astype(float)
    outputs, inputs = np.split(numbers, [len(states) * len(OUTPUTS)])
    return outputs.reshape(-1, len(OUTPUTS)), inputs.reshape(-1, len(INPUTS))[:, 0]


def differences(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Largest difference of each output as a share of its largest value."""
    return np.asarray(np.max(np.abs(a - b), axis=0) / np.max(np.abs(b), axis=0))


def machine(folder: Path, drum: str = "spiral") -> WinchProfile:
    return profile_of(folder, MACHINE.format(drum=ROOMS[drum]))


@pytest.mark.skipif(GCC is None, reason="gcc is not installed")
@pytest.mark.parametrize("drum", ROOMS)
def test_the_compiled_header_is_the_line(tmp_path: Path, drum: str) -> None:
    """All effects that have a step, at once: their memory passes from sample to sample."""
    profile = machine(tmp_path, drum)
    terms = [used(e) for name, e in EFFECTS.items() if name not in REFUSED | BETWEEN]
    random = random_states(2000, 1)
    for real, states, limit in (("double", random, 1e-12), ("float", as_float(random), 1e-6)):
        outputs, _ = by_c(tmp_path, profile, terms, states, real)
        expected = predicted(profile, terms, states)
        assert np.all(np.isfinite(expected))
        assert np.max(differences(outputs, expected)) < limit


@pytest.mark.skipif(GCC is None, reason="gcc is not installed")
@pytest.mark.parametrize("count", [20_000, pytest.param(1_000_000, marks=pytest.mark.campaign)])
def test_random_states_differ_by_rounding_only(tmp_path: Path, count: int) -> None:
    """Friction with memory, elongation, a layered drum: double to 1e-12, float to 1e-5, also where
    the motor turns by milliradians between two samples."""
    profile = machine(tmp_path, "archimedean")
    names = ("pulley-dahl", "motor-dahl", "cable-elongation-linear", "cable-creep",
             "drum-eccentricity", "motor-viscous", "rotor-inertia", "cell-gain")  # fmt: skip
    terms = [used(EFFECTS[name]) for name in names]
    states = random_states(count, 2)
    outputs, _ = by_c(tmp_path, profile, terms, states)
    assert np.max(differences(outputs, predicted(profile, terms, states))) < 1e-12
    states = as_float(random_states(count, 3))
    outputs, _ = by_c(tmp_path, profile, terms, states, "float")
    assert np.max(differences(outputs, predicted(profile, terms, states))) < 1e-5


@pytest.mark.skipif(GCC is None, reason="gcc is not installed")
def test_hysteresis_continues_as_in_control(tmp_path: Path) -> None:
    """The true length is that of the estimator of the control, which steps in Python."""
    profile, terms = machine(tmp_path), [used(EFFECTS["cable-hysteresis"])]
    terms = [Term(t.effect, {**t.values, "start": t.effect.rested}) for t in terms]
    states = random_states(200, 5)
    states[:, 0] = np.arange(200) * 0.01
    estimator = CableEstimator(profile, terms)
    tension, lengths = [], []
    for time, angle, rate, _, load, *_ in states.tolist():
        found = estimator.update(Sample(time, angle, rate, load=load))
        tension.append(found.tension)
        lengths.append(found.length)
    states[:, 4] = tension
    outputs, _ = by_c(tmp_path, profile, terms, states)
    np.testing.assert_allclose(outputs[:, 0], lengths, atol=1e-12)


@pytest.mark.skipif(GCC is None, reason="gcc is not installed")
@pytest.mark.parametrize("drum", ROOMS)
def test_the_inverse_finds_the_motor_angle(tmp_path: Path, drum: str) -> None:
    profile = machine(tmp_path, drum)
    terms = [used(EFFECTS["cable-elongation-linear"]), used(EFFECTS["drum-eccentricity"])]
    states = random_states(500, 4)
    _, angles = by_c(tmp_path, profile, terms, states)
    np.testing.assert_allclose(angles, states[:, 1], atol=1e-6)


@pytest.mark.parametrize("name", sorted(REFUSED))
def test_an_effect_without_a_step_is_refused_by_name(tmp_path: Path, name: str) -> None:
    with pytest.raises(UsageError, match=rf"^{name}: .*\n.*static inline real"):
        c_header(machine(tmp_path), [used(EFFECTS[name])])


def branching(tension: NDArray[np.float64], at: At, values: Values) -> NDArray[np.float64]:
    return tension if at.tension[0] > 5 else tension + values["gain_error"]


def test_a_user_effect_is_exported_or_refused_with_the_template(tmp_path: Path) -> None:
    base = EFFECTS["cell-gain"]
    mine = replace(base, id="mine", apply=lambda v, at, p: v * (1 + p["gain_error"] * np.sin(v)))
    assert "sin" in c_header(machine(tmp_path), [used(mine)])
    with pytest.raises(UsageError, match="fill in"):
        c_header(machine(tmp_path), [used(replace(base, id="mine", apply=branching))])


@pytest.mark.skipif(GCC is None, reason="gcc is not installed")
def test_conditions_of_a_user_effect_compile(tmp_path: Path) -> None:
    def apply(v: Any, at: At, p: Values) -> Any:
        inside = (v > 5) & (v < 200) | (at.motor_rate > 30)
        return np.where(inside, v * (1 + p["gain_error"]), v)

    profile, terms = (
        machine(tmp_path),
        [used(replace(EFFECTS["cell-gain"], id="mine", apply=apply))],
    )
    states = random_states(500, 6)
    outputs, _ = by_c(tmp_path, profile, terms, states)
    assert np.max(differences(outputs, predicted(profile, terms, states))) < 1e-12


@pytest.mark.skipif(GCC is None, reason="gcc is not installed")
@pytest.mark.parametrize("name", ["load", "before", "is-started", "motor/rate"])
def test_names_of_the_step_are_free_for_user_effects(tmp_path: Path, name: str) -> None:
    """A memory, or a parameter, that has the name of an input."""
    profile, states = machine(tmp_path), random_states(300, 7)
    own, _, parameter = name.partition("/")
    if parameter:
        gain = EFFECTS["cell-gain"]
        renamed = (replace(gain.parameters[0], name=parameter),)
        mine = replace(
            gain, id=own, parameters=renamed, apply=lambda v, at, p: v * (1 + p[parameter])
        )
        terms = [Term(mine, {parameter: 0.1})]
    else:
        states[:, 1] = np.cumsum(np.random.default_rng(8).uniform(-0.02, 0.02, len(states)))
        terms = [used(replace(EFFECTS["motor-dahl"], id=own))]
    expected = predicted(profile, terms, states)
    outputs, _ = by_c(tmp_path, profile, terms, states)
    assert np.max(differences(outputs, expected)) < 1e-12
    assert np.max(differences(by_python(profile, terms, states), expected)) < 1e-12


def by_python(
    profile: WinchProfile, terms: list[Term], states: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Outputs of the Python module, called once for each state."""
    space: dict[str, Any] = {}
    exec(python_module(profile, terms), space)
    step = space[identifier(profile.name).title().replace("_", "")]()
    return np.array([np.atleast_1d(step(*row)) for row in states.tolist()])


@pytest.mark.parametrize("drum", ROOMS)
def test_the_python_module_is_the_line(tmp_path: Path, drum: str) -> None:
    profile = machine(tmp_path, drum)
    terms = [used(e) for e in EFFECTS.values() if e.id not in REFUSED | BETWEEN]
    states = random_states(400, 9)
    found = by_python(profile, terms, states)
    assert np.max(differences(found, predicted(profile, terms, states))) < 1e-12


def test_an_axis_adds_its_effects_to_the_torque_of_ones_own_model(tmp_path: Path) -> None:
    """Friction in proportion to the load is that of the model's torque."""
    profile = profile_of(tmp_path, 'schema = 1\nkind = "axis"\nname = "my joint"\n')
    terms = [Term(EFFECTS["friction-of-load"], {"share": 0.12, "transition": 0.0}),
             Term(EFFECTS["motor-dahl"], {"torque": 0.4, "distance": 0.02, "start": 0.0,
                                          "transition": 0.0})]  # fmt: skip
    states = random_states(300, 10)
    model, rate = states[:, 4], states[:, 2]
    found = by_python(profile, terms, states)[:, 0]
    coulomb = by_python(profile, terms[:1], states)[:, 0]
    expected = model + 0.12 * np.abs(model) * np.tanh(rate / 0.5)
    assert coulomb == pytest.approx(expected, rel=1e-12)
    assert np.max(np.abs(found - coulomb)) == pytest.approx(0.4, rel=1e-3)
    assert "predicted_torque" in c_header(profile, terms)


def test_the_json_has_every_formula(tmp_path: Path) -> None:
    found = json.loads(json.dumps(as_json(machine(tmp_path), [used(EFFECTS["motor-viscous"])])))
    assert found["constants"]["motor_viscous_viscosity"]["unit"] == "N m s"
    known = {*found["inputs"], *found["constants"]}
    for name, _, *arguments in found["assignments"]:
        assert all(not isinstance(a, str) or a in known for a in arguments)
        known.add(name)
    assert {one["value"] for one in found["outputs"].values()} <= known


@pytest.mark.parametrize(
    "name", ["none", "a */ b", "a /* b", 'my "joint" <1>', "größe", "2", "a--b\\"]
)
def test_names_of_a_profile_break_no_text(tmp_path: Path, name: str) -> None:
    quoted = json.dumps(name, ensure_ascii=False)
    profile = profile_of(tmp_path, AXIS.replace('name = "axis"', f"name = {quoted}"))
    compile(python_module(profile, terms_of(profile)), "model.py", "exec")
    ElementTree.fromstring(mjcf(profile, terms_of(profile))[0])
    header = tmp_path / "model.h"
    header.write_text(c_header(profile, terms_of(profile)))
    if GCC:
        command = [GCC, *FLAGS, "-x", "c", "-fsyntax-only", str(header)]
        subprocess.run(command, check=True, capture_output=True)


def test_an_infinite_constant_is_written(tmp_path: Path) -> None:
    """JSON has no infinity: other readers than Python's refuse it as a number."""
    stiff = used(EFFECTS["cable-elongation-linear"])
    rigid = replace(stiff, values=dict.fromkeys(stiff.values, np.inf))
    exec(python_module(machine(tmp_path), [rigid]), {})
    found = json.dumps(as_json(machine(tmp_path), [rigid]), allow_nan=False)
    assert '"value": "Infinity"' in found
