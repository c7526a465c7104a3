"""benchmarks/dahl_estimator.py at a small size: it runs, and its figures are what they say."""

import json
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

import dahl_estimator as figures


def test_the_exact_step_is_far_nearer_than_eulers() -> None:
    errors = figures.coarse_errors()
    # What is left is where between two samples the cable turned round.
    assert 0 < errors["exact step"] < 0.1 * figures.LIMIT
    assert errors["euler"] > 5 * errors["exact step"]


def test_it_prints_all_it_promises(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(figures, "UPDATES", 200)
    monkeypatch.setattr(figures, "find_spec", lambda name: None)
    monkeypatch.setattr(sys, "argv", ["dahl_estimator.py", "--json", "--samples", "4000"])
    code = figures.main()
    answer = json.loads(capsys.readouterr().out)
    assert code == (1 if answer["broken"] else 0)
    assert answer["compile_seconds"] is None
    timed = answer["seconds"]
    assert {"update, plain", "constant limit, numpy"} <= set(timed)
    ratio = answer["times_faster"]["constant limit, numpy / constant limit, loop"]
    assert ratio == timed["constant limit, loop"] / timed["constant limit, numpy"]
