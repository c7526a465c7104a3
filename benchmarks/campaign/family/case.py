"""A case of the family: recordings, a profile, and what is true of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from campaign.family.friction import LAWS
from campaign.family.instruments import Chain, draw_chain, runs_of
from campaign.family.machine import PARTS, Friction, Machine, draw_friction, draw_machine, show_fine
from campaign.record import Recording, write
from campaign.winch import Winch, write_profile

Random = np.random.Generator
ATTEMPTS = 100


@dataclass(frozen=True)
class Truth:
    """What an answer is scored against."""

    words: str
    places: tuple[tuple[str, str], ...] = ()
    """Part and output of everything that is missing in the profile."""
    right: frozenset[str] = frozenset()
    """Effects whose law is right, or not distinguishable from it."""
    also: frozenset[str] = frozenset()
    """Effects that may be reported beside them: filters of the instruments, parts of a law."""
    detail: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Case:
    """What is written and diagnosed."""

    kind: str
    winch: Winch
    runs: Sequence[Recording]
    truth: Truth
    scene: str
    profile: str = ""
    """Text added to the nominal profile."""


def write_case(case: Case, folder: Path) -> tuple[tuple[Path, ...], Path]:
    """Write a case; paths of its runs and of its profile."""
    folder.mkdir(parents=True, exist_ok=True)
    profile = folder / "winch.toml"
    write_profile(case.winch, profile)
    with profile.open("a", encoding="utf-8") as out:
        out.write(case.profile)
    return write(case.runs, folder), profile


def shown_by(machine: Machine, frictions: Sequence[Friction]) -> dict[tuple[int, float], Any]:
    """What ideal instruments show of every motion with every load, the second with two of them."""
    return {
        (number, mass): show_fine(machine.winch, motor, mass, frictions)
        for number, (_, motor) in enumerate(machine.motions)
        for mass in (machine.masses if number == 0 else machine.masses[:2])
    }


_LAWS = {
    "motor": {
        "coulomb": "motor-coulomb",
        "dahl": "motor-dahl",
        "stribeck": "motor-stribeck",
        "viscous": "motor-viscous",
        "mean": "motor-coulomb-asymmetry",
    },
    "pulley": {
        "coulomb": "pulley-coulomb",
        "capstan": "pulley-capstan",
        "dahl": "pulley-dahl",
        "stribeck": "pulley-stribeck",
        "viscous": "pulley-viscous",
    },
    "gear": {"coulomb": "gear-efficiency", "dahl": "gear-dahl", "mean": "torque-constant"},
}
_RIGHT = {
    "sharp": ("coulomb", "capstan"),
    "tanh": ("coulomb", "capstan"),
    "arctan": ("coulomb", "capstan"),
    "dahl": ("coulomb", "capstan", "dahl"),
    "maxwell-slip": ("coulomb", "capstan", "dahl"),
    "lugre": ("coulomb", "capstan", "dahl", "stribeck"),
    "saturating": ("coulomb", "capstan", "stribeck", "viscous"),
    "asymmetric": ("coulomb", "capstan", "mean"),
}
"""Laws that hold what is true within their own shapes; a friction that saturates has none."""
OUTPUT = {"motor": "motor_torque", "gear": "motor_torque", "pulley": "tension"}


def draw_friction_case(random: Random, index: int) -> Case:
    """Friction at a part by a law, both in turn."""
    laws = list(LAWS)
    part, law = PARTS[index % len(PARTS)], laws[index // len(PARTS) % len(laws)]
    for _ in range(ATTEMPTS):
        machine = draw_machine(random, part)
        friction = draw_friction(random, machine, part, law)
        if friction is not None:
            chain = draw_chain(random, machine.rate)
            repeats = int(random.choice([1, 2]))
            runs = runs_of(random, machine, chain, shown_by(machine, [friction]), repeats)
            truth = _truth(friction, chain, repeats)
            return Case("friction", machine.winch, runs, truth, machine.words)
    raise AssertionError(f"no machine has {law} friction at its {part}")


def _truth(friction: Friction, chain: Chain, repeats: int) -> Truth:
    names = _LAWS[friction.part]
    right = {names[law] for law in _RIGHT[friction.law] if law in names}
    also = {"torque-lag"} if chain.drive else set()
    if friction.viscosity:
        right.add(names["viscous"])
    if friction.part == "pulley" and friction.law == "asymmetric":
        # The mean of both directions is in proportion to the load.
        also |= {"cell-gain", "torque-constant"}
    return Truth(
        f"{friction.law} at the {friction.part}, {repeats} recorded",
        ((friction.part, OUTPUT[friction.part]),),
        frozenset(right),
        frozenset(also),
        {
            "part": friction.part,
            "law": friction.law,
            "size": friction.size,
            "viscosity": friction.viscosity,
            "shape": vars(friction.shape),
            "chain": vars(chain),
            "repeats": repeats,
        },
    )
