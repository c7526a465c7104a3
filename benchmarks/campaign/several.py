"""A case of several winches in one recording: an effect hidden in none, in one or in all."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from string import ascii_uppercase

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
