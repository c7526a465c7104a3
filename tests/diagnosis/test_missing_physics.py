"""The benchmark missing_physics: its physics against closed forms, its files, its score."""

import ast
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from entrants.case import Case as EntrantCase
from missing_physics import effects, frictions, score
from missing_physics.cases import KINDS, draw_case, kinds, write_case
from missing_physics.effects import ALL, CATALOGUE, Hidden, outputs, possible
from missing_physics.enter import main
from missing_physics.machine import EVERY, FINE, GRAVITY, Machine, draw_machine, motion
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.effects.bind import terms_of
from winchkit.effects.catalogue import load_catalogue

NOISE = {"cable_length": 1e-4, "tension": 1.0, "motor_torque": 0.01}
WINCH = Machine("winch", 10.0, 0.0, NOISE, "grooved", 0.05, 0.004, 6.0, 5.0, 0.5, (np.pi,))
TIME = np.arange(0, 20, 1 / FINE)
TURNING = motion(-40 + 40 * np.cos(0.5 * TIME), 30.0, np.full_like(TIME, 20.0), 0)


def hidden(name: str, size: float, **parameters: float) -> tuple[Hidden, ...]:
    return (Hidden(name, {"size": size, **parameters}),)


def test_the_package_imports_numpy_and_the_standard_library_only() -> None:
    folder = Path(effects.__file__).parent
    names = set()
    for path in folder.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                names |= {alias.name.split(".")[0] for alias in node.names}
            if isinstance(node, ast.ImportFrom):
                names.add((node.module or "").split(".")[0])
    assert "numpy" in names
    assert names <= {
        *("numpy", "missing_physics", "__future__", "collections", "dataclasses", "math"),
        *("argparse", "json", "sys", "pathlib", "typing"),
    }


@pytest.mark.parametrize("drum", ["grooved", "archimedean"])
def test_the_motor_does_the_work_that_the_mass_gains(drum: str) -> None:
    machine = replace(WINCH, drum=drum, inertia=2e-4)
    shown = outputs(machine, TURNING)
    work = np.trapezoid(shown["motor_torque"] * TURNING.speed, TIME)
    height = shown["cable_length"][0] - shown["cable_length"][-1]
    speed = -np.gradient(shown["cable_length"], TIME)[-2]
    energy = TURNING.mass * (GRAVITY * height + speed**2 / 2) + 1e-4 * TURNING.speed[-2] ** 2
    assert abs(height) > 0.1
    assert work == pytest.approx(energy, rel=1e-3)


def test_a_turn_of_an_archimedean_drum_is_a_mean_circumference() -> None:
    spiral = replace(WINCH, drum="archimedean", growth=0.001)
    first, second = spiral.wound(np.array([0.0, 2 * np.pi]))
    assert second - first == pytest.approx(2 * np.pi * (0.05 + 0.001 * 6.5))


@pytest.mark.parametrize(
    ("name", "size", "parameters"),
    [
        ("drum-eccentricity", 3e-4, {"phase": 0.7}),
        ("drum-radius", 3e-4, {}),
        ("gear-ratio", 0.01, {}),
    ],
)
def test_wrong_kinematics_conserve_energy(
    name: str, size: float, parameters: dict[str, float]
) -> None:
    shown = outputs(WINCH, TURNING, hidden(name, size, **parameters))
    power = shown["motor_torque"] * TURNING.speed
    lifted = -shown["tension"] * np.gradient(shown["cable_length"], TIME)
    moving = np.abs(TURNING.speed) > 1.0
    assert np.allclose(power[moving], lifted[moving], atol=1e-3 * np.max(np.abs(power)))


def test_hookes_law_and_a_delay_in_closed_form() -> None:
    rest = motion(np.zeros_like(TIME), 30.0, np.full_like(TIME, 20.0), 0)
    length = outputs(WINCH, rest, hidden("cable-elongation-linear", 1e-5))["cable_length"]
    assert np.allclose(length, 5 + 5.5 * 1e-5 * 30 * GRAVITY)
    late = outputs(WINCH, TURNING, hidden("length-time-offset", 0.05))["cable_length"]
    exact = 5 + np.hypot(0.05, 0.004 / (2 * np.pi)) * (40 - 40 * np.cos(0.5 * (TIME - 0.05))) / 10
    assert np.allclose(late[100:], exact[100:], atol=1e-6)


@pytest.mark.parametrize("up", [True, False])
def test_friction_of_pulleys_and_gear_is_lost_in_both_directions(up: bool) -> None:
    run = motion((1 if up else -1) * 5 * TIME, 30.0, np.full_like(TIME, 20.0), 0)
    weight, sense, middle = 30 * GRAVITY, 1 if up else -1, len(TIME) // 2
    pulled = outputs(WINCH, run, hidden("pulley-coulomb", 0.01, scale=1e-3))["tension"]
    assert pulled[middle] == pytest.approx(weight * (1 + sense * 0.02), rel=1e-6)
    torque = outputs(WINCH, run, hidden("gear-efficiency", 0.1))["motor_torque"]
    ideal = weight * np.hypot(0.05, 0.004 / (2 * np.pi)) / 10
    assert torque[middle] == pytest.approx(ideal * 0.9**-sense, rel=1e-6)


@pytest.mark.parametrize("ratio", [0.3, 1.0, 4.0])
def test_dahls_limit_cycle_peaks_at_the_hyperbolic_tangent(ratio: float) -> None:
    # From −F to F over twice the amplitude A: F = 1 − (1 + F) exp(−2 A/δ) = tanh(A/δ).
    speed = 2 * np.pi * ratio * np.cos(2 * np.pi * TIME)
    last = frictions.share("dahl", speed, 1.0)[-round(FINE) :]
    assert np.ptp(last) / 2 == pytest.approx(np.tanh(ratio), rel=5e-3)


@pytest.mark.parametrize("form", frictions.FORMS)
def test_every_friction_slides_at_unit_size_and_opposes_the_motion(form: str) -> None:
    speed = np.where(TIME < 10, 3.0, -3.0)
    got = frictions.share(form, speed, 0.01)
    assert got[1900] == pytest.approx(1, abs=5e-3)
    assert got[-1] == pytest.approx(-1, abs=5e-3)
    assert np.all(np.abs(got) <= frictions.STRIBECK)


@pytest.mark.parametrize("name", sorted(ALL))
def test_every_effect_vanishes_at_zero_and_changes_something_above(name: str) -> None:
    effect, random = ALL[name], np.random.default_rng(3)
    kind = "axis" if effect.where == "axis" else "winch"
    machine = draw_machine(random, kind)[0]
    machine = replace(machine, ratio=1.0 if effect.where == "slow" else 10.0)
    machine = replace(machine, drum="archimedean") if kind == "winch" else machine
    run = replace(TURNING, temperature=20 + TIME / 5)
    assert possible(effect, machine, warm=True)
    drawn = effect.drawn(random, run)
    ideal = outputs(machine, run)

    def change(size: float) -> float:
        shown = outputs(machine, run, hidden(name, size, **drawn))
        return max(float(np.max(np.abs(shown[k] - ideal[k]))) for k in ideal)

    usual = machine.noise["motor_torque"] if effect.size is None else effect.size
    assert change(1e-9 * usual) < 1e-6 * change(usual)


def test_kinds_are_even_and_cases_follow_from_the_seed() -> None:
    assert sorted(kinds(5, 300)) == sorted(KINDS * 50)
    one, other, third = (draw_case(s, 3, "tidy") for s in (5, 5, 6))
    assert all(np.array_equal(one.runs[0][k], other.runs[0][k]) for k in one.runs[0])
    assert one.truth == other.truth
    assert one.machine != third.machine


def test_repeats_differ_by_the_declared_noise() -> None:
    case = draw_case(5, 3, "tidy")
    for name, rms in case.machine.noise.items():
        difference = case.runs[0][name] - case.runs[1][name]
        assert np.std(difference) == pytest.approx(rms * np.sqrt(2), rel=0.15)
    assert np.allclose(np.diff(case.runs[0]["time"]), EVERY / FINE)


TRUTHS = {
    "one": {"right": [["motor-coulomb", "motor-dahl"]], "tolerated": [], "outside": False},
    "two": {"right": [["cell-gain"], ["cell-lag"]], "tolerated": ["x"], "outside": False},
    "none": {"right": [], "tolerated": [], "outside": False},
    "outside": {"right": [], "tolerated": [], "outside": True},
}


@pytest.mark.parametrize(
    ("truth", "verdict", "effects", "word"),
    [
        ("one", "effects", [("motor-dahl", True)], "right"),
        ("one", "effects", [("motor-dahl", False)], "in a set"),
        ("one", "unknown", [("motor-dahl other", True)], "in a set"),
        ("one", "effects", [("motor-dahl", True), ("other", True)], "wrong and certain"),
        ("one", "effects", [("motor-dahl", True), ("other", False)], "right"),
        ("one", "effects", [("other", False)], "missed"),
        ("one", "none", [], "missed"),
        ("two", "effects", [("cell-lag", True)], "in part"),
        ("two", "effects", [("cell-lag", True), ("cell-gain", True), ("x", True)], "right"),
        ("none", "none", [], "rightly none"),
        ("none", "unknown", [], "missed"),
        ("none", "effects", [("other", True)], "wrong and certain"),
        ("outside", "unknown", [("other", False)], "rightly unknown"),
        ("outside", "unknown", [("other", True)], "wrong and certain"),
        ("outside", "none", [], "missed"),
        ("outside", "no answer", [], "no answer"),
    ],
)
def test_words(truth: str, verdict: str, effects: list[tuple[str, bool]], word: str) -> None:
    items = tuple((frozenset(names.split()), certain) for names, certain in effects)
    assert score.judge(score.Answer(verdict, items, {}), TRUTHS[truth]) == word


def test_the_readmes_commands_write_and_score(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["write", str(tmp_path / "d"), "--seed", "4", "--cases", "2"]) == 0
    with pytest.raises(SystemExit):
        main(["score", str(tmp_path / "d")])
    answers = tmp_path / "d" / "answers" / "mine"
    answers.mkdir(parents=True)
    truth = json.loads((tmp_path / "d" / "truths" / "case-001.json").read_text())
    given = {"names": [names[0] for names in truth["right"]], "certain": True}
    perfect = {"verdict": "effects", "effects": [given], "predicted": truth["held_out"]}
    (answers / "case-001.json").write_text(json.dumps(perfect))
    assert main(["score", str(tmp_path / "d"), "--json"]) == 0
    first, second = json.loads(capsys.readouterr().out)["cases"]["mine"]
    assert first["after"] == 0
    assert first["names"] == len(given["names"])
    assert second["word"] == "no answer"
    assert second["after"] == second["before"] > 0.9
    held = (tmp_path / "d" / "cases" / "case-001" / "held_out.csv").read_text().splitlines()
    header = next(line for line in held if not line.startswith("#")).split(",")
    assert not {c.split(" [")[0] for c in header} & set(truth["held_out"])
    (answers / "case-001.json").write_text('{"verdict": "perhaps"}')
    assert main(["score", str(tmp_path / "d")]) == 3
    assert "use one of effects, none" in capsys.readouterr().err


def test_every_name_is_in_the_readme() -> None:
    text = Path(effects.__file__).with_name("README.md").read_text(encoding="utf-8")
    assert [name for name in CATALOGUE if f"`{name}`" not in text] == []


def test_winchkit_predicts_the_declared_machine_as_the_cases_do(tmp_path: Path) -> None:
    drawn = (draw_case(5, index, "outside") for index in range(20))
    blank = next(c for c in drawn if not c.hidden and c.machine.kind == "winch")
    write_case(blank, tmp_path / "case")
    case = EntrantCase(tmp_path / "case")
    model = Hypothesis()
    for term in terms_of(case.profile, load_catalogue()):
        model = model.with_term(term, 1)
    predicted = case.predicted(case.change(model))
    for name, rms in blank.machine.noise.items():
        error = np.array(predicted[name]) - blank.held_out[f"nominal_{name}"]
        # Accelerations are differences of samples at 50 Hz there, of 200 Hz here.
        assert np.sqrt(np.mean(error**2)) < 0.3 * rms
