"""Sanity of the runs of a comparison: findings, resolutions, and spikes that are left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from winchkit.diagnosis.data.sign_and_scale import sign_and_scale
from winchkit.effects.catalogue import Catalogue
from winchkit.model.stages import OUTPUTS
from winchkit.runs.run import Channel, Run
from winchkit.runs.sanity.finding import Finding
from winchkit.runs.sanity.inspection import inspect_run
from winchkit.runs.sanity.outliers import outlier_masks
from winchkit.runs.sanity.quantisation import resolution
from winchkit.runs.sanity.sampling import with_lost_samples
from winchkit.schema.profiles.winch import WinchProfile

__all__ = ["ALARMING", "caveats", "findings", "resolutions", "without_outliers"]

ALARMING = frozenset({"inverted-sign", "wrong-factor"})
"""Codes of findings with which effects of a winch are not looked for."""


def findings(
    runs: Sequence[Run], profile: WinchProfile, catalogue: Catalogue | None = None
) -> tuple[Finding, ...]:
    """Findings on runs: sign and scale against the profile first, then of every channel."""
    found = sign_and_scale(runs, profile, catalogue)
    found += [f for run in runs for f in inspect_run(run)]
    # A constant angle is that of a run at rest, which has a note.
    return tuple(f for f in found if (f.code, f.channel) != ("constant", "motor_angle"))


def caveats(found: Sequence[Finding]) -> tuple[str, ...]:
    """Codes of the findings with which no effect is named, each once."""
    return tuple(dict.fromkeys(f.code for f in found if f.code in ALARMING))


def resolutions(runs: Sequence[Run]) -> dict[str, float]:
    """Resolution of every output, rms over the runs that have it, SI."""
    out = {}
    for output in OUTPUTS:
        squares = [
            resolution(with_lost_samples(run.time, run[output])) ** 2
            for run in runs
            if output in run
        ]
        if squares:
            out[output] = float(np.sqrt(np.mean(squares)))
    return out


def without_outliers(run: Run) -> Run:
    """The run with NaN in place of single spikes, so that these are not compared."""
    hit = outlier_masks(run)
    if not hit:
        return run
    channels: dict[str, Channel] = dict(run.channels)
    for name, mask in hit.items():
        channels[name] = replace(channels[name], values=np.where(mask, np.nan, run[name]))
    return replace(run, channels=channels)
