"""Ctrl-C while winches are diagnosed in threads: the command ends and waits for none of them."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from model_files import record_files, side_by_side
from winchkit.runs import read_run, write_run

SLOW = """
from pathlib import Path
from time import sleep
from winchkit.effects.effect import Effect, Parameter
from winchkit.model.stages import Stage

def apply(length, at, values):
    Path({marker!r}).touch()
    sleep(600)
    return length

EFFECT = Effect(
    "slow", Stage.LENGTH_INSTRUMENT, (Parameter("size", "m", 0.0, 1e-3),), apply,
    ("cable_length",), what="never ends", formula="x", source="none", looks_like="nothing",
    told_apart="nothing",
)
"""
PATIENCE = 60


@pytest.mark.slow
@pytest.mark.parametrize("winch", ["all", "A"])
def test_an_interrupted_diagnosis_waits_for_nothing(winch: str, tmp_path: Path) -> None:
    runs, both = record_files(tmp_path), tmp_path / "both.csv"
    write_run(side_by_side(read_run(runs[0]), read_run(runs[2])), both)
    marker, effects = tmp_path / "begun", tmp_path / "slow.py"
    effects.write_text(SLOW.format(marker=str(marker)), encoding="utf-8")
    asked = ("diagnose", both, "-p", "bench-spiral", "--winch", winch, "--effects", effects)
    process = subprocess.Popen(
        [sys.executable, "-m", "winchkit", *map(str, asked)], stderr=subprocess.PIPE, text=True
    )
    try:
        until = time.monotonic() + PATIENCE
        while not marker.exists() and time.monotonic() < until and process.poll() is None:
            time.sleep(0.05)
        assert marker.exists()
        process.send_signal(signal.SIGINT)
        _, told = process.communicate(timeout=PATIENCE)
    finally:
        process.kill()
    assert process.returncode == 130
    assert told.split("\n")[-2:] == ["winchkit: interrupted", ""]
    assert "Traceback" not in told
