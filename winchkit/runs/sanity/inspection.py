"""Inspection of a run: the findings on its time stamps and on every channel."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from winchkit.runs.run import Run
from winchkit.runs.sanity.consistency import implausible_speed, velocity_consistency
from winchkit.runs.sanity.finding import Finding
from winchkit.runs.sanity.ground import ground_mask, load_on_ground
from winchkit.runs.sanity.low_pass import low_pass
from winchkit.runs.sanity.outliers import outlier_masks, outliers
from winchkit.runs.sanity.quantisation import quantised, shared_resolutions
from winchkit.runs.sanity.repeated_values import constant, repeated_values
from winchkit.runs.sanity.sampling import sampling
from winchkit.runs.sanity.saturation import SATURATED, at_limit, saturated
from winchkit.schema.mapping import CHANNEL_DIMENSIONS

_INSTRUMENTS = {"tension", "tension_gross", "load", "load_gross", "motor_torque", "cable_length"}
"""Channels that no trajectory generator sets, so that a limit is one of the instrument."""


@dataclass(frozen=True)
class Inspection:
    """Findings on a run without a model of the winch."""

    run: Run
    """The run as it was read."""
    findings: tuple[Finding, ...]
    """On the time stamps first, then by channel."""
    resolutions: Mapping[str, float]
    """Resolution of every channel of the model, in its unit; 0 where none is found."""
    outliers: Mapping[str, NDArray[np.bool_]]
    """Spikes of the channels that have some, and torques at the limit of an instrument, (n,)."""
    on_ground: NDArray[np.bool_]
    """Samples in which the cable does not carry the load, (n,)."""


def inspect_run(run: Run, *, has_cable: bool = True) -> Inspection:
    """Inspect a run, without a model of the winch.

    ``has_cable``: whether a stated mass may hang on a cable; the weight of a joint does not.
    """
    (inspected,) = inspect_runs([run], has_cable=has_cable)
    return inspected


def inspect_runs(runs: Sequence[Run], *, has_cable: bool = True) -> list[Inspection]:
    """Inspect runs of one winch: their instruments have one resolution, which slow runs of few
    levels do not show.
    """
    steps = shared_resolutions(runs)
    return [_inspected(*each, has_cable=has_cable) for each in zip(runs, steps, strict=True)]


def _inspected(run: Run, steps: Mapping[str, float], *, has_cable: bool) -> Inspection:
    masks = outlier_masks(run, steps)
    out = list(sampling(run))
    for name in run:
        kind = name.rpartition(".")[2]
        if kind in CHANNEL_DIMENSIONS and np.isfinite(run[name]).any():
            out += _channel(run, name, steps[name], is_instrument=kind in _INSTRUMENTS)
    out += outliers(run, masks)
    for finding in out:
        if finding.code == SATURATED and finding.channel.endswith("motor_torque"):
            limited = at_limit(run[finding.channel], steps[finding.channel])
            if limited.any():
                masks[finding.channel] = masks.get(finding.channel, limited) | limited
    held = np.zeros(len(run), dtype=bool)
    for winch in run.winches():
        out += velocity_consistency(run, winch)
        out += implausible_speed(run, winch)
        own = run.of_winch(winch)
        held = ground_mask(own) if has_cable else held
        out += load_on_ground(own, held)
    return Inspection(run, tuple(out), steps, masks, held)


def _channel(run: Run, name: str, step: float, *, is_instrument: bool) -> Iterator[Finding]:
    alone = list(constant(run, name))
    yield from alone
    if alone:
        return
    yield from quantised(run, name, step)
    yield from repeated_values(run, name, step)
    if is_instrument:
        yield from saturated(run, name, step)
        yield from low_pass(run, name, step)
