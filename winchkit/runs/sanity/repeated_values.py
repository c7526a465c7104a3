"""Values that repeat: channels that are constant, and channels of a slower instrument.

A logger that is faster than an instrument writes its last value again (sample and hold). A coarse
resolution repeats values too, but then changes by single steps; held values change by more.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from winchkit.quantity_text import quantity
from winchkit.runs.run import Run
from winchkit.runs.sanity.finding import Finding, share

REPEATED = "repeated-values"
"""Code of the finding."""
_LEAST_SHARE = 0.2
"""Share of repeated values that is reported; fewer hardly change a spectrum. Rule of thumb."""
_LEAST_CHANGES = 20
"""Fewer changes do not show a period; rule of thumb."""
_LONG = 3
"""Intervals between changes, in median ones, above which the instrument is at rest and not held."""
_STEPS = 2.0
"""A change of fewer steps repeats because of the resolution, not of a held value."""


def constant(run: Run, name: str) -> Iterator[Finding]:
    """A channel with one value only; value: that value."""
    values = run[name]
    values = values[np.isfinite(values)]
    if len(values) > 1 and np.ptp(values) == 0:
        text = f"constant at {quantity(float(values[0]), run.channels[name].unit)} in all samples"
        yield Finding("constant", run.name, name, float(values[0]), text)


def repeated_values(run: Run, name: str, step: float) -> Iterator[Finding]:
    """A channel of resolution ``step`` with values held over several samples; value: share."""
    values = run[name]
    values = values[np.isfinite(values)]
    changes = np.flatnonzero(np.diff(values) != 0)
    if len(changes) < _LEAST_CHANGES:
        return
    lengths = np.diff(changes)
    moving = lengths[lengths <= _LONG * np.median(lengths)]
    repeated = 1 - len(moving) / float(np.sum(moving))
    if repeated < _LEAST_SHARE:
        return
    if step and float(np.median(np.abs(np.diff(values)[changes]))) < _STEPS * step:
        return
    rate = 1 / (run.interval * float(np.mean(moving)))
    yield Finding(
        REPEATED,
        run.name,
        name,
        repeated,
        f"{share(repeated)} of the samples repeat the one before: the instrument has about "
        f"{rate:.3g} Hz, the run {1 / run.interval:.3g} Hz",
    )
