"""The time of a slip is found between the points of its grid."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis_runs import CATALOGUE, GROOVED, NOISE, Ride, made, term
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.data.spectrum import to_frequency, to_time
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.regression.noise import noise_saturated
from winchkit.diagnosis.search import selection_engine
from winchkit.diagnosis.selection.candidates import with_grid_points
from winchkit.diagnosis.selection.onset import best_onset, onset_of
from winchkit.runs.run import Run

RIDE = Ride(samples=2500)
SLIP = CATALOGUE["encoder-slip"]


def slipped(time: float) -> list[Run]:
    hidden = (term("encoder-slip", step=0.02, time=time),)
    return [made(seed, GROOVED, hidden, load_mass=10.0 + seed, ride=RIDE) for seed in range(3)]


@pytest.mark.parametrize("time", [7.3, 25.9, 38.7])
def test_the_score_has_its_maximum_at_the_onset(time: float) -> None:
    engine = selection_engine(prepare(slipped(time), GROOVED), CATALOGUE)
    regression, present = engine.regression, engine.initial_model
    residual = regression.residual(present)
    noise = noise_saturated(regression, residual, np.zeros((regression.n_rows, 0)))
    found = best_onset(regression, present, noise.inverse_sigma(regression), SLIP)
    assert found is not None
    assert found[0] == pytest.approx(time, abs=0.4)
    assert found[1] > 2 * np.log(regression.n_rows)
    # It is a point of the grid from which a fit begins.
    extended = next(e for e in engine._candidates if e.id == SLIP.id)
    assert min(abs(point - time) for point in extended.parameter("time").grid) <= 0.4


@pytest.mark.parametrize("time", [7.3, 38.7])
def test_the_best_onset_is_that_of_a_regression_at_every_time(time: float) -> None:
    engine = selection_engine(prepare(slipped(time), GROOVED), CATALOGUE)
    regression, present = engine.regression, engine.initial_model
    residual = regression.residual(present)
    noise = noise_saturated(regression, residual, np.zeros((regression.n_rows, 0)))
    weight = noise.inverse_sigma(regression) * np.where(np.arange(regression.n_rows) % 2, 1.0, 1.5)
    found = best_onset(regression, present, weight, SLIP)
    assert found is not None

    whole = present.with_term(term("encoder-slip", step=0.02, time=0.0), regression.n_runs)
    change = regression.change(whole) - regression.change(present)
    known = regression.jacobian(regression.vector(present), present)

    def decrease(at: float) -> float:
        """Of χ², by least squares with and without the change from that time on."""
        column = np.zeros((regression.n_rows, 1))
        for segment in regression.segments:
            later = regression.motions[segment.run].time >= at
            own = to_time(change[segment.rows], segment.band) * later
            column[segment.rows, 0] = to_frequency(own, segment.band)
        chi_square = []
        for columns in (known, np.hstack([known, column])):
            whitened = columns * weight[:, None]
            amplitudes, *_ = np.linalg.lstsq(whitened, residual * weight, rcond=None)
            left = residual * weight - whitened @ amplitudes
            chi_square.append(float(left @ left))
        return chi_square[0] - chi_square[1]

    best = max(0.4 * np.arange(1.0, 125.0), key=decrease)
    assert found[0] == pytest.approx(best)
    assert found[1] == pytest.approx(decrease(best), rel=1e-6)


def test_without_a_slip_no_onset_is_added() -> None:
    runs = [made(seed, GROOVED, load_mass=10.0 + seed, ride=RIDE) for seed in range(3)]
    engine = selection_engine(prepare(runs, GROOVED), CATALOGUE)
    (same,) = [effect for effect in engine._candidates if effect.id == SLIP.id]
    assert same is SLIP


def test_an_onset_is_a_point_of_the_grid_and_nothing_else_changes() -> None:
    parameter = onset_of(SLIP)
    assert parameter is not None
    assert parameter.name == "time"
    longer = with_grid_points(SLIP, "time", [33.3])
    assert set(longer.parameter("time").grid) == {*parameter.grid, 33.3}
    assert longer.parameter("step") == SLIP.parameter("step")
    assert onset_of(CATALOGUE["drum-radius"]) is None


@pytest.mark.slow
@pytest.mark.parametrize("time", [25.9, 38.7])
def test_a_slip_between_the_points_of_the_grid_is_named(time: float) -> None:
    found = diagnose(slipped(time), GROOVED).diagnosis
    assert [step.effects for step in found.steps] == [("encoder-slip",)]
    values = found.steps[0].parameters["encoder-slip"]
    assert values["time"].value == pytest.approx(time, abs=0.05)
    assert values["step"].value == pytest.approx(0.02, abs=4 * values["step"].std)
    assert NOISE["cable_length"] == pytest.approx(
        found.outputs["cable_length"].heldout_rms_after, rel=0.1
    )
