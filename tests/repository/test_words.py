"""Words that winchkit does not use: one word for one thing, and none that is a metaphor.

``GONE`` must not come back in any text of the package, nor in a docstring, a comment or the name of
a test elsewhere. What to write instead is in docs/glossary.md.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

from snippets import ROOT
from texts_of import Text, texts_of, without_quotes

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
    r"(?<!wire )(?<!elastic[ -])(?<!creeping )(?<!lagging )(?<!warm )(?<!heavy )ropes?": "cable "
    "(a title, a steel wire rope and five names of simulated physics keep the word)",
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
"""Pattern between word boundaries, whatever the case, and what to write instead."""
ANY = re.compile(rf"\b(?:{'|'.join(GONE)})\b", re.IGNORECASE)


@cache
def texts() -> tuple[tuple[str, Text], ...]:
    """File and text: every text of the package, docstrings and comments of the other folders.

    Files without any of the words anywhere, names included, are left out.
    """
    found = [
        (path, text)
        for folder in ("winchkit", "benchmarks", "docs", "examples", "tests")
        for path in sorted((ROOT / folder).rglob("*.py"))
        if path != Path(__file__) and ANY.search(without_quotes(path.read_text(encoding="utf-8")))
        for text in texts_of(path)
        if folder == "winchkit" or text.about_code
    ]
    return tuple((path.relative_to(ROOT).as_posix(), text) for path, text in found)


@cache
def names() -> tuple[tuple[str, str], ...]:
    """File and name of every test."""
    return tuple(
        (path.relative_to(ROOT).as_posix(), name)
        for path in sorted((ROOT / "tests").rglob("test_*.py"))
        for name in re.findall(r"def (test_\w+)", path.read_text(encoding="utf-8"))
    )


@pytest.mark.parametrize("word", GONE)
def test_a_word_that_was_replaced_does_not_come_back(word: str) -> None:
    pattern = re.compile(rf"\b(?:{word})\b", re.IGNORECASE)
    places = [
        f"{path}:{text.line}: {match[0]}"
        for path, text in texts()
        if (match := pattern.search(text.words))
    ]
    assert not places, f"write instead: {GONE[word]}"


@pytest.mark.parametrize("word", GONE)
def test_names_of_tests_use_the_same_words(word: str) -> None:
    pattern = re.compile(rf"\b(?:{word})\b", re.IGNORECASE)
    found = [f"{path}: {name}" for path, name in names() if pattern.search(name.replace("_", " "))]
    assert not found, f"write instead: {GONE[word]}"


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
