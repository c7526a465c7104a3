"""Logs by channels: what other readers find in them, and that they read as the rows would."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader

from logs import CELL, DRIVE, LAYOUT, OFFSET, OPENED, samples_until, written
from winchkit.errors import RunError
from winchkit.runs import read_run
from winchkit.runs.formats.mcap_file import McapFile
from winchkit.runs.info import info_of
from winchkit.runs.read import read_log


def test_another_reader_finds_every_sample_with_its_own_time(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    written(path)
    given = samples_until(OPENED + 2.0)
    with path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        found = list(reader.iter_messages([DRIVE]))
        readings = list(reader.iter_messages([CELL]))
        records = {item.name: dict(item.metadata) for item in reader.iter_metadata()}
    assert summary.statistics.chunk_count == len(summary.chunk_indexes) == 21
    assert len(found) == len(given[DRIVE])
    stamps = np.array([message.log_time for _, _, message in found])
    assert np.abs(stamps - OFFSET - given[DRIVE].times * 1e9).max() <= 128, "a float64's last bits"
    values = np.array([struct.unpack("<4x2d", message.data) for _, _, message in found])
    assert np.array_equal(values, given[DRIVE].values, equal_nan=True)
    arrived = np.array([message.publish_time - message.log_time for _, _, message in readings])
    assert arrived == pytest.approx(5e6, abs=256)
    assert [message.sequence for _, _, message in readings] == list(range(len(readings)))
    schema, channel, _ = readings[0]
    assert (schema.name, schema.encoding) == ("winchkit/msg/Cell", "ros2msg")
    assert schema.data.decode().splitlines()[0] == "float64 tension # N"
    assert (channel.topic, channel.message_encoding) == (CELL, "cdr")
    assert records["winchkit.metadata"]["load_mass"] == "15 kg"
    assert records["winchkit.end"] == {"clock_offset": "1 s"}


def test_every_checksum_is_right(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    written(path)
    with path.open("rb") as stream:
        kinds = [type(item).__name__ for item in StreamReader(stream, validate_crcs=True).records]
    assert kinds[-1] == "Footer"
    assert kinds.count("Message") == sum(map(len, samples_until(OPENED + 2.0).values())) + 22


def test_a_ros_reader_reads_it(tmp_path: Path) -> None:
    ros2 = pytest.importorskip("mcap_ros2.reader", reason="needs mcap-ros2-support")
    path = tmp_path / "a.mcap"
    written(path)
    given = samples_until(OPENED + 2.0)[CELL]
    found = list(ros2.read_ros2_messages(str(path), topics=[CELL]))
    assert [item.ros_msg.tension for item in found] == given.values[:, 0].tolist()
    assert [item.ros_msg.quality for item in found] == given.values[:, 2].tolist()


def test_a_log_reads_as_the_rows_would(tmp_path: Path) -> None:
    written(tmp_path / "a.mcap")
    written(tmp_path / "a.csv")
    logged, rows = read_run(tmp_path / "a.mcap"), read_run(tmp_path / "a.csv")
    assert list(logged) == list(rows) == ["motor_angle", "motor_torque", "tension"]
    assert logged.load_mass == rows.load_mass == 15.0
    # The last moments wait for a channel when a live log ends, and have it when it is read.
    shared = len(rows)
    assert 95 <= shared <= len(logged) <= shared + 2
    assert logged.time[:shared] == pytest.approx(rows.time, abs=2e-9)
    for name in rows:
        assert logged[name][:shared] == pytest.approx(rows[name], abs=1e-8, nan_ok=True)
    assert np.isnan(rows["motor_torque"]).any()
    assert rows["tension"] == pytest.approx(100 + np.cos(OPENED + 7e-3 + rows.time), abs=1e-9)


def test_what_a_log_says_of_itself(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    written(path)
    info = info_of(read_log(path))
    assert info.closed is True
    assert info.begun == "2023-11-14T22:30:00.123+00:00"
    assert info.duration == pytest.approx(2.0, abs=0.02)
    drive, cell = info.sources
    assert (drive.rate, cell.rate) == (pytest.approx(250), pytest.approx(50))
    assert (drive.samples, drive.gaps, drive.missing) == (500, 0, {"motor_torque": 75})
    assert cell.flagged == sum(n % 7 == 3 for n in range(cell.samples))
    assert info.events == ("winch A: tension above 800 N",)
    assert info.counters == {"A.cell": {"readings": 3, "rate": None}}


def test_a_gap_is_counted(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    log = read_log(written(path))
    times = log.samples[DRIVE].times
    keep = (times < OPENED + 0.498) | (times > OPENED + 0.798)
    item = log.samples[DRIVE]
    thinner = type(item)(item.times[keep], item.received[keep], item.values[keep])
    info = info_of(type(log)(log.path, log.layout, {**log.samples, DRIVE: thinner}))
    assert info.sources[0].gaps == 1
    assert info.sources[0].longest_gap == pytest.approx(0.304, abs=1e-6)


EMPTY = '{"sources":[],"rule":{"topic":"/x","opened":0,"period":0,"start":null},"clock_offset":0}'


@pytest.mark.parametrize(
    ("about", "part"),
    [
        ({}, "layout cannot be read"),
        ({"layout": "[]"}, "layout cannot be read"),
        (
            {"layout": '{"sources":[],"rule":{"topic":"/x","opened":"y"},"clock_offset":0}'},
            "layout",
        ),
        ({"layout": '{"sources":[],"rule":[],"clock_offset":0}'}, "layout"),
        ({"layout": EMPTY}, "'/x'"),
    ],
)
def test_a_malformed_layout_is_refused(tmp_path: Path, about: dict[str, str], part: str) -> None:
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream:
        file = McapFile(stream, "winchkit", "test")
        file.put_metadata("winchkit.log", about)
        file.finish()
    with pytest.raises(RunError, match=part):
        read_run(path)


def test_messages_that_are_not_what_the_layout_says(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    written(path)
    text = path.read_bytes()
    signal = b'{"name":"raw","unit":"1","column":""}'
    assert text.count(signal) == 1
    assert len(LAYOUT.sources[1].signals) == 3
    # One signal fewer, the record as long as before; no checksum covers a file that was cut off.
    changed = text.replace(signal + b",", b" " * len(signal + b","))
    path.write_bytes(changed[: changed.index(b"\x0f\x04\0\0\0\0\0\0\0")])
    with pytest.raises(RunError, match="a message of /A/cell has 28 bytes, not 20"):
        read_run(path)
