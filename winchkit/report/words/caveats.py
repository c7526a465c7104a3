"""Caveats of a diagnosis in words: causes that these data cannot exclude."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from winchkit.quantity_text import percent
from winchkit.report.words.vocabulary import output_name, runs_listed
from winchkit.runs.sanity.finding import Finding

_CAVEATS = {
    "inverted-sign": "the sign of a channel looks inverted: no effect is looked for; import it "
    "with a minus, --column CHANNEL=-COLUMN, or negate it",
    "wrong-factor": "the unit or factor of a channel looks wrong: no effect is looked for",
    "no-repeats": "no run repeats another: the noise is known between two bounds only",
    "repeats-are-copies": "a run is a copy of another one and shows no noise: it was left out",
    "outlying-repeat": "a run differs from its repeats by something that is not recorded: it was "
    "left out",
    "saturated": "the motor torque is cut off at its largest or smallest value: what it was there "
    "is unknown",
    "noise-floor-implausible": "repeats agree to better than the resolution of an instrument: "
    "errors below the noise of its rounding cannot be excluded",
}
"""Sentence, without a full stop, of every code of ``caveats``."""
_SHOWN = 4
"""Findings or names that are listed; more are counted."""


def caveat_text(code: str) -> str:
    """Sentence of a caveat; the code itself where it has none."""
    return _CAVEATS.get(code, code)


def finding_texts(findings: Sequence[Finding], most: int = _SHOWN) -> list[str]:
    """Findings, the most important first; a line per channel and text, with its runs.

    Of more than ``most`` texts that differ in their numbers the first ones are listed.
    """
    runs: dict[tuple[str, str], dict[str, list[str]]] = {}
    for finding in findings:
        alike = runs.setdefault((finding.channel, finding.code), {})
        alike.setdefault(finding.text, []).append(finding.run)
    return [line for (channel, _), texts in runs.items() for line in _alike(channel, texts, most)]


def _alike(channel: str, texts: Mapping[str, list[str]], most: int) -> Iterator[str]:
    """Lines of one code: the first, and where they are many, how many more there are."""
    shown = texts if len(texts) <= most else dict(list(texts.items())[: max(1, most - 1)])
    for text, names in shown.items():
        yield f"{_place(names, channel)}: {text}"
    others = [name for text, names in texts.items() if text not in shown for name in names]
    if others:
        yield f"{_place(others, channel)}: the same with other numbers, listed by --json"


def used_text(used: Mapping[str, float]) -> str:
    """Share of the samples that is compared, by output; empty where it is not known."""
    shares = [f"{output_name(name)} {percent(share)}" for name, share in used.items()]
    return f"compared samples: {', '.join(shares)}" if shares else ""


def _place(runs: Sequence[str], channel: str) -> str:
    named = [name for name in dict.fromkeys(runs) if name]
    return f"{channel} of {runs_listed(named, _SHOWN)}" if named else channel
