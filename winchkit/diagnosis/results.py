"""Results of a comparison and of a diagnosis, as frozen dataclasses and as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import isnan
from typing import Any, ClassVar, Literal

from winchkit.diagnosis.data.low_pass import RemovedBand
from winchkit.diagnosis.residuals.attribution import Attribution
from winchkit.diagnosis.residuals.maps import ResidualMap
from winchkit.diagnosis.residuals.traces import OutputTrace, PoseTrace, trace_columns
from winchkit.effects.empirical import shown_id
from winchkit.effects.placement import HOME
from winchkit.fit_statistics import FitStatistics
from winchkit.rendering import Plotted
from winchkit.runs.sanity.finding import Finding
from winchkit.tabular import Columns, Tabular

_ORDER, _AMPLITUDE = "order", "amplitude"
Verdict = Literal["adequate", "explained", "partly", "unknown", "undecided"]


@dataclass(frozen=True)
class OutputError:
    """Error of one output against its prediction, SI."""

    unit: str
    samples: int
    band: float | None
    signal_rms: float
    rms: float
    max: float
    bias: float
    noise_rms: float | None
    """From differences of repeats; None without any."""
    follows: tuple[tuple[str, float], ...]
    """Variables and the share of the error variance (η²) that each explains."""
    orders: tuple[tuple[str, int, float], ...] = ()
    """Angles, periods per turn, and the share of the error variance that this sine explains."""
    rms_with_run_offsets: float | None = None
    """With a fitted offset in every run, where the means of runs without repeats differ."""
    variation: float = float("nan")
    """Standard deviation of the measured output over all runs; NaN where it is not computed."""

    def to_json(self) -> dict[str, Any]:
        """Dictionary that the command prints."""
        plain = {k: v for k, v in vars(self).items() if k not in {"follows", "orders"}}
        follows = [{"variable": name, "share": share} for name, share in self.follows]
        orders = [{"variable": v, "order": order, "share": s} for v, order, s in self.orders]
        return {**plain, "follows": follows, "orders": orders}


@dataclass(frozen=True, repr=False)
class Comparison(Plotted, Tabular):
    """Errors of a profile on measured runs, with only the length offset fitted."""

    outputs: Mapping[str, OutputError]
    offset: float | None
    """Fitted offset of the length instrument, m; the mean over the runs with an offset each."""
    notes: tuple[str, ...] = ()
    maps: tuple[ResidualMap, ...] = field(default=(), compare=False)
    """Mean errors over two variables; per output the largest share first."""
    sanity: tuple[Finding, ...] = ()
    """Findings on the runs, made before any analysis."""
    used_share: Mapping[str, float] = field(default_factory=dict)
    """Share of the measured samples that is compared, by output."""
    caveats: tuple[str, ...] = ()
    """Codes of what these runs cannot exclude."""
    traces: tuple[OutputTrace | PoseTrace, ...] = field(default=(), compare=False)
    """Measured and predicted outputs of every run, or errors of every pose."""
    removed: tuple[RemovedBand, ...] = ()
    """What the low-pass of every output that has one removes."""

    def _columns(self) -> Columns:
        return trace_columns(self.traces)

    def to_json(self) -> dict[str, Any]:
        """Dictionary that ``winchkit compare --json`` prints."""
        outputs = {name: error.to_json() for name, error in self.outputs.items()}
        return {
            "schema": 1,
            "outputs": outputs,
            "length_offset": self.offset,
            "maps": [drawn.to_json() for drawn in self.maps],
            "sanity": [finding.to_json() for finding in self.sanity],
            "used_share": dict(self.used_share),
            "caveats": list(self.caveats),
            "removed": [vars(band) for band in self.removed],
            "notes": list(self.notes),
        }


@dataclass(frozen=True)
class Estimate:
    """A parameter's value with its standard deviation, SI."""

    value: float
    std: float
    unit: str
    interval: tuple[float, float] | None = None
    """95 % confidence interval, pointwise, not conditional on selection; None if not computed."""


@dataclass(frozen=True)
class OutputFit:
    """Errors of one output before and after, SI."""

    unit: str
    band: float | None
    signal_rms: float
    rms_before: float
    rms_after: float
    heldout_rms_before: float
    heldout_rms_after: float
    noise_rms: float | None
    """From repeats or instruments; without them the white noise alone, a lower bound."""
    noise_source: str = "repeats"
    noise_upper: float | None = None
    """Without repeats: the whole residual, an upper bound."""
    p_value: float | None = None
    """Probability of as large a misfit by the noise of the repeats alone."""
    heldout_on: str = "runs"
    """Data of the held-out errors: ``runs`` of another load or programme, ``parts of the runs``
    where a value is determined by one of these only, or ``poses``."""


@dataclass(frozen=True)
class Combination:
    """The combination of parameters that the data determine, SI."""

    name: str
    """In words where it has a name, otherwise its formula."""
    value: float
    std: float
    unit: str


@dataclass(frozen=True)
class Doubt:
    """A reason to doubt a step, as a code and in words."""

    code: str
    text: str


@dataclass(frozen=True)
class Place:
    """Part of the machine, output, and variable over which a law acts there; None without one."""

    part: str
    output: str
    variable: str | None


@dataclass(frozen=True)
class RunOffset:
    """Fitted offset of an instrument in one run, SI; no part of the profile."""

    output: str
    run: str
    value: float
    std: float
    unit: str


@dataclass(frozen=True)
class Step:
    """One addition to the model, with the effects that these runs cannot distinguish from it."""

    effects: tuple[str, ...]
    parameters: Mapping[str, Mapping[str, Estimate]]
    heldout_gain: float
    angles: Mapping[str, float] = field(default_factory=dict)
    """Angle between the signatures of the first effect and of the others, rad."""
    whole: bool = False
    """Whether all effects apply together, as for a robot's geometry, instead of one of them."""
    combination: Combination | None = None
    """What the data determine of an equivalence set or of strongly correlated parameters."""
    place: tuple[Place, ...] = ()
    """Where the first effect acts."""
    law: Literal["established", "open"] = "established"
    """Established where no other law of the catalogue and no free curve explains the same better or
    as well; else open: the place is known, the law is the closest one."""
    certain: bool = False
    """Whether the law is established and less is left unexplained in its outputs than a tenth of
    what it explains."""
    share: float = float("nan")
    """Share of the excess over the noise that only this step explains (leave-one-out)."""
    explains: float = float("nan")
    """Share that it explains beside the additions before it, in the order in which the model grows;
    of laws that overlap the first explains most. NaN where it is not computed."""
    doubts: tuple[Doubt, ...] = ()
    curve: str = ""
    """Variable, in words, of a free curve that explains more than the law, where there is one."""
    refitted: bool = False
    """Whether it is an effect of the profile with another value than in the file."""
    file_values: Mapping[str, float] = field(default_factory=dict)
    """Values in the file of a refitted effect, SI."""

    def to_json(self) -> dict[str, Any]:
        """Dictionary that the command prints."""
        parameters = {
            effect: {name: vars(estimate) for name, estimate in values.items()}
            for effect, values in self.parameters.items()
        }
        first = self.parameters.get(self.effects[0], {}) if self.effects else {}
        orders = [{"order": k, "amplitude": vars(size)} for k, size in series_orders(first)]
        return {
            "effects": list(self.effects),
            "parameters": parameters,
            "orders": orders,
            "heldout_gain": self.heldout_gain,
            "angles": dict(self.angles),
            "combination": vars(self.combination) if self.combination else None,
            **self.standing_json(),
        }

    def standing_json(self) -> dict[str, Any]:
        """Place, law, share and doubts, as the command prints them."""
        return {
            "place": [vars(place) for place in self.place],
            "law": self.law,
            "certain": self.certain,
            "share": self.share,
            "explains": self.explains,
            "doubts": [vars(doubt) for doubt in self.doubts],
            "curve": self.curve or None,
            "refitted": self.refitted,
            "file_values": dict(self.file_values),
        }


def series_orders(values: Mapping[str, Estimate]) -> list[tuple[int, Estimate]]:
    """Whole orders of an effect with their amplitudes, largest first; empty without an order."""
    suffixes = [name.removeprefix(_ORDER) for name in values if name.startswith(_ORDER)]
    found = [
        (round(values[_ORDER + suffix].value), values[_AMPLITUDE + suffix])
        for suffix in suffixes
        if _AMPLITUDE + suffix in values
    ]
    return sorted(found, key=lambda item: -item[1].value)


@dataclass(frozen=True)
class CandidateScore:
    """A candidate effect with its score beside the initial model."""

    effect: str
    score: float
    heldout_rms: Mapping[str, float]
    """Held-out error with it added; empty where it was not fitted."""


@dataclass(frozen=True)
class Detectable:
    """Smallest size of an effect that these runs detect with 90 % power."""

    effect: str
    parameter: str
    smallest: float
    """NaN where no size within the parameter's bounds is detected."""
    unit: str


@dataclass(frozen=True)
class NextRun:
    """A motion programme that separates two effects, with its power, or a repeat for the noise."""

    separates: tuple[str, ...]
    """Two effects; empty for a repeat."""
    programme: str
    power: float = float("nan")

    def to_json(self) -> dict[str, Any]:
        """Dictionary that the command prints."""
        if not self.separates:
            return {"repeat": self.programme}
        return {**vars(self), "separates": list(self.separates)}


@dataclass(frozen=True, repr=False)
class Diagnosis(Plotted, Tabular):
    """Result of a diagnosis: verdict, named effects, uncertainty and limits."""

    data: ClassVar[str] = "runs"
    """Kind of data that it was made from."""

    verdict: Verdict
    outputs: Mapping[str, OutputFit]
    steps: tuple[Step, ...]
    candidates: tuple[CandidateScore, ...]
    detectable: tuple[Detectable, ...]
    unexplained_share: float
    where: tuple[Attribution, ...]
    next_runs: tuple[NextRun, ...]
    notes: tuple[str, ...] = ()
    sanity: tuple[Finding, ...] = ()
    """Findings on the runs, made before any analysis."""
    used_share: Mapping[str, float] = field(default_factory=dict)
    """Share of the measured samples that is compared, by output."""
    caveats: tuple[str, ...] = ()
    """Codes of what these runs cannot exclude, whatever the verdict."""
    interrupted: bool = False
    """Whether the search was interrupted: errors and candidates are known, the verdict is not."""
    fit: FitStatistics | None = None
    """Statistics of the reported model's fit; None without unknowns."""
    run_offsets: tuple[RunOffset, ...] = ()
    """Offsets of instruments that have another one in every run. Those of a held-out run are its
    own in every held-out error."""
    traces: tuple[OutputTrace | PoseTrace, ...] = field(default=(), compare=False)
    """Measured and predicted outputs of every run, or errors of every pose."""
    removed: tuple[RemovedBand, ...] = ()
    """What the low-pass of every output that has one removes."""

    def fit_report(self) -> str:
        """Return the report of the fit of the reported model, in the layout of lmfit's.

        Returns
        -------
        str
            Data, degrees of freedom, χ², AIC and BIC; per value its standard deviation, initial
            value, 95 % interval and plausible range; correlations above 0.5.
        """
        return "no model was fitted" if self.fit is None else self.fit.text()

    def _columns(self) -> Columns:
        return trace_columns(self.traces)

    @property
    def empirical(self) -> tuple[str, ...]:
        """Empirical effects that would describe the unexplained residual, largest share first."""
        names = [shown_id(w.output, w.variable) for w in self.where if w.frequency is None]
        return tuple(dict.fromkeys(names))

    def to_json(self) -> dict[str, Any]:
        """Dictionary that ``winchkit diagnose --json`` prints."""
        return {
            "schema": 1,
            "verdict": None if self.interrupted else self.verdict,
            "interrupted": self.interrupted,
            "outputs": {name: vars(output) for name, output in self.outputs.items()},
            "steps": [step.to_json() for step in self.steps],
            "candidates": [vars(c) | {"heldout_rms": dict(c.heldout_rms)} for c in self.candidates],
            "detectable": [vars(d) for d in self.detectable],
            "unexplained": {
                "share": self.unexplained_share,
                "where": [where.to_json() for where in self.where],
                "empirical": list(self.empirical),
            },
            "next_runs": [run.to_json() for run in self.next_runs],
            "sanity": [finding.to_json() for finding in self.sanity],
            "used_share": dict(self.used_share),
            "caveats": list(self.caveats),
            "removed": [vars(band) for band in self.removed],
            "fit": None if self.fit is None else self.fit.to_json(),
            "run_offsets": [vars(offset) for offset in self.run_offsets],
            "notes": list(self.notes),
        }


@dataclass(frozen=True, repr=False)
class RobotDiagnosis(Diagnosis):
    """Result for a robot; ids of effects at a place are ``EFFECT/LINE`` inside."""

    data: ClassVar[str] = "poses"
    geometry: str = "file"
    """``file`` where the geometry of the profile was kept, ``refitted`` where it was fitted."""

    @property
    def empirical(self) -> tuple[str, ...]:
        """None: a curve over a pose has no empirical effect."""
        return ()

    def to_json(self) -> dict[str, Any]:
        """Dictionary that ``winchkit diagnose --json`` prints for a robot."""
        out = super().to_json()
        out["geometry"] = self.geometry
        out["steps"] = [_step(step) for step in self.steps]
        out["candidates"] = [_placed(candidate) for candidate in out["candidates"]]
        out["detectable"] = _detectable(out["detectable"])
        for run in out["next_runs"]:
            if "separates" in run:
                run["separates"] = [effect_and_line(name)[0] for name in run["separates"]]
        return out


def effect_and_line(placed: str) -> tuple[str, str | None]:
    """Id of an effect and the line of its place, None for all lines or the platform."""
    effect, _, line = placed.partition("/")
    return effect, line or None


def plain_step(step: Step) -> Step:
    """A step without the home lengths that a cable law brings along."""
    parameters = {
        effect: {n: e for n, e in values.items() if not n.startswith(HOME)}
        for effect, values in step.parameters.items()
    }
    return replace(step, parameters=parameters)


def _step(step: Step) -> dict[str, Any]:
    """One step; ``lines`` has, for each of ``effects``, the lines that it may be on."""
    lines: dict[str, list[str | None]] = {}
    for placed in step.effects:
        effect, line = effect_and_line(placed)
        lines.setdefault(effect, []).append(line)
    parameters: dict[str, Any] = {}
    for placed, values in step.parameters.items():
        effect, line = effect_and_line(placed)
        several = len(lines.get(effect, ())) > 1 and effect in parameters
        key = placed if several else effect
        parameters[key] = {name: vars(estimate) for name, estimate in values.items()}
    return {
        "effects": list(lines),
        "lines": lines,
        "parameters": parameters,
        "heldout_gain": step.heldout_gain,
        "angles": dict(step.angles),
        "combination": vars(step.combination) if step.combination else None,
        "whole": step.whole,
        **step.standing_json(),
        "place": [{**vars(place), "line": _line_of(step)} for place in step.place],
    }


def _line_of(step: Step) -> str | None:
    """Line of the first effect, None for all lines or the platform."""
    return None if step.whole else effect_and_line(step.effects[0])[1]


def _placed(candidate: Mapping[str, Any]) -> dict[str, Any]:
    effect, line = effect_and_line(candidate["effect"])
    return {**candidate, "effect": effect, "line": line}


def _detectable(items: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Per effect and parameter the line with the largest detectable size."""
    out: dict[tuple[str, str], dict[str, Any]] = {}
    for item in items:
        effect, line = effect_and_line(item["effect"])
        key = effect, item["parameter"]
        worst = out.get(key)
        size = item["smallest"]
        if worst is None or isnan(size) or size > worst["smallest"]:
            out[key] = {**item, "effect": effect, "line": line}
    return list(out.values())
