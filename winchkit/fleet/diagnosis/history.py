"""Parameters of a fleet over time: changes, dates and costs; winches that differ from the others.

Estimates of one fixed set of effects (:mod:`winchkit.fleet.diagnosis.sessions`) are grouped by
effect and parameter. Every winch of a group is tested for a change over its sessions, and against
the other winches. The false discovery rate is controlled over all of these tests.

References
----------
Benjamini, Y., Hochberg, Y. (1995). Controlling the false discovery rate. J. R. Stat. Soc. B 57,
289-300.
Benjamini, Y., Yekutieli, D. (2001). The control of the false discovery rate in multiple testing
under dependency. Ann. Stat. 29, 1165-1188.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from winchkit.arrays import Array
from winchkit.fleet.diagnosis.changes import Change, ParameterSeries, change_of, session_variance
from winchkit.fleet.diagnosis.limit_date import LimitDate, limit_date
from winchkit.fleet.diagnosis.partial_pooling import PartialPooling, odd_p_values, partial_pooling
from winchkit.fleet.diagnosis.robust_variance import Variance
from winchkit.fleet.diagnosis.sessions import SessionEstimate
from winchkit.fleet.diagnosis.variance_function import moderated_stds, power_of_stated

_FALSE_DISCOVERY_RATE = 0.01
"""False discovery rate of changes and of odd winches; convention."""
_RIVAL_LEVEL = 0.05
"""Level at which the other kind of change is rejected; convention."""
Key = tuple[str, str]
"""Effect and parameter."""


@dataclass(frozen=True)
class WinchHistory:
    """One parameter of one winch over its sessions, SI."""

    winch: str
    sessions: int
    value: float
    """Own estimate of the present value: after a step, at the end of a trend, else the mean."""
    std: float
    pooled: float
    """The same with the information of the other winches."""
    pooled_std: float
    change: Change | None
    """Largest change; None with fewer than four sessions."""
    change_q_value: float
    """P-value of no change adjusted for the false discovery rate; NaN without a test."""
    odd_q_value: float
    """Adjusted p-value of being one of the other winches; NaN with fewer than four winches."""
    rms_per_unit: Mapping[str, float]
    series: ParameterSeries
    """Own estimates of the sessions."""
    limit_value: float | None = None
    """Value that must not be reached; None without one."""
    limit: LimitDate | None = None
    """Date at which it is reached; None unless there is a trend towards it at a known rate."""

    @property
    def changed(self) -> bool:
        """Whether there is a change at a false discovery rate of 1 %."""
        return bool(self.change_q_value < _FALSE_DISCOVERY_RATE)

    @property
    def odd(self) -> bool:
        """Whether the winch differs from the others at a false discovery rate of 1 %."""
        return bool(self.odd_q_value < _FALSE_DISCOVERY_RATE)

    @property
    def is_beyond_limit(self) -> bool:
        """Whether the present value is as far from zero as the limit, on its side."""
        limit = self.limit_value
        return limit is not None and self.value / limit >= 1.0

    @property
    def kind(self) -> Literal["step", "trend", "step or trend"]:
        """Kind of the change; both where neither is rejected at 5 %."""
        decided = self.change is not None and self.change.rival_p_value < _RIVAL_LEVEL
        return self.change.kind if self.change is not None and decided else "step or trend"

    @property
    def cost(self) -> dict[str, float]:
        """Rms error of every output that the change causes in the runs, SI."""
        size = 0.0 if self.change is None else abs(self.change.size)
        return {output: size * rms for output, rms in self.rms_per_unit.items()}

    def to_json(self) -> dict[str, Any]:
        """Dictionary that the command prints."""
        change = None
        if self.change is not None:
            date = self.change.date
            change = {
                **{k: v for k, v in vars(self.change).items() if k not in {"kind", "date"}},
                "kind": self.kind,
                "date": None if date is None else date.date,
                "earliest": None if date is None else date.earliest,
                "latest": None if date is None else date.latest,
                "cost": self.cost,
            }
        return {
            "winch": self.winch,
            "sessions": self.sessions,
            "value": self.value,
            "std": self.std,
            "pooled": self.pooled,
            "pooled_std": self.pooled_std,
            "changed": self.changed,
            "change_q_value": self.change_q_value,
            "odd": self.odd,
            "odd_q_value": self.odd_q_value,
            "change": change,
            "limit": None if self.limit is None else vars(self.limit),
            "beyond_limit": None if self.limit_value is None else self.is_beyond_limit,
        }


@dataclass(frozen=True)
class FleetParameter:
    """One parameter of an effect over all winches and sessions, SI."""

    effect: str
    parameter: str
    unit: str
    common: float
    common_std: float
    between_std: float
    """Standard deviation between winches (REML)."""
    session_std: float
    """Standard deviation between sessions of a winch, beyond the noise within a session."""
    winches: tuple[WinchHistory, ...]

    def deviations(self, winch: WinchHistory) -> Array:
        """Deviation of each session of a winch from the median winch, (y − m) / √(s² + τ²), s² the
        variance of the estimate and τ² that of the sessions. One odd winch does not move the median
        m, and the spread between winches is no part of it, so that a winch that differs is seen."""
        median = float(np.median([own.value for own in self.winches]))
        series = winch.series
        sigma = np.sqrt(series.stds**2 + self.session_std**2)
        return np.asarray((series.values - median) / sigma)

    def to_json(self) -> dict[str, Any]:
        """Dictionary that the command prints."""
        return {**vars(self), "winches": [winch.to_json() for winch in self.winches]}


@dataclass(frozen=True)
class FleetHistory:
    """Every parameter of a fleet over winches and time."""

    parameters: tuple[FleetParameter, ...]
    procedure: Literal["Benjamini-Hochberg", "Benjamini-Yekutieli"]
    undetermined: int
    """Estimates that were left out, since the runs of their session leave the value open."""

    @property
    def changed(self) -> list[tuple[FleetParameter, WinchHistory]]:
        """Changes at a false discovery rate of 1 %, the most significant first."""
        found = [(p, w) for p in self.parameters for w in p.winches if w.changed]
        return sorted(found, key=lambda pair: pair[1].change_q_value)

    @property
    def odd(self) -> list[tuple[FleetParameter, WinchHistory]]:
        """Winches that differ from the others, the most significant first."""
        found = [(p, w) for p in self.parameters for w in p.winches if w.odd]
        return sorted(found, key=lambda pair: pair[1].odd_q_value)

    @property
    def beyond_limit(self) -> list[tuple[FleetParameter, WinchHistory]]:
        """Winches whose present value is beyond the limit of its parameter."""
        return [(p, w) for p in self.parameters for w in p.winches if w.is_beyond_limit]

    def to_json(self) -> dict[str, Any]:
        """Dictionary that the command prints."""
        return {
            "schema": 1,
            "false_discovery_rate": _FALSE_DISCOVERY_RATE,
            "procedure": self.procedure,
            "undetermined": self.undetermined,
            "parameters": [parameter.to_json() for parameter in self.parameters],
        }


def fleet_history(
    estimates: Iterable[SessionEstimate], limits: Mapping[Key, float] | None = None
) -> FleetHistory:
    """Changes over time and differences between winches of a fleet, by estimates of one fixed set
    of effects; ``limits`` are values that must not be reached, SI, not zero.

    Adjusted p-values are those of Benjamini and Hochberg where every fit has one parameter, since
    the tests of different winches are nearly independent; otherwise those of Benjamini and
    Yekutieli, which hold under any dependence. Changes, their dates included (Bonferroni), and odd
    winches are two families of tests.
    """
    known = list(estimates)
    used = [e for e in known if np.isfinite(e.value) and e.std > 0.0]
    groups: dict[Key, dict[str, list[SessionEstimate]]] = {}
    for estimate in sorted(used, key=lambda e: e.time):
        group = groups.setdefault((estimate.effect, estimate.parameter), {})
        group.setdefault(estimate.winch, []).append(estimate)
    dependent = any(len(e.covariance) > 1 for e in used)
    tested = {key: _tested(group) for key, group in groups.items()}
    change = [_p_value(c) for each in tested.values() for c in each.changes]
    odd = [p for each in tested.values() for p in each.odd.tolist()]
    change_q, odd_q = (iter(_adjusted(p, dependent=dependent)) for p in (change, odd))
    parameters = []
    for key, group in groups.items():
        each, limit = tested[key], (limits or {}).get(key)
        winches = [
            WinchHistory(
                winch,
                len(own),
                float(each.values[index]),
                float(each.stds[index]),
                float(each.pooling.pooled[index]),
                float(each.pooling.pooled_std[index]),
                each.changes[index],
                next(change_q),
                next(odd_q),
                own[-1].rms_per_unit,
                each.series[index],
                limit,
            )
            for index, (winch, own) in enumerate(group.items())
        ]
        winches = [_with_limit_date(winch, each.between) for winch in winches]
        unit = next(iter(group.values()))[0].unit
        pooling, session_std = each.pooling, float(np.sqrt(each.between.value))
        parameters.append(
            FleetParameter(
                *key,
                unit,
                pooling.common,
                pooling.common_std,
                pooling.between_std,
                session_std,
                tuple(winches),
            )
        )
    name: Literal["Benjamini-Hochberg", "Benjamini-Yekutieli"] = (
        "Benjamini-Yekutieli" if dependent else "Benjamini-Hochberg"
    )
    return FleetHistory(tuple(parameters), name, len(known) - len(used))


@dataclass(frozen=True)
class _ParameterTests:
    """Tests of one parameter, of every winch in order."""

    series: list[ParameterSeries]
    between: Variance
    changes: list[Change | None]
    values: Array
    stds: Array
    pooling: PartialPooling
    odd: Array


def _tested(group: Mapping[str, Sequence[SessionEstimate]]) -> _ParameterTests:
    values = [np.array([e.value for e in own]) for own in group.values()]
    stated = [np.array([e.std for e in own]) for own in group.values()]
    power = power_of_stated(values, stated)
    series = [
        ParameterSeries(np.array([e.time for e in own]), y, moderated_stds(s, power))
        for own, y, s in zip(group.values(), values, stated, strict=True)
    ]
    between = session_variance(series)
    changes = [change_of(each, between) for each in series]
    present, stds = np.array(
        [_present(s, c, between) for s, c in zip(series, changes, strict=True)]
    ).T
    pooling = partial_pooling(present, stds)
    odd = odd_p_values(present, stds)
    return _ParameterTests(series, between, changes, present, stds, pooling, odd)


def _present(
    series: ParameterSeries, change: Change | None, between: Variance
) -> tuple[float, float]:
    """Present value: of the changed model where the change alone is significant, else the mean."""
    if _p_value(change) < _FALSE_DISCOVERY_RATE and change is not None:
        return change.level, change.level_std
    weight = 1 / (series.stds**2 + between.value)
    return float(np.average(series.values, weights=weight)), float(1 / np.sqrt(weight.sum()))


def _with_limit_date(winch: WinchHistory, between: Variance) -> WinchHistory:
    """The winch with the date of its limit, where it changed by a trend and not by a step."""
    if winch.limit_value is None or not winch.changed or winch.kind != "trend":
        return winch
    return replace(winch, limit=limit_date(winch.series, between, winch.limit_value))


def _p_value(change: Change | None) -> float:
    return float("nan") if change is None else change.p_value


def _adjusted(p_values: Sequence[float], *, dependent: bool) -> list[float]:
    """Adjusted p-values; NaN stays."""
    # As long to import as everything else that the page of a server needs before it starts.
    from scipy.stats import false_discovery_control

    p = np.array(p_values, dtype=np.float64)
    there = np.isfinite(p)
    if there.any():
        p[there] = false_discovery_control(p[there], method="by" if dependent else "bh")
    return [float(x) for x in p]
