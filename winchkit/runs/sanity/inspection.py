"""Inspection of a run: the findings on its time stamps and on every channel."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from winchkit.runs.run import CHANNEL_DIMENSIONS, Run
from winchkit.runs.sanity.consistency import velocity_consistency
from winchkit.runs.sanity.finding import Finding
from winchkit.runs.sanity.low_pass import low_pass
from winchkit.runs.sanity.outliers import outliers
from winchkit.runs.sanity.quantisation import quantised
from winchkit.runs.sanity.repeated_values import constant, repeated_values
from winchkit.runs.sanity.sampling import sampling
from winchkit.runs.sanity.saturation import saturated

__all__ = ["inspect_run"]

_INSTRUMENTS = {"tension", "tension_gross", "load", "load_gross", "motor_torque", "cable_length"}
"""Channels that no trajectory generator sets, so that a limit is one of the instrument."""


def inspect_run(run: Run) -> list[Finding]:
    """Findings on a run, without a model of the winch.

    Parameters
    ----------
    run : Run
        The run, of one winch or of several.

    Returns
    -------
    list of Finding
        On the time stamps first, then by channel.
    """
    out = list(sampling(run))
    for name in run:
        kind = name.rpartition(".")[2]
        if kind in CHANNEL_DIMENSIONS and np.isfinite(run[name]).any():
            out += _channel(run, name, is_instrument=kind in _INSTRUMENTS)
    out += outliers(run)
    for winch in run.winches():
        out += velocity_consistency(run, winch)
    return out


def _channel(run: Run, name: str, *, is_instrument: bool) -> Iterator[Finding]:
    alone = list(constant(run, name))
    yield from alone
    if alone:
        return
    yield from quantised(run, name)
    yield from repeated_values(run, name)
    if is_instrument:
        yield from saturated(run, name)
        yield from low_pass(run, name)
