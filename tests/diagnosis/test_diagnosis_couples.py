"""Two effects that hide each other, so that neither helps alone."""

from __future__ import annotations

from diagnosis_runs import GROOVED, Ride, made, term

from winchkit.diagnosis.couples import couples
from winchkit.diagnosis.dataset import prepare
from winchkit.diagnosis.diagnose import diagnose, inquire
from winchkit.effects.catalogue import load_catalogue

RIDE = Ride(samples=600, stroke=400.0)
MASSES = (18.0, 20.0, 22.0)
HIDDEN = (term("cell-gain", gain_error=-0.05), term("cell-offset", offset=0.05 * 20 * 9.80665))
"""Under about 20 kg the cell reads right."""
RUNS = [
    made(10 * i + k, GROOVED, HIDDEN, load_mass=mass, ride=RIDE)
    for i, mass in enumerate(MASSES)
    for k in range(2)
]


def test_a_gain_that_an_offset_hides_scores_with_it() -> None:
    inquiry = inquire(prepare(RUNS, GROOVED), load_catalogue())
    present, noise = inquiry.settle(inquiry.begin)
    scores = inquiry.scores(present, noise)
    alone = {s.atom.effect.id: s.gain for s in scores}
    projected = inquiry.projected(present, noise)
    pairs = couples(projected, present.residual, scores, inquiry.price)
    named = [{a.atom.effect.id, b.atom.effect.id} for a, b in pairs]
    assert {"cell-gain", "cell-offset"} in named
    assert alone["cell-offset"] < 0.5 * present.cost
    assert len(pairs) <= 3


def test_both_are_found() -> None:
    found = diagnose(RUNS, GROOVED).diagnosis
    assert found.verdict == "explained"
    named = [set(step.effects) for step in found.steps]
    assert len(named) == 2
    assert any("cell-gain" in names for names in named)
    assert any("cell-offset" in names for names in named)
