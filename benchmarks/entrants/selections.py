"""Usual ways to select terms, on the signatures that winchkit's own search begins with.

Each is used as its authors do; thresholds and penalties are chosen on blocks of time. They have no
repeats, sets or verdicts: what they select they name.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from time import process_time
from typing import Any

import numpy as np

from campaign.rivals import (
    ALPHA,
    Regression,
    bic_forward,
    lasso,
    regression_of,
    stlsq,
    threshold_of,
)
from entrants.case import Case
from winchkit.arrays import Array
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.search import selection_engine
from winchkit.effects.catalogue import load_catalogue

CERTAIN, NAMED = 0.95, 0.5
"""Inclusion probabilities of E-SINDy; the median of the coefficients is zero below one half."""


def answers(case: Case) -> Iterator[tuple[str, dict[str, Any]]]:
    """BIC, lasso, STLSQ and E-SINDy on one regression; its time is counted for each."""
    start = process_time()
    engine = selection_engine(prepare(case.runs, case.profile), load_catalogue())
    data = regression_of(engine)
    shared = process_time() - start
    every = np.ones(len(data.effects))
    for name, select in (
        ("BIC forward", bic_forward),
        ("LassoCV, block folds", lasso),
        ("STLSQ", stlsq),
        ("E-SINDy", None),
    ):
        start = process_time()
        probability = inclusion(data) if select is None else every
        chosen = select(data) if select else [int(i) for i in np.flatnonzero(probability >= NAMED)]
        effects: dict[str, float] = {}
        for i in chosen:
            effects[data.effects[i]] = max(probability[i], effects.get(data.effects[i], 0.0))
        answer = {
            "verdict": "effects" if effects else "none",
            "effects": [{"names": [k], "certain": bool(p >= CERTAIN)} for k, p in effects.items()],
            "predicted": case.predicted(held_out(case, data, engine.initial_model, chosen)),
        }
        yield name, answer | {"seconds": shared + process_time() - start}


def held_out(case: Case, data: Regression, present: Hypothesis, chosen: list[int]) -> Array:
    """Change of the held-out run by the chosen columns, fitted by least squares."""
    solved = np.linalg.lstsq(data.columns[:, chosen], data.residual, rcond=1e-8)[0]
    here = case.change(present)
    total = here.copy()
    for i, coefficient in zip(chosen, solved, strict=True):
        step = case.change(present.with_term(data.terms[i], 1)) - here
        total += coefficient * data.steps[i] * step
    return total


def inclusion(data: Regression) -> Array:
    """Share of twenty bootstrap models that have each term (Fasel and others 2022, bagging)."""
    from pysindy.optimizers import STLSQ, EnsembleOptimizer

    model = EnsembleOptimizer(STLSQ(threshold=threshold_of(data), alpha=ALPHA), bagging=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model.fit(data.columns * np.sqrt(len(data.residual)), data.residual[:, None])
    return np.mean([np.ravel(one) != 0 for one in model.coef_list], axis=0)
