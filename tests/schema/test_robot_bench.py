"""The table ``[robot]`` of a bench file: what is read, and what is refused."""

from __future__ import annotations

from math import radians
from pathlib import Path

import pytest

from winchkit.errors import FileError
from winchkit.schema.read import load, read_bench
from winchkit.sim.live.bench_file import write_bench

ROBOT = """\
schema = 1
kind = "bench"
[robot]
profile = "winding-device-8"
speed = "0.2 m/s"
rotation_speed = "20 deg/s"
tension = ["60 N", "800 N"]
tension_trim = "end"
tracker = { listen = "udp://127.0.0.1:5100" }
[bus.can]
kind = "can"
interface = "virtual"
channel = "robot"
"""
WINCH = """\
[winch.{name}]
profile = "winding-device-winch"
servo = {{ device = "generic-cia402", bus = "can", node = {name}, encoder = "absolute" }}
limits = {{ speed = "0.5 m/s", tension_high = "900 N", tension_slack = "20 N" }}
"""


def write(path: Path, names: str = "12345678", **replaced: str) -> Path:
    text = ROBOT + "".join(WINCH.format(name=name) for name in names)
    for old, new in replaced.items():
        text = text.replace(old, new)
    path.write_text(text)
    return path


def test_a_robot_is_read_in_si(tmp_path: Path) -> None:
    spec = read_bench(write(tmp_path / "bench.toml"))
    assert spec.robot is not None
    assert spec.robot.tracker is not None
    assert spec.robot.tension == (60.0, 800.0)
    assert spec.robot.rotation_speed == pytest.approx(radians(20))
    assert spec.robot.lost_winch == "stop-together"
    assert spec.robot.tension_trim == "end"
    assert spec.robot.tracker.frame == "tracker"
    again = load(write_bench(spec, tmp_path / "again.toml")).value
    assert again == spec


@pytest.mark.parametrize(
    ("names", "replaced", "words"),
    [
        ("1234567", {}, "line 8 of robot 'winding-device-8' is no winch of this bench"),
        ("12345678", {"800": "1000"}, "1000 N is above tension_high of winch 1, 900 N"),
        ("12345678", {'"60 N"': '"10 N"'}, "10 N is below tension_slack of winch 1, 20 N"),
        ("12345678", {'"60 N"': '"800 N"'}, "the lower limit 800 N is not below"),
        ("12345678", {"udp:": "tcp:"}, "is no address such as"),
        ("12345678", {":5100": ":x"}, "is no address such as"),
        ("12345678", {"winding-device-8": "bench-spiral"}, "is 'winch'"),
    ],
)
def test_what_does_not_fit_is_refused(
    tmp_path: Path, names: str, replaced: dict[str, str], words: str
) -> None:
    with pytest.raises(FileError, match=words):
        read_bench(write(tmp_path / "bench.toml", names, **replaced))
