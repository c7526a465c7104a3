"""Answers against truths: one word per case, and the error on the held-out run."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

VERDICTS = ("effects", "none", "unknown", "no answer")
WORDS = (
    "right",
    "in a set",
    "in part",
    "missed",
    "wrong and certain",
    "rightly none",
    "rightly unknown",
    "no answer",
)
"""What one answer is; README.md has the rules."""


class AnswerError(Exception):
    """An answer that does not have the format, or truths that are not there."""


@dataclass(frozen=True)
class Answer:
    """What an entrant says of one case."""

    verdict: str
    effects: tuple[tuple[frozenset[str], bool], ...]
    """Names that the runs do not distinguish, and whether it is certain of them."""
    predicted: Mapping[str, Sequence[float]]
    """Output of the held-out run, by name; SI."""
    seconds: float = 0.0


def read_answer(path: Path) -> Answer:
    """Read one answer; raises AnswerError with the file and what to do."""
    try:
        entry = json.loads(path.read_text(encoding="utf-8"))
        effects = tuple(
            (frozenset(e["names"]), bool(e.get("certain", True))) for e in entry.get("effects", [])
        )
        answer = Answer(
            str(entry["verdict"]), effects, entry.get("predicted", {}), entry.get("seconds", 0.0)
        )
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise AnswerError(f"{path}: not an answer ({error}); README.md has the format") from error
    if answer.verdict not in VERDICTS:
        raise AnswerError(f"{path}: verdict {answer.verdict!r}; use one of {', '.join(VERDICTS)}")
    if answer.verdict == "none" and effects:
        raise AnswerError(f"{path}: verdict 'none' beside effects; use 'effects'")
    return answer


def judge(answer: Answer, truth: Mapping[str, Any]) -> str:
    """One of ``WORDS``."""
    right = [set(names) for names in truth["right"]]
    known = set(truth["tolerated"]).union(*right)
    if answer.verdict == "no answer":
        return answer.verdict
    if any(certain and not names & known for names, certain in answer.effects):
        return "wrong and certain"
    if not right:
        # A doubtful name where nothing has a name is neither certain nor "none".
        expected = "unknown" if truth["outside"] else "none"
        return f"rightly {expected}" if answer.verdict == expected else "missed"
    found = sum(any(names & named for named, _ in answer.effects) for names in right)
    if found < len(right):
        return "in part" if found else "missed"
    alone = [any(sure and named <= names for named, sure in answer.effects) for names in right]
    return "right" if all(alone) else "in a set"


def held_out_error(predicted: Mapping[str, Sequence[float]], truth: Mapping[str, Any]) -> float:
    """Rms over the outputs of error / noise; 1 is perfect. A length about its mean error."""
    ratios = []
    for name, measured in truth["held_out"].items():
        values = np.asarray(predicted.get(name, truth["nominal"][name]), dtype=float)
        if values.shape != (len(measured),) or not np.all(np.isfinite(values)):
            raise AnswerError(
                f"predicted {name}: {values.size} values, of which "
                f"{int(np.sum(~np.isfinite(values)))} are not finite; the run has {len(measured)}"
            )
        error = values - np.asarray(measured)
        error = error - np.mean(error) if name == "cable_length" else error
        ratios.append(np.sqrt(np.mean(error**2)) / truth["noise"][name])
    return float(np.sqrt(np.mean(np.square(ratios))))


@dataclass(frozen=True)
class Judged:
    """One case of one entrant."""

    case: str
    kind: str
    word: str
    hidden: int
    """Effects with a name that are hidden."""
    found: int
    """Those of them that are named, alone or in a set, certain or not."""
    wrong: int
    """Names, alone or in a set, that no hidden effect bears."""
    names: int
    """Names that the answer has in all."""
    before: float
    """Error of the declared machine on the held-out run over the noise."""
    after: float
    """Error of the entrant's prediction, the declared one where it gives none."""
    seconds: float


def score(truths: Path, answers: Path, cases: int | None = None) -> list[Judged]:
    """The first truths, or all, against the answers of their names; raises AnswerError."""
    found = sorted(truths.glob("*.json"))[:cases]
    if not found:
        raise AnswerError(f"{truths}: no truths (*.json) there; write cases first")
    out = []
    for path in found:
        truth = json.loads(path.read_text(encoding="utf-8"))
        before, given = held_out_error({}, truth), answers / path.name
        answer = read_answer(given) if given.is_file() else Answer("no answer", (), {})
        try:
            after = held_out_error(answer.predicted, truth)
        except AnswerError as error:
            raise AnswerError(f"{given}: {error}") from error
        right, tolerated = [set(names) for names in truth["right"]], set(truth["tolerated"])
        named = [names for names, _ in answer.effects]
        out.append(
            Judged(
                case=path.stem,
                kind=truth["kind"],
                word=judge(answer, truth),
                hidden=len(right),
                found=sum(any(names & one for one in named) for names in right),
                wrong=sum(not one & tolerated.union(*right) for one in named),
                names=sum(map(len, named)),
                before=before,
                after=after,
                seconds=answer.seconds,
            )
        )
    return out


def summary(judged: Sequence[Judged]) -> dict[str, Any]:
    """Counts of words, errors before and after, seconds; the same for each kind."""

    def figures(some: Sequence[Judged]) -> dict[str, Any]:
        counts = Counter(one.word for one in some)
        after = [one.after for one in some]
        return {
            "cases": len(some),
            **{word: counts[word] for word in WORDS},
            "found": f"{sum(one.found for one in some)} of {sum(one.hidden for one in some)}",
            "wrong names": sum(one.wrong for one in some),
            "names": sum(one.names for one in some),
            "before": float(np.median([one.before for one in some])),
            "after": float(np.median(after)),
            "after, 90 %": float(np.quantile(after, 0.9)),
            "seconds": float(np.sum([one.seconds for one in some])),
        }

    kinds = sorted({one.kind for one in judged})
    return figures(judged) | {
        "kinds": {kind: figures([one for one in judged if one.kind == kind]) for kind in kinds}
    }


def table(found: Mapping[str, Mapping[str, Any]]) -> str:
    """One line for each entrant, as Markdown."""
    columns = [*WORDS, "found", "names", "wrong names", "before", "after", "after, 90 %", "seconds"]
    lines = ["| entrant | " + " | ".join(columns) + " |", "|---" * (len(columns) + 1) + "|"]
    for entrant, figures in found.items():
        cells = [
            f"{figures[c]:.3g}" if isinstance(figures[c], float) else str(figures[c])
            for c in columns
        ]
        lines.append(f"| {entrant} | " + " | ".join(cells) + " |")
    return "\n".join(lines)
