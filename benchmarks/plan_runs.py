"""How many further runs it takes until one name is left: by plan, at random, by D-optimal design.

    python benchmarks/plan_runs.py --cases 100 --seed S [--json]

A case is a winch of the campaign (its own physics, ``campaign/truth.py``) that hides one effect and
was recorded twice in one short motion with one load, so that its diagnosis names a set. Then each
strategy records again, diagnoses all runs so far, and goes on until the set has one member:

- ``plan``: the first programme that ``winchkit.plan`` offers within the bench's limits;
- ``random``: a motion over a random part of the stroke at random speeds, with one of the loads and
  temperatures that ``plan`` tries;
- ``d-optimal``: of the programmes that ``plan`` tries the one with the largest determinant of the
  information of all runs on all values of all members.

Counted are runs, at most ``--most``; one without load in its file has no choice of it. A case is
left out where no programme of ``plan`` separates the hidden effect from another member (power below
0.2), as friction of pulleys by their wrap and by their bearings, which differ by a factor alone;
their number is printed.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

from campaign.bench import Bench, draw_bench, programme
from campaign.case import Plan, draw_effects, size_effects
from campaign.record import recordings, write
from campaign.truth import Hidden, Situation
from campaign.winch import turns_for, write_profile
from winchkit.arrays import Array
from winchkit.diagnosis.design.discrimination import weights_of
from winchkit.diagnosis.design.plan import inseparable, offers
from winchkit.diagnosis.design.programmes import (
    CandidateProgramme,
    candidates,
    range_of_limits,
)
from winchkit.diagnosis.diagnose import WinchAnswer, diagnose
from winchkit.diagnosis.plan import plan
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.regression.time_series import TimeSeriesRegression
from winchkit.errors import WinchkitError
from winchkit.runs.read import read_run
from winchkit.schema.bench import LimitSpec
from winchkit.schema.read import read_profile

Random = np.random.Generator
_RATE, _SHORT = 200.0, 0.3
"""Steps of the physics, Hz, and the share of the stroke that the first runs cover."""
_ATTEMPTS = 200
_LOADS, _RISES = (0.5, 1.0, 2.0), (0.0, 15.0)
"""Those of the programmes that ``plan`` tries."""
_RIDGE = 1e-6
"""Information on a value, in units of its size, without any run: keeps the determinant finite."""


@dataclass(frozen=True)
class Scene:
    """A winch, what it hides, its limits, and its runs so far."""

    bench: Bench
    hidden: Hidden
    limits: LimitSpec
    mass: float
    runs: tuple[Situation, ...]

    @property
    def truth(self) -> str:
        """The hidden effect."""
        return next(iter(self.hidden))


@dataclass(frozen=True)
class Outcome:
    """What a strategy came to."""

    strategy: str
    runs: int
    left: tuple[str, ...]
    """Members of the set in the end."""
    right: bool
    certain: bool
    """Whether the one name has no doubt, such as an order above the band of the comparison."""


Strategy = Callable[[Random, Scene, WinchAnswer], list[Situation]]


def scene_of(random: Random) -> Scene | None:
    """A winch with one hidden effect of three times the noise; None where none is possible."""
    bench = draw_bench(random, repeats=False, small=True, finely=True)
    names = draw_effects(random, Plan("single", 3.0), bench)
    hidden = names and size_effects(random, Plan("single", 3.0), bench, names)
    if not hidden:
        return None
    stroke, low = bench.scene.stroke, bench.winch.length_reference
    mass = float(np.mean(bench.scene.masses))
    limits = LimitSpec(speed=0.45, length=(low, low + stroke))
    scene = Scene(bench, hidden, limits, mass, ())
    _, wound = programme(random, _RATE, 40.0, _SHORT * stroke)
    first = situation(scene, wound - 0.3 * stroke, mass, 0.0)
    return replace(scene, runs=(first, first))


def situation(scene: Scene, wound: Array, mass: float, rise: float) -> Situation:
    """A run of a motion (cable wound in since the shortest length, m), (n,)."""
    winch = scene.bench.winch
    motor = winch.direction * winch.ratio * turns_for(winch, 1.0) * wound
    count = len(wound)
    return Situation(
        time=np.arange(count) / _RATE,
        motor_angle=winch.motor_reference + motor,
        mass=mass,
        temperature=np.full(count, 20.0 + rise),
        wander=np.zeros(count),
        every=scene.bench.situations[0].every,
    )


def planned(random: Random, scene: Scene, answer: WinchAnswer) -> list[Situation]:
    """The first programme that ``plan`` offers."""
    return [_run_of(scene, plan(answer, limits=scene.limits).offers[0].kind)]


def at_random(random: Random, scene: Scene, answer: WinchAnswer) -> list[Situation]:
    """One run over a random part of the stroke."""
    stroke = scene.bench.scene.stroke
    part = float(random.uniform(0.3, 1.0))
    _, wound = programme(random, _RATE, 40.0, part * stroke)
    start = float(random.uniform(0, 1 - part)) * stroke
    rise = float(random.choice(_RISES)) if scene.bench.measures_temperature else 0.0
    return [situation(scene, wound - start, scene.mass * float(random.choice(_LOADS)), rise)]


def d_optimal(random: Random, scene: Scene, answer: WinchAnswer) -> list[Situation]:
    """The programme whose run determines all values of all members best."""
    regression = answer.engine.regression
    known = _information(regression, answer)
    allowed = range_of_limits(regression.dataset, scene.limits)
    tried = list(candidates(regression.dataset, allowed))
    gains = [_log_determinant(known + _information(run, answer)) for _, run in tried]
    return [_run_of(scene, tried[int(np.argmax(gains))][0])]


STRATEGIES: dict[str, Strategy] = {
    "plan": planned,
    "random": at_random,
    "d-optimal": d_optimal,
}


def _log_determinant(information: Array) -> float:
    return float(np.linalg.slogdet(information + _RIDGE * np.eye(len(information)))[1])


def _information(regression: TimeSeriesRegression, answer: WinchAnswer) -> Array:
    """Information on the values of all members, each in units of its fitted size, (p, p)."""
    terms = {term.effect.id: term for pair in answer.pairs for term in pair}
    noise, blocks, sizes = answer.result.noise.rms, [], []
    weight = np.empty(regression.n_rows)
    for segment in regression.segments:
        weight[segment.rows] = 1 / noise[segment.output]
    own = [regression.nuisance_columns * weight[:, None]]
    for term in terms.values():
        one = Hypothesis().with_term(term, regression.n_runs)
        vector = regression.vector(one)
        columns = regression.jacobian(vector, one) * weight[:, None]
        columns = columns[:, regression.nuisance_columns.shape[1] :]
        states = sum(len(start) for start in one.starts)
        count = columns.shape[1] - states
        own.append(columns[:, count:])
        blocks.append(columns[:, :count])
        sizes += [abs(value) or 1.0 for value in np.asarray(vector)[-columns.shape[1] :][:count]]
    basis = np.linalg.svd(np.hstack(own), full_matrices=False)[0]
    columns = np.hstack(blocks) * np.array(sizes)
    columns = columns - basis @ (basis.T @ columns)
    return np.asarray(columns.T @ columns)


def _run_of(scene: Scene, kind: CandidateProgramme) -> Situation:
    """The run of a programme, driven with smooth changes of the speed."""
    fastest, stroke = scene.limits.speed / 1.5, scene.bench.scene.stroke
    speeds, at = [np.zeros(round(kind.hold * _RATE))], 0.05
    for share, part in kind.moves:
        goal, fast = 0.05 + 0.9 * share, part * fastest
        count = max(2, round(abs(goal - at) * stroke / fast * _RATE))
        speeds += [np.full(count, (at - goal) * stroke * _RATE / count)]
        speeds += [np.zeros(round(kind.hold * _RATE))]
        at = goal
    bell = np.hanning(round(0.25 * _RATE) + 2)
    smooth = np.convolve(np.concatenate(speeds), bell / bell.sum(), mode="same")
    wound = np.cumsum(smooth) / _RATE - 0.05 * stroke
    return situation(scene, wound, scene.mass * kind.load, kind.temperature_rise)


def answer_of(random: Random, scene: Scene, folder: Path) -> WinchAnswer:
    """The diagnosis of a scene's runs, from files."""
    bench = replace(
        scene.bench, situations=scene.runs, programmes=_programmes(scene.runs), colour=0.0
    )
    folder.mkdir(parents=True, exist_ok=True)
    recorded = recordings(random, {"": bench}, {"": scene.hidden})
    for index, run in enumerate(scene.runs):
        if run is not scene.runs[0]:
            # The programme asks for its load, whose mass 'winchkit run' writes to the file.
            metadata = {**recorded[index].metadata, "load_mass": f"{run.mass} kg"}
            recorded[index] = replace(recorded[index], metadata=metadata)
    paths = write(recorded, folder)
    profile = folder / "winch.toml"
    write_profile(bench.winch, profile)
    found = diagnose([read_run(path) for path in paths], read_profile(profile))
    assert isinstance(found, WinchAnswer)
    return found


def _programmes(runs: Sequence[Situation]) -> tuple[int, ...]:
    """Equal numbers for equal motions."""
    return tuple(next(i for i, other in enumerate(runs) if other is run) for run in runs)


def is_separable(scene: Scene, answer: WinchAnswer) -> bool:
    """Whether some programme separates the hidden effect from each other member of the set."""
    terms = {term.effect.id: term for pair in answer.pairs for term in pair}
    truth = terms.pop(scene.truth)
    pairs, regression = [(truth, other) for other in terms.values()], answer.engine.regression
    found = offers(
        regression,
        pairs,
        weights_of(regression, answer.result.noise),
        [],
        threshold=answer.threshold,
        operating_range=range_of_limits(regression.dataset, scene.limits),
    )
    return not inseparable(found, pairs)


def played(seed: int, index: int, most: int) -> list[Outcome] | None:
    """Every strategy on the case of a number, none where no programme separates; None where its
    diagnosis names no set."""
    random = np.random.default_rng([seed, index])
    scene = scene_of(random)
    if scene is None:
        return None
    noise = int(random.integers(2**31))
    out: list[Outcome] = []
    with TemporaryDirectory() as folder:
        for name, strategy in STRATEGIES.items():
            draws, now = np.random.default_rng([noise, len(out)]), scene
            while True:
                # The same noise in the same runs, whatever is recorded after them.
                answer = answer_of(np.random.default_rng(noise), now, Path(folder))
                steps = answer.diagnosis.steps
                left = steps[0].effects if steps else ()
                if len(now.runs) == len(scene.runs) and (
                    len(left) < 2 or scene.truth not in left or not answer.pairs
                ):
                    return None
                if now is scene and not out and not is_separable(scene, answer):
                    return []
                done = len(now.runs) - len(scene.runs)
                if len(left) < 2 or done >= most or not answer.pairs:
                    is_certain = bool(steps) and steps[0].certain
                    out.append(Outcome(name, done, left, scene.truth in left[:1], is_certain))
                    break
                more = strategy(draws, now, answer)
                now = replace(now, runs=(*now.runs, *more))
    return out


def main_of(arguments: Sequence[str]) -> int:
    """Run the cases, print each, and the means."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=100, help="ambiguous ones")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--most", type=int, default=12, help="further runs")
    parser.add_argument("--json", action="store_true", help="the means alone")
    options = parser.parse_args(arguments)
    found: list[list[Outcome]] = []
    equal = 0
    for index in range(_ATTEMPTS * options.cases):
        if len(found) == options.cases:
            break
        try:
            case = played(options.seed, index, options.most)
        except WinchkitError as error:
            print(f"case {index}: {error}", file=sys.stderr)
            continue
        equal += case == []
        if case:
            found.append(case)
            if not options.json:
                print(json.dumps([index, *(asdict(outcome) for outcome in case)]), flush=True)
    print(json.dumps({"not separable": equal, **{name: means(found, name) for name in STRATEGIES}}))
    return 0


def means(found: Sequence[Sequence[Outcome]], strategy: str) -> dict[str, float]:
    """Runs until one name is left, how often one was left and was right, or wrong without doubt."""
    own = [outcome for case in found for outcome in case if outcome.strategy == strategy]
    return {
        "cases": len(own),
        "runs_mean": float(np.mean([outcome.runs for outcome in own])),
        "one_name": float(np.mean([len(outcome.left) == 1 for outcome in own])),
        "right": float(np.mean([outcome.right and len(outcome.left) == 1 for outcome in own])),
        "certain_and_wrong": float(np.mean([o.certain and not o.right for o in own])),
    }


if __name__ == "__main__":
    sys.exit(main_of(sys.argv[1:]))
