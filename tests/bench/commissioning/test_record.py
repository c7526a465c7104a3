"""The commissioning record by itself: what makes it stale, and files that cannot be used."""

from __future__ import annotations

import dataclasses
import json
import os
import re
from pathlib import Path

import pytest

from slave_bench import write_bench
from winchkit.bench.commissioning.dialogue import AnswerFile
from winchkit.bench.commissioning.record import (
    CommissioningRecord,
    Confirmation,
    DriveRecord,
    HostLossRecord,
    WinchRecord,
    hash_of,
    is_simulated,
    items_of,
    read_record,
    stale_items,
    write_record,
)
from winchkit.errors import FileError, NotPermitted
from winchkit.schema.bench import BenchSpec, BusSpec
from winchkit.schema.read import read_bench

DRIVE = DriveRecord(vendor=0x29C, product=2, revision=3, serial=4711, software="1.2")


@pytest.fixture
def spec(tmp_path: Path) -> BenchSpec:
    """A bench with a record that holds."""
    spec = read_bench(write_bench(tmp_path))
    done = tuple(Confirmation(item, "?", "yes", "now") for item in items_of(spec.winch["A"]))
    winch = WinchRecord(
        drive=DRIVE,
        device=hash_of(tmp_path / "drive" / "device.toml"),
        eds=hash_of(tmp_path / "drive" / "generic-cia402.eds"),
        host_loss=HostLossRecord("heartbeat", 0.25, 0.1, 0.24),
        stops_on_nmt=True,
        confirmed=done,
    )
    record = CommissioningRecord(
        "slave-bench", "now", "me", "typed", {}, hash_of(spec.path), {"A": winch}
    )
    write_record(record, spec.record_file)
    return spec


def rewrite(spec: BenchSpec, *path: str, value: object) -> None:
    tree = json.loads(Path(spec.record_file).read_text())
    inner = tree
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = value
    Path(spec.record_file).write_text(json.dumps(tree))


def test_a_record_reads_back_as_it_was_written_and_holds(spec: BenchSpec) -> None:
    record = read_record(spec.record_file)
    assert record.winch["A"].drive == DRIVE
    assert stale_items(spec, {"A": DRIVE}) == ()
    assert stale_items(spec) == (), "without the drives nothing is known against it"


@pytest.mark.parametrize(
    ("file", "words"),
    [
        ("bench.toml", "the bench file bench.toml has changed"),
        ("drive/device.toml", "winch A: the device file device.toml has changed"),
        ("drive/generic-cia402.eds", "winch A: the EDS generic-cia402.eds has changed"),
    ],
)
def test_a_changed_file_is_named(spec: BenchSpec, file: str, words: str) -> None:
    path = Path(spec.path).parent / file
    path.write_text(path.read_text() + "\n; changed\n".replace(";", "#"))
    assert [item for item in stale_items(spec, {"A": DRIVE}) if words in item]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"serial": 12}, "the drive's serial number is 12, commissioned was 4711"),
        ({"vendor": 1}, "vendor id is 1, commissioned was 668"),
        ({"product": 9}, "product code is 9"),
        ({"revision": 9}, "revision number is 9"),
        ({"software": "1.3"}, r"software version \(100Ah\) is 1.3, commissioned was 1.2"),
        ({"polarity": 0x80}, r"polarity \(607Eh\) is 128, commissioned was None"),
    ],
)
def test_another_drive_is_named_by_what_differs(
    spec: BenchSpec, change: dict[str, int], words: str
) -> None:
    other = dataclasses.replace(DRIVE, **change)  # type: ignore[arg-type]
    (item,) = stale_items(spec, {"A": other})
    assert item.startswith("winch A: ")
    assert re.search(words, item)


@pytest.mark.parametrize("item", ["brake", "host loss", "direction", "units", "limits"])
def test_an_item_that_was_not_confirmed_is_named(spec: BenchSpec, item: str) -> None:
    tree = json.loads(Path(spec.record_file).read_text())
    kept = [one for one in tree["winch"]["A"]["confirmed"] if one["item"] != item]
    rewrite(spec, "winch", "A", "confirmed", value=kept)
    assert stale_items(spec, {"A": DRIVE}) == (f"winch A: {item} was not confirmed",)


def test_a_drive_that_was_never_seen_to_stop_is_named(spec: BenchSpec) -> None:
    rewrite(spec, "winch", "A", "host_loss", "stopped_after", value=None)
    (item,) = stale_items(spec)
    assert "was not seen to stop when the computer fell silent" in item


def test_another_mechanism_than_the_one_that_was_tried_is_named(spec: BenchSpec) -> None:
    rewrite(spec, "winch", "A", "host_loss", "mechanism", value="guarding")
    assert stale_items(spec) == ("winch A: host_loss is heartbeat, commissioned was guarding",)


def test_a_winch_that_came_later_is_named(spec: BenchSpec) -> None:
    rewrite(spec, "winch", value={})
    assert stale_items(spec) == ("winch A is not in the record",)


@pytest.mark.parametrize("text", ["", "{", "[]", '{"schema": 1}', '{"schema": 2}', "null"])
def test_a_record_that_cannot_be_used_counts_as_none(spec: BenchSpec, text: str) -> None:
    Path(spec.record_file).write_text(text)
    with pytest.raises(FileError, match=r"commissioned\.json"):
        read_record(spec.record_file)
    (item,) = stale_items(spec)
    assert "bench.commissioned.json" in item


def test_no_record_is_said_with_its_place(spec: BenchSpec) -> None:
    Path(spec.record_file).unlink()
    (item,) = stale_items(spec)
    assert item.startswith("there is no commissioning record ")
    assert item.endswith("bench.commissioned.json")


def test_a_record_that_cannot_be_written_leaves_the_old_one(spec: BenchSpec) -> None:
    record = read_record(spec.record_file)
    assert record is not None
    with pytest.raises(NotPermitted, match="cannot be written"):
        write_record(record, Path(spec.path).parent / "nowhere" / "x.json")
    assert read_record(spec.record_file) == record


@pytest.mark.parametrize(
    ("interface", "channel", "simulated"),
    [
        ("virtual", "a", True),
        ("udp_multicast", "239.0.0.1", True),
        ("socketcan", "vcan0", True),
        ("socketcan", "can0", False),
        ("slcan", "vcan0", False),
        ("pcan", "PCAN_USBBUS1", False),
    ],
)
def test_only_buses_without_real_drives_need_no_record(
    spec: BenchSpec, interface: str, channel: str, simulated: bool
) -> None:
    bus = BusSpec("can", interface=interface, channel=channel)
    assert is_simulated(dataclasses.replace(spec, bus={"can": bus})) is simulated


def test_a_fifo_is_refused_as_record_and_as_answers(spec: BenchSpec) -> None:
    """Reading one would wait for ever."""
    record = Path(spec.record_file)
    record.unlink()
    os.mkfifo(record)
    (item,) = stale_items(spec)
    assert "it is a FIFO, not a regular file" in item
    with pytest.raises(FileError, match="it is a FIFO, not a regular file"):
        AnswerFile(record, lambda _text: None)
