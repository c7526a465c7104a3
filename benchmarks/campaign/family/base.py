"""Base cases of metamorphic relations: one physics, recorded as often as a relation wants."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from campaign.bench import Bench
from campaign.case import ATTEMPTS, Plan, size_effects
from campaign.family.friction import LAWS
from campaign.family.instruments import Chain, draw_chain, runs_of
from campaign.family.machine import STEP, Friction, Machine, draw_friction, draw_machine, show_fine
from campaign.record import Recording
from campaign.sizes import Scene, allowed
from campaign.truth import Hidden, Shown, Situation, show

Random = np.random.Generator
BASES: tuple[tuple[str, ...], ...] = (
    ("friction",),
    ("motor-coulomb",),
    ("drum-radius",),
    ("pulley-coulomb", "cell-gain"),
    ("friction",),
    (),
    ("cable-elongation-linear",),
    ("motor-coulomb", "motor-viscous"),
    ("friction",),
    ("gear-efficiency",),
    ("cell-lag",),
    ("cable-elongation-linear", "pulley-coulomb"),
    ("friction",),
    ("drum-eccentricity",),
    ("frame-compliance", "motor-viscous"),
    ("length-time-offset",),
    ("motor-stribeck",),
    ("drum-radius", "cell-offset"),
    ("motor-cogging",),
    ("pulley-viscous",),
)
"""Effects that a case hides; ``friction`` is one of the family's laws at any part."""
SIZES = (4.0, 15.0)
"""Rms over the noise, far more than is detectable."""


@dataclass(frozen=True)
class Base:
    """A machine that hides something, to be recorded."""

    machine: Machine
    chain: Chain
    hidden: Hidden
    frictions: tuple[Friction, ...]
    seed: tuple[int, ...]

    def _one(self, number: int, mass: float) -> Shown:
        winch = self.machine.winch
        if self.frictions:
            motor = self.machine.motions[number][1]
            return show_fine(winch, motor, mass, self.frictions)
        return show(winch, _situation(self.machine, number, mass, 1), self.hidden)

    def runs(self, repeats: int, noise: int = 0, further: bool = False) -> list[Recording]:
        """Every motion with every load; ``further``: the first one with another load as well.

        The same files for the same ``noise``; further repeats and loads come after them.
        """
        machine = self.machine
        motions = range(len(machine.motions))
        shown = {(n, m): self._one(n, m) for n in motions for m in machine.masses[:2]}
        out = self._recorded(shown, repeats, (noise, 0))
        if further:
            mass = round(0.7 * machine.masses[0], 2)
            out += self._recorded({(0, mass): self._one(0, mass)}, repeats, (noise, 1))
        return out

    def _recorded(
        self, shown: Mapping[tuple[int, float], Shown], repeats: int, noise: tuple[int, int]
    ) -> list[Recording]:
        zero = float(np.random.default_rng(self.seed).normal(0, 0.02))
        out = []
        for again in range(repeats):
            random = np.random.default_rng([*self.seed, *noise, again])
            out += runs_of(random, self.machine, self.chain, shown, 1, zero=zero)
        return out

    @property
    def words(self) -> str:
        """What is hidden."""
        own = [f"{f.law} friction of the {f.part}" for f in self.frictions]
        return " + ".join([*own, *self.hidden]) or "nothing"


def _situation(machine: Machine, number: int, mass: float, every: int) -> Situation:
    time, motor = machine.motions[number]
    still = np.zeros_like(time)
    return Situation(time, motor, mass, still + 20.0, still, every)


def draw_base(seed: tuple[int, ...], index: int) -> Base:
    """Each entry of :data:`BASES` in turn."""
    random, names = np.random.default_rng(seed), BASES[index % len(BASES)]
    for _ in range(ATTEMPTS):
        part = str(random.choice(["motor", "pulley", "gear"]))
        machine = draw_machine(random, part if "friction" in names else "")
        chain = draw_chain(random, machine.rate)
        if "friction" in names:
            friction = draw_friction(random, machine, part, str(random.choice(list(LAWS))))
            if friction is not None:
                return Base(machine, chain, {}, (friction,), seed)
            continue
        known, loads = machine.load != "cell", len(machine.masses)
        if not all(allowed(name, machine.winch, known, False, loads) for name in names):
            continue
        hidden = _sized(random, machine, names)
        if hidden is not None:
            return Base(machine, chain, hidden, (), seed)
    raise AssertionError(f"no machine can have {', '.join(names)}")


def _sized(random: Random, machine: Machine, names: tuple[str, ...]) -> Hidden | None:
    every = round(1 / (machine.rate * STEP))
    motions = range(len(machine.motions))
    stroke = float(np.ptp(machine.motions[0][1])) * machine.winch.radius / machine.winch.ratio
    bench = Bench(
        machine.winch,
        tuple(_situation(machine, n, m, every) for n in motions for m in machine.masses[:2]),
        tuple(n for n in motions for _ in machine.masses[:2]),
        Scene(float(machine.motions[0][0][-1]), stroke, machine.masses),
        machine.load,
        "none",
        False,
        False,
        machine.noise,
        machine.colour,
    )
    size = float(np.exp(random.uniform(*np.log(SIZES))))
    return size_effects(random, Plan("single", size), bench, names)
