"""Identification of friction, presliding stiffness and shape of pulley groups, with uncertainties.

The runs hold both ends of the cable: the cell at the drum, and a cell or a known weight at the
platform. The estimator's output at the platform is fitted to the measurement by nonlinear least
squares.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np

from winchkit.arguments import require_sequence, require_type, require_types
from winchkit.arrays import Array
from winchkit.errors import RunError, UsageError
from winchkit.estimation.groups import PulleyGroup, flat_pulleys
from winchkit.estimation.kernels import PLAIN, Kernels
from winchkit.model.line import Line
from winchkit.model.stages import Signals
from winchkit.runs.run import Run, real_numbers
from winchkit.schema.profiles.winch import WinchProfile

_SINGULAR = 1e-10
"""Share of the largest singular value of scaled columns below which a combination is not
identified: a condition of 1e10 leaves six of the sixteen digits (rule of thumb)."""


def covariance_of(residuals: Array, jacobian: Array, lengths: Sequence[int]) -> Array:
    """Covariance s² τ (JᵀJ)⁻¹ of least-squares estimates under correlated residuals, with the
    correlation time τ in samples; NaN for parameters that are not identifiable."""
    rows, columns = jacobian.shape
    scale = np.sqrt(np.sum(jacobian**2, axis=0))
    used = scale > 0
    out = np.full((columns, columns), np.nan)
    freedom = max(1, rows - int(np.count_nonzero(used)))
    noise = float(np.sum(residuals**2)) / freedom * correlation_time(residuals, lengths)
    _, singular, rotation = np.linalg.svd(jacobian[:, used] / scale[used], full_matrices=False)
    known = singular > _SINGULAR * singular[:1].max(initial=0.0)
    inverse = (rotation[known].T / singular[known] ** 2) @ rotation[known]
    lost = np.any(np.abs(rotation[~known]) > np.sqrt(_SINGULAR), axis=0)
    block = noise * inverse / np.outer(scale[used], scale[used])
    block[lost, :] = block[:, lost] = np.nan
    out[np.ix_(used, used)] = block
    return out


def correlation_time(residuals: Array, lengths: Sequence[int]) -> float:
    """Integrated correlation time in samples, at least 1: 1 + 2 Σ ρ_k up to the first lag with ρ_k
    <= 0."""
    parts = np.split(residuals, np.cumsum(lengths)[:-1])
    size = max(len(part) for part in parts)
    padded = 2 ** int(np.ceil(np.log2(2 * size)))
    power = sum(np.abs(np.fft.rfft(part - part.mean(), padded)) ** 2 for part in parts if len(part))
    covariance = np.fft.irfft(power, padded)[:size]
    if not covariance[0] > 0:
        return 1.0
    rho = covariance[1:] / covariance[0]
    end = np.flatnonzero(rho <= 0)
    return float(1.0 + 2.0 * np.sum(rho[: end[0]] if end.size else rho))


_LEAST_SAMPLES = 20
"""Rule of thumb: three parameters a group; fewer samples than 20 determine no memory."""
_BOUNDS = ((1e-5, 0.5), (1.0, 1e8), (0.05, 4.0))
"""Bounds of μ, σ (N/m) and β."""
_BEGINNINGS = 3
"""Starting points for every group after the first."""
_LENGTHS = (3e-4, 3e-3, 0.02, 0.1)
"""Presliding distances of the starting points, as shares of the stroke."""


@dataclass(frozen=True)
class PulleyRecord:
    """Both tensions of one run and the motion of the cable; arrays (n,), finite."""

    cell: Array
    """At the drum, N."""
    platform: Array
    """At the platform end, N."""
    wound: Array
    """Cable wound in, any origin, m."""


@dataclass(frozen=True)
class Identified:
    """Identified pulley groups, for a :class:`~winchkit.estimation.DahlEstimator`."""

    groups: tuple[PulleyGroup, ...]
    """With the covariance of μ, σ and β; NaN where not identifiable from these runs."""
    residual_std: float
    """Rms of estimate less measurement, N."""
    starts: tuple[float, ...]
    """Friction at the start of each run as a share of its limit, -1 to 1."""
    samples: int
    at_bound: tuple[str, ...] = ()
    """Parameters that ended at a bound; their standard deviations mean little."""


def record_of(run: Run, profile: WinchProfile) -> PulleyRecord:
    """Both tensions and the nominal motion of a run of one winch, without rows with NaN; raises
    RunError without ``tension``, and without ``load`` and ``load_mass``."""
    require_type(run, Run, "run")
    require_type(profile, WinchProfile, "profile")
    load = run["load"] if "load" in run.channels else None
    if load is None and run.load_mass is None:
        raise RunError(
            f"{run.path or run.name}: no tension at the platform is known; pulley friction needs "
            "a column 'load [N]' or the metadata 'load_mass' beside 'tension [N]'"
        )
    motion = Line(profile).motion(
        Signals(run.time, run["motor_angle"], load=load, load_mass=run.load_mass)
    )
    assert motion.load is not None
    rows = np.column_stack([run["tension"], motion.load, -motion.at.free_length])
    good = rows[np.isfinite(rows).all(axis=1)]
    return PulleyRecord(*(np.ascontiguousarray(column) for column in good.T))


def identify_dahl(
    records: Sequence[PulleyRecord],
    wraps: Sequence[Sequence[float]],
    *,
    shape: float | None = None,
    kernels: Kernels = PLAIN,
) -> Identified:
    """Fit μ, σ and β of every pulley group.

    Parameters
    ----------
    records
        Runs with both tensions.
    wraps
        Wrap angles of each group from the drum on, rad.
    shape
        Value at which β is held; None to fit it.
    kernels
        Compiled loops, or plain Python.

    Returns
    -------
    Identified
        Of least residual sum of squares over several starting points.

    Raises
    ------
    UsageError
        Without enough samples, or without a group.

    Notes
    -----
    Nonlinear least squares with analytic derivatives; the friction at the start of each run is a
    nuisance parameter.
    """
    from scipy.optimize import least_squares

    require_types(records, PulleyRecord, "records")
    require_sequence(wraps, "wraps", "a list of lists of wrap angles, one per group")
    for index, group in enumerate(wraps):
        real_numbers(f"wraps[{index}]", group)
    samples = sum(len(record.cell) for record in records)
    if samples < _LEAST_SAMPLES or not len(wraps):
        raise UsageError(
            f"{samples} samples and {len(wraps)} pulley groups cannot be identified; give at "
            f"least {_LEAST_SAMPLES} samples and one group"
        )
    problem = _Problem(tuple(records), tuple(tuple(group) for group in wraps), shape, kernels)
    # Groups with exchanged parameters fit nearly as well: several starting points.
    begins = sorted(problem.beginnings(), key=lambda x: float(np.sum(problem.residuals(x) ** 2)))
    fits = [
        least_squares(
            problem.residuals, begin, jac=problem.slopes, bounds=problem.bounds, x_scale="jac"
        )
        for begin in begins[: _BEGINNINGS * len(wraps) - _BEGINNINGS + 1]
    ]
    return problem.answer(min(fits, key=lambda fit: float(fit.cost)).x)


@dataclass
class _Problem:
    """Residuals and derivatives over (ln μ, ln σ, β) of every group and the start of every run."""

    records: tuple[PulleyRecord, ...]
    wraps: tuple[tuple[float, ...], ...]
    shape: float | None
    kernels: Kernels
    _last: tuple[bytes, Array, Array] | None = field(default=None, repr=False)

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds."""
        ends = []
        for end, share in ((0, -1.0), (1, 1.0)):
            group = [np.log(_BOUNDS[0][end]), np.log(_BOUNDS[1][end]), _BOUNDS[2][end]]
            ends.append(np.array(group * len(self.wraps) + [share] * len(self.records)))
        return ends[0], ends[1]

    def groups(self, x: Array) -> list[PulleyGroup]:
        """Pulley groups at a parameter vector."""
        out = []
        for wraps, part in zip(self.wraps, x[: 3 * len(self.wraps)].reshape(-1, 3), strict=True):
            shape = float(part[2]) if self.shape is None else self.shape
            out.append(PulleyGroup(wraps, float(np.exp(part[0])), float(np.exp(part[1])), shape))
        return out

    def beginnings(self) -> list[Array]:
        """Starting points: friction from the spread of the tension ratio, several distances."""
        ratio = np.concatenate([r.cell / r.platform for r in self.records])
        force = float(np.median(np.concatenate([r.platform for r in self.records])))
        stroke = max(float(np.ptp(record.wound)) for record in self.records)
        pressure = sum(2 * abs(np.sin(wrap / 2)) for group in self.wraps for wrap in group)
        lost = float(np.median(np.abs(ratio - 1.0)))
        friction = float(np.clip(lost / max(pressure, 1e-9), 1e-4, 0.3))
        out = []
        for lengths in product(_LENGTHS, repeat=len(self.wraps)):
            x: list[float] = []
            for length in lengths:
                stiffness = friction * force / max(length * stroke, 1e-9)
                x += [np.log(friction), np.log(max(stiffness, 1.0)), self.shape or 1.0]
            out.append(np.clip([*x, *[0.0] * len(self.records)], *self.bounds))
        return out

    def both(self, x: Array) -> tuple[Array, Array]:
        """Residuals (n,), N, and their derivatives (n, p)."""
        if self._last is None or self._last[0] != x.tobytes():
            parts = [self._one(k, x) for k in range(len(self.records))]
            residuals = np.concatenate([residual for residual, _ in parts])
            self._last = (x.tobytes(), residuals, np.vstack([slope for _, slope in parts]))
        return self._last[1], self._last[2]

    def residuals(self, x: Array) -> Array:
        """Estimate less measurement, N, shape (n,)."""
        return self.both(x)[0]

    def slopes(self, x: Array) -> Array:
        """Derivatives of the residuals, shape (n, p)."""
        return self.both(x)[1]

    def _one(self, index: int, x: Array) -> tuple[Array, Array]:
        """Residuals and derivatives of one run."""
        record, groups, array = self.records[index], self.groups(x), self.kernels.array
        width, share = 3 * len(groups), float(x[3 * len(groups) + index])
        pulleys, state = flat_pulleys(groups), []
        for group in groups:
            for wrap in group.wraps:
                limit = group.friction * abs(record.cell[0]) * 2 * abs(np.sin(wrap / 2))
                state += [share * limit, share * limit / group.friction, 0.0, 0.0, limit]
        plain = self.kernels is PLAIN
        moved = -np.diff(record.wound, prepend=record.wound[:1])
        out, slopes = np.empty(len(moved)), np.empty((len(moved), width + 1))
        told = [0.0] * len(moved), [[0.0] * (width + 1) for _ in moved] if plain else []
        self.kernels.follow(
            record.cell.tolist() if plain else record.cell,
            moved.tolist() if plain else moved,
            array(state),
            array(pulleys),
            array([0.0] * (6 * len(groups))),
            array([0.0] * width),
            told[0] if plain else out,
            told[1] if plain else slopes,
        )
        if plain:
            out, slopes = np.array(told[0]), np.array(told[1])
        return out - record.platform, self._chain(slopes, index, x)

    def _chain(self, slopes: Array, index: int, x: Array) -> Array:
        """Derivatives by the fitted parameters from those by the physical ones (chain rule)."""
        full = np.zeros((len(slopes), len(x)))
        width = 3 * len(self.wraps)
        scale = np.ones(width)
        logs = np.arange(width) % 3 < 2
        scale[logs] = np.exp(x[:width][logs])
        full[:, :width] = slopes[:, :width] * scale
        if self.shape is not None:
            full[:, 2:width:3] = 0.0
        full[:, width + index] = slopes[:, width]
        return full

    def answer(self, x: Array) -> Identified:
        """Groups with their covariances at a parameter vector."""
        residuals, jacobian = self.both(x)
        spread = covariance_of(residuals, jacobian, [len(r.cell) for r in self.records])
        groups = []
        for k, group in enumerate(self.groups(x)):
            scale = np.array([group.friction, group.stiffness, 1.0])
            held = np.array([False, False, self.shape is not None])
            block = spread[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] * np.outer(scale, scale)
            block[held, :] = block[:, held] = 0.0
            rows = tuple((float(row[0]), float(row[1]), float(row[2])) for row in block)
            groups.append(
                PulleyGroup(group.wraps, group.friction, group.stiffness, group.shape, rows)
            )
        return Identified(
            tuple(groups),
            float(np.sqrt(np.mean(residuals**2))),
            tuple(float(share) for share in x[3 * len(groups) :]),
            len(residuals),
            self._at_bound(x),
        )

    def _at_bound(self, x: Array) -> tuple[str, ...]:
        low, high = self.bounds
        near = np.minimum(x - low, high - x) < 1e-6 * (high - low)
        names = ("friction", "stiffness", "shape")
        return tuple(
            f"group {k // 3 + 1} {names[k % 3]}"
            for k in range(3 * len(self.wraps))
            if near[k] and not (k % 3 == 2 and self.shape is not None)
        )
