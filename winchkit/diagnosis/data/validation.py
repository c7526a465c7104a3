"""Input validation: whether runs can be compared with a profile, by file and column of a fault.

A motor torque that was not recorded follows from the current, torque = torque constant × current.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from winchkit.arrays import Array
from winchkit.diagnosis.data.sign_and_scale import MOST_SAMPLES, length_words
from winchkit.diagnosis.data.statics import is_at_rest
from winchkit.errors import Fault, RunError
from winchkit.model.line import Line
from winchkit.model.stages import OUTPUTS, Signals
from winchkit.runs.run import Channel, Run
from winchkit.runs.sanity.finding import Finding
from winchkit.runs.sanity.repeated_values import constant
from winchkit.schema.profiles.axis import AxisProfile
from winchkit.schema.profiles.winch import WinchProfile

_LEAST_SAMPLES = 50
"""Samples that a run must have; screened."""
_SLOPE_RANGE = 0.75, 1.3333
"""Slope of the measured over the predicted length outside of which it is another winch;
screened."""
_LEAST_FINITE_SHARE = 0.5
"""Share of samples of a column that must not be NaN; screened."""
_LEAST_TRAVEL = 0.01
"""Least travel of the prediction, in winding radii, with which a slope is judged; screened."""
_LEAST_CORRELATION = 0.5
"""Least squared correlation of the measured and the predicted length with which a slope is judged;
below it most of the measured variance is not the motion."""


def validate_runs(runs: Sequence[Run], profile: WinchProfile) -> list[str]:
    """Validate runs against a profile: notes on what is missing without being a fault.

    A RunError has every fault of every run: missing columns, constant or mostly missing channels,
    the same run twice, a run of another winch.
    """
    if not runs:
        raise RunError("no run given")
    faults = [fault for run in runs for fault in _faults(run, profile)] + _duplicates(runs)
    if not faults:
        faults = _alike([fault for run in runs for fault in _other_winch(run, profile)])
    if faults:
        raise RunError(faults)
    unweighed = [] if isinstance(profile, AxisProfile) else _unweighed(runs)
    others = [note for run in runs for note in _other_profile(run, profile)]
    return [*unweighed, *_missing(runs), *others]


_FACTOR = re.compile(r"^changes by \S+")
"""In which the faults of several runs with one wrong factor differ."""


def _alike(faults: Sequence[Fault]) -> list[Fault]:
    """The first of the faults that differ in their factor only, with the number of the others."""
    kinds: dict[tuple[str, str], list[Fault]] = {}
    for fault in faults:
        kinds.setdefault((fault.key, _FACTOR.sub("", fault.message)), []).append(fault)
    out = []
    for first, *others in kinds.values():
        more = f"; so it is in {len(others)} more of the runs" if others else ""
        out.append(replace(first, message=first.message + more))
    return out


def without_constants(runs: Sequence[Run]) -> tuple[list[Run], list[Finding]]:
    """Leave a constant channel out of a run in motion where it varies in another run.

    The instrument's resolution is then coarser than what happens in this run. A channel that is
    constant in all runs stays, for :func:`validate_runs` to refuse.
    """
    varies = {
        name for run in runs for name in OUTPUTS if name in run and not any(constant(run, name))
    }
    kept, found = [], []
    for run in runs:
        moves = "motor_angle" in run and not any(constant(run, "motor_angle"))
        names = [name for name in OUTPUTS if moves and name in varies and name in run]
        left_out = [finding for name in names for finding in constant(run, name)]
        for finding in left_out:
            text = f"{finding.text}, while it varies in other runs; not compared there"
            found.append(replace(finding, text=text))
        without = {finding.channel for finding in left_out}
        channels = {name: item for name, item in run.channels.items() if name not in without}
        kept.append(replace(run, channels=channels) if without else run)
    return kept, found


def _faults(run: Run, profile: WinchProfile) -> list[Fault]:
    where = run.path or run.name
    faults = []
    if "motor_angle" not in run:
        known = ", ".join(["time", *run])
        return [Fault(f"no column 'motor_angle [rad]'; it has {known}", where)]
    if len(run) < _LEAST_SAMPLES:
        faults.append(
            Fault(f"only {len(run)} samples; at least {_LEAST_SAMPLES} are needed", where)
        )
        return faults
    if not any(output in run for output in OUTPUTS):
        message = f"no column to compare; it needs at least one of {', '.join(OUTPUTS)}"
        faults.append(Fault(message, where))
    for name in ("motor_angle", "load", *OUTPUTS):
        if name not in run:
            continue
        values = run[name]
        finite = values[np.isfinite(values)]
        key = f"column '{name}'"
        if len(finite) < _LEAST_FINITE_SHARE * len(values):
            message = f"{len(values) - len(finite)} of {len(values)} samples are NaN; remove it"
            faults.append(Fault(message, where, key=key))
        elif any(constant(run, name)):
            if name == "motor_angle":
                if is_at_rest(run, profile):
                    continue
                message = (
                    f"constant at {finite[0]:g} rad: nothing moves in this run; "
                    "a run at rest needs a tension and a load (column 'load' or load_mass)"
                )
            elif name == "load":
                continue
            else:
                message = (
                    f"constant at {finite[0]:g} in all {len(values)} samples: the instrument "
                    "did not measure; remove the column"
                )
            faults.append(Fault(message, where, key=key))
    return faults


def _duplicates(runs: Sequence[Run]) -> list[Fault]:
    """Faults of runs that were given twice: as repeats of themselves they would have no noise."""
    faults = []
    for index, run in enumerate(runs):
        for other in runs[:index]:
            if len(run) != len(other) or set(run) != set(other):
                continue
            if all(np.array_equal(run[c], other[c], equal_nan=True) for c in run):
                message = f"holds the same samples as {other.path or other.name}; give it once"
                faults.append(Fault(message, run.path or run.name))
    return faults


def _other_winch(run: Run, profile: WinchProfile) -> list[Fault]:
    """Faults of a run whose length changes by another factor than the profile predicts."""
    where = run.path or run.name
    if "cable_length" not in run:
        named = run.metadata.get("profile", profile.name)
        if named == profile.name:
            return []
        message = f"recorded with profile '{named}', compared with '{profile.name}'"
        return [
            Fault(message + "; give the profile of this machine", where, key="metadata profile")
        ]
    good = np.isfinite(run["motor_angle"]) & np.isfinite(run["cable_length"])
    few = np.flatnonzero(good)[:: max(1, len(run) // MOST_SAMPLES)]
    line = Line(profile)
    signals = Signals(run.time[few], run["motor_angle"][few])
    predicted = line.predict(line.motion(signals))["cable_length"]
    measured = run["cable_length"][few]
    if np.ptp(predicted) < _LEAST_TRAVEL * profile.drum.winding_radius or not np.ptp(measured):
        return []
    if np.corrcoef(predicted, measured)[0, 1] ** 2 < _LEAST_CORRELATION:
        return []  # no motion beside the noise or drift of the instrument
    slope = _slope(predicted, measured)
    if _SLOPE_RANGE[0] < slope < _SLOPE_RANGE[1]:
        return []

    def slope_at(factor: float) -> float:
        scaled = replace(signals, motor_angle=signals.motor_angle * factor)
        return _slope(line.predict(line.motion(scaled))["cable_length"], measured)

    known = length_words(slope, slope_at)
    why = f"{known}; or " if known else ""
    message = (
        f"changes by {slope:.3g} times what profile '{profile.name}' predicts. Cause: {why}"
        "another winch, another ratio or another direction: check gearbox.ratio, "
        "gearbox.direction and drum.winding_radius"
    )
    return [Fault(message, where, key="column 'cable_length'")]


def _slope(predicted: Array, measured: Array) -> float:
    return float(np.polyfit(predicted - predicted.mean(), measured, 1)[0])


def _unweighed(runs: Sequence[Run]) -> list[str]:
    """A note where the cell's reading has to serve as the load of every run."""
    if not any("tension" in run for run in runs):
        return []
    if any("load" in run or run.load_mass is not None for run in runs):
        return []
    return [
        "tension is not compared but taken as the load, since no run states its load: friction of "
        "pulleys and errors of the cell cannot be seen; state it in the head of each file "
        "(# load_mass: 10 kg) or at its import, or record a second cell"
    ]


def _missing(runs: Sequence[Run]) -> list[str]:
    """A note on the samples that are NaN, by channel, with the number of runs; none without any."""
    counts: dict[str, list[int]] = {}
    for run in runs:
        for name, channel in run.channels.items():
            if channel.missing:
                counts.setdefault(name, []).append(channel.missing)
    listed = [
        f"{name} {sum(own)}" + (f" in {len(own)} runs" if len(own) > 1 else "")
        for name, own in counts.items()
    ]
    return [f"NaN samples not compared: {', '.join(listed)}"] if listed else []


def _other_profile(run: Run, profile: WinchProfile) -> list[str]:
    named = run.metadata.get("profile", profile.name)
    if named == profile.name:
        return []
    return [f"{run.name}: recorded with profile '{named}', compared with '{profile.name}'"]


def with_torques(runs: Sequence[Run], profile: WinchProfile) -> list[Run]:
    """Runs with a motor torque where only the motor current was recorded.

    A RunError names a run with a current and nothing else to compare where the profile has no
    ``motor.torque_constant``.
    """
    faults: list[Fault] = []
    out = [_with_torque(run, profile, faults) for run in runs]
    if faults:
        raise RunError(faults)
    return out


def _with_torque(run: Run, profile: WinchProfile, faults: list[Fault]) -> Run:
    if "motor_current" not in run or "motor_torque" in run:
        return run
    constant = profile.motor.torque_constant
    if constant is None:
        if not {"cable_length", "tension"} & set(run):
            message = (
                f"has a motor current and no torque, and profile '{profile.name}' no torque "
                'constant; give motor.torque_constant in the profile, e.g. "0.1 N m/A"'
            )
            faults.append(Fault(message, run.path or run.name, key="column 'motor_current'"))
        return run
    current = run.channels["motor_current"]
    torque = Channel(constant * current.values, "N m", current.column)
    return replace(run, channels={**run.channels, "motor_torque": torque})
