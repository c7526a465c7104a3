"""Scores: what an answer is worth against the truth, and the figures of a campaign."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from campaign.case import Case
from campaign.sizes import CATALOGUED
from campaign.truth import Hidden

AIMS = {
    "none": {"alarm": "<= 0.05", "named": "<= 0.01"},
    "single": {"truth_in_first": ">= 0.98", "wrong_single_name": "<= 0.005"},
    "pair": {"all_found": ">= 0.92"},
    "outside": {"unknown_or_partly": ">= 0.97", "wrong_single_name": "<= 0.02"},
}


@dataclass(frozen=True)
class Interval:
    """A fitted value of a hidden effect, beside what is true."""

    effect: str
    parameter: str
    true: float
    value: float
    low: float
    high: float
    off: float
    """Deviation in standard deviations."""

    @property
    def covers(self) -> bool:
        """Whether the 95 % interval holds the truth."""
        return self.low <= self.true <= self.high


@dataclass(frozen=True)
class Score:
    """One case's answer."""

    seed: int
    kind: str
    snr: float
    hidden: dict[str, dict[str, float]]
    truth: tuple[str, ...]
    verdict: str
    steps: tuple[tuple[str, ...], ...]
    share: float
    p_value: float
    truth_in_first: bool
    wrong_single_names: tuple[str, ...]
    found: int
    heldout_over_noise: float
    intervals: tuple[Interval, ...]
    seconds: float
    scene: str

    @classmethod
    def read(cls, line: Mapping[str, Any]) -> Score:
        """From JSON."""
        lists = {
            "truth": tuple(line["truth"]),
            "steps": tuple(tuple(s) for s in line["steps"]),
            "wrong_single_names": tuple(line["wrong_single_names"]),
            "intervals": tuple(Interval(**i) for i in line["intervals"]),
        }
        return cls(**{**line, **lists})

    @property
    def covered(self) -> tuple[int, int]:
        """How many 95 % intervals hold the truth, and of how many."""
        return sum(i.covers for i in self.intervals), len(self.intervals)

    @property
    def ok(self) -> bool:
        """Whether the answer is as the truth is."""
        if self.kind == "none":
            return self.verdict == "adequate"
        if self.kind == "outside" and self.found < len(self.truth):
            return self.verdict != "adequate" and not self.wrong_single_names
        if self.snr < 1:
            return not self.wrong_single_names
        return self.found == len(self.truth) and not self.wrong_single_names

    @property
    def line(self) -> str:
        """The case in a line."""
        return (
            f"{'ok  ' if self.ok else 'FAIL'} {self.seed} {self.kind} {self.snr:g} "
            f"{','.join(self.truth)} -> {self.verdict} {[list(s) for s in self.steps]} "
            f"share {self.share:.3f} p {self.p_value:.2g} {self.seconds:.1f} s | {self.scene}"
        )


def score(case: Case, answer: dict[str, Any], p_value: float, seconds: float) -> Score:
    """Compare an answer (as JSON) with what the case hides."""
    steps = tuple(tuple(s["effects"]) for s in answer["steps"])
    truth = tuple(CATALOGUED.get(name, name) for name in case.hidden)
    inside = [t for t in truth if not t.startswith("outside-")]
    ratios = [
        o["heldout_rms_after"] / o["noise_rms"]
        for o in answer["outputs"].values()
        if o["noise_rms"]
    ]
    return Score(
        case.seed,
        case.kind,
        case.snr,
        {name: dict(values) for name, values in case.hidden.items()},
        truth,
        answer["verdict"],
        steps,
        answer["unexplained"]["share"],
        p_value,
        bool(steps) and any(t in steps[0] for t in inside),
        tuple(s["effects"][0] for s in answer["steps"] if _is_certain(s, inside)),
        sum(any(t in s for s in steps) for t in inside),
        max(ratios, default=float("nan")),
        tuple(_intervals(case.hidden, answer["steps"])),
        seconds,
        case.scene,
    )


def _is_certain(step: Mapping[str, Any], truth: Sequence[str]) -> bool:
    """Whether a step is certain of a name that is not the truth."""
    return bool(step["certain"]) and step["effects"][0] not in truth


def refused(case: Case, message: str, seconds: float) -> Score:
    """A case that was not answered."""
    nothing: dict[str, Any] = {
        "verdict": f"error: {message}",
        "steps": [],
        "outputs": {},
        "unexplained": {"share": float("nan")},
    }
    return score(case, nothing, float("nan"), seconds)


def _intervals(hidden: Hidden, steps: Sequence[dict[str, Any]]) -> Iterator[Interval]:
    """The intervals of every hidden effect that was found, where one was given."""
    for step in steps:
        for effect, values in step["parameters"].items():
            for name, estimate in values.items() if effect in hidden else ():
                true, std = hidden[effect].get(name), estimate["std"]
                if true is None or std is None or not np.isfinite(std) or std <= 0:
                    continue
                value = float(estimate["value"])
                low, high = estimate.get("interval") or (value - 1.96 * std, value + 1.96 * std)
                # The same truth, expressed as near the value as its symmetries allow.
                near = value - _apart(effect, name, value, true)
                yield Interval(effect, name, near, value, low, high, (value - near) / std)


def _apart(effect: str, name: str, value: float, true: float) -> float:
    """How far off; a guide's path is the same with offset and mismatch both negative."""
    off = value - true
    if effect == "guide-offset":
        off = min(off, value + true, key=abs)
    return float((off + np.pi) % (2 * np.pi) - np.pi) if name == "phase" else off


def summary(scores: Sequence[Score]) -> dict[str, Any]:
    """Figures by kind and SNR, and every failure."""
    groups: dict[str, list[Score]] = {}
    for s in scores:
        groups.setdefault(s.kind if s.kind == "none" else f"{s.kind} snr {s.snr:g}", []).append(s)
    return {
        "cases": len(scores),
        "aims": AIMS,
        "groups": {name: _figures(group) for name, group in sorted(groups.items())},
        "right_by_repeats": _right_by_repeats(scores),
        "coverage_by_effect": _coverage_by_effect(scores),
        "failures": [asdict(s) for s in scores if not s.ok],
    }


def _right_by_repeats(scores: Sequence[Score]) -> dict[str, tuple[int, int]]:
    """Answers as the truth is, and cases, by how runs were repeated."""
    kinds: dict[str, list[bool]] = {}
    for s in scores:
        kinds.setdefault(s.scene.rsplit(" ", 1)[-1], []).append(s.ok)
    return {kind: (sum(right), len(right)) for kind, right in sorted(kinds.items())}


def _coverage_by_effect(scores: Sequence[Score]) -> dict[str, tuple[int, int]]:
    """95 % intervals that hold the truth, and how many there were."""
    effects: dict[str, list[bool]] = {}
    for interval in (i for s in scores for i in s.intervals):
        effects.setdefault(interval.effect, []).append(interval.covers)
    return {effect: (sum(held), len(held)) for effect, held in sorted(effects.items())}


def _figures(group: Sequence[Score]) -> dict[str, Any]:
    explained = [s.heldout_over_noise for s in group if s.verdict == "explained"]
    hits = np.sum([s.covered for s in group], axis=0)
    sizes = [len(s.steps[0]) for s in group if s.steps]
    return {
        "cases": len(group),
        "alarm": _mean([s.verdict != "adequate" for s in group]),
        "named": _mean([bool(s.steps) for s in group]),
        "truth_in_first": _mean([s.truth_in_first for s in group]),
        "all_found": _mean([s.found == len(s.truth) for s in group]),
        "wrong_single_name": _mean([bool(s.wrong_single_names) for s in group]),
        "unknown_or_partly": _mean(
            [s.verdict in {"unknown", "partly", "undecided"} for s in group]
        ),
        "set_size": _mean(sizes),
        "heldout_at_noise": _mean([ratio <= 1.1 for ratio in explained]),
        "coverage": float(hits[0] / hits[1]) if hits[1] else None,
        "seconds": _mean([s.seconds for s in group]),
    }


def _mean(values: Sequence[float]) -> float | None:
    return float(np.mean(values)) if len(values) else None


def table(result: dict[str, Any]) -> str:
    """The figures for a reader."""
    names = list(next(iter(result["groups"].values())))
    lines = [f"{'':20}" + "".join(f"{n[:12]:>13}" for n in names)]
    for group, figures in result["groups"].items():
        cells = [figures[n] for n in names]
        shown = "".join(f"{'-' if c is None else f'{c:.3g}':>13}" for c in cells)
        lines.append(f"{group:20}" + shown)
    return "\n".join(lines)
