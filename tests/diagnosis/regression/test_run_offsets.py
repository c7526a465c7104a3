"""Offsets between runs without repeats: found, estimated, and never where there are none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binomtest

from diagnosis_runs import GROOVED, Array, Ride, made, term, with_channel
from winchkit.diagnosis.add import add, remove
from winchkit.diagnosis.compare import compare
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.regression import run_offsets
from winchkit.diagnosis.regression.gls import Fit, fit
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.run_offsets import offset_between_runs, with_run_offsets
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.report.text import report_text
from winchkit.runs.run import Run
from winchkit.schema.profiles.winch import EffectTable

FRICTION = term("motor-coulomb", torque=0.03)
SHIFTS = (0.04, -0.05, 0.02)
NOISE = 0.004
RIDE = Ride(samples=400)


def ridden(masses: Sequence[float] = (10.0, 10.0, 10.0)) -> list[Run]:
    """Runs of three different motions with friction."""
    return [
        made(
            k, GROOVED, [FRICTION], {"motor_torque": NOISE}, load_mass=mass,
            ride=replace(RIDE, stroke=300.0 + 90.0 * k, period=4.0 + k),
        )
        for k, mass in enumerate(masses)
    ]  # fmt: skip


def moved(runs: Sequence[Run], changes: Sequence[float | Array]) -> list[Run]:
    return [
        with_channel(run, "motor_torque", run["motor_torque"] + change, "N m")
        for run, change in zip(runs, changes, strict=True)
    ]


def beside_friction(runs: Sequence[Run]) -> tuple[TimeSeriesRegression, Fit]:
    regression = TimeSeriesRegression(prepare(runs, GROOVED))
    model = Hypothesis().with_term(FRICTION, len(runs))
    return regression, fit(regression, model, np.full(regression.n_rows, 1 / NOISE))


def test_an_offset_of_every_run_is_found_with_its_standard_deviation() -> None:
    regression, fitted = beside_friction(moved(ridden(), SHIFTS))
    found = offset_between_runs(regression, fitted, "motor_torque")
    assert found is not None
    assert (found.code, found.channel) == ("zeroed-anew", "motor_torque")
    assert found.value == pytest.approx(np.std(SHIFTS, ddof=1), rel=0.05)
    grown = with_run_offsets(regression.dataset, regression, fitted)
    assert grown is not None
    assert grown.zeroed_anew == {"motor_torque"}
    assert TimeSeriesRegression(grown).n_run_offsets == 3


@pytest.mark.slow
def test_noise_alone_has_offsets_at_the_level_of_the_test(monkeypatch: pytest.MonkeyPatch) -> None:
    """400 draws of the null at 5 %; at the level of 10⁻⁴ that applies, none."""
    regression, fitted = beside_friction(ridden())
    random = np.random.default_rng(3)
    draws = [
        replace(fitted, residual=NOISE * random.standard_normal(regression.n_rows))
        for _ in range(400)
    ]
    assert not any(offset_between_runs(regression, drawn, "motor_torque") for drawn in draws)
    monkeypatch.setattr(run_offsets, "LEVEL", 0.05)
    monkeypatch.setattr(run_offsets, "is_random_walk", lambda means: False)
    found = sum(
        offset_between_runs(regression, drawn, "motor_torque") is not None for drawn in draws
    )
    assert binomtest(found, 400, 0.05).pvalue > 0.001


@pytest.mark.parametrize("kind", ["load", "wander"])
def test_what_may_be_something_else_is_no_new_zero(kind: str) -> None:
    """An unknown effect of the load, and an instrument that is_random_walk from a common zero."""
    random = np.random.default_rng(2)
    if kind == "load":
        masses = (10.0, 25.0, 40.0)
        runs = moved(ridden(masses), [0.002 * mass for mass in masses])
    else:
        walks = [np.cumsum(random.normal(0.0, 0.002, RIDE.samples)) for _ in range(3)]
        runs = moved(ridden(), walks)
    regression, fitted = beside_friction(runs)
    assert offset_between_runs(regression, fitted, "motor_torque") is None


@pytest.mark.slow
def test_friction_is_named_beside_offsets_that_the_report_lists() -> None:
    clean, shifted = ridden(), moved(ridden(), SHIFTS)
    before, answer = diagnose(clean, GROOVED).diagnosis, diagnose(shifted, GROOVED)
    after = answer.diagnosis
    assert (before.verdict, after.verdict) == ("explained", "explained")
    assert [f.code for f in before.sanity] == []
    for found in (before, after):
        (step,) = found.steps
        assert step.parameters["motor-coulomb"]["torque"].value == pytest.approx(0.03, rel=0.05)
    assert before.run_offsets == ()
    listed = {offset["run"]: offset for offset in after.to_json()["run_offsets"]}
    for run, shift in zip(shifted, SHIFTS, strict=True):
        own = listed[run.name]
        assert abs(own["value"] - shift) < 4 * own["std"] + 1e-4
    text = report_text(answer)
    assert "offset of each run" in text
    assert "is estimated from every run itself" in " ".join(text.split())


def test_add_and_remove_estimate_an_offset_of_every_run_as_a_diagnosis_does() -> None:
    shifted = moved(ridden(), SHIFTS)
    added = add("motor-coulomb", shifted, GROOVED)
    torque = added.added[1]["torque"]
    assert abs(torque.value - 0.03) < 4 * torque.std
    fitted = added.outputs["motor_torque"]
    assert fitted.heldout_rms_after < 1.1 * NOISE
    assert any("the offset differs between runs" in note for note in added.notes)
    sticky = replace(GROOVED, effect=(EffectTable("motor-coulomb", {"torque": "0.03 N m"}),))
    removed = remove("motor-coulomb", shifted, sticky)
    left = removed.outputs["motor_torque"]
    assert left.heldout_rms_before < 1.1 * NOISE
    assert left.heldout_rms_after > 4 * NOISE


def test_compare_states_the_error_with_an_offset_per_run_beside_the_whole_error() -> None:
    sticky = replace(GROOVED, effect=(EffectTable("motor-coulomb", {"torque": "0.03 N m"}),))
    found = compare(moved(ridden(), SHIFTS), sticky)
    error = found.outputs["motor_torque"]
    whole = float(np.sqrt(np.mean(np.square(SHIFTS))))
    assert error.rms == pytest.approx(whole, rel=0.05)
    assert error.rms_with_run_offsets is not None
    assert error.rms_with_run_offsets < 1.1 * NOISE < error.rms
    assert error.rms_with_run_offsets == error.to_json()["rms_with_run_offsets"]
    assert any("with an offset per run the error is" in note for note in found.notes)
    assert compare(ridden(), sticky).outputs["motor_torque"].rms_with_run_offsets is None
