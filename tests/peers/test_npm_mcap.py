"""Foxglove's own libraries read our logs: closed, in parts, and recovered ones."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from command_line import own_process
from npm_install import install
from winchkit.runs.layout import Layout, RowRule, SignalSource, SourceSamples, SourceSignal
from winchkit.runs.recording.open_log import open_log
from winchkit.runs.recover import recover

PACKAGES = (
    "@mcap/core@2.2.2",
    "@foxglove/rosmsg@5.0.5",
    "@foxglove/rosmsg2-serialization@3.1.0",
    "fzstd@0.1.1",
)
PEER = Path(__file__).with_name("mcap_peer.cjs")
UTC = 1_700_000_000_123_456_789
COUNT = 500


@pytest.fixture(scope="session")
def modules(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return install(tmp_path_factory.mktemp("npm"), *PACKAGES)


def written(path: Path) -> SourceSamples:
    """A log of one drive in ten chunks; its samples."""
    source = SignalSource(
        "/A/drive", (SourceSignal("motor_angle", "rad"), SourceSignal("motor_torque", "N m")), 0.1
    )
    times = np.arange(COUNT) / 250
    torque = np.where(times < 0.5, np.nan, np.cos(times))
    samples = SourceSamples(times, times + 1e-3, np.column_stack([np.sin(times), torque]))
    log = open_log(path, Layout((source,), RowRule("/A/drive", 0.0), UTC), {"load_mass": "15 kg"})
    for part in np.array_split(np.arange(COUNT), 10):
        piece = SourceSamples(times[part], samples.received[part], samples.values[part])
        log.write({"/A/drive": piece}, float(times[part[-1]]))
    log.add_event(times[-1], {"tripped": ["winch A: tension above 800 N"]})
    log.close({})
    return samples


def read(path: Path, modules: Path) -> Any:
    done = own_process("node", PEER, path, env={**os.environ, "NODE_PATH": str(modules)})
    return json.loads(done.stdout)


def test_every_sample_event_and_metadata_is_read(modules: Path, tmp_path: Path) -> None:
    samples = written(tmp_path / "a.mcap")
    told = read(tmp_path / "a.mcap", modules)
    drive = told["topics"]["/A/drive"]
    assert [int(time) for time in drive["times"]] == [
        UTC + round(time * 1e9) for time in samples.times.tolist()
    ]
    for column, name in enumerate(("motor_angle", "motor_torque")):
        read_back = [np.nan if row[name] is None else row[name] for row in drive["values"]]
        np.testing.assert_array_equal(read_back, samples.values[:, column])
    assert told["topics"]["/events"]["values"][-1]["tripped"] == ["winch A: tension above 800 N"]
    assert ["load_mass", "15 kg"] in told["metadata"]["winchkit.metadata"]
    assert told["streamed"] == COUNT + 1
    assert told["ended"]


def test_what_was_recovered_is_read_as_well(modules: Path, tmp_path: Path) -> None:
    written(tmp_path / "a.mcap")
    data = (tmp_path / "a.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: len(data) // 2])
    saved = recover(tmp_path / "cut.mcap", tmp_path / "saved.mcap")
    told = read(tmp_path / "saved.mcap", modules)
    assert 0 < len(told["topics"]["/A/drive"]["times"]) == saved.kept == told["streamed"] < COUNT
    assert told["ended"]
