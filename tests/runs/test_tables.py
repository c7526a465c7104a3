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


FRAME = {"time": [0.0, 0.1, 0.2, 0.3], "motor_angle": [0.0, 1.0, 2.0, 3.0]}
UNITS = {"time": "s", "motor_angle": "rad"}


@pytest.mark.parametrize(
    "values",
    [
        [True, False, True, True],
        ["0", "1", "2", "3"],
        np.array([1, "x", 2, 3], dtype=object),
        pd.date_range("2026-01-01", periods=4),
        np.array([0, 1j, 2, 3]),
        [[0.0], [1.0], [2.0], [3.0]],
    ],
)
def test_a_channel_without_numbers_is_refused_in_one_sentence(values: Any) -> None:
    with pytest.raises(UsageError, match="motor_angle"):
        run_of(pd.DataFrame({**FRAME, "motor_angle": values}), units=UNITS)


def test_other_kinds_of_numbers_are_converted() -> None:
    """Missing values, decimals, categories, whole numbers beyond 2^53, and a flag."""
    from decimal import Decimal

    big = 2**60 + 1
    for values, second in (
        (pd.array([0, None, 2, 3], dtype="Int64"), np.nan),
        ([Decimal("0"), Decimal("1.5"), Decimal("2"), Decimal("3")], 1.5),
        (pd.Categorical([0.0, 1.0, 2.0, 3.0]), 1.0),
        (np.ma.masked_array([0.0, 1.0, 2.0, 3.0], [False, True, False, False]), np.nan),
        (np.array([0, big, 2, 3], dtype=np.int64), float(big)),
    ):
        run = run_of(
            pd.DataFrame({**FRAME, "motor_angle": values, "brake": [True] * 4}), units=UNITS
        )
        np.testing.assert_equal(run["motor_angle"][1], second)
        np.testing.assert_array_equal(run["brake"], 1.0)


def test_moments_are_seconds_after_the_first() -> None:
    moments = pd.date_range("2026-03-01 10:00", periods=4, freq="100ms")
    run = run_of(pd.DataFrame({**FRAME, "time": moments}), units={"motor_angle": "rad"})
    np.testing.assert_allclose(run.time, [0.0, 0.1, 0.2, 0.3])
    assert run.metadata["start_time"].startswith("2026-03-01T10:00:00")


@pytest.mark.parametrize(
    ("values", "told"),
    [
        (["a"] * 3, "no array of real numbers"),
        (np.zeros((3, 2)), "no array of real numbers"),
        (np.array([0, 1j, 2]), "no array of real numbers"),
        (None, "no array of real numbers"),
        (np.zeros(2), "has 2 values for 3 times"),
    ],
)
def test_a_channel_of_a_run_made_by_hand_is_an_array_of_numbers(values: Any, told: str) -> None:
    with pytest.raises(UsageError, match=told):
        Run("x", np.arange(3.0), {"motor_angle": Channel(values, "rad")})


def test_lists_and_masked_arrays_of_a_run_made_by_hand_are_converted() -> None:
    masked = np.ma.masked_array([1, 2, 3], [False, True, False])
    run = Run("x", [0, 1, 2], {"a": Channel([True, False, None], "1"), "b": Channel(masked, "N")})  # type: ignore[arg-type]
    np.testing.assert_array_equal(run["a"], [1.0, 0.0, np.nan])
    np.testing.assert_array_equal(run["b"], [1.0, np.nan, 3.0])
    assert run.time.dtype == np.float64
