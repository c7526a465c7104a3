"""Recordings of others: winchkit's diagnosis beside usual methods, judged on held-out runs.

``python benchmarks/real.py --data DIR --json``: DIR has ``emps`` and ``real`` (see
benchmarks/README.md; the recordings are no part of winchkit). Every method gets the same runs, the
same candidate effects and the same filter; each is judged by the rms of the torque on runs, or on
a part of a run, that it has not seen. Needs requirements-rivals.txt.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from numpy.typing import NDArray

from campaign.rivals import SELECTIONS, Regression, all_columns, in_time
from winchkit.arrays import Array
from winchkit.diagnosis.data.preparation import prepare
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.regression.hypothesis import Hypothesis
from winchkit.diagnosis.search import selection_engine
from winchkit.diagnosis.selection.signatures import Signatures
from winchkit.diagnosis.selection.time_series import TimeSeriesSelection
from winchkit.effects.catalogue import load_catalogue
from winchkit.runs.read import read_run
from winchkit.runs.run import Run
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.read import read_profile

OURS = "winchkit"
OUTPUT = "motor_torque"
MOST_SAMPLES = 10_000
FOLDS = 5
FEATURES = ("sine", "cosine", "speed", "direction", "acceleration")
AXIS = """schema = 1
kind = "axis"
name = "{name}"
[gearbox]
ratio = 1
[reference]
motor_angle = "0 rad"
{effects}"""
MOVING_MASS = """[[effect]]
id = "rotor-inertia"
inertia = "95.11 kg m^2"
[[effect]]
id = "motor-viscous"
viscosity = "203.5 N m s"
"""


@dataclass(frozen=True)
class Recording:
    """Runs of one machine for the fit and others to judge by."""

    name: str
    fit: tuple[str, ...]
    held_out: tuple[str, ...] = ()
    """Empty: the last third of each run."""
    effects: str = ""
    """Effects that the profile has before."""
    expert: tuple[str | int, ...] = ()
    """What least squares by hand take: columns of FEATURES, and whole orders of the motor angle.

    As judged on the raw samples before winchkit saw them.
    """


RECORDINGS = (
    Recording(
        "emps",
        ("emps/train.csv",),
        ("emps/test.csv",),
        MOVING_MASS,
        expert=("direction", "speed", "acceleration"),  # published: mass, viscous, Coulomb, offset
    ),
    Recording(
        "odrive-maps",
        tuple(
            f"real/odrive-cogging/map-{m}_16.csv" for m in "ab"
        ),  # map-c has another zero of its angle
        ("real/odrive-cogging/map-d_16.csv",),
        expert=(7, 28, 14, 36, 12, 84),
    ),
    Recording(
        "franka-q2",
        tuple(f"real/franka-q2/case3_{speed}.csv" for speed in ("slow", "high")),
        ("real/franka-q2/case3_middle.csv",),
        expert=("direction", "speed", 1),
    ),
    Recording("openarm-j4", ("real/openarm-j4/collect.csv",), expert=("speed", 1)),
)


@dataclass(frozen=True)
class Result:
    """What one method selected on one recording, and its held-out error."""

    recording: str
    method: str
    verdict: str
    names: tuple[str, ...]
    held_out_rms: float
    """N m; the mean of each run taken out, since its zero is not known beforehand."""
    relative: float
    """The same over the rms of the measured torque about its mean."""
    cpu_seconds: float


def runs_of(recording: Recording, folder: Path) -> tuple[list[Run], list[Run]]:
    """Runs to fit and runs to judge by."""
    fit = [read_run(folder / name) for name in recording.fit]
    if recording.held_out:
        return fit, [read_run(folder / name) for name in recording.held_out]
    cuts = [len(run) * 2 // 3 for run in fit]
    first = [_part(run, slice(0, cut), "first") for run, cut in zip(fit, cuts, strict=True)]
    last = [_part(run, slice(cut, None), "last") for run, cut in zip(fit, cuts, strict=True)]
    return first, last


def _part(run: Run, rows: slice, name: str) -> Run:
    channels = {k: replace(c, values=c.values[rows]) for k, c in run.channels.items()}
    return replace(run, name=f"{run.name}-{name}", path="", time=run.time[rows], channels=channels)


def profile_of(recording: Recording) -> WinchProfile:
    """An axis without cable, with the effects that it has before."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "axis.toml"
        path.write_text(AXIS.format(name=recording.name, effects=recording.effects))
        return read_profile(path)


@dataclass(frozen=True)
class Table:
    """Samples of the torque in time: residual of the profile, and the columns of all candidates."""

    residual: Array
    """Shape (n,), N m; without the mean of each run."""
    columns: Array
    """Shape (n, p), N m per usual-size step; without the mean of each run."""
    features: Array
    """Shape (n, 5): FEATURES; sine and cosine are those of the motor angle."""
    run: NDArray[np.intp]
    """Run of every sample."""
    measured_rms: float
    """Rms of the measured torque about the mean of each run, N m."""
    fold: NDArray[np.intp]
    """Block of time of every sample."""


def table_of(
    engine: TimeSeriesSelection, tried: Signatures, fitted: Hypothesis, runs: range
) -> Table:
    """Samples of some runs, after the profile's own effects at their fitted values."""
    regression = engine.regression
    segments = [s for s in regression.segments if s.run in runs and s.output == OUTPUT]
    every = max(1, sum(s.rows.stop - s.rows.start for s in segments) // MOST_SAMPLES)
    left = regression.residual(fitted)
    parts: list[tuple[Array, ...]] = []
    for segment in segments:
        recording = regression.dataset.recordings[segment.run]
        at = recording.raw.at
        rows = np.column_stack([left, tried.columns])[segment.rows]
        values = np.column_stack(
            [
                in_time(rows, segment.band),
                np.sin(at.motor_angle),
                np.cos(at.motor_angle),
                at.motor_rate,
                at.motor_direction,
                at.motor_acceleration,
                recording.measured[OUTPUT],
            ]
        )[recording.valid[OUTPUT]]
        kept = len(values) // every * every
        values = values[:kept].reshape(-1, every, values.shape[1]).mean(axis=1)
        values[:, :-6] -= values[:, :-6].mean(axis=0)
        values[:, -1] -= values[:, -1].mean()
        fold = np.arange(len(values)) * FOLDS // len(values)
        parts.append((values, fold, np.full(len(values), segment.run)))
    values = np.concatenate([part[0] for part in parts])
    return Table(
        residual=values[:, 0],
        columns=values[:, 1:-6],
        features=values[:, -6:-1],
        run=np.concatenate([part[2] for part in parts]).astype(np.intp),
        measured_rms=float(np.sqrt(np.mean(values[:, -1] ** 2))),
        fold=np.concatenate([part[1] for part in parts]),
    )


def results(recording: Recording, folder: Path) -> list[Result]:
    """Every method on one recording."""
    fit, held_out = runs_of(recording, folder)
    profile, catalogue = profile_of(recording), load_catalogue()
    start = _cpu()
    answer = diagnose(fit, profile)
    ours = _cpu() - start
    # One data set of all runs, so that every method has the same candidates, filter and masks.
    engine = selection_engine(prepare([*fit, *held_out], profile), catalogue)
    own = selection_engine(prepare(fit, profile), catalogue)
    nominal = own.fit_with_noise(own.initial_model)[0].hypothesis
    n_fit, n_all = len(fit), len(fit) + len(held_out)
    known = _known(nominal, n_all)
    tried = all_columns(engine)
    train, test = (
        table_of(engine, tried, known, runs) for runs in (range(n_fit), range(n_fit, n_all))
    )

    def result(method: str, left: Array, names: Sequence[str] = (), seconds: float = 0.0) -> Result:
        rms = float(np.sqrt(np.mean(left**2)))
        verdict = answer.diagnosis.verdict if method == OURS else ""
        return Result(
            recording.name, method, verdict, tuple(names), rms, rms / test.measured_rms, seconds
        )

    best = _known(answer.result.final.hypothesis, n_all)
    left = table_of(engine, tried, best, range(n_fit, n_all)).residual
    names = [" / ".join(step.effects) for step in answer.diagnosis.steps]
    out = [result("profile", test.residual), result(OURS, left, names, ours)]
    for name, select in SELECTIONS.items():
        start = _cpu()
        chosen, coefficients = _selected(tried, train, select)
        left = test.residual - test.columns[:, chosen] @ coefficients
        effects = _effects(tried)
        names = list(dict.fromkeys(effects[i] for i in chosen))
        out.append(result(name, left, names, _cpu() - start))
    start = _cpu()
    left = test.residual - _boosted(train, test)
    out.append(result("gradient boosting", left, seconds=_cpu() - start))
    own, held = (_by_hand(recording, table) for table in (train, test))
    left = test.residual - held @ np.linalg.lstsq(own, train.residual, rcond=None)[0]
    out.append(result("expert, least squares", left, [str(one) for one in recording.expert]))
    return out


def _known(fitted: Hypothesis, runs: int) -> Hypothesis:
    """The effects of a fitted model for other runs; initial states at zero."""
    model = Hypothesis()
    for term in fitted.terms:
        model = model.with_term(term, runs)
    return model


def _effects(tried: Signatures) -> list[str]:
    """Effect of every column."""
    effects = [""] * tried.columns.shape[1]
    for candidate in tried.candidates:
        for index in range(candidate.columns.start, candidate.columns.stop):
            effects[index] = candidate.effect.id
    return effects


def _selected(
    tried: Signatures, train: Table, select: Callable[[Regression], list[int]]
) -> tuple[list[int], Array]:
    """Columns that a method selects, and their coefficients by least squares."""
    length = np.maximum(np.sqrt(np.sum(train.columns**2, axis=0)), 1e-12)
    data = Regression(
        train.residual / max(float(np.std(train.residual)), 1e-12),
        train.columns / length,
        tuple(_effects(tried)),
        tuple(candidate.columns for candidate in tried.candidates),
        train.fold,
    )
    chosen = select(data)
    solved = np.linalg.lstsq(data.columns[:, chosen], train.residual, rcond=1e-8)[0]
    return chosen, solved / length[chosen]


def _by_hand(recording: Recording, table: Table) -> Array:
    """Columns of an expert's least squares, without the mean of each run, (n, p)."""
    angle = np.arctan2(table.features[:, 0], table.features[:, 1])
    columns: list[Array] = []
    for one in recording.expert:
        if isinstance(one, int):
            columns += [np.sin(one * angle), np.cos(one * angle)]
        else:
            columns.append(table.features[:, FEATURES.index(one)])
    found = np.column_stack(columns)
    for run in np.unique(table.run):
        found[table.run == run] -= found[table.run == run].mean(axis=0)
    return found


def _boosted(train: Table, test: Table) -> Array:
    """Prediction of the residual by gradient boosting on the motion."""
    from sklearn.ensemble import HistGradientBoostingRegressor

    model = HistGradientBoostingRegressor(random_state=0)
    model.fit(train.features, train.residual)
    predicted = np.asarray(model.predict(test.features))
    return predicted - predicted.mean()


def _cpu() -> float:
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, required=True, help="folder with emps and real")
    names = [recording.name for recording in RECORDINGS]
    parser.add_argument("--only", choices=names, action="append")
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    found: list[Result] = []
    for recording in RECORDINGS:
        if args.only and recording.name not in args.only:
            continue
        missing = [
            n for n in (*recording.fit, *recording.held_out) if not (args.data / n).is_file()
        ]
        if missing:
            parser.error(f"{args.data / missing[0]} is not there; --data names the folder of it")
        for one in results(recording, args.data):
            found.append(one)
            print(
                f"{one.recording:12} {one.method:22} {one.held_out_rms:9.4f} N m "
                f"{one.relative:7.1%} {one.cpu_seconds:6.1f} s  {one.verdict:9} "
                f"{', '.join(one.names)[:160]}",
                file=sys.stderr,
                flush=True,
            )
    if args.json:
        print(json.dumps({"results": [asdict(one) for one in found]}, indent=1))


if __name__ == "__main__":
    main()
