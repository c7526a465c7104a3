"""EMPS simulated forward: values refitted to the motion of the training file, from many starts.

Prints, for each model, the position error (rms) of the training and the test file by the start with
the least training error, and the spread over the starts. The first 20 samples are not compared; the
initial state is given. The test file takes no part in the fit or the choice.

    python benchmarks/emps_forward.py FOLDER [--starts 20]

A. Janot, M. Gautier, M. Brunot, Data Set and Reference Models of EMPS, 2019; the folder has the
runs train.csv and test.csv.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from winchkit.dynamics.drives import Inputs
from winchkit.dynamics.forward import Setup, motion_of
from winchkit.effects.catalogue import load_catalogue
from winchkit.effects.linear_axis import linear_effect
from winchkit.effects.term import Term
from winchkit.runs import Run, read_run
from winchkit.schema.profiles.axis import LinearAxisProfile

Values = NDArray[np.float64]
DROPPED = 20
EVERY = 10
"""Samples of which one is simulated in the fit, whose force is the mean around it; the errors that
are printed are those of all samples."""
CORRECTIONS = 3
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
PROFILE = LinearAxisProfile("emps")
CATALOGUE = load_catalogue()


def terms_of(names: Sequence[tuple[str, str]], values: Values) -> list[Term]:
    """The effects of a model with their values."""
    found: dict[str, dict[str, float]] = {}
    for (effect, name), value in zip(names, values, strict=True):
        own = linear_effect(CATALOGUE[effect])
        found.setdefault(effect, dict(own.null))[name] = float(value)
    return [Term(linear_effect(CATALOGUE[effect]), own) for effect, own in found.items()]


def setup_of(run: Run, every: int = 1) -> Setup:
    """Force and initial state of a run; with ``every`` averaged between the samples kept."""
    force, time = run["motor_torque"], run.time
    if every > 1:
        weights = np.concatenate([np.arange(1, every + 1), np.arange(every - 1, 0, -1)])
        padded = np.pad(force, every - 1, mode="edge")
        force = np.convolve(padded, weights / every**2, "valid")[::every]
        time = time[::every]
    speed = (run["motor_angle"][3] - run["motor_angle"][0]) / (run.time[3] - run.time[0])
    inputs = Inputs(time, {"torque": force})
    return Setup(run.name, time, float(run["motor_angle"][0]), float(speed), inputs)


def error(names: Sequence[tuple[str, str]], values: Values, run: Run) -> float:
    """Position error, rms, m."""
    motion = motion_of(PROFILE, terms_of(names, values), setup_of(run), 1e-8)
    return float(np.sqrt(np.mean((motion.angle - run["motor_angle"])[DROPPED:] ** 2)))


def refitted(names: Sequence[tuple[str, str]], start: Values, run: Run) -> Values:
    """Values with the least position error, from a start; none changes its sign.

    Few samples are simulated, and what they differ by from all of them is added to the motion; it
    is computed again with the values that are found.
    """
    setup, whole, values = setup_of(run, EVERY), setup_of(run), start
    measured = run["motor_angle"][::EVERY]

    def position(values: Values, of: Setup) -> Values:
        return motion_of(PROFILE, terms_of(names, values), of, 1e-6).angle

    for _ in range(CORRECTIONS):
        added = position(values, whole)[::EVERY] - position(values, setup) - measured

        def residual(shares: Values, scale: Values = values, added: Values = added) -> Values:
            return (position(scale * shares, setup) + added)[DROPPED // EVERY :]

        found = least_squares(
            residual, np.ones(len(start)), bounds=(0.05, 20.0), diff_step=1e-4, max_nfev=12,
            x_scale="jac", ftol=1e-5, xtol=1e-5,
        )  # fmt: skip
        values = values * found.x
    return values


def main() -> None:
    """Print the table of all models."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--starts", type=int, default=20)
    parser.add_argument("--models", type=int, nargs="*", default=[0, 1, 2])
    asked = parser.parse_args()
    train, test = (read_run(asked.folder / f"{name}.csv") for name in ("train", "test"))
    random = np.random.default_rng(46)
    for label, model in [list(MODELS.items())[k] for k in asked.models]:
        names, usual = list(model), np.array(list(model.values()))
        rows = []
        for index in range(asked.starts):
            start = usual * np.exp(SPREAD * random.standard_normal(len(usual)) * (index > 0))
            values = refitted(names, start, train)
            row = error(names, values, train), error(names, values, test), values
            rows.append(row)
            print(f"  start {index}: train {row[0] * 1e3:.3f} mm, test {row[1] * 1e3:.3f} mm  "
                  f"{np.array2string(values, precision=4)}", flush=True)  # fmt: skip
        best = min(rows, key=lambda row: row[0])
        errors = 1e3 * np.array([row[:2] for row in rows])
        print(f"{label}: train {best[0] * 1e3:.2f} mm, test {best[1] * 1e3:.2f} mm")
        print(f"  over {len(rows)} starts: train {errors[:, 0].min():.2f} to "
              f"{errors[:, 0].max():.2f} mm, test {errors[:, 1].min():.2f} to "
              f"{errors[:, 1].max():.2f} mm")  # fmt: skip
        for (effect, name), value in zip(names, best[2], strict=True):
            print(f"  {effect} {name} = {value:.4g}")
    names, values = list(PUBLISHED), np.array(list(PUBLISHED.values()))
    for run in (train, test):
        print(f"authors' values: {run.name} {error(names, values, run) * 1e3:.2f} mm")


if __name__ == "__main__":
    main()
