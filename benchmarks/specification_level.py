"""How often the specification test takes the name of a right effect away.

``python benchmarks/specification_level.py --benches 10 --draws 60 --json``: random benches of the
diagnosis campaign, each with random effects of the catalogue, alone or two together. The recorded
errors are replaced by the change of these effects (by their own formulas) and by fresh coloured
noise; noise and values are estimated from them, and the right names are tested against free curves.
Every test uses its own noise, so that the share of refusals has a binomial error.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parent))

import numpy as np
from scipy.signal import lfilter
from scipy.stats import beta

from campaign.case import Plan, make_case
from winchkit.arrays import Array
from winchkit.diagnosis.data.dataset import prepare
from winchkit.diagnosis.diagnose import selection_engine
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.prediction_cache import masked
from winchkit.diagnosis.selection.scores import score
from winchkit.diagnosis.selection.stepwise import SelectionResult
from winchkit.diagnosis.selection.time_series import TimeSeriesSelection
from winchkit.diagnosis.verdict.specification_test import SpecificationTest
from winchkit.effects.catalogue import load_catalogue
from winchkit.effects.parametrization import Coordinates
from winchkit.effects.term import Term
from winchkit.runs.read import read_run
from winchkit.schema.read import read_profile

EXPLAINED = (1e2, 1e3, 1e4, 1e5)
"""χ² that an effect explains."""
COLOURS = (0.0, 0.3, 0.6)
"""Share of the noise's power with a correlation time of 0.5 s."""


def noise_rows(
    engine: TimeSeriesSelection, rms: dict[str, float], random: np.random.Generator
) -> Array:
    """Coloured noise of every run and output as rows."""
    regression = engine.regression
    out = np.zeros(regression.n_rows)
    for segment in regression.segments:
        recording = regression.dataset.recordings[segment.run]
        count, colour = segment.band.count, random.choice(COLOURS)
        memory = np.exp(-1 / (0.5 * segment.band.rate))
        driving = random.standard_normal(count + 500) * np.sqrt(1 - memory**2)
        slow = lfilter([1.0], [1.0, -memory], driving)[500:]
        noise = np.sqrt(colour) * slow + np.sqrt(1 - colour) * random.standard_normal(count)
        out[segment.rows] = masked(recording, segment.output, rms[segment.output] * noise)
    return out


def drawn_term(
    engine: TimeSeriesSelection, scores: list, random: np.random.Generator
) -> Term | None:
    """A random effect of the catalogue whose change has a drawn size."""
    item = scores[random.integers(len(scores))]
    effect = item.candidate.effect
    coordinates = Coordinates(effect)
    if effect.probes or effect.memory or item.noncentrality < 1e-6 or engine.signatures is None:
        return None
    times = np.sqrt(random.choice(EXPLAINED) / item.noncentrality) * random.choice([-1.0, 1.0])
    values = {**effect.null, **item.candidate.shape}
    usual = coordinates.vector({**values, **item.candidate.usual_steps[0]})
    vector = coordinates.vector(values) + times * (usual - coordinates.vector(values))
    low, high = coordinates.bounds()
    if abs(times) > 20 or np.any((vector < low) | (vector > high)):
        return None
    return Term(effect, coordinates.values(vector, values))


def as_result(engine: TimeSeriesSelection, hypothesis: Hypothesis) -> SelectionResult:
    """The right model as the result of a selection."""
    initial, first_noise = engine.fit_with_noise(engine.initial_model)
    final, noise = engine.fit_with_noise(hypothesis)
    begun, test = (
        engine.lack_of_fit_test(initial, first_noise),
        engine.lack_of_fit_test(final, noise),
    )
    lack = bool(test.p_value < 0.02)
    return SelectionResult(
        initial, first_noise, begun, True, final.hypothesis, final, noise, test, lack, (), (), 0.0
    )  # fmt: skip


def refusals(seed: int, draws: int) -> list[dict[str, object]]:
    """Every drawn case of one bench, with the curve that took a name away."""
    with tempfile.TemporaryDirectory() as folder:
        case = make_case(seed, Plan("none", 1.0, (), True), Path(folder))
        if case is None:
            return []
        runs = [read_run(path) for path in case.runs]
        profile = read_profile(case.profile)
    engine = selection_engine(prepare(runs, profile), load_catalogue())
    initial, noise = engine.fit_with_noise(engine.initial_model)
    scores = score(engine.projected(initial, noise), initial.residual, engine.regression.n_rows)
    rms, out = dict(noise.rms), []
    random = np.random.default_rng(seed)
    while len(out) < draws:
        count = 1 + (len(out) % 3 == 2)
        terms = [drawn_term(engine, scores, random) for _ in range(count)]
        there = [t for t in terms if t is not None]
        if len(there) < count or len({t.effect.id for t in there}) < count:
            continue
        hypothesis = engine.initial_model
        for term in there:
            hypothesis = hypothesis.with_term(term, engine.regression.n_runs)
        change = engine.regression.change(hypothesis)
        engine.regression.nominal_residual = change + noise_rows(engine, rms, random)
        test = SpecificationTest(engine, as_result(engine, hypothesis))
        groups = [list(test.added)] + ([[i] for i in test.added] if count > 1 else [])
        curves = [c for c in (test.outperforming_curve(group) for group in groups) if c]
        out.append(
            {
                "effects": [t.effect.id for t in there],
                "refused": bool(curves),
                "curve": f"{curves[0].place} over {curves[0].variable}" if curves else None,
            }
        )
    return out


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--benches", type=int, default=10)
    parser.add_argument("--draws", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    cases: list[dict[str, object]] = []
    for index in range(args.benches):
        own = refusals(args.seed * 1000 + index, args.draws)
        cases += own
        print(index, sum(bool(c["refused"]) for c in cases), len(cases), file=sys.stderr)
    refused = [case for case in cases if case["refused"]]
    n, x = len(cases), len(refused)
    interval = [
        float(beta.ppf(0.025, x, n - x + 1)) if x else 0.0,
        float(beta.ppf(0.975, x + 1, n - x)),
    ]
    result = {"cases": n, "refused": x, "rate": x / n, "interval": interval, "which": refused}
    print(json.dumps(result, indent=1) if args.json else result)


if __name__ == "__main__":
    main()
