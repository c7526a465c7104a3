"""Cases of several winches, diagnosed and scored: named where it is and nowhere else."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from string import ascii_uppercase
from typing import Any

import numpy as np

from campaign.bench import draw_bench, draw_beside
from campaign.case import ATTEMPTS, Plan, draw_effects, size_effects
from campaign.record import record_several
from campaign.truth import Hidden
from campaign.winch import write_profile

EXTENTS = ("none", "one", "all")


@dataclass(frozen=True)
class Several:
    """A case on disk and what is true of it."""

    seed: int
    extent: str
    """In how many winches: one of :data:`EXTENTS`."""
    snr: float
    """In the one winch, or in the first of all; others move in their own way."""
    hidden: Mapping[str, Hidden]
    """Per winch; empty where it hides nothing."""
    runs: tuple[Path, ...]
    profile: Path
    scene: str


def make_several(seed: int, extent: str, plan: Plan, winches: int, folder: Path) -> Several | None:
    """Draw a case of winches of one make, every run recorded twice, and write it.

    None where no winch drawn can have the wanted effect at the wanted size.
    """
    single = Plan("none" if extent == "none" else "single", plan.snr, plan.effects, plan.small)
    for attempt in range(ATTEMPTS):
        random = np.random.default_rng([seed, attempt])
        bench = draw_bench(random, repeats=True, small=plan.small)
        names = draw_effects(random, single, bench) if extent != "none" else ()
        values = None if names is None else size_effects(random, single, bench, names)
        if values is None:
            continue
        letters = ascii_uppercase[:winches]
        # The size was chosen for the first winch drawn: it is the one that hides something.
        one = str(random.choice(list(letters)))
        benches = {w: bench if w == one else draw_beside(random, bench) for w in letters}
        there = {"none": "", "one": one, "all": letters}[extent]
        hidden: dict[str, Hidden] = {w: values if w in there else {} for w in letters}
        folder.mkdir(parents=True, exist_ok=True)
        profile = folder / "winch.toml"
        write_profile(bench.winch, profile)
        runs = record_several(random, benches, hidden, folder)
        scene = f"{winches} winches, {one} first: {bench.words}"
        return Several(seed, extent, plan.snr, hidden, runs, profile, scene)
    return None


@dataclass(frozen=True)
class SeveralScore:
    """The answers to one recording of several winches."""

    seed: int
    extent: str
    snr: float
    truth: dict[str, tuple[str, ...]]
    """What every winch hides."""
    verdicts: dict[str, str]
    steps: dict[str, tuple[tuple[str, ...], ...]]
    shared: tuple[dict[str, Any], ...]
    seconds: float
    scene: str

    @classmethod
    def read(cls, line: Mapping[str, Any]) -> SeveralScore:
        """From JSON."""
        lists = {
            "truth": {w: tuple(effects) for w, effects in line["truth"].items()},
            "steps": {w: tuple(map(tuple, steps)) for w, steps in line["steps"].items()},
            "shared": tuple(line["shared"]),
        }
        return cls(**{**line, **lists})

    @property
    def there(self) -> list[str]:
        """Winches that hide something."""
        return [w for w, effects in self.truth.items() if effects]

    @property
    def found(self) -> list[str]:
        """Winches that hide something and whose only step holds it."""
        return [
            w
            for w in self.there
            if len(self.steps[w]) == 1 and self.truth[w][0] in self.steps[w][0]
        ]

    @property
    def elsewhere(self) -> list[str]:
        """Winches that hide nothing."""
        return [w for w, effects in self.truth.items() if not effects]

    @property
    def alarms(self) -> list[str]:
        """Winches that hide nothing and were not called adequate."""
        return [w for w in self.elsewhere if self.verdicts[w] != "adequate"]

    @property
    def wrong(self) -> list[str]:
        """Winches in which something is named that they do not hide."""
        return [
            w
            for w, steps in self.steps.items()
            if any(len(s) == 1 and s[0] not in self.truth[w] for s in steps)
        ]

    @property
    def shared_right(self) -> bool:
        """Whether the report on all together is true: who has it, and that alike."""
        own = [
            s for s in self.shared if any(t in s["effects"] for t in self.truth[s["winches"][0]])
        ]
        if not self.there or len(self.shared) != len(own):
            return not self.shared and not self.there
        return [s["winches"] for s in own] == [self.there] and self.alike

    @property
    def alike(self) -> bool:
        """Whether no winch's size was said to differ from the others', which it does not."""
        chances = [p["p_value"] for s in self.shared for p in s["parameters"].values()]
        return not any(chance < 0.01 for chance in chances)

    @property
    def ok(self) -> bool:
        """Whether every winch's answer is as the truth is."""
        return not self.alarms and not self.wrong and self.found == self.there

    @property
    def line(self) -> str:
        """The case in a line."""
        told = "ok  " if self.ok and self.shared_right else "FAIL"
        truth = sorted({effect for effects in self.truth.values() for effect in effects})
        steps = {w: [list(s) for s in steps] for w, steps in self.steps.items() if steps}
        other = {w: v for w, v in self.verdicts.items() if v in {"partly", "unknown"}}
        shared = [(s["effects"], "".join(s["winches"])) for s in self.shared]
        return (
            f"{told} {self.seed} {self.extent} {self.snr:g} {','.join(truth)} in "
            f"{''.join(self.there)} -> {steps} {other} shared {shared} alike {self.alike} "
            f"{self.seconds:.1f} s | {self.scene}"
        )


def answer_several(case: Several) -> SeveralScore:
    """Diagnose every winch of a case from its files."""
    from winchkit.effects import load_catalogue
    from winchkit.fleet.diagnosis.diagnose import diagnose_each
    from winchkit.fleet.diagnosis.meta_analysis import shared_effects
    from winchkit.runs.read import read_run
    from winchkit.schema.read import read_profile

    runs, catalogue = [read_run(path) for path in case.runs], load_catalogue()
    winches = {name: [run.of_winch(name) for run in runs] for name in case.hidden}
    begun = time.perf_counter()
    each = diagnose_each(winches, read_profile(case.profile), catalogue)
    found = {name: answer.diagnosis for name, answer in each}
    shared = tuple(one.to_json() for one in shared_effects(found, catalogue))
    return SeveralScore(
        case.seed,
        case.extent,
        case.snr,
        {name: tuple(hidden) for name, hidden in case.hidden.items()},
        {name: one.verdict for name, one in found.items()},
        {name: tuple(step.effects for step in one.steps) for name, one in found.items()},
        shared,
        time.perf_counter() - begun,
        case.scene,
    )


def run_several(
    winches: int, seed: int, plan: tuple[str, Plan], folder: Path
) -> SeveralScore | None:
    """Make one case of an extent and size, and diagnose it; None where no case can be made."""
    case = make_several(seed, *plan, winches, folder)
    return None if case is None else answer_several(case)


def several_summary(scores: Sequence[SeveralScore]) -> dict[str, Any]:
    """Figures by extent and SNR, and every failure."""
    groups: dict[str, list[SeveralScore]] = {}
    for s in scores:
        name = s.extent if s.extent == "none" else f"{s.extent} snr {s.snr:g}"
        groups.setdefault(name, []).append(s)
    ordered = sorted(groups.items(), key=lambda group: EXTENTS.index(group[1][0].extent))
    return {
        "cases": len(scores),
        "groups": {name: _figures(group) for name, group in ordered},
        "failures": [asdict(s) for s in scores if not (s.ok and s.shared_right)],
    }


def _figures(group: Sequence[SeveralScore]) -> dict[str, Any]:
    there = sum(len(s.there) for s in group)
    elsewhere = sum(len(s.elsewhere) for s in group)
    return {
        "cases": len(group),
        "right": sum(s.ok for s in group) / len(group),
        "shared_right": sum(s.shared_right for s in group) / len(group),
        "found_there": sum(len(s.found) for s in group) / there if there else None,
        "alarm_elsewhere": sum(len(s.alarms) for s in group) / elsewhere if elsewhere else None,
        "wrong_single_name": sum(len(s.wrong) for s in group) / (there + elsewhere),
        "alike": sum(s.alike for s in group) / len(group),
        "seconds": float(np.mean([s.seconds for s in group])),
    }
