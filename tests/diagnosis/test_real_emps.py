"""A real drive, recorded by others, whose friction the model lacks: EMPS.

A. Janot, M. Gautier, M. Brunot, "Data Set and Reference Models of EMPS", Workshop on Nonlinear
System Identification Benchmarks, 2019. The data carry no licence and are no part of the project:
they are looked for in the folder that WINCHKIT_EMPS names, and beside the checkout in
``shared/data/emps``; the tests are skipped where there are none.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from recordings_of_others import folder
from winchkit.diagnosis.add import Addition, add
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.diagnose import WinchAnswer, diagnose
from winchkit.diagnosis.results import Diagnosis
from winchkit.diagnosis.search import selection_engine
from winchkit.diagnosis.write import write_addition
from winchkit.effects.bind import line_of
from winchkit.effects.catalogue import load_catalogue
from winchkit.effects.term import Term, modifiers_of
from winchkit.model.line import Line
from winchkit.model.stages import Signals
from winchkit.runs import read_run
from winchkit.runs.run import Run
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.read import read_profile

VARIABLE = "WINCHKIT_EMPS"
PROFILE = """\
schema = 1
kind = "winch"
name = "emps"

[drum]
kind = "grooved"
winding_radius = "1 m"
groove_pitch = "0 mm"

[gearbox]
ratio = 1

[reference]
wound_turns = 0

[[effect]]
id = "rotor-inertia"
inertia = "95.11 kg m^2"

[[effect]]
id = "motor-viscous"
viscosity = "203.5 N m s"
"""
DATA = folder(VARIABLE, "emps", "train.csv", "test.csv")
pytestmark = pytest.mark.skipif(
    DATA is None, reason=f"the EMPS data are not here; {VARIABLE} names the folder that has them"
)


@cache
def run_of(name: str) -> Run:
    assert DATA is not None
    return read_run(DATA / f"{name}.csv")


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("emps") / "emps.toml"
    path.write_text(PROFILE)
    return path


@pytest.fixture(scope="module")
def profile(source: Path) -> WinchProfile:
    return read_profile(source)


@pytest.fixture(scope="module")
def found(profile: WinchProfile) -> WinchAnswer:
    return diagnose([run_of("train")], profile)


@pytest.fixture(scope="module")
def answer(found: WinchAnswer) -> Diagnosis:
    return found.diagnosis


@pytest.fixture(scope="module")
def addition(profile: WinchProfile) -> Addition:
    return add("motor-coulomb", [run_of("train")], profile)


def error_on_test(line: Line) -> float:
    """Rms of the torque's residual over rms of the torque, both low-passed; the oracle's own."""
    run = run_of("test")
    predicted = line.predict(line.motion(Signals(run.time, run["motor_angle"])))["motor_torque"]
    sections = butter(4, 20.0, fs=1 / run.interval, output="sos")

    def filtered(signal: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(sosfiltfilt(sections, signal))

    measured = filtered(run["motor_torque"])
    left = measured - filtered(predicted)
    return float(np.sqrt(np.mean(left**2) / np.mean(measured**2)))


def test_it_names_friction_what_the_directions_differ_in_and_a_record_of_commands(
    answer: Diagnosis,
) -> None:
    """Beyond these three there is only presliding, a fifth of the friction."""
    found = [step.effects for step in answer.steps if not step.refitted]
    friction = {"motor-coulomb", "motor-stribeck", "motor-dahl"}
    assert [of for of in found if not friction & set(of)] == [
        ("motor-viscous-asymmetry",), ("torque-lead",),
    ]  # fmt: skip
    assert len(found) <= 4
    assert answer.caveats == ("no-repeats",)
    values = {name: of for step in answer.steps for name, of in step.parameters.items()}
    drag = values["motor-viscous-asymmetry"]["viscosity_difference"]
    assert drag.value < -20 * drag.std
    # The recorded force is a voltage times a constant: the current comes after it.
    assert 0.3e-3 < values["torque-lead"]["lead"].value < 1.2e-3


def test_beside_coulomb_friction_the_directions_differ_by_38_newton_seconds(
    profile: WinchProfile,
) -> None:
    """The difference vanishes at standstill and grows with the speed, 38 N s/m either way."""
    catalogue = load_catalogue()
    engine = selection_engine(prepare([run_of("train")], profile), catalogue)
    hypothesis = engine.initial_model
    for name in ("motor-viscous-asymmetry", "torque-lead", "motor-coulomb"):
        hypothesis = hypothesis.with_term(Term(catalogue[name], catalogue[name].null), 1)
    fitted, _ = engine.fit_with_noise(hypothesis)
    drag = fitted.hypothesis.terms[2].values["viscosity_difference"]
    assert drag == pytest.approx(-38.0, abs=4.0)


def test_what_was_found_leaves_three_hundredths_on_another_file(
    found: WinchAnswer, profile: WinchProfile
) -> None:
    """The files differ by 2.0 % that no function of the motion explains."""
    terms = found.result.final.hypothesis.terms
    assert error_on_test(Line(profile, modifiers_of(terms))) < 0.029


def test_without_friction_even_a_refitted_model_misses_a_sixth(profile: WinchProfile) -> None:
    engine = selection_engine(prepare([run_of("train")], profile), load_catalogue())
    fitted, _ = engine.fit_with_noise(engine.initial_model)
    error = error_on_test(Line(profile, modifiers_of(fitted.hypothesis.terms)))
    assert 0.16 < error < 0.20


def test_with_friction_the_error_falls_under_nine_percent(
    source: Path, addition: Addition, tmp_path: Path
) -> None:
    better = tmp_path / "better.toml"
    write_addition(source, addition, ["train.csv"], better)
    assert error_on_test(line_of(read_profile(better))) < 0.09


def test_the_sizes_are_those_that_others_found(addition: Addition) -> None:
    """Janot and others identify 95.1 kg, 203.5 N s/m and 20.4 N; the drum has a radius of 1 m."""
    values = {term.effect.id: dict(term.values) for term, _ in addition.terms}
    assert values["rotor-inertia"]["inertia"] == pytest.approx(95.1, rel=0.02)
    assert values["motor-viscous"]["viscosity"] == pytest.approx(203.5, rel=0.1)
    assert values["motor-coulomb"]["torque"] == pytest.approx(20.4, rel=0.15)
