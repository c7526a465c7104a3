"""The same motion in the layouts of many loggers is imported to the same run."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from logger_layouts import LAYOUTS, START, Layout, motion
from winchkit.runs import read_run
from winchkit.runs.importing.answers import Answers, read_column
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns
from winchkit.runs.importing.mapping import mapping_of, write_mapping
from winchkit.runs.importing.runs import metadata_of, run_of
from winchkit.runs.importing.streams import streams_of
from winchkit.runs.run import Run


def imported(layout: Layout, folder: Path) -> tuple[Run, Path, Path]:
    """The run of a layout, its file, and the mapping of its import."""
    if layout.needs and importlib.util.find_spec(layout.needs) is None:
        pytest.skip(f"needs {layout.needs}")
    path = folder / f"log{layout.suffix}"
    layout.write(path)
    values = dict(layout.answers)
    columns = tuple(read_column(text) for text in values.pop("columns", ()))
    guess = guess_columns(read_table(path), Answers(columns=columns, **values))
    assert not guess.questions
    mapping = folder / "mapping.toml"
    write_mapping(mapping_of("mapping", [("log", guess)]), mapping)
    return run_of(streams_of(guess), metadata_of(guess, {})), path, mapping


@pytest.mark.slow
@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda layout: layout.name)
def test_every_layout_gives_the_same_run(layout: Layout, tmp_path: Path) -> None:
    run, path, mapping = imported(layout, tmp_path)
    true = motion()
    assert set(run) == set(layout.channels)
    rows = np.round((run.time + (0.0 if run.time[0] == 0 else run.time[0])) * 100).astype(int)
    assert len(run) >= 75
    assert run.time == pytest.approx(true.time[rows], abs=2e-5)
    for name in layout.channels:
        expected = true.channels[name][rows]
        assert run[name] == pytest.approx(expected, abs=layout.tolerance * np.ptp(expected)), name
    again = read_run(path, mapping=mapping)
    assert np.array_equal(again.time, run.time)
    for name in layout.channels:
        assert np.array_equal(again[name], run[name], equal_nan=True)


@pytest.mark.parametrize(
    "name", ["iso-stamps", "epoch-ms", "epoch-ns", "excel-serial", "xlsx-dates", "parquet",
             "mcap-json", "american-stamps", "excel-german-date-and-time", "odrive"]
)  # fmt: skip
def test_an_absolute_clock_is_kept_in_the_metadata(name: str, tmp_path: Path) -> None:
    layout = next(item for item in LAYOUTS if item.name == name)
    run, _, _ = imported(layout, tmp_path)
    from datetime import datetime

    start = datetime.fromisoformat(run.metadata["start_time"])
    assert abs((start - START).total_seconds()) < 2e-3
