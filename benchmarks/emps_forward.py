"""EMPS simulated forward: values refitted to the motion of the training file, from many starts.

Prints, for each model, the position error (rms) of the training and the test file by the start with
the least training error, and the spread over the starts; each start is fitted by multiple shooting
(``winchkit.dynamics.refit``). The first 20 samples are not compared; the
initial state is given. The test file takes no part in the fit or the choice.

    python benchmarks/emps_forward.py FOLDER [--starts 20]

A. Janot, M. Gautier, M. Brunot, Data Set and Reference Models of EMPS, 2019; the folder has the
runs train.csv and test.csv.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from winchkit.dynamics.forward import motion_of, setup_of
from winchkit.dynamics.refit import refit_to_motion
from winchkit.effects.catalogue import load_catalogue
from winchkit.effects.linear_axis import linear_effect
from winchkit.effects.term import Term
from winchkit.runs import Channel, Run, read_run
from winchkit.schema.profiles.axis import LinearAxisProfile

Values = NDArray[np.float64]
DROPPED = 20
EVERY = 10
"""Samples of which one is simulated in a fit, whose force is the mean around it; the errors that
are printed are those of all samples."""
FITS = 3
"""Fits of a start, each with the difference between few and all samples computed anew."""
PUBLISHED = {
    ("rotor-inertia", "mass"): 95.11,
    ("motor-viscous", "viscosity"): 203.5,
    ("motor-coulomb", "force"): 20.39,
    ("motor-coulomb-asymmetry", "offset"): -3.16,
}
MODELS = {
    "mass, viscous and Coulomb friction, offset": PUBLISHED,
    "as named by diagnose": {
        ("rotor-inertia", "mass"): 95.11,
        ("motor-viscous", "viscosity"): 295.5,
        ("motor-coulomb", "force"): 16.0,
        ("motor-dahl", "force"): 3.96,
        ("motor-dahl", "distance"): 3e-4,
        ("motor-viscous-asymmetry", "viscosity_difference"): -37.5,
        ("torque-lead", "lead"): 8e-4,
    },
    "with asymmetry, offset and Stribeck friction": {
        **PUBLISHED,
        ("motor-viscous-asymmetry", "viscosity_difference"): -10.0,
        ("motor-stribeck", "force"): 3.0,
        ("motor-stribeck", "stribeck_speed"): 0.01,
        ("torque-lead", "lead"): 8e-4,
    },
}
SPREAD = 0.3
"""Standard deviation of the logarithm of the starting values."""
PROFILE = LinearAxisProfile("emps", motion="linear")
CATALOGUE = load_catalogue()


def terms_of(names: Sequence[tuple[str, str]], values: Values) -> list[Term]:
    """The effects of a model with their values."""
    found: dict[str, dict[str, float]] = {}
    for (effect, name), value in zip(names, values, strict=True):
        own = linear_effect(CATALOGUE[effect])
        found.setdefault(effect, dict(own.null))[name] = float(value)
    return [Term(linear_effect(CATALOGUE[effect]), own) for effect, own in found.items()]


def read(path: Path) -> Run:
    """A file with the channels of a linear axis."""
    run = read_run(path)
    names = {"position": ("motor_angle", "m"), "force": ("motor_torque", "N")}
    channels = {name: Channel(run[old], unit) for name, (old, unit) in names.items()}
    return Run(run.name, run.time, channels)


def thinned(run: Run, terms: Sequence[Term]) -> Run:
    """Every tenth sample of a run, its position less what thinning changes with these effects."""
    weights = np.concatenate([np.arange(1, EVERY + 1), np.arange(EVERY - 1, 0, -1)]) / EVERY**2
    padded = np.pad(run["force"], EVERY - 1, mode="edge")
    force = Channel(np.convolve(padded, weights, "valid")[::EVERY], "N")
    few = replace(run, time=run.time[::EVERY], channels={
        "position": Channel(run["position"][::EVERY], "m"), "force": force})  # fmt: skip
    speed = initial_speed(run)
    changed = simulated(terms, few, speed) - simulated(terms, run, speed)[::EVERY]
    moved = Channel(few["position"] + changed, "m")
    return replace(few, channels={"position": moved, "force": force})


def initial_speed(run: Run) -> float:
    """Speed of the first sample by a parabola through those that are not compared, m/s."""
    first = slice(DROPPED + 1)
    return float(np.polyfit(run.time[first] - run.time[0], run["position"][first], 2)[1])


def simulated(terms: Sequence[Term], run: Run, speed: float) -> Values:
    """Position from the first sample, (n,), m."""
    setup = setup_of(PROFILE, run, None, speed, is_torque=True)
    return motion_of(PROFILE, terms, setup).angle


def error(terms: Sequence[Term], run: Run) -> float:
    """Position error, rms, m."""
    off = simulated(terms, run, initial_speed(run)) - run["position"]
    return float(np.sqrt(np.mean(off[DROPPED:] ** 2)))


def main() -> None:
    """Print the table of all models."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--starts", type=int, default=20)
    parser.add_argument("--models", type=int, nargs="*", default=[0, 1, 2])
    asked = parser.parse_args()
    train, test = (read(asked.folder / f"{name}.csv") for name in ("train", "test"))
    random = np.random.default_rng(46)
    for label, model in [list(MODELS.items())[k] for k in asked.models]:
        names, usual = list(model), np.array(list(model.values()))
        rows = []
        for index in range(asked.starts):
            start = usual * np.exp(SPREAD * random.standard_normal(len(usual)) * (index > 0))
            terms: Sequence[Term] = terms_of(names, start)
            for _ in range(FITS):
                found = refit_to_motion([thinned(train, terms)], PROFILE, terms)
                terms = found.terms
            fitted = {term.effect.id: term.values for term in terms}
            values = np.array([fitted[effect][name] for effect, name in names])
            row = error(terms, train), error(terms, test), values
            rows.append(row)
            print(f"  start {index}: train {row[0] * 1e3:.3f} mm, test {row[1] * 1e3:.3f} mm  "
                  f"{np.array2string(values, precision=4)}"
                  f"{'' if found.converged else '  (not converged)'}", flush=True)  # fmt: skip
        best = min(rows, key=lambda row: row[0])
        errors = 1e3 * np.array([row[:2] for row in rows])
        print(f"{label}: train {best[0] * 1e3:.2f} mm, test {best[1] * 1e3:.2f} mm")
        print(f"  over {len(rows)} starts: train {errors[:, 0].min():.2f} to "
              f"{errors[:, 0].max():.2f} mm, test {errors[:, 1].min():.2f} to "
              f"{errors[:, 1].max():.2f} mm")  # fmt: skip
        for (effect, name), value in zip(names, best[2], strict=True):
            print(f"  {effect} {name} = {value:.4g}")
    published = terms_of(list(PUBLISHED), np.array(list(PUBLISHED.values())))
    for run in (train, test):
        print(f"authors' values: {run.name} {error(published, run) * 1e3:.2f} mm")


if __name__ == "__main__":
    main()
