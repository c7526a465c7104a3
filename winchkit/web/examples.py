"""Simulated runs for the page: an example of the catalogue, or a bench with a hidden effect."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from winchkit.catalog import find
from winchkit.errors import UsageError
from winchkit.report.words.vocabulary import effect_name
from winchkit.runs.run import Run
from winchkit.schema.read import read_programme, read_simbench, read_winch
from winchkit.schema.simbench import SimBench
from winchkit.sim import choose_bench
from winchkit.sim.record import simulate

_PROGRAMMES = ("programme-demo-fast", "programme-demo-slow")


@dataclass(frozen=True)
class ExampleRuns:
    """Runs of a simulated bench, its nominal profile, and what it hides in words."""

    bench: SimBench
    seed: int

    @property
    def profile(self) -> str:
        """Name of the declared profile."""
        return next(iter(self.bench.bench.winch.values())).profile

    def command(self, name: str) -> str:
        """Command that writes the runs into a folder of the bench's name."""
        folder = shlex.quote(Path(name).stem)
        made = f"winchkit sim record {shlex.quote(name)} {' '.join(_PROGRAMMES)}"
        return f"{made} --seed {self.seed} -o {folder}"

    @property
    def truth(self) -> str:
        """Names and identifiers of the hidden effects, or ``nothing``."""
        named = [f"{effect_name(effect)} ({effect})" for effect in self.bench.answers]
        return ", ".join(named) or "nothing"

    @property
    def runs(self) -> Iterator[Run]:
        """Two programmes under two loads, each twice."""
        wiring = self.bench.bench.winch
        profiles = {
            name: read_winch(find("profiles", winch.profile)) for name, winch in wiring.items()
        }
        for name in _PROGRAMMES:
            programme = read_programme(find("sim", name))
            yield from simulate(self.bench, profiles, programme, seed=self.seed)


def example_runs(name: str) -> ExampleRuns:
    """An example of the catalogue; raises UsageError for a bench with several winches."""
    bench = read_simbench(find("sim", name))
    if len(bench.bench.winch) != 1:
        raise UsageError(f"'{name}' has {len(bench.bench.winch)} winches; choose one with one")
    return ExampleRuns(bench, seed=1)


def mystery_runs(seed: int) -> ExampleRuns:
    """The simulated bench of a seed, which determines its hidden effect."""
    return ExampleRuns(choose_bench(seed), seed)
