"""Scan, information, settings and LSS as Python calls: a script without the command line."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

import winchkit
from can_commands import Served, served
from lss_device import LssDevice
from winchkit.drivers.can.canopen.identity import Identity
from winchkit.errors import NoReply, NotPermitted, UsageError

IDENTITY = (0x26C, 0x12345, 0x10002, 0xDEADBEEF)
_channels = itertools.count()


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with served(tmp_path_factory.mktemp("calls"), "AB", paced=True) as running:
        yield running


@pytest.fixture
def device() -> Iterator[LssDevice]:
    with LssDevice(f"lss-calls-{os.getpid()}-{next(_channels)}", IDENTITY) as running:
        yield running


def test_scan_by_bench_file_and_by_bus_finds_the_same_nodes(bench: Served) -> None:
    by_file = winchkit.scan(bench.file)
    bus = winchkit.can_bus("virtual", bench.live.bench_spec.bus["can"].channel)
    by_bus = winchkit.scan(bus)
    assert [(item.node, item.winch) for item in by_file] == [(1, "A"), (2, "B")]
    assert [(item.node, item.winch) for item in by_bus] == [(1, ""), (2, "")]
    assert [item.identity for item in by_file] == [item.identity for item in by_bus]
    assert bench.number(0x1016, 1) == 0, "a scan writes nothing"


def test_information_of_a_drive(bench: Served) -> None:
    info = winchkit.drive_info(bench.file, "A")
    assert info.identity.vendor == bench.number(0x1018, 1)
    assert info.state == "switch on disabled"
    assert info.device == "generic-cia402"
    with pytest.raises(UsageError, match="A, B, or a node number"):
        winchkit.drive_info(bench.file, "C")
    with pytest.raises(UsageError):
        winchkit.drive_info(bench.file)  # of two winches none is the only one


def test_settings_are_saved_compared_and_loaded(bench: Served, tmp_path: Path) -> None:
    objects = bench.live.winches["A"].drive.objects
    objects.put(0x6085, 0, 123_456)
    path = tmp_path / "a.json"
    assert winchkit.config_save(bench.file, path, "A") == ()
    with pytest.raises(UsageError, match="exists already"):
        winchkit.config_save(bench.file, path, "A")
    assert winchkit.config_diff(bench.file, path, "A") == []
    objects.put(0x6085, 0, 99)
    (found,) = winchkit.config_diff(bench.file, path, "A")
    assert (found.object, found.file, found.drive) == ("6085h", 123_456, 99)
    (written,) = winchkit.config_load(bench.file, path, "A")
    assert written.object == "6085h"
    assert bench.number(0x6085) == 123_456
    assert winchkit.config_diff(bench.file, path, "A") == []


def test_settings_are_not_written_beside_an_owner(bench: Served, tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    winchkit.config_save(bench.file, path, "A")
    bench.live.winches["A"].drive.objects.put(0x6084, 0, 5_000)
    with winchkit.open_bench(bench.file), pytest.raises(NotPermitted, match="another process"):
        winchkit.config_load(bench.file, path, "A")
    assert bench.number(0x6084) == 5_000


@pytest.mark.slow
def test_lss_finds_identifies_and_numbers_a_device(device: LssDevice) -> None:
    bus = winchkit.can_bus("virtual", device.channel)
    found = winchkit.lss_list(bus)
    assert found == Identity(*IDENTITY)
    assert winchkit.lss_identify(bus, found) is None
    assert winchkit.lss_set(bus, found, node=9, store=True) == found
    assert device.stored[0] == 9
    assert winchkit.lss_list(bus) is None
    assert winchkit.lss_identify(bus) == 9
    with pytest.raises(UsageError, match="nothing to set"):
        winchkit.lss_set(bus)
    with pytest.raises(NoReply):
        winchkit.lss_identify(bus, Identity(1, 2, 3, 4))
    assert not device.selected, "it takes part in the network again"


def test_bus_load_is_that_of_its_frames_and_opens_nothing(bench: Served) -> None:
    spec = winchkit.read_bench(bench.file)
    load = winchkit.bus_load(spec)["can"]
    assert load.share == winchkit.bus_load(bench.file)["can"].share
    assert 0.0 < load.share < 1.0
    # At a tenth of the bit rate the same frames take ten times as long.
    slow = replace(spec, bus=spec.bus | {"can": replace(spec.bus["can"], bitrate=100_000)})
    assert winchkit.bus_load(slow)["can"].share == pytest.approx(10 * load.share)
