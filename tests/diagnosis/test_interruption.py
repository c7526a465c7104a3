"""Progress of a diagnosis, and what is known when it is interrupted."""

from __future__ import annotations

import pytest

from diagnosis_runs import GROOVED, Ride, made, term
from winchkit.diagnosis.diagnose import WinchAnswer, diagnose
from winchkit.report.text import report_text
from winchkit.runs.run import Run

RIDE = Ride(samples=600)
RADIUS = term("drum-radius", radius_error=1e-3)


@pytest.fixture(scope="module")
def runs() -> list[Run]:
    return [
        made(2 * mass + seed, GROOVED, (RADIUS,), load_mass=float(mass), ride=RIDE)
        for mass in (10, 25)
        for seed in range(2)
    ]


@pytest.fixture(scope="module")
def ended(runs: list[Run]) -> tuple[WinchAnswer, list[tuple[str, float]]]:
    """A diagnosis that was not interrupted, and its progress."""
    told: list[tuple[str, float]] = []
    answer = diagnose(runs, GROOVED, progress=lambda what, share: told.append((what, share)))
    return answer, told


@pytest.mark.slow
def test_the_bar_moves_with_every_candidate_and_never_back(
    ended: tuple[WinchAnswer, list[tuple[str, float]]],
) -> None:
    _, told = ended
    shares = [share for _, share in told]
    assert shares == sorted(shares)
    assert shares[0] >= 0.0
    assert shares[-1] <= 1.0
    assert sum(what.startswith("fitting ") for what, _ in told) > 2
    assert any(what == "fitting drum-radius" for what, _ in told)


def test_an_interrupt_in_the_search_gives_errors_and_candidates(runs: list[Run]) -> None:
    known: list[WinchAnswer] = []

    def pressed(what: str, share: float) -> None:
        if what.startswith("fitting "):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        diagnose(runs, GROOVED, progress=pressed, interrupted=known.append)
    (answer,) = known
    plain = answer.diagnosis.to_json()
    assert plain["interrupted"]
    assert plain["verdict"] is None
    assert not plain["steps"]
    assert {plain["candidates"][n]["effect"] for n in (0, 1)} == {"drum-radius", "gear-ratio"}
    length = answer.diagnosis.outputs["cable_length"]
    assert length.heldout_rms_before > 3 * length.noise_rms
    assert report_text(answer).startswith("INTERRUPTED\n")


def test_an_interrupt_before_the_scores_gives_nothing(runs: list[Run]) -> None:
    def pressed(what: str, share: float) -> None:
        if what == "testing which effects fit":
            raise KeyboardInterrupt

    known: list[WinchAnswer] = []
    with pytest.raises(KeyboardInterrupt):
        diagnose(runs, GROOVED, progress=pressed, interrupted=known.append)
    assert not known


def test_a_diagnosis_that_ends_is_not_interrupted(
    ended: tuple[WinchAnswer, list[tuple[str, float]]],
) -> None:
    plain = ended[0].diagnosis.to_json()
    assert plain["verdict"] == "explained"
    assert plain["interrupted"] is False
