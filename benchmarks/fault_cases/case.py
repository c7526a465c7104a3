"""A case: which motion, which faults at which moments, drawn from a seed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from random import Random

from fault_cases.kinds import KINDS

_MOTIONS = ("jog", "move", "programme")
_SPANS = (0.02, 0.05, 0.12, 0.3, 0.8)
_INDEPENDENT = 0.4
"""Share of cases with the independent slave for a drive."""
_EIGHT = 0.08
"""Share of cases with eight winches: they take eight times as long to compute."""
_COMES_TO_REST = 1.0
"""After the release of a key, s: dead-man, the ramp from 0.45 m/s, and a third of a second."""
NOISE_KNOWN = 4.0
"""Rest after which the noise of a load cell is known, s: 1 s, 200 conversions at 100 Hz, and 1 s
for the first reading to arrive. A quarter of the cases rests for so long."""


@dataclass(frozen=True)
class Planned:
    """One fault of a case."""

    kind: str
    winch: str
    at: float
    """After the motion has started, s."""
    span: float | None
    """s; None lasts until everything is mended."""


@dataclass(frozen=True)
class Case:
    """What happens; the same seed brings the same case back."""

    seed: str
    winches: int
    motion: str
    speed: float
    """Of the cable, m/s."""
    paying_out: bool
    faults: tuple[Planned, ...]
    resets_early: bool
    """Whether a reset is tried while the fault lasts."""
    real_time: bool = False
    independent: bool = False
    """Whether the slaves of ``tests/support/slave`` are its drives."""
    rest: float = 0.2
    """Between the opening of the bench and the motion, s."""

    @property
    def incremental(self) -> bool:
        """Whether its encoders are incremental."""
        return any(KINDS[one.kind].incremental for one in self.faults)

    @property
    def guarded(self) -> bool:
        """Whether its drives are guarded."""
        return any(KINDS[one.kind].guarded for one in self.faults)


def cases(number: int, seed: int, *, real_time_share: float = 0.0) -> list[Case]:
    """Every kind of fault in turn as the first one of a case; all else is drawn."""
    names = list(KINDS)
    every = round(1 / real_time_share) if real_time_share else 0
    found = []
    for k in range(number):
        again = bool(every) and k % every == every - 1
        found.append(_case(f"{seed}/{k}", names[k % len(names)], real_time=again))
    return found


def _case(seed: str, name: str, *, real_time: bool) -> Case:
    random = Random(f"fault case {seed}")
    winches = 8 if random.random() < _EIGHT else 1
    if real_time:
        winches = 1
        possible = [one for one in KINDS if KINDS[one].real_time]
        name = name if KINDS[name].real_time else random.choice(possible)
    first = KINDS[name]
    at = random.uniform(0.35, 1.2)
    pattern = random.choices(("single", "double", "repeated"), (6, 3, 1))[0]
    if first.guarded or first.at_rest:
        pattern = "single"
    winch = random.choice("ABCDEFGH"[:winches])
    lasts = bool(first.crosses) or random.random() < 0.7
    faults = [Planned(name, winch, at, None if lasts else random.choice(_SPANS))]
    if pattern == "double":
        possible = [one for one, kind in KINDS.items() if not (kind.moving or kind.guarded)]
        second = random.choice(possible)
        if not real_time or KINDS[second].real_time:
            other = random.choice("ABCDEFGH"[:winches])
            span = None if random.random() < 0.5 else random.choice(_SPANS)
            faults.append(Planned(second, other, at + random.uniform(0.0, 0.4), span))
    if pattern == "repeated" and not first.crosses:
        faults = [
            Planned(name, winch, at + k * random.uniform(0.2, 0.4), random.choice(_SPANS))
            for k in range(3)
        ]
    paying_out = {"in": False, "out": True}.get(first.moving, random.random() < 0.5)
    faults = [replace(one, span=None) if KINDS[one.kind].lasts else one for one in faults]
    if first.at_rest:
        faults = [Planned("released", winch, at, None), replace(faults[0], at=at + _COMES_TO_REST)]
    held = first.moving or first.at_rest or name == "released"
    motion = "jog" if held else random.choice(_MOTIONS)
    return Case(
        seed,
        winches,
        motion,
        random.choice((0.05, 0.15, 0.3, 0.45)) if not first.moving else 0.2,
        paying_out,
        tuple(sorted(faults, key=lambda fault: fault.at)),
        random.random() < 0.3,
        real_time,
        not real_time
        and (random.random() < _INDEPENDENT or any(KINDS[one.kind].independent for one in faults)),
        random.choices((0.2, NOISE_KNOWN), (3, 1))[0],
    )
