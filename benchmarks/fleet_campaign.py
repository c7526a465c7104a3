"""A simulated fleet over a year: are its steps found, named and dated, and nothing else?

    python benchmarks/fleet_campaign.py --winches 6 --sessions 8 --seed 1 --json

Runs are those of winchkit's simulator, whose physics is separate from the catalogue of effects.
Every winch has its own values of five effects, its own two loads, and a logger of one of three
makes. The temperature differs from session to session and moves the zero of every load cell, which
no profile declares. Half of the winches have one step of 3, 5 or 10 standard deviations of a
session's estimate; one has a load cell whose gain creeps to 1.2 %, one a gain far from the others,
and two were given each other's profiles. ``steps`` and ``steps_dated`` are by size in standard
deviations. In full (100 winches, 24 sessions) about 40 CPU minutes; with ``--log`` an interrupted
campaign goes on, and ``--minutes`` ends a part of it (exit code 3).
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import nullcontext
from dataclasses import asdict, dataclass, replace
from functools import cache
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from summaries import print_summary
from winchkit.catalog import find
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.fleet.diagnosis.history import FleetHistory, fleet_history
from winchkit.fleet.diagnosis.sessions import SessionEstimate, fit_session, null_term
from winchkit.fleet.diagnosis.swapped_profiles import swapped_by_radius
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.read import read_programme, read_simbench
from winchkit.sim.bench import hiding, profiles_of, programme_path
from winchkit.sim.record import simulate

WEEK = 7 * 86400.0
SIZES = (3.0, 5.0, 10.0)
CREEP = 0.012
"""Of the gain, from the first session to the last."""
FULL_SCALE_SHARE = 0.01
ODD_GAIN = 0.04
RADIUS_SPREAD = 3e-4
"""Of the winding radii of the fleet, which their profiles have, m."""
COLDEST, WARMEST = 10.0, 30.0
SPAN = WARMEST - COLDEST
ZERO_DRIFT = 0.02
"""Thermal drift of the zero of every load cell, N/K."""
COMPARED = 12
"""Fits of which the plain loop is timed as well."""
LOADS = (0.8, 1.2)
"""Range of the loads of a winch, relative to those of the programme."""


@dataclass(frozen=True)
class Logger:
    """What a make of loggers does to a run."""

    rate: float
    resolution: Mapping[str, float]
    jitter: float = 0.0
    """Error of a time stamp, uniform within this share of an interval."""
    lost: float = 0.0
    """Share of the samples that are missing."""


LOGGERS = (
    Logger(25.0, {}),
    Logger(40.0, {"tension": 0.1, "cable_length": 1e-4}, jitter=0.1),
    Logger(20.0, {"tension": 0.5, "motor_angle": 2 * np.pi / 2**16}, lost=0.01),
)


@dataclass(frozen=True)
class Kind:
    """An effect of the set, the physics that causes it, and its values over the fleet."""

    effect: str
    physics: str
    parameter: str
    unit: str
    mean: float
    spread: float
    reciprocal: bool = False


KINDS = (
    Kind("cell-gain", "stretched cell", "gain_error", "", 0.0, 2e-3),
    Kind("cell-offset", "shifted cell", "offset", " N", 0.0, 0.5),
    Kind("cable-elongation-linear", "elastic rope", "axial_stiffness", " N", 3e-6, 2e-7, True),
    Kind("motor-coulomb", "motor drag", "torque", " N m", 0.02, 2e-3),
    Kind("drum-radius", "fat drum", "radius_error", " m", 0.0, 5e-6),
)
EFFECTS = tuple(kind.effect for kind in KINDS)


@dataclass(frozen=True)
class Step:
    """The true step of a winch."""

    effect: str
    size: float
    """In standard deviations of a session's estimate."""
    session: int
    """First session after it."""


@dataclass(frozen=True)
class Session:
    """What is true of one winch in one session."""

    winch: str
    number: int
    values: Mapping[str, float]
    radius: float
    """Winding radius of the profile by which the runs are compared, m."""
    true_radius: float
    temperature: float
    load: float
    """Relative to the loads of the programme."""
    logger: int
    seed: int


@dataclass(frozen=True)
class Fleet:
    """What is true of a fleet."""

    steps: Mapping[str, Step]
    creeping: str
    odd: str
    swapped: tuple[str, str]
    sessions: tuple[Session, ...]
    radii: Mapping[str, float]
    """Winding radius of the declared profile of every winch."""


def draw_fleet(winches: int, sessions: int, seed: int, std: Mapping[str, float]) -> Fleet:
    """Draw what is true."""
    random = np.random.default_rng(seed)
    names = [f"W{index:03}" for index in range(winches)]
    creeping, odd, *swapped = (str(n) for n in random.choice(names, 4, replace=False))
    free = [name for name in names if name not in (creeping, odd, *swapped)]
    steps = {}
    for name in free[: max(1, winches // 2)]:
        size, session = float(random.choice(SIZES)), int(random.integers(2, sessions - 1))
        steps[name] = Step(str(random.choice(EFFECTS)), size, session)
    true_radii = {name: 0.06 + float(random.normal(0.0, RADIUS_SPREAD)) for name in names}
    radii = dict(true_radii)
    radii[swapped[0]], radii[swapped[1]] = true_radii[swapped[1]], true_radii[swapped[0]]
    out = []
    for name in names:
        base = {kind.effect: random.normal(kind.mean, kind.spread) for kind in KINDS}
        if name == odd:
            base["cell-gain"] += ODD_GAIN
        load, logger = float(random.uniform(*LOADS)), int(random.integers(len(LOGGERS)))
        for number in range(sessions):
            values = dict(base)
            if name == creeping:
                values["cell-gain"] += CREEP * number / (sessions - 1)
            step = steps.get(name)
            if step is not None and number >= step.session:
                values[step.effect] += step.size * std[step.effect]
            warm = float(random.uniform(COLDEST, WARMEST))
            own = int(random.integers(2**31))
            out.append(
                Session(
                    name, number, values, radii[name], true_radii[name], warm, load, logger, own
                )
            )
    return Fleet(steps, creeping, odd, (swapped[0], swapped[1]), tuple(out), radii)


@cache
def catalogue() -> Catalogue:
    """Effects of the set only."""
    known = load_catalogue()
    return Catalogue([known[effect] for effect in EFFECTS])


@cache
def _shipped() -> WinchProfile:
    """Profile of the bench that the winches are variants of."""
    (shipped,) = profiles_of(read_simbench(find("sim", "demo-adequate"))).values()
    return shipped


def runs_of(session: Session) -> tuple[list[Run], WinchProfile]:
    """Simulate a session, and the profile that its winch declares."""
    hidden = [f"warm cell, sensitivity={ZERO_DRIFT:g} N/K"]
    for kind in KINDS:
        value = session.values[kind.effect]
        number = 1 / value if kind.reciprocal else value
        hidden.append(f"{kind.physics}, {kind.parameter}={number:.12g}{kind.unit}")
    bench = hiding(read_simbench(find("sim", "demo-adequate")), hidden)
    truth = {name: replace(t, temperature=session.temperature) for name, t in bench.truth.items()}
    shipped = _shipped()
    true, declared = (
        replace(shipped, drum=replace(shipped.drum, winding_radius=radius))
        for radius in (session.true_radius, session.radius)
    )
    programme = read_programme(programme_path("programme-demo"))
    steps = tuple(
        step if step.load_mass is None else replace(step, load_mass=step.load_mass * session.load)
        for step in programme.step
    )
    programme, bench = replace(programme, step=steps), replace(bench, truth=truth)
    logger, random = LOGGERS[session.logger], np.random.default_rng(session.seed)
    runs = simulate(bench, {"A": true}, programme, seed=session.seed, rate=logger.rate)
    return [_logged(run, logger, random) for run in runs], declared


def _logged(run: Run, logger: Logger, random: np.random.Generator) -> Run:
    kept = random.random(len(run.time)) >= logger.lost
    late = random.uniform(-logger.jitter, logger.jitter, len(run.time)) / logger.rate
    channels = {}
    for name, channel in run.channels.items():
        step = logger.resolution.get(name)
        values = channel.values if step is None else np.round(channel.values / step) * step
        channels[name] = Channel(values[kept], channel.unit)
    return Run(run.name, (run.time + late)[kept], channels, run.metadata)


def fit(session: Session) -> tuple[tuple[SessionEstimate, ...], float]:
    """Estimates of a session, and the CPU time of the fit, s."""
    runs, declared = runs_of(session)
    terms = [null_term(effect) for effect in catalogue()]
    start = time.process_time()
    found = fit_session(
        runs,
        declared,
        terms,
        winch=session.winch,
        time=WEEK * session.number,
        catalogue=catalogue(),
    )
    return found, time.process_time() - start


def session_std() -> dict[str, float]:
    """Standard deviation of every effect's estimate in one session of a usual winch."""
    values = {kind.effect: kind.mean for kind in KINDS}
    found, _ = fit(Session("", 0, values, 0.06, 0.06, 20.0, 1.0, 0, 0))
    std = {each.effect: each.std for each in found}
    # The temperature of the session, uniform between its ends, moves the zero of the cell.
    std["cell-offset"] = float(np.hypot(std["cell-offset"], ZERO_DRIFT * SPAN / np.sqrt(12)))
    return std


def score(fleet: Fleet, found: Sequence[SessionEstimate], sessions: int) -> dict[str, Any]:
    """What was found of what is true."""
    history = fleet_history(found)
    changed: dict[str, list[str]] = {}
    for parameter, winch in history.changed:
        changed.setdefault(winch.winch, []).append(parameter.effect)
    steps, named, dated = Counter[str](), Counter[str](), Counter[str]()
    for name, step in fleet.steps.items():
        size = f"{step.size:g}"
        steps[size] += 1
        if changed.get(name, [""])[0] == step.effect:
            named[size] += 1
            dated[size] += _dated(history, name, step)
    true = {(name, step.effect) for name, step in fleet.steps.items()}
    true.add((fleet.creeping, "cell-gain"))
    false = [(n, e) for n, effects in changed.items() for e in effects if (n, e) not in true]
    odd = {(fleet.odd, "cell-gain"), *((name, "drum-radius") for name in fleet.swapped)}
    odd_found = {(winch.winch, parameter.effect) for parameter, winch in history.odd}
    swaps = [sorted(swap.winches) for swap in _swaps(fleet, history)]
    return {
        "steps": dict(steps),
        "steps_named": dict(named),
        "steps_dated": dict(dated),
        "false_trends": len(false),
        "winch_effects": len(fleet.radii) * len(KINDS),
        "odd": len(odd),
        "odd_found": len(odd & odd_found),
        "odd_false": len(odd_found - odd - true),
        "swapped_found": sorted(fleet.swapped) in swaps,
        "swapped_false": sum(swap != sorted(fleet.swapped) for swap in swaps),
        "creep_found_at": _creep_found_at(fleet, found, sessions),
        "creep_limit": FULL_SCALE_SHARE,
        "procedure": history.procedure,
    }


def _dated(history: FleetHistory, name: str, step: Step) -> bool:
    """Whether the median of the date is within one session of the true interval."""
    for parameter, winch in history.changed:
        if (winch.winch, parameter.effect) == (name, step.effect) and winch.change is not None:
            date = winch.change.date
            if date is not None:
                return step.session - 2 <= date.date / WEEK <= step.session + 1
    return False


def _swaps(fleet: Fleet, history: FleetHistory) -> Sequence[Any]:
    """Exchanged profiles by the winding radius."""
    shipped = _shipped()
    profiles = {
        name: replace(shipped, drum=replace(shipped.drum, winding_radius=radius))
        for name, radius in fleet.radii.items()
    }
    return swapped_by_radius(history.parameters, profiles, catalogue())


def _creep_found_at(fleet: Fleet, found: Sequence[SessionEstimate], sessions: int) -> float | None:
    """True change of the gain in the session after which the creep is found first."""
    for last in range(sessions):
        history = fleet_history([e for e in found if e.time <= WEEK * last])
        pairs = {(winch.winch, parameter.effect) for parameter, winch in history.changed}
        if (fleet.creeping, "cell-gain") in pairs:
            return CREEP * last / (sessions - 1)
    return None


def logged_fits(path: Path | None) -> dict[tuple[str, int], tuple[list[SessionEstimate], float]]:
    """Fits of a log by winch and number of the session."""
    if path is None or not path.exists():
        return {}
    out = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        known = json.loads(line)
        estimates = [
            SessionEstimate(**{**each, "covariance": tuple(each["covariance"])})
            for each in known["estimates"]
        ]
        out[known["winch"], known["session"]] = (estimates, known["seconds"])
    return out


def campaign(
    winches: int, sessions: int, seed: int, jobs: int, *, log: Path | None, seconds: float
) -> dict[str, Any] | None:
    """Simulate, fit and score a fleet; None where the time ended before."""
    begun = time.monotonic()
    fleet = draw_fleet(winches, sessions, seed, session_std())
    known = logged_fits(log)
    left = [s for s in fleet.sessions if (s.winch, s.number) not in known]
    with ProcessPoolExecutor(jobs) if jobs > 1 else nullcontext() as pool:
        fits = map(fit, left) if pool is None else pool.map(fit, left, chunksize=4)
        for session, (estimates, cpu) in zip(left, fits, strict=True):
            known[session.winch, session.number] = (list(estimates), cpu)
            if log is not None:
                line = {"winch": session.winch, "session": session.number, "seconds": cpu}
                told = [asdict(each) for each in estimates]
                with log.open("a", encoding="utf-8") as lines:
                    lines.write(json.dumps(line | {"estimates": told}) + "\n")
            if time.monotonic() - begun > seconds and len(known) < len(fleet.sessions):
                if pool is not None:
                    pool.shutdown(cancel_futures=True)
                return None
    again = fleet.sessions[:: max(1, len(fleet.sessions) // COMPARED)][:COMPARED]
    plain = [fit(session)[1] for session in again]
    by_processes = [known[session.winch, session.number][1] for session in again]
    found = [estimate for estimates, _ in known.values() for estimate in estimates]
    cpu_times = [cpu for _, cpu in known.values()]
    return {
        "seed": seed,
        "diagnoses": len(known),
        **score(fleet, found, sessions),
        "cpu_seconds_per_fit": float(np.mean(cpu_times)),
        # CPU time of the same fits: the plain loop over the processes.
        "throughput_ratio": float(np.median(np.divide(plain, by_processes))),
    }


def main() -> int:
    """Run the campaign that the options describe."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--winches", type=int, default=100)
    parser.add_argument("--sessions", type=int, default=24)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--log", type=Path, help="file that gets every fit as a line of JSON")
    parser.add_argument("--minutes", type=float, default=inf, help="longest time of this part")
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    if args.winches < 6 or args.sessions < 4:
        parser.error("a fleet has 6 winches and 4 sessions at least")
    if args.log is None and args.minutes < inf:
        parser.error("--minutes needs --log, from which the campaign goes on")
    result = campaign(
        args.winches,
        args.sessions,
        args.seed,
        args.jobs,
        log=args.log,
        seconds=60 * args.minutes,
    )
    if result is None:
        print(f"not complete; repeat the command to go on from {args.log}", file=sys.stderr)
        return 3
    print_summary(result, as_json=args.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
