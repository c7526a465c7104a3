"""The five verdicts, each reached, and what an answer then holds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from diagnosis_runs import GROOVED, Array, Ride, made, term, with_channel, without
from winchkit.diagnosis.diagnose import _unless_at_noise as unless_at_noise
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.results import Diagnosis, OutputFit
from winchkit.diagnosis.selection.time_series import TimeSeriesSelection
from winchkit.diagnosis.steps import standing_of
from winchkit.diagnosis.verdict.decision import verdict_of as decided
from winchkit.effects.term import Term
from winchkit.report.text import report_text
from winchkit.runs.run import Run
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


@cache
def dragged() -> Diagnosis:
    """Of runs with a drag of the motor."""
    return diagnose(runs((DRAG,)), GROOVED).diagnosis


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
    found = verdict_of(dragged(), "explained")
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
    assert not any(step.certain for step in found.steps)
    assert found.unexplained_share > 0.5
    assert {where.output for where in found.where} == {"cable_length"}


def test_a_significant_wave_of_a_fifth_of_the_noise_leaves_the_model_adequate() -> None:
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
    assert found.steps == ()


def output(before: float, after: float, noise: float | None = 1.0) -> OutputFit:
    return OutputFit("N", None, 100.0, before, after, before, after, noise)


@pytest.mark.parametrize(
    ("after", "steps", "verdict"),
    [
        (10.0, 0, "unknown"),
        (1.09, 0, "adequate"),
        (1.09, 2, "explained"),
        (3.2, 1, "explained"),
        (3.5, 1, "partly"),
        (7.0, 1, "partly"),
        (7.2, 1, "unknown"),
    ],
)
def test_the_share_of_the_excess_decides(after: float, steps: int, verdict: str) -> None:
    """E is 99 before; a tenth of it is left at 3.30, a half at 7.11."""
    outputs = {"tension": output(10.0 if steps or after > 2 else after, after)}
    assert told(outputs, steps=steps) == verdict


@pytest.mark.parametrize(("p_value", "verdict"), [(0.01, "adequate"), (1e-4, "unknown")])
def test_an_error_that_repeats_cannot_distinguish_from_their_noise_is_noise(
    p_value: float, verdict: str
) -> None:
    error = replace(output(1.2, 1.2), p_value=p_value)
    assert told({"tension": error}, steps=0) == verdict


def told(outputs: Mapping[str, OutputFit], **changed: Any) -> str:
    """Verdict of a decision in which every output varies and none refutes the model."""
    usual: dict[str, Any] = {
        "steps": 1, "noise_known": True, "deciding": set(outputs), "refuted": (),
        "predictable": lambda: False,
    }  # fmt: skip
    return decided(outputs, **{**usual, **changed})


def test_without_repeats_what_nothing_predicts_is_undecided() -> None:
    outputs = {"tension": output(10.0, 9.0)}
    assert told(outputs, noise_known=False) == "undecided"
    assert told(outputs, noise_known=False, predictable=lambda: True) == "unknown"


def test_an_output_that_decides_nothing_makes_no_model_adequate() -> None:
    outputs = {"tension": output(1.0, 1.0)}
    assert told(outputs, steps=0) == "adequate"
    assert told(outputs, steps=0, deciding=set()) == "undecided"


@pytest.mark.parametrize("steps", [0, 1])
def test_an_output_that_its_own_mean_predicts_better_forbids_the_good_verdicts(steps: int) -> None:
    outputs = {"tension": output(10.0, 1.0)}
    assert told(outputs, steps=steps, refuted={"tension"}) == "unknown"


def test_partly() -> None:
    """A large drag keeps its name beside a wobble of another output that no effect explains."""
    strange = {"cable_length": strange_length(2e-3)}
    found = verdict_of(diagnose(runs((DRAG,), beside=strange), GROOVED).diagnosis, "partly")
    step = found.steps[0]
    assert step.effects == ("motor-coulomb",)
    torque = step.parameters["motor-coulomb"]["torque"]
    assert torque.value == pytest.approx(0.02, abs=5 * torque.std)
    assert "cable_length" in {where.output for where in found.where}
    assert step.certain
    assert 0 < found.unexplained_share <= 0.5


def test_without_repeats_the_answer_says_what_it_rests_on() -> None:
    found = verdict_of(diagnose(runs((DRAG,), repeats=1), GROOVED).diagnosis, "explained")
    assert found.steps[0].effects[0] == "motor-coulomb"
    assert {output.noise_source for output in found.outputs.values()} == {"white noise"}
    assert all(o.noise_upper >= o.noise_rms for o in found.outputs.values())
    assert found.caveats == ("no-repeats",)


def test_a_wrong_value_of_the_profile_is_a_step_with_the_file_s_value_beside() -> None:
    table = EffectTable("motor-coulomb", {"torque": "5 mN m"})
    better = replace(GROOVED, effect=(table,))
    found = verdict_of(diagnose(runs((DRAG,)), better).diagnosis, "explained")
    (step,) = found.steps
    assert step.refitted
    assert step.file_values["torque"] == pytest.approx(5e-3)
    assert step.parameters["motor-coulomb"]["torque"].value == pytest.approx(0.02, rel=0.05)
    assert "motor-coulomb" not in {item.effect for item in found.candidates}
    torque = found.outputs["motor_torque"]
    assert torque.noise_rms is not None
    assert torque.rms_after == pytest.approx(torque.noise_rms, rel=0.1)
    assert torque.rms_before > 1.5 * torque.rms_after


def test_two_hidden_effects_are_both_named() -> None:
    both = (DRAG, term("cell-gain", gain_error=0.02))
    found = verdict_of(diagnose(runs(both), GROOVED).diagnosis, "explained")
    named = [step.effects for step in found.steps]
    assert sorted(effects[0] for effects in named) == ["cell-gain", "motor-coulomb"]


def test_the_order_of_runs_does_not_matter() -> None:
    one, other = dragged(), diagnose(runs((DRAG,))[::-1], GROOVED).diagnosis
    assert one.verdict == other.verdict
    assert [s.effects for s in one.steps] == [s.effects for s in other.steps]
    value = "motor-coulomb", "torque"
    sizes = [d.steps[0].parameters[value[0]][value[1]].value for d in (one, other)]
    assert sizes[0] == pytest.approx(sizes[1], rel=1e-3)


def test_a_clock_that_starts_elsewhere_changes_nothing() -> None:
    later = [replace(run, time=run.time + 1000.0 * n) for n, run in enumerate(runs((DRAG,)))]
    one, other = dragged(), diagnose(later, GROOVED).diagnosis
    assert [s.effects for s in one.steps] == [s.effects for s in other.steps]
    for output, fitted in one.outputs.items():
        assert other.outputs[output].rms_after == pytest.approx(fitted.rms_after, rel=1e-3)


def test_candidates_are_ranked_and_the_first_ones_fitted() -> None:
    found = dragged()
    scores = [item.score for item in found.candidates]
    assert scores == sorted(scores, reverse=True)
    assert len({item.effect for item in found.candidates}) == len(scores)
    best = found.candidates[0]
    assert best.heldout_rms["motor_torque"] == pytest.approx(
        found.outputs["motor_torque"].heldout_rms_after, rel=0.05
    )
    assert found.candidates[-1].heldout_rms == {}


def test_repeats_that_differ_by_as_much_as_the_output_varies_are_unknown() -> None:
    """The noise is known, and nothing else is there: to repeat once more decides nothing."""
    outputs = {"tension": output(1.0, 1.0)}
    assert told(outputs, steps=0, deciding=set(), refuted={"tension"}) == "unknown"
    assert (
        told(outputs, steps=0, deciding=set(), refuted={"tension"}, noise_known=False)
        == "undecided"
    )


def test_a_random_torque_does_not_follow_the_motion() -> None:
    random = np.random.default_rng(5)
    runs = [
        with_channel(
            without(run, "tension", "cable_length"),
            "motor_torque",
            0.5 * random.standard_normal(len(run)),
            "N m",
        )
        for run in (made(seed, load_mass=10.0) for seed in range(4))
    ]
    answer = diagnose(runs, GROOVED)
    assert answer.diagnosis.verdict == "unknown"
    text = " ".join(report_text(answer).split())
    assert "The motor torque does not follow the motion. Repeats of the same motion differ" in text
    assert "record the same motion again" not in text
    assert "Check the instrument of the motor torque" in text


def test_an_addition_where_the_profile_leaves_no_error_above_the_noise_is_no_finding() -> None:
    answer = diagnose(runs((DRAG,)), GROOVED)
    assert isinstance(answer.engine, TimeSeriesSelection)
    found = answer.result
    assert unless_at_noise(answer.engine, found) is found
    noise = replace(found.noise, rms={name: 2.0 * own for name, own in found.noise.rms.items()})
    known = replace(found, initial_model=found.final, initial_noise=noise)
    assert unless_at_noise(answer.engine, known).final is known.initial_model
    changed = found.final.hypothesis.terms[-1].effect.outputs
    own = {name: rms * (2.0 if name in changed else 0.1) for name, rms in found.noise.rms.items()}
    elsewhere = replace(known, initial_noise=replace(found.noise, rms=own))
    bare = replace(elsewhere, initial_model=found.initial_model)
    assert unless_at_noise(answer.engine, elsewhere).noise is elsewhere.initial_noise
    assert unless_at_noise(answer.engine, bare) is bare


@pytest.mark.parametrize(
    ("after", "p_value", "spread", "remaining"),
    [
        (1.01, 0.5, 0.05, ""),
        (1.6, 0.5, 0.05, "only in part"),
        (1.2, 0.5, 1.5, "too uncertain"),
        (1.2, 1e-3, 0.05, "may fit better"),
        (1.02, 1e-3, 0.05, ""),
    ],
)
def test_a_step_is_certain_where_what_it_leaves_is_known_to_be_little(
    after: float, p_value: float, spread: float, remaining: str
) -> None:
    """The error without the step is 4 times the noise: it explains 15 times its power."""
    outputs = {"tension": OutputFit("N", None, 9.0, 4.0, after, 4.0, after, 1.0, p_value=p_value)}
    found = standing_of(
        {"tension": 4.0}, outputs, ["tension"], trusted=True, spread={"tension": spread}
    )
    assert (remaining in found.remaining) if remaining else not found.remaining
    assert standing_of({"tension": 4.0}, outputs, ["tension"], trusted=False).remaining
