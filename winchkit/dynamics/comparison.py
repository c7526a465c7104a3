"""Comparison of a simulated motion with the measured one: open loop, and under the loops.

Open loop an error of the initial speed grows with time. The comparison says when it alone makes an
error as large as that of the model: from then on the motion shows nothing of the model.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from winchkit.arrays import Array
from winchkit.dynamics.forward import GOAL, Setup, driving_part, motion_of, setup_of
from winchkit.effects.bind import terms_of
from winchkit.effects.catalogue import Catalogue
from winchkit.effects.term import Term
from winchkit.model.derivatives import SamplingTimes
from winchkit.model.line import Line
from winchkit.model.stages import Signals
from winchkit.runs.run import Run
from winchkit.schema.profiles.winch import WinchProfile

_SIGMAS = 2.0
"""Standard deviations of the initial speed within which it lies in 95 of 100 runs."""


@dataclass(frozen=True)
class SimulatedError:
    """Error of one simulated motion of the motor."""

    run: str
    driven_by: str
    """``torque`` as measured, or ``reference`` that the loops of the profile follow."""
    unit: str
    """rad, or m on a linear axis."""
    rms: float
    largest: float
    motion_rms: float
    """Of the measured motion about its mean."""
    meaningful_until: float | None
    """Time at which the uncertain initial speed alone makes an error of ``rms``, s; None if never
    within the run, or under loops."""
    time: Array = field(compare=False)
    """(n,), s, and at it:"""
    measured: Array = field(compare=False)
    simulated: Array = field(compare=False)

    def to_json(self) -> dict[str, Any]:
        """All but the motions."""
        arrays = {"time", "measured", "simulated"}
        return {name: value for name, value in vars(self).items() if name not in arrays}


def simulated_errors(
    runs: Sequence[Run], profile: WinchProfile, catalogue: Catalogue | None = None
) -> list[SimulatedError]:
    """Errors of the motions that the measured torque, and a recorded reference, would make; raises
    RunError and UsageError as :func:`winchkit.forward`."""
    return [error for run in runs for error in _of_run(run, profile, catalogue)]


def smoothed(run: Run, profile: WinchProfile) -> SamplingTimes:
    """Motion of the motor of a run as the model smooths it."""
    velocity = run.channels.get("motor_velocity")
    signals = Signals(
        run.time, run["motor_angle"], motor_velocity=None if velocity is None else velocity.values
    )
    return Line(profile).motion(signals).clock


def open_loop_error(
    profile: WinchProfile, terms: Sequence[Term], run: Run, setup: Setup, speed_std: float
) -> SimulatedError:
    """Error of the motion that the measured torque of a run in the model's channels makes;
    ``speed_std`` is the standard deviation of the initial speed, rad/s."""
    found = _error(profile, terms, run, setup, "torque")
    faster = replace(setup, speed=setup.speed + _SIGMAS * speed_std)
    grown = np.abs(motion_of(profile, terms, faster).angle - found.simulated)
    beyond = np.flatnonzero(grown > found.rms)
    return replace(found, meaningful_until=float(run.time[beyond[0]]) if len(beyond) else None)


def _error(
    profile: WinchProfile, terms: Sequence[Term], run: Run, setup: Setup, driven_by: str
) -> SimulatedError:
    measured = run["motor_angle"]
    simulated = motion_of(profile, terms, setup).angle
    error = simulated - measured
    return SimulatedError(
        run.name, driven_by, "m" if profile.is_linear else "rad",
        float(np.sqrt(np.mean(error**2))), float(np.max(np.abs(error))), float(np.std(measured)),
        None, run.time, measured, simulated,
    )  # fmt: skip


def _of_run(
    run: Run, profile: WinchProfile, catalogue: Catalogue | None
) -> Iterator[SimulatedError]:
    terms = terms_of(profile, catalogue)
    own = driving_part(run, profile, is_torque=True)
    speed, speed_std = smoothed(own, profile).initial_rate
    setup = setup_of(profile, run, None, speed, is_torque=True)
    yield open_loop_error(profile, terms, own, setup, speed_std)
    if profile.control is not None and GOAL in own:
        own = driving_part(run, profile, is_torque=False)
        setup = setup_of(profile, run, None, speed, is_torque=False)
        yield _error(profile, terms, own, setup, "reference")
