"""benchmarks/robot_metrology.py draws what it says, and its answers are right in a small run."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from robot_metrology import drawn, judged, random_frames, summary


def test_cases_are_drawn_over_instruments_and_effects_and_repeat_with_the_seed() -> None:
    cases = list(drawn(12, 5))
    assert {(c.instrument, c.case.name) for c in cases} == {
        (i, r)
        for i in ("frame", "reflector", "scale")
        for r in ("none", "home length", "exit point", "drum radius")
    }
    assert cases == list(drawn(12, 5))


@pytest.mark.slow
@pytest.mark.campaign
def test_a_small_run_is_right(tmp_path: Path) -> None:
    rows = []
    for n, hidden in enumerate(drawn(3, 31)):
        folder = tmp_path / str(n)
        folder.mkdir()
        rows.append(judged(hidden, folder))
    assert json.loads(json.dumps(rows)) == rows
    told = summary(rows)
    assert told["instrument and effect in the first set"] == "3 of 3"
    assert told["a wrong line named alone"] == "0 of 3"
    assert told["raw files within 0.04 mm and 0.03 deg"] == "3 of 3"


@pytest.mark.slow
def test_random_frames_never_crash() -> None:
    told = random_frames(4, 3)
    assert told["crashed"] == 0
    assert told["largest_error_mm"] < 1.0
