"""Ablation of the diagnosis: each rule off by itself, the same cases diagnosed again.

``python benchmarks/ablation.py --tidy 40 --friction 24 --garbage 8 --profiles 8 --loggers 24
--seed 1``: for each rule of the table below the cases that are lost and won without it, and the
processor time. A rule without which nothing is lost is a candidate for deletion, once a larger
campaign agrees. ``--rule NAME`` runs some of them. See benchmarks/README.md.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest import mock

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parent))

import numpy as np

from campaign.case import make_case
from campaign.family.answers import answer as family_answer
from campaign.family.run import Job, line_of, write_case
from campaign.family.score import fails
from campaign.logger_case import LoggerPlan, make_logger_case
from campaign.logger_case import answer as logger_answer
from campaign.run import answer
from diagnosis_campaign import KINDS, LOGGER_SNRS, plans
from winchkit.diagnosis import search
from winchkit.diagnosis.selection.weighting import Reweighted

HOUSE = "winchkit.diagnosis"
SNRS = (1.0, 3.0, 10.0)
LIMIT = 60.0
"""Processor time of one diagnosis, s."""


def _nothing(*_: Any, **__: Any) -> None:
    return None


def _no(*_: Any, **__: Any) -> bool:
    return False


def _first(first: Any, *_: Any, **__: Any) -> Any:
    return first


def _second(_: Any, second: Any, *__: Any, **___: Any) -> Any:
    return second


def _none_masked(measured: Any, *_: Any, **__: Any) -> Any:
    return np.zeros(len(measured), dtype=bool)


RULES: Mapping[str, Mapping[str, Any]] = {
    "offset per run": {"search.with_offsets_where_better": lambda data, found, *_: (data, found)},
    "impacts left out": {"search.without_impacts": _nothing},
    "rounded reversals": {"search.scanned_transitions": lambda *_: {}},
    "fitted transitions": {
        "search.with_fitted_transitions": _second,
        "diagnose.with_fitted_transitions": _second,
    },
    "search without degenerate laws": {
        "search._with_plain_laws": lambda engine, result, _: (
            engine,
            search._simplified(engine, result),
        )
    },
    "simplest laws": {"search.simplified": lambda _, final, noise, __: (final, noise)},
    "equal weights": {"diagnose.reweighted": lambda _, fitted, noise: Reweighted(fitted, noise)},
    "order by contribution": {"diagnose.ordered_by_contribution": _second},
    "joint fit of first members": {
        "diagnose.with_first_members": lambda _, final, __, sets: (final, sets)
    },
    "refitted values": {"diagnose.refitted_steps": lambda *_: ()},
    "open laws": {"diagnose.better_curve": _nothing},
    "small steps": {"diagnose.is_small": _no},
    "predictable residual": {"diagnose.predictable_share": lambda *_: 0.0},
    "pairs": {"selection.stepwise._best_pair": _nothing},
    "exchange for a pair": {"selection.stepwise.pair_exchange": _second},
    "exchange": {"selection.stepwise._exchanged_terms": _second},
    "minor terms": {"selection.stepwise._without_minor_terms": lambda _, p, noise: (p, noise)},
    "other grid point": {"selection.stepwise.other_grid_point": _no},
    "explained by initial states": {"selection.engine.explained_by_initial_states": _no},
    "minor orders": {
        "selection.engine.significant_orders": lambda _, fitted, *__: fitted.hypothesis
    },
    "truncated series": {"selection.engine.truncated_series": lambda effect: (effect,)},
    "shape at its bound": {"selection.engine.shape_at_bound": _no},
    "start without discretisation": {
        "selection.engine.SelectionEngine._without_discretization": lambda *_: []
    },
    "discretisation in the lack of fit": {
        "selection.time_series.without_discretization_error": lambda _, fitted, __: fitted.residual
    },
    "onset scan": {"selection.time_series.best_onset": _nothing},
    "further orders": {"selection.time_series.further_orders": lambda *_: ()},
    "denoised inputs": {"data.dataset.denoised_motions": lambda _, __, raw, ___: raw},
    "transients": {"data.dataset.transient_mask": _none_masked},
    "uncertain force": {"data.dataset.uncertain_force_mask": _none_masked},
    "standstills": {"data.dataset.standstill_mask": _none_masked},
    "zeroed anew": {"data.dataset.zeroed_anew": _nothing},
    "angles from zero": {"data.dataset.angles_from_zero": lambda _: []},
    "outlying repeats": {"data.dataset._outlying": _nothing},
    "rounded alike": {"data.dataset.rounded_alike": lambda *_: []},
    "overdispersion": {"verdict.equivalence.overdispersed": lambda _, __, noise: noise},
    "waves of one load": {"verdict.equivalence._waves_of_one_load": _no},
    "beside another": {"verdict.equivalence._beside_another": _no},
    "listed as confusable": {"verdict.equivalence._is_listed": _no},
    "adds nothing": {"verdict.equivalence._adds_nothing": _no},
    "coarse fits": {"selection.time_series.TimeSeriesSelection.coarse_problem": _nothing},
}


@contextmanager
def without(rule: str) -> Iterator[None]:
    """The diagnosis without a rule."""
    with ExitStack() as stack:
        for target, replacement in RULES.get(rule, {}).items():
            stack.enter_context(mock.patch(f"{HOUSE}.{target}", replacement))
        yield


@dataclass(frozen=True)
class Item:
    """A case that was made, and how its answer is judged."""

    name: str
    judged: Callable[[], tuple[bool, str]]
    """Whether the answer is right, and the answer."""


def items(args: argparse.Namespace, folder: Path) -> Iterator[Item]:
    """All cases, made once."""
    for index, plan in enumerate(plans(args.tidy, list(KINDS), list(SNRS), (), small=True)):
        seed = args.seed * 100_000 + index
        if (case := make_case(seed, plan, folder / f"tidy-{index}")) is not None:
            yield Item(f"tidy {seed} {plan.kind}", lambda case=case: _tidy(case))
    for kind in ("friction", "garbage", "profiles"):
        for index in range(getattr(args, kind)):
            job = Job(kind, args.seed, index, LIMIT)
            made = job.case()
            runs, profile = write_case(made, folder / f"{kind}-{index}")
            yield Item(
                f"{kind} {job.number}",
                lambda job=job, made=made, runs=runs, profile=profile: _family(
                    line_of(job, made, family_answer(runs, profile, LIMIT))
                ),
            )
    for index in range(args.loggers):
        seed, snr = args.seed * 100_000 + index, (0.0, *LOGGER_SNRS)[index % 4]
        made_case = make_logger_case(seed, LoggerPlan(snr, "", "", True), folder / f"log-{index}")
        if made_case is not None:
            yield Item(f"logger {seed}", lambda case=made_case: _logger(case))


def _tidy(case: Any) -> tuple[bool, str]:
    score = answer(case)
    return score.ok, f"{score.truth} -> {score.verdict} {score.steps} {score.wrong_single_names}"


def _family(line: Mapping[str, Any]) -> tuple[bool, str]:
    named = [step["effects"] for step in line["steps"]]
    return not fails(line), f"{line['truth']['words']} -> {line['verdict']} {named}"


def _logger(case: Any) -> tuple[bool, str]:
    score = logger_answer(case)
    return score.ok, score.line


def judged(cases: Sequence[Item], rule: str) -> tuple[dict[str, tuple[bool, str]], float]:
    """Answers to all cases without a rule, and the processor time, s."""
    begun = time.process_time()
    with without(rule):
        out = {}
        for item in cases:
            try:
                out[item.name] = item.judged()
            except Exception as error:  # noqa: BLE001 - a crash is a lost case
                out[item.name] = False, f"{type(error).__name__}: {error}"
    return out, time.process_time() - begun


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    for kind in ("tidy", "friction", "garbage", "profiles", "loggers"):
        parser.add_argument(f"--{kind}", type=int, default=4)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--rule", action="append", choices=RULES)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        cases = list(items(args, Path(folder)))
        whole, seconds = judged(cases, "")
        right = sum(ok for ok, _ in whole.values())
        print(f"all rules: {right} of {len(cases)} right, {seconds:.0f} s", flush=True)
        for name, (ok, said) in whole.items():
            if not ok:
                print(f"  wrong with all rules: {name}: {said}", flush=True)
        for rule in args.rule or RULES:
            less, took = judged(cases, rule)
            lost = [name for name in whole if whole[name][0] and not less[name][0]]
            won = [name for name in whole if less[name][0] and not whole[name][0]]
            print(
                f"{rule:36} lost {len(lost)} won {len(won)} time {took / seconds:.2f}", flush=True
            )
            for sign, names in (("lost", lost), ("won", won)):
                for name in names:
                    print(f"  {sign} {name}: {less[name][1]}", flush=True)


if __name__ == "__main__":
    main()
