"""A simulated fleet over a year: are its steps found, named and dated, and nothing else?

    python benchmarks/fleet_campaign.py --winches 6 --sessions 8 --seed 1 --json

Runs are those of winchkit's simulator, whose physics is separate from the catalogue of effects.
Every winch has its own values of five effects, a temperature per session, and a logger of its own
rate and resolution. Half of the winches have one step of 3, 5 or 10 standard deviations of a
session's estimate; one has a load cell whose gain creeps to 1.2 %, one a gain far from the others,
and two were given each other's profiles. ``steps`` and ``steps_dated`` are by size in standard
deviations. In full (100 winches, 24 sessions) about 40 CPU minutes.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from winchkit.catalog import find
from winchkit.diagnosis.fleet.history import FleetHistory, fleet_history
from winchkit.diagnosis.fleet.sessions import SessionEstimate, fit_session, null_term
from winchkit.diagnosis.fleet.swapped_profiles import swapped_profiles
from winchkit.effects.catalogue import Catalogue, load_catalogue
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
RATES = (20.0, 25.0, 40.0)
RESOLUTIONS: tuple[Mapping[str, float], ...] = (
    {"tension": 0.1, "cable_length": 1e-4},
    {"tension": 0.5},
    {},
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
    rate: float
    resolution: Mapping[str, float]
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
        rate, resolution = float(random.choice(RATES)), RESOLUTIONS[int(random.integers(3))]
        for number in range(sessions):
            values = dict(base)
            if name == creeping:
                values["cell-gain"] += CREEP * number / (sessions - 1)
            step = steps.get(name)
            if step is not None and number >= step.session:
                values[step.effect] += step.size * std[step.effect]
            warm = float(random.uniform(10.0, 30.0))
            own = int(random.integers(2**31))
            out.append(
                Session(
                    name, number, values, radii[name], true_radii[name], warm, rate, resolution, own
                )
            )
    return Fleet(steps, creeping, odd, (swapped[0], swapped[1]), tuple(out), radii)


@cache
def catalogue() -> Catalogue:
    """Effects of the set only."""
    known = load_catalogue()
    return Catalogue([known[effect] for effect in EFFECTS])


def runs_of(session: Session) -> tuple[list[Run], WinchProfile]:
    """Simulate a session, and the profile that its winch declares."""
    hidden = []
    for kind in KINDS:
        value = session.values[kind.effect]
        number = 1 / value if kind.reciprocal else value
        hidden.append(f"{kind.physics}, {kind.parameter}={number:.12g}{kind.unit}")
    bench = hiding(read_simbench(find("sim", "demo-adequate")), hidden)
    truth = {name: replace(t, temperature=session.temperature) for name, t in bench.truth.items()}
    (shipped,) = profiles_of(bench).values()
    true, declared = (
        replace(shipped, drum=replace(shipped.drum, winding_radius=radius))
        for radius in (session.true_radius, session.radius)
    )
    programme = read_programme(programme_path("programme-demo"))
    bench = replace(bench, truth=truth)
    runs = simulate(bench, {"A": true}, programme, seed=session.seed, rate=session.rate)
    return [_rounded(run, session.resolution) for run in runs], declared


def _rounded(run: Run, resolution: Mapping[str, float]) -> Run:
    channels = dict(run.channels)
    for name, step in resolution.items():
        channel = channels[name]
        channels[name] = Channel(np.round(channel.values / step) * step, channel.unit)
    return Run(run.name, run.time, channels, run.metadata)


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
    found, _ = fit(Session("", 0, values, 0.06, 0.06, 20.0, 25.0, {}, 0))
    return {each.effect: each.std for each in found}


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
        "odd_false": len(odd_found - odd),
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
    """Exchanged profiles by the winding radius; winches share the scatter of their radii."""
    (radius,) = (p for p in history.parameters if p.effect == "drum-radius")
    identified, covariances = {}, {}
    for winch in radius.winches:
        identified[winch.winch] = np.array([fleet.radii[winch.winch] + winch.value])
        covariances[winch.winch] = np.array([[winch.std**2 + KINDS[-1].spread ** 2]])
    profiles = {name: np.array([value]) for name, value in fleet.radii.items()}
    return swapped_profiles(identified, covariances, profiles)


def _creep_found_at(fleet: Fleet, found: Sequence[SessionEstimate], sessions: int) -> float | None:
    """True change of the gain in the session after which the creep is found first."""
    for last in range(sessions):
        history = fleet_history([e for e in found if e.time <= WEEK * last])
        pairs = {(winch.winch, parameter.effect) for parameter, winch in history.changed}
        if (fleet.creeping, "cell-gain") in pairs:
            return CREEP * last / (sessions - 1)
    return None


def campaign(winches: int, sessions: int, seed: int, jobs: int) -> dict[str, Any]:
    """Simulate, fit and score a fleet."""
    fleet = draw_fleet(winches, sessions, seed, session_std())
    plain = [fit(session)[1] for session in fleet.sessions[:3]]
    if jobs == 1:
        fits = [fit(session) for session in fleet.sessions]
    else:
        with ProcessPoolExecutor(jobs) as pool:
            fits = list(pool.map(fit, fleet.sessions, chunksize=4))
    found = [estimate for estimates, _ in fits for estimate in estimates]
    cpu = [seconds for _, seconds in fits]
    return {
        "seed": seed,
        "diagnoses": len(fits),
        **score(fleet, found, sessions),
        "cpu_seconds_per_fit": float(np.mean(cpu)),
        # Of the fits alone, by CPU time: processes beside the plain loop.
        "throughput_ratio": float(np.median(plain) / np.median(cpu)),
    }


def main() -> None:
    """Run the campaign that the options describe."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--winches", type=int, default=100)
    parser.add_argument("--sessions", type=int, default=24)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    if args.winches < 6 or args.sessions < 4:
        parser.error("a fleet has 6 winches and 4 sessions at least")
    result = campaign(args.winches, args.sessions, args.seed, args.jobs)
    for key, value in result.items():
        print(f"{key:20} {value}", file=sys.stderr)
    if args.json:
        print(json.dumps(result))


if __name__ == "__main__":
    main()
