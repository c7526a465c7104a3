"""``winchkit log decode``, and ``winchkit import`` of a trace of CAN frames."""

from __future__ import annotations

import json
import os
import struct
from datetime import datetime
from pathlib import Path

import can
import numpy as np
import pytest

from command_line import done, invoke
from winchkit import catalog
from winchkit.runs import read_run

TURN = 65536
"""Increments of the device file generic-cia402, whose rated torque is 2 N m."""
FOLDER = Path(os.environ.get("WINCHKIT_INPUTS", Path(__file__).parents[4] / "shared/data/inputs"))
INPUTS = FOLDER / "candump"


def motion(time: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    angle, velocity = 3 * np.sin(np.pi * time), 3 * np.pi * np.cos(np.pi * time)
    return angle, velocity, 0.4 * np.tanh(velocity) + 0.02 * velocity


@pytest.fixture
def trace(tmp_path: Path) -> Path:
    """Two TPDOs of a motion at 250 Hz, 0.2 ms apart, as candump -L has them."""
    path = tmp_path / "lift.log"
    with can.CanutilsLogWriter(str(path)) as writer:

        def write(time: float, identifier: int, data: bytes) -> None:
            writer(can.Message(1.7e9 + time, identifier, is_extended_id=False, data=data))

        write(0.0, 0x701, b"\0")
        for time in 0.01 + 0.004 * np.arange(800):
            angle, _, _ = motion(time)
            write(time, 0x080, b"")
            write(time, 0x181, struct.pack("<Hib", 0x1637, round(angle * TURN / 2 / np.pi), 9))
            _, velocity, torque = motion(time + 2e-4)
            counts = round(velocity * TURN / 2 / np.pi), round(torque / 2 * 1000), 0
            write(time + 2e-4, 0x281, struct.pack("<ihH", *counts))
    return path


def test_a_trace_in_words_and_as_json(trace: Path) -> None:
    lines = done("log", "decode", trace, "--device", "generic-cia402").stdout.splitlines()
    assert len(lines) == 1 + 3 * 800
    assert "701  heartbeat  node 1: boot-up" in lines[0]
    assert "6041h Statusword 1637h operation enabled, follows the command" in lines[2]
    words = done("log", "decode", trace, "--device", "1=generic-cia402", "--only", "tpdo", "--json")
    found = json.loads(words.stdout)
    assert found["layout"] == "candump -L"
    assert {frame["kind"] for frame in found["frames"]} == {"TPDO"}
    assert found["frames"][0]["values"]["6061h"] == 9


def test_a_trace_is_imported_as_a_run_in_si(trace: Path, tmp_path: Path) -> None:
    result = done("import", trace, "--device", "generic-cia402", "-y", "-o", tmp_path / "runs")
    assert "are those of the device file" in result.stderr
    got = read_run(tmp_path / "runs" / "lift.csv")
    start = datetime.fromisoformat(got.metadata["start_time"]).timestamp() - 1.7e9
    angle, velocity, torque = motion(start + got.time)
    np.testing.assert_allclose(got["motor_angle"], angle, atol=2 * np.pi / TURN)
    # Interpolated to the times of the other PDO.
    np.testing.assert_allclose(got["motor_velocity"][1:], velocity[1:], atol=1e-3)
    np.testing.assert_allclose(got["motor_torque"][1:], torque[1:], atol=2e-3)


def test_the_counter_of_a_position_wraps_at_32_bits(trace: Path, tmp_path: Path) -> None:
    """The range of 6064h is known: nothing is asked, and the angle continues over its end."""
    lines = []
    for line in trace.read_text().splitlines():
        head, mark, data = line.partition(" 181#")
        if mark:
            word, counts, mode = struct.unpack("<Hib", bytes.fromhex(data.split()[0]))
            counts = (counts + 2**32 - TURN // 7) % 2**32 - 2**31
            data = struct.pack("<Hib", word, counts, mode).hex().upper()
        lines.append(head + mark + data)
    path = tmp_path / "wraps.log"
    path.write_text("\n".join(lines) + "\n")
    result = done("import", path, "--device", "generic-cia402", "-y", "-o", tmp_path / "runs")
    assert "wraps at" in result.stderr
    got = read_run(tmp_path / "runs" / "wraps.csv")
    start = datetime.fromisoformat(got.metadata["start_time"]).timestamp() - 1.7e9
    error = got["motor_angle"] - motion(start + got.time)[0]
    np.testing.assert_allclose(error, np.median(error), atol=2 * np.pi / TURN)


def test_several_nodes_are_winches_and_several_buses_are_refused(
    trace: Path, tmp_path: Path
) -> None:
    lines = trace.read_text().splitlines()
    second = [line.replace(" 181#", " 182#").replace(" 281#", " 282#") for line in lines]
    both = tmp_path / "both.log"
    both.write_text("\n".join(line for pair in zip(lines, second, strict=True) for line in pair))
    done("import", both, "--device", "generic-cia402", "-y", "-o", tmp_path / "runs")
    got = read_run(tmp_path / "runs" / "both.csv")
    assert got.winches() == ["1", "2"]
    np.testing.assert_array_equal(got["1.motor_angle"], got["2.motor_angle"])
    buses = {line.split()[1] for line in lines}
    both.write_text(both.read_text().replace(f"{buses.pop()} 182#", "other 182#"))
    told = done("import", both, "--device", "generic-cia402", code=3).stderr
    assert "split it by bus" in told


def test_by_an_eds_alone_the_import_asks_for_the_units(trace: Path) -> None:
    eds = catalog.find("devices", "generic-cia402").parent / "generic-cia402.eds"
    shown = done("import", trace, "--device", eds).stdout
    assert "6064h Position actual v…  motor_angle" in shown
    assert "--counts-per-turn" in shown
    assert "1/360 turn" not in shown, "increments and increments a second are no degrees"
    assert "--rated-torque" in shown


def test_without_a_device_the_import_names_the_option(trace: Path) -> None:
    assert "--device D" in done("import", trace, code=3).stderr
    assert "--device D" in done("check", trace, code=3).stderr
    assert "--device D" in done("log", "info", trace, code=3).stderr


@pytest.mark.parametrize(
    ("content", "device", "message"),
    [
        (None, "generic-cia402", "no such file"),
        (b"", "generic-cia402", "is empty"),
        (bytes(range(256)), "generic-cia402", "is binary"),
        (b"time,angle\n0,1\n", "generic-cia402", "has no CAN frames"),
        (b"(0.1) can0 701#05\n", "laumas-tlb", "sends no CANopen frames"),
        (b"(0.1) can0 701#05\n", "no-such-device", "there is no device"),
        (b"(0.1) can0 701#05\n", "200=generic-cia402", "no node number"),
    ],
)
def test_what_cannot_be_decoded_is_refused_with_its_place(
    content: bytes | None, device: str, message: str, tmp_path: Path
) -> None:
    path = tmp_path / "bus.log"
    if content is not None:
        path.write_bytes(content)
    result = invoke("log", "decode", path, "--device", device)
    assert result.exit_code in (2, 3)
    assert message in result.stderr


def test_a_table_is_no_trace(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("time [s],position [deg]\n" + "".join(f"{k / 100},{k}\n" for k in range(50)))
    assert "no FILE is one" in done("import", path, "--device", "generic-cia402", code=2).stderr


@pytest.mark.skipif(not INPUTS.is_dir(), reason="the inputs are not on this computer")
def test_logs_that_people_paste() -> None:
    device = ("--device", "generic-cia402")
    words = done("log", "decode", INPUTS / "L.log", *device).stdout
    for part in ("0637h", "6064h Position actual value 10000", "606Ch Velocity actual value 300"):
        assert part in words
    assert "6077h Torque actual value 5" in words
    assert "EMCY 8110h" in words
    refused = done("log", "decode", INPUTS / "tz.log", *device).stdout
    assert refused.count("refused: Code 0x06010002") == 2
    assert "60FEh:1" in refused
    assert "start" in done("log", "decode", INPUTS / "plain.log", *device).stdout
