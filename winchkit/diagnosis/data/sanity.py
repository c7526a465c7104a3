"""Sanity of the runs of a comparison: findings, resolutions, and spikes that are left out."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from winchkit.diagnosis.data.sign_and_scale import mending_column, sign_and_scale
from winchkit.effects.catalogue import Catalogue
from winchkit.errors import Fault, RunError
from winchkit.model.stages import OUTPUTS
from winchkit.runs.run import Channel, Run
from winchkit.runs.sanity.consistency import INCONSISTENT
from winchkit.runs.sanity.finding import Finding
from winchkit.runs.sanity.inspection import Inspection
from winchkit.runs.sanity.quantisation import printed_resolution
from winchkit.schema.profiles.winch import WinchProfile

ALARMING = frozenset({"inverted-sign", "wrong-factor"})
"""Codes of findings with which effects of a winch are not looked for."""

UNRELATED = "unrelated"
"""Code of an output that does not follow the motion: repeats differ by as much as it varies."""


def findings(
    inspected: Sequence[Inspection], profile: WinchProfile, catalogue: Catalogue | None = None
) -> tuple[Finding, ...]:
    """Findings on runs: sign and scale against the profile first, then of every channel."""
    runs = [usable(one) for one in inspected]
    found = sign_and_scale(runs, profile, catalogue)
    found += [f for one in inspected for f in one.findings]
    # A constant angle is that of a run at rest, which has a note.
    return tuple(f for f in found if (f.code, f.channel) != ("constant", "motor_angle"))


def caveats(found: Sequence[Finding]) -> tuple[str, ...]:
    """Codes of the findings with which no effect is named, each once."""
    return tuple(dict.fromkeys(f.code for f in found if f.code in ALARMING))


def require_drive(found: Sequence[Finding]) -> None:
    """Raise RunError where what drives a simulated motion has a wrong sign or unit."""
    faults = []
    for one in found:
        if one.code in ALARMING and one.channel in ("motor_torque", "load"):
            column = mending_column(one)
            mend = f": winchkit import {one.run}.csv --column '{column}'" if column else ""
            message = f"{one.channel}: {one.text}; no motion is simulated from it; correct it{mend}"
            faults.append(Fault(message, one.run))
    if faults:
        raise RunError(faults)


def unrelated(outputs: Collection[str]) -> tuple[Finding, ...]:
    """Findings on outputs whose repeats differ by as much as they vary."""
    text = (
        "repeats of the same motion differ by as much as it varies: it does not follow the motion"
    )
    return tuple(Finding(UNRELATED, "", name, float("nan"), text) for name in outputs)


def resolutions(inspected: Sequence[Inspection]) -> dict[str, float]:
    """Resolution of every output and of the load, rms over the runs that have it, SI: their common
    step, or that of the printed digits."""
    out = {}
    for name in (*OUTPUTS, "load"):
        steps = [
            one.resolutions[name] or printed_resolution(one.run[name])
            for one in inspected
            if name in one.run
        ]
        if steps:
            out[name] = float(np.sqrt(np.mean(np.square(steps))))
    return out


def usable(inspected: Inspection) -> Run:
    """The run without what findings exclude.

    Single spikes are NaN, as are outputs where the load does not hang on the cable. A velocity that
    is not the derivative of the motor angle is left out: the rate is then that of the angle.
    """
    run = _with_derived_velocity(inspected)
    channels: dict[str, Channel] = dict(run.channels)
    held = [(name, inspected.on_ground) for name in OUTPUTS if inspected.on_ground.any()]
    for name, mask in (*inspected.outliers.items(), *held):
        if name in channels:
            channels[name] = replace(
                channels[name], values=np.where(mask, np.nan, channels[name].values)
            )
    return replace(run, channels=channels)


def _with_derived_velocity(inspected: Inspection) -> Run:
    """The run without velocities that contradict the motor angle."""
    run = inspected.run
    wrong = {found.channel for found in inspected.findings if found.code == INCONSISTENT}
    if not wrong:
        return run
    kept = {name: channel for name, channel in run.channels.items() if name not in wrong}
    return replace(run, channels=kept)
