"""Scores of cases with faults of loggers, and the figures of a campaign with exact intervals.

References
----------
Clopper, C. J., Pearson, E. S. (1934). The use of confidence or fiducial limits illustrated in the
case of the binomial. Biometrika 26, 404-413.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from scipy.stats import beta

from campaign.loggers import FAULTS, MISREAD

AIMS = {
    "truth_in_first": ">= 0.97",
    "wrong_single_name": "<= 0.005",
    "false_alarm": "<= 0.02",
    "misread_named": ">= 0.95",
}
_WORDS = {"inverted-sign": "inverted sign", "wrong-unit": "wrong factor or unit"}
_CODES = {"inverted-sign": "inverted-sign", "wrong-unit": "wrong-factor"}


@dataclass(frozen=True)
class LoggerScore:
    """One case: what is true, and what was answered."""

    seed: int
    snr: float
    hidden: dict[str, dict[str, float]]
    fault: str
    detail: str
    channel: str
    """The one with a wrong sign or unit."""
    rival: str
    """Effect whose likelihood comes nearest to that of the hidden one."""
    log_ratio: float | None
    """ln of the truth's likelihood over that of the rival; None where it was not asked."""
    identifiable: bool
    verdict: str
    steps: tuple[tuple[str, ...], ...]
    certain: tuple[str, ...]
    """Effects of certain steps."""
    caveats: tuple[str, ...]
    findings: tuple[tuple[str, str], ...]
    """Codes and channels under ``sanity``."""
    refusal: str
    seconds: float
    """CPU time of reading and diagnosing."""
    scene: str

    @classmethod
    def read(cls, line: Mapping[str, Any]) -> LoggerScore:
        """From JSON."""
        lists = {
            "steps": tuple(tuple(s) for s in line["steps"]),
            "certain": tuple(line["certain"]),
            "caveats": tuple(line["caveats"]),
            "findings": tuple((code, channel) for code, channel in line["findings"]),
        }
        return cls(**{**line, **lists})

    @property
    def misread(self) -> bool:
        """Whether a channel has a wrong sign or unit."""
        return self.fault in MISREAD

    @property
    def named_as_such(self) -> bool:
        """Whether the wrong sign or unit is what was said, of the right channel."""
        if self.refusal:
            return _WORDS[self.fault] in self.refusal and f"'{self.channel}'" in self.refusal
        code = _CODES[self.fault]
        return code in self.caveats and (code, self.channel) in self.findings and not self.steps

    @property
    def truth_in_first(self) -> bool:
        """Whether the first set has the hidden effect."""
        return bool(self.steps) and any(name in self.steps[0] for name in self.hidden)

    @property
    def wrong_single_name(self) -> bool:
        """Whether a step is certain of an effect that is not hidden."""
        return any(name not in self.hidden for name in self.certain)

    @property
    def alarm(self) -> bool:
        """Whether something is said to be missing."""
        return bool(self.steps) or self.verdict not in {"adequate", "undecided"}

    @property
    def ok(self) -> bool:
        """Whether the answer is as the truth is, as far as the runs identify it."""
        if self.misread:
            return self.named_as_such
        if self.wrong_single_name or (not self.hidden and self.alarm):
            return False
        return self.truth_in_first or not self.identifiable

    @property
    def line(self) -> str:
        """The case in a line."""
        ratio = "" if self.log_ratio is None else f" ln LR {self.log_ratio:.3g} to {self.rival}"
        said = self.refusal or f"{self.verdict} {[list(s) for s in self.steps]}"
        return (
            f"{'ok  ' if self.ok else 'FAIL'} {self.seed} {self.snr:g} {','.join(self.hidden)}"
            f"{ratio} | {self.fault} {self.detail} -> {said} {list(self.caveats)} "
            f"{self.seconds:.1f} s | {self.scene}"
        )


def clopper_pearson(hits: int, cases: int) -> tuple[float, float]:
    """Exact 95 % interval of a rate."""
    low = float(beta.ppf(0.025, hits, cases - hits + 1)) if hits else 0.0
    high = float(beta.ppf(0.975, hits + 1, cases - hits)) if hits < cases else 1.0
    return low, high


_FIGURES: Mapping[str, tuple[Callable[[LoggerScore], bool], Callable[[LoggerScore], bool]]] = {
    "truth_in_first": (lambda s: s.identifiable, lambda s: s.truth_in_first),
    "truth_in_first_of_all": (
        lambda s: bool(s.hidden) and not s.misread,
        lambda s: s.truth_in_first,
    ),
    "wrong_single_name": (lambda s: True, lambda s: s.wrong_single_name),
    "wrong_single_name_identifiable": (lambda s: s.identifiable, lambda s: s.wrong_single_name),
    "false_alarm": (lambda s: not s.hidden and not s.misread, lambda s: s.alarm),
    "misread_named": (lambda s: s.misread, lambda s: s.named_as_such),
    "refused": (lambda s: not s.misread, lambda s: bool(s.refusal)),
}
"""Of which cases a figure is, and what is counted."""


def logger_summary(scores: Sequence[LoggerScore]) -> dict[str, Any]:
    """Figures with intervals, by fault too, and every failure."""
    return {
        "cases": len(scores),
        "identifiable": sum(s.identifiable for s in scores),
        "aims": AIMS,
        "figures": _figures(scores),
        "faults": {
            fault: _figures(group)
            for fault in FAULTS
            if (group := [s for s in scores if s.fault == fault])
        },
        "seconds": sum(s.seconds for s in scores) / max(len(scores), 1),
        "failures": [asdict(s) for s in scores if not s.ok],
    }


def _figures(scores: Iterable[LoggerScore]) -> dict[str, Any]:
    out = {}
    for name, (counts, hit) in _FIGURES.items():
        group = [s for s in scores if counts(s)]
        if group:
            hits = sum(map(hit, group))
            out[name] = {
                "hits": hits,
                "cases": len(group),
                "rate": hits / len(group),
                "interval": clopper_pearson(hits, len(group)),
            }
    return out


def logger_table(result: Mapping[str, Any]) -> str:
    """The figures for a reader."""
    lines = [f"{result['cases']} cases, {result['identifiable']} identifiable"]
    for name, figure in result["figures"].items():
        low, high = figure["interval"]
        lines.append(
            f"{name:32} {figure['hits']:4} of {figure['cases']:4}  {100 * figure['rate']:5.1f} % "
            f"({100 * low:.1f} to {100 * high:.1f})  {AIMS.get(name, '')}"
        )
    names = list(_FIGURES)
    lines.append(f"{'':14}" + "".join(f"{name[:14]:>16}" for name in names))
    for fault, figures in result["faults"].items():
        cells = (figures.get(name) for name in names)
        shown = (f"{f['hits']}/{f['cases']}" if f else "-" for f in cells)
        lines.append(f"{fault:14}" + "".join(f"{cell:>16}" for cell in shown))
    return "\n".join(lines)
