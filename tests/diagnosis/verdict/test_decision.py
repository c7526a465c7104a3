"""The four verdicts, each reached, and what an answer then holds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from diagnosis_runs import CATALOGUE, GROOVED, Array, Ride, made, term, with_channel
from winchkit.diagnosis.data.dataset import prepare
from winchkit.diagnosis.diagnose import diagnose, selection_engine
from winchkit.diagnosis.regression.cross_validation import held_out_rms
from winchkit.diagnosis.results import Diagnosis
from winchkit.diagnosis.selection.stepwise import initial_result, stepwise_selection
from winchkit.diagnosis.verdict.decision import judge
from winchkit.effects.term import Term
from winchkit.report.words.sentence import sentence
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.axis import AxisProfile
from winchkit.schema.profiles.winch import EffectTable

RIDE = Ride(samples=400)
DRAG = term("motor-coulomb", torque=0.02)


def runs(
    terms: tuple[Term, ...] = (), repeats: int = 2, beside: Mapping[str, Array] | None = None
) -> list[Run]:
    """Two loads, each driven ``repeats`` times, and what lies beside any effect."""
    out = []
    for mass in (10.0, 25.0):
        for seed in range(repeats):
            run = made(int(10 * mass) + seed, GROOVED, terms, load_mass=mass, ride=RIDE)
            for output, strange in (beside or {}).items():
                unit = run.channels[output].unit
                run = with_channel(run, output, run[output] + strange, unit)
            out.append(run)
    return out


def strange_length(size: float) -> Array:
    """What no effect does: a wobble of the instrument at every second."""
    return size * np.asarray(np.sin(2 * np.pi * RIDE.time / 1.03) ** 3)


def verdict_of(found: Diagnosis, name: str) -> Diagnosis:
    assert found.verdict == name
    return found


def test_adequate() -> None:
    found = verdict_of(diagnose(runs(), GROOVED).diagnosis, "adequate")
    assert found.steps == found.where == found.next_runs == ()


def test_explained() -> None:
    found = verdict_of(diagnose(runs((DRAG,)), GROOVED).diagnosis, "explained")
    (step,) = found.steps
    assert step.effects == ("motor-coulomb",)
    torque = found.outputs["motor_torque"]
    assert torque.rms_after < 0.4 * torque.rms_before
    assert torque.heldout_rms_after < 0.4 * torque.heldout_rms_before
    length = found.outputs["cable_length"]
    assert length.rms_after == pytest.approx(length.rms_before, rel=1e-6)
    assert found.unexplained_share < 0.1


def test_unknown() -> None:
    strange = {"cable_length": strange_length(2e-3)}
    found = verdict_of(diagnose(runs(beside=strange), GROOVED).diagnosis, "unknown")
    assert found.steps == ()
    assert found.unexplained_share > 0.5
    assert {where.output for where in found.where} == {"cable_length"}
    told = [where.frequency for where in found.where if where.frequency]
    assert any(abs(frequency - 1 / 1.03) < 0.5 for frequency in told)


def test_a_significant_wave_of_a_fifth_of_the_noise_is_a_note_and_the_model_adequate() -> None:
    """Long repeats show what no error shows: significance is no relevance."""
    ride = replace(RIDE, samples=6000)
    wave = 6e-5 * np.sin(2 * np.pi * ride.time / 1.03)
    long = [
        with_channel(run, "cable_length", run["cable_length"] + wave, "m")
        for mass in (10.0, 25.0)
        for run in (made(int(mass) + seed, load_mass=mass, ride=ride) for seed in range(3))
    ]
    found = verdict_of(diagnose(long, GROOVED).diagnosis, "adequate")
    length = found.outputs["cable_length"]
    assert length.noise_rms is not None
    assert length.heldout_rms_after < 1.02 * length.noise_rms
    assert any("a lack of fit is significant" in note for note in found.notes)


@pytest.mark.parametrize(("scale", "verdict"), [(1.0, "explained"), (10.0, "adequate")])
def test_errors_below_the_noise_of_repeats_are_not_explained(scale: float, verdict: str) -> None:
    """As beside a resolution above the error: repeats round alike, and an offset seems certain."""
    engine = selection_engine(prepare(runs((DRAG,)), GROOVED), CATALOGUE)
    result = stepwise_selection(engine)
    rms = {output: scale * value for output, value in result.initial_noise.rms.items()}
    noise = replace(result.initial_noise, rms=rms)
    found = judge(engine, replace(result, initial_noise=noise))
    assert found.verdict == verdict
    named = found.reported.final.labels
    assert named == (("motor-coulomb",) if verdict == "explained" else ())


def test_partly() -> None:
    """A large drag keeps its name beside a wobble of another output that no effect explains."""
    strange = {"cable_length": strange_length(1e-3)}
    found = verdict_of(diagnose(runs((DRAG,), beside=strange), GROOVED).diagnosis, "partly")
    (step,) = found.steps
    assert step.effects == ("motor-coulomb",)
    torque = step.parameters["motor-coulomb"]["torque"]
    assert torque.value == pytest.approx(0.02, abs=5 * torque.std)
    assert found.closest == ()
    assert found.where[0].output == "cable_length"
    text = sentence(found)
    assert "The motor side has Coulomb friction" in text
    assert "Partly unexplained" in text
    assert 0 < found.unexplained_share <= 0.5


def test_without_repeats_the_answer_says_what_it_rests_on() -> None:
    found = verdict_of(diagnose(runs((DRAG,), repeats=1), GROOVED).diagnosis, "explained")
    assert found.steps[0].effects[0] == "motor-coulomb"
    assert {output.noise_source for output in found.outputs.values()} == {"saturated fit"}
    assert any("cannot be excluded" in note for note in found.notes)


def test_effects_that_a_profile_has_are_refitted_and_not_named_again() -> None:
    table = EffectTable("motor-coulomb", {"torque": "5 mN m"})
    better = replace(GROOVED, effect=(table,))
    found = verdict_of(diagnose(runs((DRAG,)), better).diagnosis, "adequate")
    assert found.steps == ()
    assert "motor-coulomb" not in {item.effect for item in found.candidates}
    torque = found.outputs["motor_torque"]
    assert torque.noise_rms is not None
    assert torque.rms_before == pytest.approx(torque.noise_rms, rel=0.1)


def test_two_hidden_effects_are_both_named() -> None:
    both = (DRAG, term("cell-gain", gain_error=0.02))
    found = verdict_of(diagnose(runs(both), GROOVED).diagnosis, "explained")
    named = [step.effects for step in found.steps]
    assert sorted(effects[0] for effects in named) == ["cell-gain", "motor-coulomb"]


def test_the_order_of_runs_does_not_matter() -> None:
    given = runs((DRAG,))
    one, other = (diagnose(order, GROOVED).diagnosis for order in (given, given[::-1]))
    assert one.verdict == other.verdict
    assert [s.effects for s in one.steps] == [s.effects for s in other.steps]
    value = "motor-coulomb", "torque"
    sizes = [d.steps[0].parameters[value[0]][value[1]].value for d in (one, other)]
    assert sizes[0] == pytest.approx(sizes[1], rel=1e-3)


def test_a_clock_that_starts_elsewhere_changes_nothing() -> None:
    given = runs((DRAG,))
    later = [replace(run, time=run.time + 1000.0 * n) for n, run in enumerate(given)]
    one, other = (diagnose(some, GROOVED).diagnosis for some in (given, later))
    assert [s.effects for s in one.steps] == [s.effects for s in other.steps]
    for output, fitted in one.outputs.items():
        assert other.outputs[output].rms_after == pytest.approx(fitted.rms_after, rel=1e-3)


def test_candidates_are_ranked_and_the_first_ones_fitted() -> None:
    found = diagnose(runs((DRAG,)), GROOVED).diagnosis
    scores = [item.score for item in found.candidates]
    assert scores == sorted(scores, reverse=True)
    assert len({item.effect for item in found.candidates}) == len(scores)
    best = found.candidates[0]
    assert best.heldout_rms["motor_torque"] == pytest.approx(
        found.outputs["motor_torque"].heldout_rms_after, rel=0.05
    )
    assert found.candidates[-1].heldout_rms == {}


def test_the_verdict_holds_out_what_the_other_runs_determine() -> None:
    """Cogging and a ripple of the friction of one order: one direction determines their sum only.

    The model is right. A run left out is predicted by values that the other one does not determine,
    whether or not a lack of fit remains.
    """
    noise_rms, order = 2e-4, 24
    moves = []
    for index, direction in enumerate((1.0, -1.0)):
        time = np.arange(0.0, 30.0, 0.01)
        angle = direction * (0.5 * time + 0.2 * np.sin(time))
        torque = direction * 0.01 * (1 + 0.05 * np.sin(order * angle + 0.4))
        torque += 5e-4 * np.cos(order * angle + 1.0)
        torque += noise_rms * np.random.default_rng(index).standard_normal(len(time))
        channels = {"motor_angle": Channel(angle, "rad"), "motor_torque": Channel(torque, "N m")}
        moves.append(Run(f"{index}", time, channels, {}))
    joint = AxisProfile(name="joint")
    engine = selection_engine(prepare(moves, joint, fast=True), CATALOGUE)
    hypothesis = engine.initial_model
    for one in (
        term("motor-coulomb", torque=0.01),
        term("motor-cogging", amplitude=5e-4, phase=1.0, order=order),
        term("torque-ripple", amplitude=0.05, phase=0.4, order=order),
    ):
        hypothesis = hypothesis.with_term(one, engine.regression.n_runs)
    fit, noise = engine.fit_with_noise(hypothesis)
    first = initial_result(engine)
    regression = engine.regression
    assert held_out_rms(regression, fit, noise, regression.groups)["motor_torque"] > 2 * noise_rms
    for lacking in (False, True):
        result = replace(first, final=fit, noise=noise, lack_of_fit=lacking)
        found = judge(engine, result)
        assert found.outputs["motor_torque"].heldout_rms_after < 1.1 * noise_rms
        assert found.verdict == "explained"
