"""Files on the disk: synced from another thread, each at least once, errors kept and not raised."""

from __future__ import annotations

import errno
import os
import threading
from pathlib import Path

import pytest

from winchkit.runs.recording.sync import SYNC_PERIOD, Syncer


def test_the_promise_is_kept_by_the_period() -> None:
    assert SYNC_PERIOD <= 1.0


def test_every_file_is_synced_by_another_thread(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced: list[tuple[int, int]] = []
    monkeypatch.setattr(
        os, "fsync", lambda fd: synced.append((os.fstat(fd).st_ino, threading.get_ident()))
    )
    syncer = Syncer()
    files = [(tmp_path / name).open("wb") for name in "ab"]
    nodes = [os.fstat(file.fileno()).st_ino for file in files]
    for file in files:
        syncer.watch(file.fileno())
        file.close()
    syncer.close()
    assert {node for node, _ in synced} == set(nodes)
    assert threading.get_ident() not in {thread for _, thread in synced}
    assert syncer.error is None


@pytest.mark.parametrize(("number", "kept"), [(errno.EIO, True), (errno.EINVAL, False)])
def test_an_input_output_error_is_kept_and_a_missing_fsync_is_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, kept: bool
) -> None:
    def fsync(_descriptor: int) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "fsync", fsync)
    syncer = Syncer()
    with (tmp_path / "a").open("wb") as file:
        syncer.watch(file.fileno())
    syncer.close()
    assert (syncer.error is not None) is kept


def test_no_descriptor_is_left_open(tmp_path: Path) -> None:
    before = len(os.listdir("/proc/self/fd")) if os.path.isdir("/proc/self/fd") else 0
    syncer = Syncer()
    with (tmp_path / "a").open("wb") as file:
        for _ in range(20):
            syncer.watch(file.fileno())
    syncer.close()
    after = len(os.listdir("/proc/self/fd")) if os.path.isdir("/proc/self/fd") else 0
    assert after == before
