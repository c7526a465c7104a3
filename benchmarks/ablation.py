"""Ablation of the diagnosis: each rule off by itself, the same cases diagnosed again.

``python benchmarks/ablation.py --tidy 40 --friction 24 --garbage 8 --profiles 8 --loggers 24
--seed 1``: for each rule of the table below the number of cases in which it changes anything, and
of (at most twelve of) these the ones that are lost and won without it. A rule that never acts, or
without which nothing is lost, is a candidate for deletion, once a larger campaign agrees.
``--rule NAME`` judges some of them. See benchmarks/README.md.
"""

from __future__ import annotations

import argparse
import os
import pkgutil
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
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
    "search without degenerate laws": {"search.degenerate_laws": lambda *_: set()},
    "simplest laws": {"search.simplified": lambda _, final, noise, __: (final, noise)},
    "equal weights": {"diagnose.reweighted": lambda _, fitted, noise: Reweighted(fitted, noise)},
    "order by contribution": {"diagnose.ordered_by_contribution": _second},
    "joint fit of first members": {
        "diagnose.with_first_members": lambda _, final, __, sets: (final, sets)
    },
    "refitted values": {"diagnose.refitted_steps": lambda *_: ()},
    "open laws": {"diagnose.open_law": _nothing},
    "compensations": {"diagnose.with_compensations": lambda _, __, ___, steps: steps},
    "imitated curve": {"search.CurveInstead.__call__": _no},
    "small steps": {"diagnose.is_small": _no},
    "predictable residual": {"diagnose.predictable_share": lambda *_: 0.0},
    "rounded law": {"diagnose._rounded_law": lambda *_: ""},
    "unless at the noise": {"diagnose._unless_at_noise": _second},
    "delays last": {"search._with_delays_last": lambda engine, result, _: (engine, result)},
    "oversized": {"steps.oversized": _nothing},
    "short record": {"steps.short_record": _nothing},
    "asymmetric friction": {"steps.asymmetric_friction": _nothing},
    "unresolved order": {"steps.unresolved_order": _nothing},
    "miscounted turns": {"steps.miscounted_turns": _nothing},
    "curve beside": {"verdict.open_law._beside": _nothing},
    "beside an unknown law": {"verdict.compensation.beside_unknown": _first},
    "transfers": {"verdict.laws.transfers": lambda *_: True},
    "needless steps": {"verdict.laws._without_needless": _nothing},
    "pairs": {"selection.stepwise._best_pair": _nothing},
    "spoils": {"selection.stepwise.spoils": _no},
    "unknown cause": {"verdict.equivalence._where_explained": lambda _, rival, *__: rival.residual},
    "exchange for a pair": {"selection.stepwise.pair_exchange": _second},
    "rest imitated": {"selection.stepwise._imitates_rest": _no},
    "truncated series": {"selection.engine.truncated_series": lambda effect: (effect,)},
    "shape at its bound": {"selection.engine.shape_at_bound": _no},
    "discretisation in the lack of fit": {
        "selection.time_series.without_discretization_error": lambda _, fitted, __: fitted.residual
    },
    "onset scan": {"selection.time_series.best_onset": _nothing},
    "further orders": {"selection.time_series.further_orders": lambda *_: ()},
    "denoised inputs": {"data.dataset.denoised_motions": lambda _, __, raw, ___: raw},
    "transients": {"data.dataset.transient_mask": _none_masked},
    "uncertain force": {"data.dataset.uncertain_force_mask": _none_masked},
    "standstills": {"data.dataset.standstill_mask": _none_masked},
    "zeroed anew": {"data.preparation.zeroed_anew": _nothing},
    "angles from zero": {"data.preparation.angles_from_zero": lambda _: []},
    "outlying repeats": {"data.preparation._outlying": _nothing},
    "rounded alike": {"data.preparation.rounded_alike": lambda *_: []},
    "overdispersion": {"verdict.equivalence.overdispersed": lambda _, __, noise: noise},
    "waves of one load": {"verdict.equivalence._waves_of_one_load": _no},
    "beside another": {"verdict.equivalence._beside_another": _no},
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


@contextmanager
def watched() -> Iterator[set[str]]:
    """The whole diagnosis; gives the rules that have changed anything in it."""
    acted: set[str] = set()

    def watch(rule: str, own: Any, replacement: Callable[..., Any]) -> Callable[..., Any]:
        def call(*args: Any, **kwargs: Any) -> Any:
            found = own(*args, **kwargs)
            if rule not in acted and not _same(found, replacement(*args, **kwargs)):
                acted.add(rule)
            return found

        return call

    with ExitStack() as stack:
        for rule, targets in RULES.items():
            for target, replacement in targets.items():
                place = f"{HOUSE}.{target}"
                own = pkgutil.resolve_name(place)
                stack.enter_context(mock.patch(place, watch(rule, own, replacement)))
        yield acted


def _same(found: Any, other: Any) -> bool:
    """Whether a rule's result is that without the rule."""
    if isinstance(found, np.ndarray):
        known = isinstance(other, np.ndarray)
        return known and np.array_equal(found, other, equal_nan=found.dtype.kind == "f")
    if isinstance(found, tuple | list):
        alike = isinstance(other, tuple | list) and len(found) == len(other)
        return alike and all(map(_same, found, other))
    if isinstance(found, Reweighted):
        return isinstance(other, Reweighted) and found.fit is other.fit
    return found is other or (isinstance(found, str | int | float | dict) and found == other)


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


def judged(item: Item) -> tuple[bool, str]:
    """Whether a case is answered right, and the answer."""
    try:
        return item.judged()
    except Exception as error:  # noqa: BLE001 - a crash is a lost case
        return False, f"{type(error).__name__}: {error}"


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    for kind in ("tidy", "friction", "garbage", "profiles", "loggers"):
        parser.add_argument(f"--{kind}", type=int, default=4)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--most", type=int, default=12, help="cases that a rule is judged by")
    parser.add_argument("--rule", action="append", choices=RULES)
    args = parser.parse_args()
    rules = args.rule or list(RULES)
    with tempfile.TemporaryDirectory() as folder:
        whole: dict[str, tuple[bool, str]] = {}
        acted: dict[str, list[Item]] = {rule: [] for rule in rules}
        for item in items(args, Path(folder)):
            with watched() as there:
                whole[item.name] = judged(item)
            for rule in there & set(rules):
                acted[rule].append(item)
            if not whole[item.name][0]:
                print(f"wrong with all rules: {item.name}: {whole[item.name][1]}", flush=True)
        right = sum(ok for ok, _ in whole.values())
        print(f"all rules: {right} of {len(whole)} right", flush=True)
        for rule in rules:
            words = []
            cases = acted[rule][:: max(1, -(-len(acted[rule]) // args.most))]
            for item in cases:
                with without(rule):
                    ok, said = judged(item)
                if ok != whole[item.name][0]:
                    words.append(f"  {'won' if ok else 'lost'} {item.name}: {said}")
            lost = sum(word.startswith("  lost") for word in words)
            print(
                f"{rule:36} acts in {len(acted[rule])}, of {len(cases)}: lost {lost}, "
                f"won {len(words) - lost}",
                *words,
                sep="\n",
                flush=True,
            )


if __name__ == "__main__":
    main()
