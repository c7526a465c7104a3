"""Statistics of a fit and its report, in the layout of lmfit's.

The noise variances are known to the fit (from repeats, or from a saturated model), so that the
likelihood is Gaussian with known variances: up to a constant of the data, −2 ln L = χ².

References
----------
Akaike, H. (1974). IEEE Trans. Autom. Control 19, 716-723.
Schwarz, G. (1978). Ann. Stat. 6, 461-464.
Newville, M. et al. (2014). LMFIT: Non-linear least-square minimization (layout of the report).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import isfinite, log, nan, sqrt
from typing import Any

from winchkit.rendering import Shown
from winchkit.tabular import Columns, Tabular

_SHOWN = 0.5
"""Least size of a correlation that is listed."""


@dataclass(frozen=True)
class Correlation:
    """Correlation of two fitted values."""

    a: str
    """``effect.parameter``, or a nuisance parameter."""
    b: str
    value: float


@dataclass(frozen=True)
class FittedParameter:
    """A fitted value, SI or the unit of files."""

    name: str
    """``effect.parameter``, a nuisance parameter, or a parameter of a calibration."""
    value: float
    std: float
    """Standard deviation; NaN where the data leave the value anywhere within its bounds."""
    unit: str
    initial: float
    """Value in the profile; the value of no effect where the profile lacks the effect."""
    interval: tuple[float, float] | None = None
    """95 % confidence interval; None where it was not computed."""
    plausible: tuple[float, float] | None = None
    """Range of real machines, bounds of the fit, or range of the prior; None without any."""
    note: str = ""
    """``at its low bound`` and the like."""

    def to_json(self) -> dict[str, Any]:
        """Dictionary that the command prints."""
        return {**vars(self), "interval": _pair(self.interval), "plausible": _pair(self.plausible)}


@dataclass(frozen=True, repr=False)
class FitStatistics(Shown, Tabular):
    """How well a model fits, and how well the data determine its values.

    Notes
    -----
    With n observations, p unknowns and whitened residuals r: χ² = Σ r², reduced χ² = χ²/(n − p),
    AIC = χ² + 2 p, BIC = χ² + p ln n. A prior counts as an observation. lmfit, which does not know
    the noise, has n ln(χ²/n) in place of χ².
    """

    correlations: tuple[Correlation, ...]
    """Pairs above 0.5 in size, largest first."""
    condition: float
    """Condition number of the whitened derivatives with columns of unit length."""
    method: str = ""
    """Method of the fit, and source of the noise."""
    data: str = ""
    """The data in words."""
    n_observations: int = 0
    """Number of observations n: samples within the band, or equations and priors."""
    n_unknowns: int = 0
    """Number of unknowns p: parameters, nuisance parameters, initial states, poses."""
    chi_square: float = nan
    initial_chi_square: float = nan
    """χ² at the profile's values."""
    parameters: tuple[FittedParameter, ...] = ()
    converged: bool = True
    """Whether the iteration ended at a minimum to its tolerance."""
    iterations: int | None = None
    """Steps of the last fit; None where it is not known."""
    rank: int | None = None
    """Unknowns less the directions that the data do not determine; None where it is not known."""

    @property
    def dof(self) -> int:
        """Degrees of freedom n − p."""
        return self.n_observations - self.n_unknowns

    @property
    def reduced_chi_square(self) -> float:
        """χ² per degree of freedom; NaN without any."""
        return self.chi_square / self.dof if self.dof > 0 else nan

    @property
    def aic(self) -> float:
        """Akaike information criterion with known noise, up to a constant of the data."""
        return self.chi_square + 2 * self.n_unknowns

    @property
    def bic(self) -> float:
        """Bayesian information criterion with known noise, up to a constant of the data."""
        return self.chi_square + self.n_unknowns * log(max(self.n_observations, 1))

    def _columns(self) -> Columns:
        nothing = (nan, nan)
        rows = self.parameters
        return Columns(
            {
                "parameter": [p.name for p in rows],
                "unit": [p.unit for p in rows],
                "value": [p.value for p in rows],
                "std": [p.std for p in rows],
                "low": [(p.interval or nothing)[0] for p in rows],
                "high": [(p.interval or nothing)[1] for p in rows],
                "initial": [p.initial for p in rows],
                "plausible_low": [(p.plausible or nothing)[0] for p in rows],
                "plausible_high": [(p.plausible or nothing)[1] for p in rows],
            },
            metadata={key: value for key, value in self.to_json().items() if key in _FIGURES},
            index=("parameter",),
        )

    def to_json(self) -> dict[str, Any]:
        """Dictionary that the command prints."""
        return {
            "correlations": [vars(pair) for pair in self.correlations],
            "condition": self.condition,
            "converged": self.converged,
            "iterations": self.iterations,
            "rank": self.rank,
            "method": self.method,
            "data": self.data,
            "n_observations": self.n_observations,
            "n_unknowns": self.n_unknowns,
            "dof": self.dof,
            "chi_square": self.chi_square,
            "initial_chi_square": self.initial_chi_square,
            "reduced_chi_square": self.reduced_chi_square,
            "aic": self.aic,
            "bic": self.bic,
            "parameters": [parameter.to_json() for parameter in self.parameters],
        }

    def text(self) -> str:
        """Return the report, in the layout of lmfit's ``fit_report``.

        Returns
        -------
        str
            Statistics, parameters with initial values and ranges, and correlations.
        """
        return "\n".join([*self._statistics(), *self._variables(), *self._correlated()])

    def _statistics(self) -> Iterator[str]:
        yield "[[Fit Statistics]]"
        first = f" ({self.initial_chi_square:.6g} with the profile's values)"
        rows = [
            ("fitting method", self.method),
            ("data", self.data),
            ("observations n", f"{self.n_observations}"),
            ("unknowns p", f"{self.n_unknowns}"),
            ("degrees of freedom", f"{self.dof}"),
            ("chi-square", f"{self.chi_square:.6g}" + first * isfinite(self.initial_chi_square)),
            ("reduced chi-square", f"{self.reduced_chi_square:.5g}"),
            ("AIC = chi-square + 2 p", f"{self.aic:.7g}"),
            ("BIC = chi-square + p ln n", f"{self.bic:.7g}"),
            ("condition number", f"{self.condition:.3g}"),
            ("converged", "yes" if self.converged else "no: the values may change"),
            ("iterations", "" if self.iterations is None else f"{self.iterations}"),
            ("rank", "" if self.rank is None else f"{self.rank}"),
        ]
        for name, value in rows:
            if value:
                yield f"    {name:27} = {value}"

    def _variables(self) -> Iterator[str]:
        yield "[[Variables]]"
        if not self.parameters:
            yield "    none"
        width = max((len(p.name) for p in self.parameters), default=0) + 1
        for p in self.parameters:
            unit = "" if p.unit in ("", "1") else f" {p.unit}"
            share = f" ({abs(p.std / p.value):.2%})" if p.value and isfinite(p.std) else ""
            error = f" +/- {p.std:.3g}{unit}{share}" if isfinite(p.std) else f"{unit}, undetermined"
            ranges = [f"init = {p.initial:.6g}"]
            if p.interval is not None:
                ranges.append(f"95 % [{p.interval[0]:.6g}, {p.interval[1]:.6g}]")
            if p.plausible is not None:
                ranges.append(f"plausible [{p.plausible[0]:.4g}, {p.plausible[1]:.4g}]")
            note = f"; {p.note}" if p.note else ""
            yield f"    {p.name + ':':{width}} {p.value:.8g}{error}"
            yield f"    {'':{width}}   {', '.join(ranges)}{note}"

    def _correlated(self) -> Iterator[str]:
        yield f"[[Correlations]] (unreported correlations are < {_SHOWN:.3f})"
        if not self.correlations:
            yield "    none"
        for pair in self.correlations:
            yield f"    C({pair.a}, {pair.b}) = {pair.value:+.4f}"


_FIGURES = ("method", "data", "n_observations", "n_unknowns", "dof", "chi_square",
            "reduced_chi_square", "aic", "bic")  # fmt: skip


def correlations_of(names: Sequence[str], covariance: Any) -> tuple[Correlation, ...]:
    """Correlations above 0.5 in size, largest first, of a covariance (q, q)."""
    std = [sqrt(max(float(covariance[i, i]), 0.0)) for i in range(len(names))]
    pairs = [
        Correlation(a, names[j], float(covariance[i, j]) / (std[i] * std[j]))
        for i, a in enumerate(names)
        for j in range(i + 1, len(names))
        if std[i] > 0.0 and std[j] > 0.0
    ]
    shown = [pair for pair in pairs if abs(pair.value) > _SHOWN]
    return tuple(sorted(shown, key=lambda p: -abs(p.value)))


def _pair(ends: tuple[float, float] | None) -> list[float] | None:
    return None if ends is None else list(ends)
