"""Cable lengths of a motion programme over time, as a bench would move them; nothing moves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite

import numpy as np

from winchkit.arrays import Array
from winchkit.bench.control.motion import within_limits
from winchkit.errors import NotPermitted, UsageError
from winchkit.model.trajectory import JERK_TIME, plan
from winchkit.schema.bench import LimitSpec
from winchkit.schema.programme import ALL, Programme, ProgrammeStep

_SAMPLES = 24
"""Of a move."""


@dataclass(frozen=True)
class ProgrammePlan:
    """One repeat of a motion programme, without the time of operator requests."""

    time: Array
    """(k,), s."""
    length: Mapping[str, Array]
    """Cable length by winch, (k,), m."""
    asks: tuple[tuple[float, str], ...]
    """Time (s) and text of the operator requests."""

    @property
    def duration(self) -> float:
        """s."""
        return float(self.time[-1])


def plan_programme(
    programme: Programme, limits: Mapping[str, LimitSpec], start: Mapping[str, float]
) -> ProgrammePlan:
    """Plan one repeat of a motion programme within the limits of a bench.

    ``start``: cable length by winch, m; where the programme has repeats a winch begins at the
    length at which a repeat ends. Raises UsageError for a winch that the bench lacks; NotPermitted
    for a length, a speed or an acceleration beyond the limits, with the number of the step.
    """
    here = dict(start)
    if programme.repeat > 1:
        here |= {name: way[-1] for name in limits if (way := programme.approach(name))}
    time, lengths = [np.zeros(1)], {name: [np.array([here[name]])] for name in limits}
    asks: list[tuple[float, str]] = []
    now = 0.0
    for number, step in enumerate(programme.step, start=1):
        if step.ask is not None:
            asks.append((now, step.ask))
            continue
        try:
            duration, moved = _leg(step, limits, here)
        except NotPermitted as error:
            raise NotPermitted(f"{programme.name}, step {number}: {error}") from None
        for name in limits:
            rest = np.full(len(moved.time), here[name])
            lengths[name].append(moved.length.get(name, rest))
            here[name] = float(lengths[name][-1][-1])
        time.append(now + moved.time)
        now += duration
    return ProgrammePlan(
        np.concatenate(time),
        {name: np.concatenate(parts) for name, parts in lengths.items()},
        tuple(asks),
    )


@dataclass(frozen=True)
class _Moved:
    time: Array
    length: Mapping[str, Array]


def _leg(
    step: ProgrammeStep, limits: Mapping[str, LimitSpec], here: Mapping[str, float]
) -> tuple[float, _Moved]:
    """Duration and samples of a step; shorter moves last as long as the longest."""
    if step.hold is not None:
        return step.hold, _Moved(np.array([0.0, step.hold]), {})
    if step.winch != ALL and step.winch not in limits:
        raise UsageError(f"no winch '{step.winch}' on this bench; it has {', '.join(limits)}")
    plans = {}
    for name in limits if step.winch == ALL else (step.winch,):
        if not isfinite(here[name]):
            raise NotPermitted(f"the cable length of winch {name} is not known; home it first")
        goal = step.to if step.to is not None else here[name] + (step.by or 0.0)
        speed, ramp = within_limits(limits[name], goal, step.speed, step.acceleration)
        plans[name] = plan(goal - here[name], speed, ramp, ramp / JERK_TIME)
    duration = max(item.duration for item in plans.values())
    share = np.linspace(0.0, 1.0, _SAMPLES)
    length = {name: here[name] + item.at(share * item.duration)[0] for name, item in plans.items()}
    return duration, _Moved(share * duration, length)
