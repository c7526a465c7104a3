"""Words that winchkit does not use: one word for one thing, and none that is a metaphor.

``GONE`` must not come back in any docstring, comment or text of the package. ``PENDING`` are still
somewhere; in the packages of ``CLEAN`` they are gone from docstrings and comments. What to write
instead is in docs/glossary.md.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import cache
from pathlib import Path

import pytest

from snippets import ROOT
from texts_of import Text, texts_of

PACKAGE = ROOT / "winchkit"
GONE = {
    r"wiring files?": "bench file",
    r"in disguise": "shape parameter at its bound",
    r"deaf": "does not answer",
    r"crooked": "strongly nonlinear, asymmetric",
    r"owed": "penalty, required",
    r"so does": "name the subject and the verb",
    r"equal runs": "repeats",
    r"twice recorded": "repeats",
    r"hats?(?! matrix)": "basis function, linear B-spline",
    r"carded": "listed as confusable",
    r"kindred": "of the same family",
    r"skirts?": "transition band, stop-band leakage",
    r"smears?": "length of a filter's response",
    r"numbers of a law": "parameters",
    r"(forgets?|remembers) itself": "loses its state, is autocorrelated",
    r"lean(s|t|ed|ing)? to": "likelihood-ratio test is significant",
    r"rubs?": "Coulomb friction",
    r"out of true": "runout",
    r"doubt(s|ed)?": "specification test",
    r"imagined": "simulated",
    r"calm(s|ed|er)?": "denoised, low-passed",
    r"freedoms": "degrees of freedom",
    r"let(s|ting)? go": "released, geometry free",
    r"loud(est)?": "largest",
    r"prices?": "penalty per parameter",
    r"whitened squares": "χ²",
    r"unseen": "below the noise",
    r"strangers?": "unknown device",
    r"(gives?|gave|given) way": "yields, is compliant, is replaced by",
}
"""Pattern between word boundaries, whatever the case, and what to write instead."""
PENDING = {
    r"(?<!wire )ropes?": "cable (a title and a steel wire rope keep the word)",
    r"nobody": "name what is missing",
    r"told": "reported, given, known",
    r"tells?": "reports, shows, states",
    r"begun": "started, initial",
    r"heed(s|ed|ing)?": "follow, obey",
    r"(rest|error|it) lives|lives? in": "is, is explained by (residual attribution)",
    r"(tell|tells|told)( \w+){0,4} apart": "distinguish, separate",
    r"believ(e|es|ed|ing)": "prior, assumed",
    r"jerk(s|ed)": "transient, impact",
    r"shak(e|es|en)|shook": "oscillates, transient",
    r"what stands": "signal above the noise floor",
    r"stands? beside": "cannot be distinguished from",
    r"nameless": "spline alternative",
    r"merely quiet": "a signal that does not change",
    r"hears?": "receives",
    r"pays(?! out)|pay for": "net decrease of χ²",
    r"thin(s|ned)": "decimate",
    r"drawn anew|sought": "recomputed, searched",
}
"""The same of words that are still to be replaced."""
CLEAN = (
    "calibration",
    "diagnosis/data",
    "diagnosis/design",
    "diagnosis/fleet",
    "diagnosis/residuals",
    "diagnosis/verdict",
    "effects",
    "estimation",
    "model",
    "profile_edit",
    "report",
    "runs",
    "schema",
    "sim",
)


@cache
def texts(folder: str = "") -> tuple[tuple[str, Text], ...]:
    """File and text of every text in a folder of the package."""
    paths = sorted((PACKAGE / folder).rglob("*.py"))
    return tuple(
        (path.relative_to(ROOT).as_posix(), text) for path in paths for text in texts_of(path)
    )


def found(words: Iterable[str], folder: str = "", *, about_code: bool = False) -> list[str]:
    """Places of words in a folder of the package; or in its docstrings and comments only."""
    pattern = re.compile(rf"\b(?:{'|'.join(words)})\b", re.IGNORECASE)
    return [
        f"{path}:{text.line}: {match[0]}"
        for path, text in texts(folder)
        if (text.about_code or not about_code) and (match := pattern.search(text.words))
    ]


@pytest.mark.parametrize("word", GONE)
def test_a_word_that_was_replaced_does_not_come_back(word: str) -> None:
    assert not found([word]), f"write instead: {GONE[word]}"


@pytest.mark.parametrize("folder", CLEAN)
def test_docstrings_and_comments_that_were_rewritten_stay_plain(folder: str) -> None:
    assert (PACKAGE / folder).is_dir()
    assert not found(PENDING, folder, about_code=True)


def test_no_word_is_both_gone_and_pending() -> None:
    assert not GONE.keys() & PENDING.keys()


def test_texts_are_docstrings_comments_and_sentences_without_names(tmp_path: Path) -> None:
    source = tmp_path / "one.py"
    source.write_text(
        '"""A rope and ``a_rope``.\n\nParameters\n----------\nrope : float\n    A thing.\n"""\n'
        "key = 'rope'  # about a rope\nsaid = 'the rope is slack'\n",
        encoding="utf-8",
    )
    assert sorted((t.line, t.words.count("rope"), t.about_code) for t in texts_of(source)) == [
        (1, 1, True),
        (8, 1, True),
        (9, 1, False),
    ]
