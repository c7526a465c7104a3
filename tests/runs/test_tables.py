"""Runs as tables of pandas, Polars, pyarrow and xarray, and back."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from winchkit.errors import RunError, UsageError
from winchkit.runs.run import Channel, Run
from winchkit.runs.tables import run_of

pa = pytest.importorskip("pyarrow")
pd = pytest.importorskip("pandas")

TENSION = np.array([98.0, np.nan, 99.5])
RUN = Run(
    "lift",
    np.array([0.0, 0.1, 0.2]),
    {
        "motor_angle": Channel(np.array([0.0, 1.0, 2.0]), "rad", 2),
        "tension": Channel(TENSION, "N", 3),
        "humidity": Channel(np.array([40.0, 41.0, 42.0]), "%RH", 4),
    },
    {"load_mass": "10 kg"},
    "lift.csv",
)


def same(run: Run) -> bool:
    return (
        run.name == RUN.name
        and dict(run.metadata) == RUN.metadata
        and np.array_equal(run.time, RUN.time)
        and list(run) == list(RUN)
        and all(np.array_equal(run[name], RUN[name], equal_nan=True) for name in RUN)
        and all(run.channels[name].unit == RUN.channels[name].unit for name in RUN)
    )


@pytest.mark.parametrize(
    "through",
    [
        Run.to_pandas,
        Run.to_arrow,
        lambda run: run,
        lambda run: run.to_pandas().reset_index(),
        pa.RecordBatchReader.from_stream,
    ],
    ids=["pandas", "arrow", "stream", "pandas without index", "arrow reader"],
)
def test_a_run_comes_back_the_same(through: Callable[[Run], Any]) -> None:
    assert same(run_of(through(RUN)))


def test_a_table_that_lost_its_units_comes_back_with_those_of_the_run() -> None:
    table = RUN.to_arrow()
    bare = table.cast(pa.schema([pa.field(one.name, one.type) for one in table.schema]))
    with pytest.raises(RunError, match="has no unit"):
        run_of(bare)
    assert RUN.units["time"] == "s"
    assert same(run_of(bare, units=RUN.units, metadata=RUN.metadata, name="lift"))


def test_units_and_missing_values_are_those_of_the_run() -> None:
    table = RUN.to_arrow()
    assert table.schema.field("tension").metadata == {b"unit": b"N"}
    assert table.schema.field("time").metadata == {b"unit": b"s"}
    assert table["tension"].to_pylist() == [98.0, None, 99.5]
    frame = RUN.to_pandas()
    assert frame.attrs["units"]["tension"] == "N"
    assert frame.index.name == "time"
    assert np.array_equal(frame["tension"].to_numpy(), TENSION, equal_nan=True)


def test_polars_reads_the_stream_and_needs_the_units_back() -> None:
    pl = pytest.importorskip("polars")
    frame = pl.DataFrame(RUN)
    assert frame.columns == ["time", *RUN]
    assert frame["tension"].to_list() == [98.0, None, 99.5]
    assert same(run_of(frame, units=RUN.units, metadata=RUN.metadata, name="lift"))


def test_xarray_has_the_time_as_dimension() -> None:
    pytest.importorskip("xarray")
    dataset = RUN.to_pandas().to_xarray()
    assert dict(dataset.sizes) == {"time": 3}
    assert same(run_of(dataset.to_dataframe(), units=RUN.units, metadata=RUN.metadata, name="lift"))


def test_a_table_of_ones_own_has_units_in_its_names_or_beside_them() -> None:
    frame = pd.DataFrame({"time [ms]": [0, 10], "motor_angle [deg]": [0.0, 180.0], "load": [1, 2]})
    run = run_of(frame, units={"load": "kN"}, metadata={"load_mass": "5 kg"})
    assert run.time.tolist() == [0.0, 0.01]
    assert run["motor_angle"] == pytest.approx([0.0, np.pi])
    assert run["load"].tolist() == [1000.0, 2000.0]
    assert run.load_mass == 5.0
    assert run.name == "table"


def test_faults_are_those_of_a_file() -> None:
    frame = pd.DataFrame({"time [s]": [0.0, 0.0], "motor_angle": [0.0, 1.0]})
    with pytest.raises(RunError, match="column 'motor_angle' has no unit"):
        run_of(frame)
    with pytest.raises(RunError, match="stands still"):
        run_of(frame, units={"motor_angle": "rad"})
    with pytest.raises(UsageError, match="did you mean 'motor_angle'"):
        run_of(frame, units={"motor_angel": "rad"})
    with pytest.raises(UsageError, match="dict is no table"):
        run_of({"time": [0.0]})


@pytest.mark.parametrize(
    ("package", "call", "extra"),
    [("pandas", Run.to_pandas, "pandas"), ("pyarrow", Run.to_arrow, "parquet")],
)
def test_an_absent_package_is_named_with_the_line_that_installs_it(
    package: str, call: Callable[[Run], object], extra: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(UsageError, match=rf"pip install 'winchkit\[{extra}\]'"):
        call(RUN)
