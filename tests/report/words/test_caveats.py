"""Findings in lines: equal ones once, alike ones of many runs shortened."""

from __future__ import annotations

from winchkit.report.words.caveats import caveat_text, finding_texts
from winchkit.runs.sanity.finding import Finding


def jitter(run: str, share: int) -> Finding:
    return Finding("jitter", run, "time", share / 100, f"intervals vary by {share} %")


def test_equal_findings_of_several_runs_are_one_line() -> None:
    found = [jitter("a", 50), jitter("b", 50), jitter("c", 20)]
    assert finding_texts(found) == [
        "time of a, b: intervals vary by 50 %",
        "time of c: intervals vary by 20 %",
    ]


def test_alike_findings_of_many_runs_are_shortened() -> None:
    found = [jitter(f"run-{number}", 40 + number) for number in range(14)]
    others = [Finding("gap", "run-0", "time", 1.0, "1 gap")]
    assert finding_texts([*found, *others]) == [
        "time of run-0: intervals vary by 40 %",
        "time of run-1: intervals vary by 41 %",
        "time of run-2: intervals vary by 42 %",
        "time of 11 runs, run-3 to run-13: the same with other numbers, listed by --json",
        "time of run-0: 1 gap",
    ]


def test_the_short_text_has_one_line_per_kind_of_finding() -> None:
    assert finding_texts([jitter("a", 50), jitter("b", 20), jitter("c", 30)], most=1) == [
        "time of a: intervals vary by 50 %",
        "time of b, c: the same with other numbers, listed by --json",
    ]


def test_an_inverted_sign_says_what_to_do() -> None:
    assert "--column CHANNEL=-COLUMN" in caveat_text("inverted-sign")
