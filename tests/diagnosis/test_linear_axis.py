"""A linear axis has the numbers of a rotary one with 1 m for 1 rad, and N, N s/m and kg."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.typing import NDArray

from winchkit.cli import main
from winchkit.diagnosis.add import fitted_addition
from winchkit.diagnosis.compare import compared
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.data.requirements import missing_needs
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.residuals.attribution import Attribution
from winchkit.diagnosis.search import selection_engine
from winchkit.diagnosis.write import write_addition
from winchkit.effects.catalogue import load_catalogue
from winchkit.effects.empirical import shown_id
from winchkit.errors import FileError, RunError
from winchkit.report.figures.reduction import curve_of
from winchkit.report.pages.pages import addition_html, comparison_html, report_html
from winchkit.report.text import report_text
from winchkit.runs.run import Channel, Run
from winchkit.runs.writer import write_run
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.read import read_profile
from winchkit.web.curves import curves_of
from winchkit.web.workspace import DiagnoseView

MASS, VISCOSITY, FRICTION = 40.0, 120.0, 15.0
"""kg, N s/m, N."""
HEAD = 'schema = 1\nkind = "axis"\nname = "carriage"\n'
LINEAR = HEAD + 'motion = "linear"\n[[effect]]\nid = "rotor-inertia"\nmass = "40 kg"\n'
ROTARY = HEAD + '[[effect]]\nid = "rotor-inertia"\ninertia = "40 kg m^2"\n'
OF_TURNS = re.compile(
    r"\bN m\b|\bmotor[ _](?:torque|angle|side)\b|\bm?rad\b|(?<![-\w])torque\b(?!-)"
)


def signals(seed: int) -> tuple[NDArray[np.float64], ...]:
    """Time, position and force of a carriage with friction, 100 Hz."""
    time = np.arange(3000) / 100
    w = 2 * np.pi * np.array([0.1, 0.23])
    a = np.array([0.2, 0.05])
    position = np.sin(np.outer(time, w)) @ a
    velocity = np.cos(np.outer(time, w)) @ (a * w)
    acceleration = -np.sin(np.outer(time, w)) @ (a * w**2)
    force = MASS * acceleration + VISCOSITY * velocity + FRICTION * np.sign(velocity)
    return time, position, force + np.random.default_rng(seed).normal(0, 0.5, len(time))


def run(seed: int, *, linear: bool = True) -> Run:
    """The same numbers as a run of either kind of axis."""
    time, position, force = signals(seed)
    names = (
        ("position", "m", "force", "N") if linear else ("motor_angle", "rad", "motor_torque", "N m")
    )
    channels = {names[0]: Channel(position, names[1]), names[2]: Channel(force, names[3])}
    return Run(f"run{seed}", time, channels)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("linear")
    (folder / "linear.toml").write_text(LINEAR)
    (folder / "rotary.toml").write_text(ROTARY)
    for seed in (1, 2):
        write_run(run(seed), folder / f"run{seed}.csv")
    return folder


@cache
def profile(path: Path) -> WinchProfile:
    return read_profile(path)


def test_the_diagnosis_is_that_of_a_rotary_axis_in_other_units(folder: Path) -> None:
    own = diagnose([run(1), run(2)], profile(folder / "linear.toml"))
    other = diagnose([run(1, linear=False), run(2, linear=False)], profile(folder / "rotary.toml"))
    steps, others = own.diagnosis.steps, other.diagnosis.steps
    assert [step.effects for step in steps] == [step.effects for step in others]
    assert {"motor-viscous", "motor-coulomb"} <= {e for step in steps for e in step.effects}
    units = {"N m": "N", "N m s": "N s/m", "rad": "m", "rad/s": "m/s"}
    for step, rotary in zip(steps, others, strict=True):
        for effect, values in rotary.parameters.items():
            for turning, sliding in zip(
                values.values(), step.parameters[effect].values(), strict=True
            ):
                assert sliding.value == pytest.approx(turning.value, rel=1e-9), effect
                assert sliding.unit == units.get(turning.unit, turning.unit)
    found = {e: v for step in steps for e, v in step.parameters.items()}
    assert found["motor-viscous"]["viscosity"].value == pytest.approx(VISCOSITY, abs=3)
    assert found["motor-coulomb"]["force"].value == pytest.approx(FRICTION, abs=0.5)
    text = report_text(own, verbose=True)
    assert not OF_TURNS.findall(text)
    assert "force" in own.diagnosis.outputs
    assert own.diagnosis.outputs["force"].unit == "N"
    gravity = load_catalogue()["joint-gravity"]
    assert missing_needs(gravity, own.engine.regression.dataset)
    assert not missing_needs(gravity, other.engine.regression.dataset)
    assert not OF_TURNS.findall(json.dumps(own.diagnosis.to_json()))
    page = re.sub(
        r"<style.*?</style>|<script.*?</script>", "", report_html(own, "page"), flags=re.S
    )
    assert not re.findall(r"\d N m\b|motor[ _]torque|motor[ _]angle", page)
    curves = curves_of(own.engine.regression, own.result.initial_model.residual, {})
    drawn = curves["force"].over_time(0.0, 30.0, 300)
    assert (drawn["name"], drawn["unit"]) == ("Force", "N")
    assert set(curves["force"].variables) & {"position", "motor_angle", "drum_angle"} == {
        "position"
    }


def test_an_axis_of_larger_forces_has_the_same_scores_and_deviations(tmp_path: Path) -> None:
    """Metamorphic: with 1000 times the mass and forces the usual sizes are 10⁻⁷ of the noise."""
    (tmp_path / "bare.toml").write_text(HEAD + 'motion = "linear"\n')
    bare, scores, masses = read_profile(tmp_path / "bare.toml"), [], []
    for scale in (1.0, 1e3):
        larger = {"force": Channel(run(1)["force"] * scale, "N")}
        runs = [replace(run(1), channels={**run(1).channels, **larger})]
        engine = selection_engine(prepare(runs, bare), load_catalogue())
        fitted, noise = engine.fit_with_noise(engine.initial_model)
        scores.append({s.candidate.effect.id: s.net_gain for s in engine.scores(fitted, noise)})
        steps = diagnose(runs, bare).diagnosis.steps
        values = {effect: v for step in steps for effect, v in step.parameters.items()}
        assert set(values) == {"rotor-inertia", "motor-viscous", "motor-coulomb"}
        masses.append(values["rotor-inertia"]["mass"])
    assert scores[1] == pytest.approx(scores[0], rel=1e-3, abs=1e-3)
    assert masses[0].value == pytest.approx(MASS, rel=0.01)
    assert masses[1].value == pytest.approx(1e3 * masses[0].value, rel=1e-3)
    assert masses[1].std == pytest.approx(1e3 * masses[0].std, rel=0.05)


def test_a_comparison_and_an_addition_are_in_newtons(folder: Path, tmp_path: Path) -> None:
    own = compared([run(1)], profile(folder / "linear.toml"))
    assert own.comparison.outputs["force"].rms > 10
    assert {trace.output for trace in own.comparison.traces} == {"force"}
    comparison_html(own, "page")
    fitted = fitted_addition("motor-coulomb", [run(1), run(2)], profile(folder / "linear.toml"))
    assert not OF_TURNS.findall(json.dumps(fitted.addition.to_json()))
    addition_html(fitted, "page")
    better = tmp_path / "better.toml"
    write_addition(folder / "linear.toml", fitted.addition, ["run1.csv"], better)
    text = better.read_text()
    assert re.search(r'mass = "\S+ kg"', text)
    assert re.search(r'force = "\S+ N"', text)
    assert "N m" not in text
    again = compared([run(2)], read_profile(better))
    assert again.comparison.outputs["force"].rms < own.comparison.outputs["force"].rms


@pytest.mark.parametrize("linear", [True, False])
def test_a_run_of_the_other_motion_is_refused_in_one_sentence(folder: Path, linear: bool) -> None:
    declared = profile(folder / ("linear.toml" if linear else "rotary.toml"))
    with pytest.raises(RunError, match='motion = "linear"') as caught:
        compared([run(1, linear=not linear)], declared)
    assert len(caught.value.faults) == 1


@pytest.mark.parametrize(
    ("more", "place"),
    [
        ("[gearbox]\nratio = 3\n", "gearbox"),
        ('[reference]\nmotor_angle = "0 rad"\n', "reference"),
        ('[motor]\ninertia = "1 kg m^2"\n', "motor.inertia"),
        ('[motor]\ntorque_constant = "1 N m/A"\n', "motor.torque_constant"),
        ('[[effect]]\nid = "motor-coulomb"\ntorque = "1 N m"\n', "motor-coulomb.torque"),
        ('[[effect]]\nid = "motor-coulomb"\nforce = "1 N m"\n', "motor-coulomb.force"),
    ],
)
def test_parts_and_units_of_a_rotary_axis_are_refused(
    tmp_path: Path, more: str, place: str
) -> None:
    path = tmp_path / "axis.toml"
    path.write_text(HEAD + 'motion = "linear"\n' + more)
    result = CliRunner().invoke(main, ["check", str(path)])
    assert result.exit_code == FileError.exit_code
    assert place in result.output


def test_a_current_gives_the_force_by_the_force_constant(tmp_path: Path) -> None:
    path = tmp_path / "axis.toml"
    path.write_text(LINEAR + '[motor]\nforce_constant = "5 N/A"\n')
    own = run(1)
    current = Channel(own["force"] / 5, "A")
    measured = replace(
        own, channels={"position": own.channels["position"], "motor_current": current}
    )
    expected = compared([own], read_profile(path)).comparison.outputs["force"].rms
    found = compared([measured], read_profile(path)).comparison.outputs["force"].rms
    assert found == pytest.approx(expected)


def test_commands_read_and_write_a_linear_axis(folder: Path) -> None:
    call = CliRunner()
    paths = [str(folder / f"run{seed}.csv") for seed in (1, 2)]
    own = ["-p", str(folder / "linear.toml")]
    assert call.invoke(main, ["check", *paths, own[1]]).exit_code == 0
    told = call.invoke(main, ["compare", *paths, *own])
    assert told.exit_code == 0
    assert re.search(r"force +\d+\.?\d* N", told.output)
    assert not OF_TURNS.findall(told.stdout)


def test_the_page_is_in_newtons(folder: Path, tmp_path: Path) -> None:
    page = DiagnoseView(tmp_path)
    try:
        paths = [folder / f"run{seed}.csv" for seed in (1, 2)]
        page.open(paths, str(folder / "linear.toml")).result()
        shown = page.state.to_json()
        assert shown["outputs"] == ["force"]
        card = page.card("motor-dahl")
        assert card["outputs"] == ["force"]
        assert not OF_TURNS.findall(json.dumps([shown, card], default=str, ensure_ascii=False))
    finally:
        page.close()


def bent(seed: int, shape: Callable[[NDArray[np.float64]], NDArray[np.float64]]) -> Run:
    """A run with a further force over the position."""
    plain = run(seed)
    force = Channel(plain["force"] + shape(plain["position"]), "N")
    return replace(plain, channels={**plain.channels, "force": force})


def test_a_period_is_drawn_over_one_period(folder: Path) -> None:
    """The teeth of a linear motor, 24 mm apart: one whole wave of 8 N within 24 mm."""
    teeth = [bent(s, lambda x: 8.0 * np.sin(2 * np.pi / 0.024 * x)) for s in (1, 2)]
    found = compared(teeth, profile(folder / "linear.toml"))
    order = round(2 * np.pi / 0.024)
    curve = curve_of(found.regression, found.residual, Attribution("force", "position", 1.0, order))
    assert np.ptp(curve.x) == pytest.approx(0.024, rel=0.1)
    wave = curve.mean - curve.mean.mean()
    power = np.abs(np.fft.rfft(wave)) ** 2
    assert int(np.argmax(power)) == 1
    assert np.sqrt(2 * np.mean(wave**2)) == pytest.approx(8.0, rel=0.15)


def test_a_bend_over_the_travel_is_no_period(folder: Path) -> None:
    """A cubic spring over 0.5 m, which a sine of 0.35 m resembles."""
    springs = [bent(s, lambda x: -160.0 * x * (1.0 - (x / 0.18) ** 2)) for s in (1, 2)]
    found = compared(springs, profile(folder / "linear.toml")).comparison
    travel = float(np.ptp(springs[0]["position"]))
    assert all(2 * np.pi / order <= 0.51 * travel for _, order, _ in found.outputs["force"].orders)


def test_the_curve_of_a_linear_axis_has_its_names() -> None:
    where = Attribution("force", "position", 0.8)
    assert shown_id(where.output, where.variable) == "empirical-force-position"
    effect = load_catalogue()["empirical-force-position"]
    assert effect is load_catalogue()["empirical-motor-torque-motor-angle"]
    assert "empirical-force-speed" in load_catalogue()
    assert "empirical-force-nothing" not in load_catalogue()
