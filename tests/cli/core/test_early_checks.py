"""Wrong names and files are refused before a bus is opened: these buses have no device."""

from __future__ import annotations

from pathlib import Path

import pytest

from command_line import done, invoke

BENCH = """schema = 1
kind = "bench"
cycle = "4 ms"
[bus.can]
kind = "can"
interface = "virtual"
channel = "nobody-there"
[bus.cells]
kind = "modbus-tcp"
host = "127.0.0.1"
port = 9
[winch.A]
profile = "bench-spiral"
servo = { device = "generic-cia402", bus = "can", node = 1, encoder = "absolute" }
cell = { device = "laumas-tlb", bus = "cells", unit = 1 }
[winch.A.limits]
speed = "0.5 m/s"
acceleration = "1 m/s^2"
length = ["0.5 m", "4.7 m"]
"""
STEP = '[[step]]\nwinch = "{}"\nto = "2 m"\nspeed = "0.1 m/s"\n'


@pytest.mark.parametrize(
    ("line", "code", "message"),
    [
        ("move Z --to 2m", 2, "no winch 'Z'"),
        ("tare Z", 2, "no winch 'Z'"),
        ("cell info Z", 2, "no instrument 'Z'"),
        ("cell zero A.load", 2, "no instrument 'A.load'"),
        ("cell store Z -y", 2, "no instrument 'Z'"),
        ("cell calibrate A --weights 1kg -o none/x.toml -y", 2, "there is no folder 'none'"),
        ("cell calibrate --points none.csv -y", 3, "none.csv: there is no such file"),
        ("info Z", 2, "no winch 'Z'"),
        ("info A --device zzz", 3, "there is no device 'zzz'"),
        ("config save A -o a.txt", 2, "name a .dcf or .json file"),
        ("config save A -o none/a.dcf", 2, "there is no folder 'none'"),
        ("config load A none.dcf", 3, "none.dcf: there is no such file"),
        ("config diff A none.dcf", 3, "none.dcf: there is no such file"),
        ("run other.toml", 2, "no winch 'Z'"),
        ("run own.toml -o bench.toml/runs", 2, "'bench.toml' is a file"),
        ("log -o x.txt", 2, "name a .csv or .mcap file"),
        ("log -o none/x.csv", 2, "there is no folder 'none'"),
        ("lss set --only --node 128", 2, "128 is no node id"),
        ("lss set --only --new-bitrate 7", 2, "is not in the standard's table"),
    ],
)
def test_what_is_refused_without_a_bus(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, line: str, code: int, message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bench.toml").write_text(BENCH)
    for name, winch in (("own", "A"), ("other", "Z")):
        (tmp_path / f"{name}.toml").write_text(
            'schema = 1\nkind = "programme"\n' + STEP.format(winch)
        )
    result = done(*line.split(), code=code)
    assert message in result.stderr
    assert "Errno" not in result.stderr


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("compare a.csv -p bench-spiral --html none/sub/x.html", "there is no folder 'none'"),
        ("compare a.csv -p bench-spiral --figures a.csv", "is a file, and no folder can be made"),
        ("add cable-creep --fit a.csv -p bench-spiral -o none/x.toml", "there is no folder 'none'"),
        ("export a.csv -o none/x.csv", "there is no folder 'none'"),
        ("plan a.csv -p bench-spiral -o .", ".: cannot be written: it is a folder"),
        ("sim record demo-adequate programme-demo -o a.csv/runs", "no folder can be made there"),
    ],
)
def test_a_place_that_cannot_be_written_is_refused_before_the_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: str, message: str
) -> None:
    """The run is no run: a command that read it first would report that."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.csv").write_text("no run")
    result = invoke(*words.split())
    assert result.exit_code in {2, 3}
    assert message in result.stderr
    assert "Traceback" not in result.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.csv"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("compare runs -p bench-spiral", "runs: is a folder; name the runs in it, such as runs/*"),
        (
            "compare p.toml -p bench-spiral",
            "p.toml: is a declaration such as a profile, and no run",
        ),
        ("compare a.csv -p a.csv", "a.csv: is a .csv file, and no declaration: profiles"),
        ("compare a.csv -p spiral-bench", "'spiral-bench' is a shipped simulated bench"),
        ("sim record bench-spiral programme-demo", "'bench-spiral' is a shipped profile"),
    ],
)
def test_a_file_of_another_kind_is_named_by_its_kind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: str, message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "runs").mkdir()
    (tmp_path / "p.toml").write_text('schema = 1\nkind = "winch"\n')
    (tmp_path / "a.csv").write_text("time [s],motor_angle [rad]\n0,0\n1,1\n2,2\n")
    result = done(*words.split(), code=3)
    assert message in result.stderr
