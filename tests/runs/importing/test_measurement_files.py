"""MDF and TDMS files: bytes after the maker's description, files of the libraries' own writers."""

from __future__ import annotations

import io
import struct
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from winchkit.errors import RunError
from winchkit.runs.export import export
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.table import ColumnTable

_META, _NEW_LIST, _RAW = 1 << 1, 1 << 2, 1 << 3
_DOUBLE, _TEXT, _NO_DATA = 10, 0x20, 0xFFFFFFFF


def tdms(objects: Mapping[str, tuple[Sequence[float] | None, Mapping[str, float | str]]]) -> bytes:
    """A TDMS file of one segment (NI, *TDMS File Format Internal Structure*)."""

    def text(words: str) -> bytes:
        return struct.pack("<I", len(words.encode())) + words.encode()

    meta, raw = struct.pack("<I", len(objects)), b""
    for path, (values, properties) in objects.items():
        meta += text(path)
        if values is None:
            meta += struct.pack("<I", _NO_DATA)
        else:
            meta += struct.pack("<IIIQ", 20, _DOUBLE, 1, len(values))
            raw += struct.pack(f"<{len(values)}d", *values)
        meta += struct.pack("<I", len(properties))
        for name, value in properties.items():
            meta += text(name)
            if isinstance(value, str):
                meta += struct.pack("<I", _TEXT) + text(value)
            else:
                meta += struct.pack("<Id", _DOUBLE, value)
    lead = b"TDSm" + struct.pack(
        "<IIQQ", _META | _NEW_LIST | _RAW, 4713, len(meta + raw), len(meta)
    )
    return lead + meta + raw


def read(folder: Path, name: str, data: bytes) -> ColumnTable:
    path = folder / name
    path.write_bytes(data)
    return read_table(path)


def values(table: ColumnTable, source: str) -> list[float]:
    column = table.column(source)
    assert column is not None, [item.source for item in table.columns]
    return [float(value) for value in column.values]


class TestTdms:
    @pytest.fixture(autouse=True)
    def library(self) -> None:
        pytest.importorskip("nptdms")

    def test_a_waveform_of_bytes_after_the_makers_description(self, tmp_path: Path) -> None:
        wave = {"wf_increment": 0.01, "wf_start_offset": 0.5, "unit_string": "N"}
        data = tdms(
            {
                "/": (None, {"operator": "Ø"}),
                "/'rig'": (None, {}),
                "/'rig'/'force'": ([1.0, 2.5, -4.0], wave),
            }
        )
        table = read(tmp_path, "a.tdms", data)
        assert table.layout == "TDMS"
        assert table.metadata["operator"] == "Ø"
        assert values(table, "time") == pytest.approx([0.5, 0.51, 0.52])
        assert values(table, "force") == [1.0, 2.5, -4.0]
        force = table.column("force")
        assert force is not None
        assert force.unit == "N"

    def test_channels_of_two_rates_have_a_time_each(self, tmp_path: Path) -> None:
        fast, slow = {"wf_increment": 0.1}, {"wf_increment": 0.5}
        data = tdms(
            {
                "/'a'": (None, {}),
                "/'a'/'force'": ([0.0, 1.0, 2.0, 3.0], fast),
                "/'a'/'angle'": ([4.0, 5.0, 6.0, 7.0], fast),
                "/'a'/'temperature'": ([8.0, 9.0], slow),
            }
        )
        table = read(tmp_path, "a.tdms", data)
        groups: dict[str, list[str]] = {}
        for column in table.columns:
            groups.setdefault(column.group, []).append(column.name)
        assert list(groups.values()) == [["time", "force", "angle"], ["time", "temperature"]]

    def test_a_channel_of_time_stamps_is_in_nanoseconds(self, tmp_path: Path) -> None:
        from nptdms import ChannelObject, RootObject, TdmsWriter

        stamps = np.array(["2026-01-01T00:00:00", "2026-01-01T00:00:01"], dtype="datetime64[us]")
        path = tmp_path / "a.tdms"
        with TdmsWriter(str(path)) as writer:
            writer.write_segment(
                [
                    RootObject({}),
                    ChannelObject("g", "stamp", stamps),
                    ChannelObject("g", "label", ["one", "two"]),
                    ChannelObject("g", "count", np.array([3, 4], dtype=np.int32)),
                ]
            )
        table = read_table(path)
        first, second = values(table, "stamp")
        assert second - first == 1e9
        assert values(table, "count") == [3.0, 4.0]
        assert "channel 'label' has no numbers" in table.notes[0]

    @given(st.data())
    def test_a_cut_file_is_a_message(
        self, tmp_path_factory: pytest.TempPathFactory, data: Any
    ) -> None:
        whole = tdms({"/'a'": (None, {}), "/'a'/'b'": ([1.0, 2.0], {"unit_string": "N"})})
        cut = whole[: data.draw(st.integers(5, len(whole) - 1))]
        path = tmp_path_factory.mktemp("cut") / "a.tdms"
        path.write_bytes(cut)
        try:
            table = read_table(path)
        except RunError:
            return
        assert values(table, "b") == [1.0, 2.0][: len(values(table, "b"))]


class TestMdf:
    def test_groups_have_their_own_times_and_invalid_samples_are_nan(self, tmp_path: Path) -> None:
        asammdf = pytest.importorskip("asammdf")
        times, slow = np.arange(4) * 0.01, np.arange(2) * 0.5
        force = asammdf.Signal(
            np.array([1.0, 2.0, 3.0, 4.0]),
            times,
            unit="kN",
            name="force",
            invalidation_bits=np.array([False, True, False, False]),
        )
        angle = asammdf.Signal(np.array([5, 6, 7, 8], dtype=np.int16), times, "deg", "angle")
        temperature = asammdf.Signal(np.array([20.0, 21.0]), slow, "degC", "temperature")
        path = tmp_path / "a.mf4"
        with asammdf.MDF(version="4.10") as file:
            file.append([force, angle], acq_name="drive", common_timebase=True)
            file.append([temperature], acq_name="room")
            file.save(path)
        table = read_table(path)
        assert table.layout == "MDF 4.10"
        assert values(table, "angle") == [5.0, 6.0, 7.0, 8.0]
        np.testing.assert_array_equal(values(table, "force"), [1.0, np.nan, 3.0, 4.0])
        assert [column.unit for column in table.columns] == ["s", "kN", "deg", "s", "degC"]
        assert [column.group for column in table.columns] == ["drive"] * 3 + ["room"] * 2

    def test_an_exported_run_is_imported(self, tmp_path: Path) -> None:
        pytest.importorskip("asammdf")
        log = tmp_path / "a.csv"
        rows = "\n".join(f"{0.01 * n:.2f},{0.1 * n:.1f},{n}" for n in range(50))
        head = "# load_mass: 10 kg\ntime [s],motor_angle [rad],tension [N]"
        log.write_text(f"{head}\n{rows}\n")
        export([log], tmp_path / "a.mf4")
        table = read_table(tmp_path / "a.mf4")
        found = {column.name.rpartition(".")[2]: column for column in table.columns}
        assert list(found["tension"].values) == list(range(50))
        assert found["tension"].unit == "N"
        assert table.metadata["load_mass"] == "10 kg"

    @pytest.mark.parametrize("length", [5, 64, 200])
    def test_a_cut_file_is_a_message(self, tmp_path: Path, length: int) -> None:
        asammdf = pytest.importorskip("asammdf")
        buffer = io.BytesIO()
        with asammdf.MDF(version="4.10") as file:
            file.append([asammdf.Signal(np.ones(9), np.arange(9.0), name="x")])
            file.save(buffer)
        with pytest.raises(RunError, match="MDF"):
            read(tmp_path, "a.mf4", buffer.getvalue()[:length])
