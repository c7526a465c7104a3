"""The digest of the files that a bench was opened with, and the lock of its owner."""

from __future__ import annotations

import shutil
import threading
import time
from pathlib import Path

import pytest

from slave.wire import GENERIC
from snippets import ROOT
from winchkit.bench.ownership import Ownership, await_end, digest_of
from winchkit.schema.bench import BenchSpec
from winchkit.schema.read import read_bench

BENCH = """\
schema = 1
kind = "bench"
name = "digest"
effects = ["mine.py"]
[bus.can]
kind = "can"
interface = "virtual"
channel = "digest"
[bus.line]
kind = "modbus-tcp"
host = "127.0.0.1"
port = 502
[winch.A]
profile = "winch.toml"
servo = { device = "drive/device.toml", bus = "can", node = 1 }
cell = { device = "cell.toml", bus = "line", unit = 1, calibration = "cell.calibration.toml" }
limits = { speed = "0.1 m/s", acceleration = "0.1 m/s^2" }
"""
FILES = (
    "winch.toml",
    "drive/device.toml",
    f"drive/{GENERIC.name}",
    "cell.toml",
    "cell.calibration.toml",
    "mine.py",
)


@pytest.fixture
def spec(tmp_path: Path) -> BenchSpec:
    shutil.copytree(GENERIC.parent, tmp_path / "drive")
    shutil.copy(ROOT / "profiles/bench-spiral.toml", tmp_path / "winch.toml")
    shutil.copy(ROOT / "devices/generic-modbus/device.toml", tmp_path / "cell.toml")
    (tmp_path / "cell.calibration.toml").write_text("# none\n", encoding="utf-8")
    (tmp_path / "mine.py").write_text("# none\n", encoding="utf-8")
    file = tmp_path / "bench.toml"
    file.write_text(BENCH, encoding="utf-8")
    return read_bench(file)


@pytest.mark.parametrize("name", FILES)
def test_every_file_of_a_bench_changes_its_digest(
    spec: BenchSpec, tmp_path: Path, name: str
) -> None:
    before = digest_of(spec)
    assert digest_of(spec) == before
    with (tmp_path / name).open("a", encoding="utf-8") as file:
        file.write("# changed\n")
    assert digest_of(spec) != before


def test_a_file_that_is_missing_changes_the_digest_and_raises_nothing(
    spec: BenchSpec, tmp_path: Path
) -> None:
    digests = {digest_of(spec)}
    for name in reversed(FILES):
        (tmp_path / name).unlink()
        digests.add(digest_of(spec))
    assert len(digests) == 1 + len(FILES)


def test_the_end_of_an_owner_is_awaited_but_not_for_ever(spec: BenchSpec) -> None:
    """`winchkit stop` asks the drives itself only then: an owner that closes would take it for
    a second master."""
    owner = Ownership(spec)
    begun = time.monotonic()
    await_end(spec, 0.1)
    assert time.monotonic() - begun >= 0.1
    ending = threading.Timer(0.1, owner.close)
    ending.start()
    await_end(spec, 60.0)
    ending.join()
    assert time.monotonic() - begun < 30.0
    Ownership(spec).close()
