"""Limits that make no sense are refused or warned of by ``winchkit check``, and on opening."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from click.testing import Result

from command_line import invoke
from declared import BENCH, WINCH
from winchkit.errors import FileError, UsageError
from winchkit.schema.bench_warnings import bench_warnings
from winchkit.schema.read import read_bench, read_device

DEVICES = Path(__file__).parents[2] / "devices"
PROGRAMME = """\
schema = 1
kind = "programme"
[[step]]
to = "2 m"
speed = "0.1 m/s"
"""
LIMITED = BENCH.replace(
    'limits = { speed = "0.5 m/s" }',
    'limits = { speed = "0.5 m/s", length = ["1 m", "9 m"], tension_high = "500 N" }',
)


def checked(path: Path, text: str) -> Result:
    path.write_text(text)
    return invoke("check", path)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('speed = "0.5 m/s"', 'speed = "1e308 m/s"', "at most 50 m/s"),
        ('channel = "x"', 'channel = "x"\nheartbeat = "1000 s"', "at most 1 s"),
        ('channel = "x"', 'channel = "x"\nheartbeat = "0.1 ms"', "at least 0.002 s"),
        ('kind = "bench"', 'kind = "bench"\ncycle = "100 s"', "at most 0.1 s"),
        ("port = 502", 'port = 502\ntimeout = "1 h"', "at most 10 s"),
        ('["1 m", "9 m"]', '["9 m", "1 m"]', "lower limit 9 m is not below"),
        ('["1 m", "9 m"]', '["-5 m", "9 m"]', "at least 0"),
        ('["1 m", "9 m"]', '["1 m", "1e200 m"]', "at most 100000 m"),
        (
            'tension_high = "500 N"',
            'tension_high = "500 N", tension_slack = "600 N"',
            "600 N is not below tension_high",
        ),
        ('tension_high = "500 N"', 'tension_high = "1e300 N"', "at most 1e+15 N"),
    ],
)
def test_limits_without_sense_are_refused(bench: Path, old: str, new: str, words: str) -> None:
    assert old in LIMITED
    result = checked(bench, LIMITED.replace(old, new))
    assert result.exit_code == FileError.exit_code, result.output
    assert words in result.stderr
    with pytest.raises(FileError):
        read_bench(bench)


@pytest.mark.parametrize("ratio", ["2e31", "1e-9", "inf", "nan"])
def test_a_gear_ratio_without_sense_is_refused(file: Path, ratio: str) -> None:
    result = checked(file, WINCH.replace("ratio = 20", f"ratio = {ratio}"))
    assert result.exit_code == FileError.exit_code
    assert "gearbox.ratio" in result.stderr


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('to = "2 m"', 'to = "-5 m"', "a cable length is at least 0"),
        ('speed = "0.1 m/s"', 'speed = "1e308 m/s"', "at most 50 m/s"),
        ('to = "2 m"\nspeed = "0.1 m/s"', 'hold = "1e308 s"', "at most 1e+07 s"),
        ('kind = "programme"', 'kind = "programme"\nrepeat = 100000000000', "out of range"),
        ('to = "2 m"', 'by = "inf m"', "must be finite"),
    ],
)
def test_a_programme_without_sense_is_refused(file: Path, old: str, new: str, words: str) -> None:
    assert checked(file, PROGRAMME).exit_code == 0
    result = checked(file, PROGRAMME.replace(old, new))
    assert result.exit_code == FileError.exit_code
    assert words in result.stderr


def test_a_bench_without_length_or_tension_limits_is_warned_of(bench: Path) -> None:
    result = checked(bench, BENCH)
    assert "there are no length limits" in result.stderr
    assert "there is no upper tension limit" in result.stderr
    assert "(warning)" in result.stderr
    kept = [message for _, message in bench_warnings(read_bench(bench))]
    assert len(kept) == 2
    limited = checked(bench, LIMITED)
    assert "limits: there" not in limited.stderr
    entry = json.loads(invoke("check", "--json", bench).stdout)
    assert not [one for one in entry["files"][0]["warnings"] if "limit" in one["message"]]


def test_a_slow_heartbeat_is_warned_of(bench: Path) -> None:
    text = LIMITED.replace('channel = "x"', 'channel = "x"\nheartbeat = "800 ms"')
    assert "run on for up to 2 s" in checked(bench, text).stderr


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("inf", "must be finite"),
        ("nan", "must be finite"),
        ("-inf", "must be finite"),
        ("1e308", "beyond what u16 holds"),
        ("70000", "beyond what u16 holds"),
        ("0.5", "not a whole number"),
    ],
)
def test_a_command_value_that_is_no_register_is_refused(
    tmp_path: Path, value: str, words: str
) -> None:
    """An infinite one was an internal error."""
    shutil.copytree(DEVICES / "generic-modbus", tmp_path / "device")
    path = tmp_path / "device" / "device.toml"
    text = path.read_text()
    assert "zero = { register = 8, value = 3 }" in text
    result = checked(
        path, text.replace("register = 8, value = 3", f"register = 8, value = {value}")
    )
    assert result.exit_code == FileError.exit_code, result.output
    assert words in result.stderr
    with pytest.raises(FileError):
        read_device(path)


@pytest.mark.parametrize(
    "words",
    [
        ("cell", "rate", "--for", "1e308 s"),
        ("cell", "rate", "--for", "inf s"),
        ("cell", "diagnose", "--for", "1e308h"),
        ("monitor", "--for", "1e308 s"),
        ("monitor", "--every", "inf s"),
        ("log", "--for", "1e308 s"),
        ("move", "A", "--to", "1e308 m"),
        ("move", "A", "--to", "inf m"),
        ("sim", "record", "spiral-bench", "--rate", "1e308 Hz"),
    ],
)
def test_a_command_line_refuses_sizes_without_sense(bench: Path, words: tuple[str, ...]) -> None:
    bench.write_text(LIMITED)
    named = [] if words[0] == "sim" else ["--bench", str(bench)]
    result = invoke(*words, *named)
    assert not isinstance(result.exception, OverflowError | ValueError), result.exception
    if isinstance(result.exception, SystemExit):
        assert result.exit_code == UsageError.exit_code, result.output
    else:
        assert isinstance(result.exception, UsageError), result.exception
