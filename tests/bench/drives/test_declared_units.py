"""Units of a device file on the independent slave, whose counts are given in rad/s."""

from __future__ import annotations

from math import pi
from pathlib import Path

import pytest

from slave import Declared
from slave_bench import served, write_bench

_TURN = 2 * pi


@pytest.mark.parametrize(
    ("keys", "counts", "velocity_unit"),
    [
        ('speed_unit = "0.1 counts/s"', 10_000, 0.1 * _TURN / 10_000),
        ('speed_unit = "counts / 65536 / 1 ms"', 10_000, _TURN / 10_000 / 65.536),
        ('speed_unit = "1875 rpm / 512 / encoder"', 10_000, 1875 * _TURN / 60 / 512 / 10_000),
        ('position_unit = "0.1 deg"\nspeed_unit = "0.1 rpm"', 3600, _TURN / 600),
    ],
)
def test_the_shaft_turns_as_far_as_it_is_commanded(
    tmp_path: Path, keys: str, counts: int, velocity_unit: float
) -> None:
    path = write_bench(tmp_path)
    device = path.parent / "drive" / "device.toml"
    kept = [
        line
        for line in device.read_text().split("\n")
        if not line.startswith(("speed_unit", "units", "increments_per_turn"))
    ]
    own = f'[servo]\nunits = "file"\nincrements_per_turn = 10000\n{keys}'
    device.write_text("\n".join(kept).replace("[servo]", own, 1))
    declared = Declared(counts=counts, velocity_unit=velocity_unit)
    with served(path, declared=declared) as bench, bench.open() as opened:
        winch, motor = opened.winch["A"], bench.slave.motor
        begin, start = motor.angle, winch.snapshot.cable_length
        winch.move_by(pay_out=0.2, speed=0.1)
        assert winch.snapshot.cable_length - start == pytest.approx(0.2, abs=2e-3)
        # The profile's drum, by its own numbers: 60 mm and a gear of 20.4.
        turned = abs(motor.angle - begin)
        assert turned == pytest.approx(0.2 / 0.0603 * 20.4, rel=0.02)
