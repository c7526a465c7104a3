"""Cases of one hidden effect, or none, that a logger with a fault recorded; and their answers."""

from __future__ import annotations

import time
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path

import numpy as np

from campaign.bench import Bench, draw_bench
from campaign.case import ATTEMPTS, Plan, size_effects
from campaign.identifiable import Identity, identity
from campaign.logger_score import LoggerScore
from campaign.loggers import FAULTS, MISREAD, Fault, fault_of
from campaign.record import recordings, write
from campaign.sizes import CATALOGUE, RECENT, allowed
from campaign.truth import Hidden
from campaign.winch import write_profile

Random = np.random.Generator


@dataclass(frozen=True)
class LoggerPlan:
    """What a case is to be; what is empty is drawn at random."""

    snr: float
    """Zero where nothing is hidden."""
    effect: str = ""
    fault: str = ""
    small: bool = False


@dataclass(frozen=True)
class LoggerCase:
    """A case on disk and what is true of it."""

    seed: int
    snr: float
    hidden: Hidden
    fault: Fault
    identity: Identity | None
    """None where nothing is hidden, and where a sign or unit is wrong."""
    runs: tuple[Path, ...]
    profile: Path
    scene: str


def make_logger_case(seed: int, plan: LoggerPlan, folder: Path) -> LoggerCase | None:
    """Draw a case and write it, the same for the same seed and plan.

    None where no winch drawn can have the wanted effect at the wanted size.
    """
    for attempt in range(ATTEMPTS):
        random = np.random.default_rng([seed, attempt])
        name = plan.fault or str(random.choice(FAULTS))
        bench = draw_bench(random, repeats=True, small=plan.small, finely=True)
        folder.mkdir(parents=True, exist_ok=True)
        profile = folder / "winch.toml"
        write_profile(bench.winch, profile)
        hidden = _hidden(random, plan, bench)
        if hidden is None or not _plausible(hidden, profile):
            continue
        fault = fault_of(name, random, bench, recordings(random, {"": bench}, {"": hidden}))
        if fault is None:
            continue
        runs = write([file.recording for file in fault.files], folder)
        known = None if not hidden or name in MISREAD else identity(bench, hidden, fault)
        return LoggerCase(seed, plan.snr, hidden, fault, known, runs, profile, bench.words)
    return None


def _hidden(random: Random, plan: LoggerPlan, bench: Bench) -> Hidden | None:
    """One effect at the wanted size, nothing where the size is zero; None where it cannot be."""
    if not plan.snr:
        return {}
    known, loads = bench.load != "cell", len(bench.scene.masses)
    pool = (plan.effect,) if plan.effect else (*CATALOGUE, *RECENT)
    fit = [e for e in pool if allowed(e, bench.winch, known, bench.warms, loads)]
    if not fit:
        return None
    name = str(random.choice(fit))
    return size_effects(random, Plan("single", plan.snr), bench, (name,))


def _plausible(hidden: Hidden, profile: Path) -> bool:
    """Whether all values are within the ranges that the catalogue declares for real machines."""
    from winchkit.effects.catalogue import load_catalogue
    from winchkit.schema.read import read_profile

    catalogue, winch = load_catalogue(), read_profile(profile)
    for effect, values in hidden.items():
        for name, value in values.items():
            known = catalogue[effect].parameter(name).plausible if name != "opens" else None
            if known is not None:
                size = float(attrgetter(known.of)(winch)) if known.of else 1.0
                if not known.low * size <= value <= known.high * size:
                    return False
    return True


def answer(case: LoggerCase) -> LoggerScore:
    """Diagnose a case from its files."""
    from winchkit.diagnosis.diagnose import diagnose
    from winchkit.errors import WinchkitError
    from winchkit.runs.read import read_run
    from winchkit.schema.read import read_profile

    begun = time.process_time()
    try:
        said = diagnose([read_run(path) for path in case.runs], read_profile(case.profile))
    except WinchkitError as error:
        told, refusal = {}, str(error)
    else:
        told, refusal = said.diagnosis.to_json(), ""
    known = case.identity
    return LoggerScore(
        seed=case.seed,
        snr=case.snr,
        hidden={name: dict(values) for name, values in case.hidden.items()},
        fault=case.fault.name,
        detail=case.fault.words,
        channel=case.fault.channel,
        rival=known.rival if known else "",
        log_ratio=known.log_ratio if known else None,
        identifiable=bool(known and known.identifiable),
        verdict=told.get("verdict", "refused"),
        steps=tuple(tuple(step["effects"]) for step in told.get("steps", ())),
        certain=tuple(s["effects"][0] for s in told.get("steps", ()) if s["certain"]),
        caveats=tuple(told.get("caveats", ())),
        findings=tuple(sorted({(f["code"], f["channel"]) for f in told.get("sanity", ())})),
        refusal=refusal,
        seconds=time.process_time() - begun,
        scene=case.scene,
    )


def run_logger_case(seed: int, plan: LoggerPlan, folder: Path) -> LoggerScore | None:
    """Make one case and diagnose its files; None where no case can be made."""
    case = make_logger_case(seed, plan, folder)
    return None if case is None else answer(case)
