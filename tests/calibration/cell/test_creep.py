"""Creep of a calibration whose readings have times, against the law by which they were made."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from winchkit.calibration.cell.files import PointFile, read_points
from winchkit.calibration.cell.static_effects import static_effects
from winchkit.errors import FileError

LOADS = (0, 40, 100, 160, 200, 160, 100, 40, 0)
SHARE, NOISE = 2e-3, 0.02
"""Of a change of load between 1 and 30 minutes; N."""


def measured(
    path: Path, *, creep: float, loop: float = 0.0, seed: int = 0, count: int = 20, head: str = "s"
) -> PointFile:
    """Readings every 20 s, each load hung 10 s before its first one and held for ``count``."""
    random, rows, changes = np.random.default_rng(seed), [], list[tuple[float, float]]()
    factor = {"s": 1.0, "min": 60.0}[head]
    for place, load in enumerate(LOADS):
        start = 20.0 * count * place
        if place:
            changes.append((start - 10.0, load - LOADS[place - 1]))
        for k in range(count):
            time = start + 20.0 * k
            past = sum(step * math.log((time - at) / 60) for at, step in changes) / math.log(30)
            lag = loop * load * (1 if place > 4 else -1)
            reading = load + creep * past + lag + random.normal(0, NOISE)
            rows.append(f"{time / factor:.9g},{load},{reading:.5f}")
    path.write_text("\n".join([f"time [{head}],load [N],reading [N]", *rows]) + "\n")
    return read_points(path)


@pytest.mark.parametrize("head", ["s", "min"])
def test_readings_at_one_load_give_the_creep_with_its_uncertainty(
    tmp_path: Path, head: str
) -> None:
    errors = []
    for seed in range(60):
        found = measured(tmp_path / "p.csv", creep=SHARE, seed=seed, head=head).creep
        errors.append((found.value - SHARE) / found.std)
    assert abs(float(np.mean(errors))) < 0.45
    assert 0.75 < float(np.std(errors)) < 1.25


@pytest.mark.parametrize(
    ("creep", "loop", "name"),
    [(SHARE, 0.0, "creep"), (0.0, 2e-3, "cell-hysteresis"), (0.0, 0.0, "")],
)
def test_creep_is_distinguished_from_hysteresis_by_the_times(
    tmp_path: Path, creep: float, loop: float, name: str
) -> None:
    found = measured(tmp_path / "p.csv", creep=creep, loop=loop)
    effects = static_effects(found.points, found.unit, found.creep_shape).effects
    assert [e.effect for e in effects if e.effect != "cell-gain"] == ([name] if name else [])
    assert all(
        e.value == pytest.approx(creep or loop, abs=4 * e.std) for e in effects if e.effect == name
    )


def test_one_reading_for_each_load_gives_no_creep_of_its_own(tmp_path: Path) -> None:
    found = measured(tmp_path / "p.csv", creep=SHARE, count=1)
    assert math.isnan(found.creep.value)
    assert len(found.creep_shape) == len(found.points) == len(LOADS)


def test_stamps_are_times_and_times_increase(tmp_path: Path) -> None:
    path = tmp_path / "p.csv"
    rows = [f"2026-03-01 10:0{k}:00,{load},{load}.1" for k, load in enumerate(LOADS)]
    path.write_text("\n".join(["time,load [N],reading [N]", *rows]) + "\n")
    assert len(read_points(path).creep_shape) == len(LOADS)
    for time in ("0", "x"):
        path.write_text(f"time [s],load [N],reading [N]\n1,0,0\n{time},5,5\n")
        with pytest.raises(FileError, match=r":3: .*time"):
            read_points(path)
