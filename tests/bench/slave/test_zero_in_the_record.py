"""The length of a drive that cannot be homed: its zero is in the record, by the true shaft."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from slave import Slave
from slave.rig import Rig, bench_text
from slave.wire import GENERIC
from winchkit.bench.bench import Bench
from winchkit.errors import NotPermitted

_ARM = 2.957e-3
"""Cable of the profile per motor angle near 4 m, m/rad."""
_HM = 1 << 5
"""In 6502h."""


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    """A drive without the mode HM, 6098h and 607Ch, whose encoder stands anywhere."""
    slave = Slave.from_file(GENERIC, 1)
    slave.objects.declare(0x6502, 0, 0x07, slave.objects.get(0x6502) & ~_HM, "ro")
    for index in (0x6098, 0x607C):
        slave.objects.remove(index)
    slave.motor.angle = -100.0
    return Rig(tmp_path, [slave])


def opened(rig: Rig, encoder: str, extra: str = "") -> Bench:
    text = bench_text(rig.channel, encoder=encoder)
    return rig.open(text + f'length = ["0.5 m", "4.3 m"]\n{extra}')


def homed(bench: Bench, rig: Rig) -> None:
    """Homed at 4 m, where nothing moves; then 0.1 m wound in, by the shaft."""
    slave, winch = rig.slaves[0], bench.winch["A"]
    begun = slave.motor.angle
    winch.home(at=4.0)
    assert slave.motor.angle == begun
    assert winch.cable_length == pytest.approx(4.0, abs=1e-4)
    winch.move_to(3.9)
    assert (slave.motor.angle - begun) * _ARM == pytest.approx(0.1, abs=2e-3)
    assert not bench.snapshot.tripped


def required_unknown(bench: Bench, reason: str) -> None:
    assert math.isnan(bench.winch["A"].cable_length)
    with pytest.raises(NotPermitted, match=reason):
        bench.winch["A"].move_to(3.8)


@pytest.mark.parametrize("encoder", ["absolute", "incremental"])
def test_the_zero_is_that_of_the_next_process(rig: Rig, encoder: str) -> None:
    with opened(rig, encoder) as bench:
        required_unknown(bench, "there is no record")
        homed(bench, rig)
    for _ in range(2):
        with rig.opened() as bench:
            assert bench.winch["A"].cable_length == pytest.approx(3.9, abs=1e-3)


@pytest.mark.parametrize("encoder", ["absolute", "incremental"])
def test_after_a_power_cycle_it_is_that_of_an_absolute_encoder_only(rig: Rig, encoder: str) -> None:
    if encoder == "incremental":
        rig.slaves[0].inject("counter begins anew", 0)
    with opened(rig, encoder) as bench:
        homed(bench, rig)
    rig.power_cycle()
    rig.slaves[0].motor.angle += 0.05 / _ARM
    with rig.opened() as bench:
        if encoder == "incremental":
            required_unknown(bench, "the drive was switched off since")
            bench.winch["A"].home(at=3.0)
            assert bench.winch["A"].cable_length == pytest.approx(3.0, abs=1e-4)
        else:
            assert bench.winch["A"].cable_length == pytest.approx(3.85, abs=1e-3)


@pytest.mark.parametrize("encoder", ["absolute", "incremental"])
def test_a_restart_within_a_process(rig: Rig, encoder: str) -> None:
    with opened(rig, encoder) as bench:
        homed(bench, rig)
        rig.slaves[0].inject("reboots")
        rig.wait(1.0)
        bench.reset()
        if encoder == "incremental":
            required_unknown(bench, "restarted")
        else:
            assert bench.winch["A"].cable_length == pytest.approx(3.9, abs=1e-3)


def test_a_kill_right_after_a_homing_and_one_in_motion_keep_the_zero(rig: Rig) -> None:
    bench = opened(rig, "absolute")
    bench.winch["A"].home(at=4.0)
    rig.kill(bench)
    rig.wait(1.0)
    with rig.opened() as again:
        assert again.winch["A"].cable_length == pytest.approx(4.0, abs=1e-4)
    bench = opened(rig, "absolute")
    bench.winch["A"].move_to(3.0, wait=False)
    begun = rig.slaves[0].motor.angle
    rig.wait(1.0)
    rig.kill(bench)
    rig.wait(1.0)
    with rig.opened() as again:
        again.reset()
        moved = (rig.slaves[0].motor.angle - begun) * _ARM
        assert moved > 0.1
        assert again.winch["A"].cable_length == pytest.approx(4.0 - moved, abs=3e-3)


@pytest.mark.parametrize("lost", ["removed", "cut"])
def test_without_the_record_the_zero_is_lost_with_it(rig: Rig, lost: str) -> None:
    with opened(rig, "absolute") as bench:
        homed(bench, rig)
    record = rig.bench_file.with_suffix(".position.json")
    assert json.loads(record.read_bytes())["winch"]["A"]["zero"]
    if lost == "removed":
        record.unlink()
    else:
        record.write_bytes(record.read_bytes()[:100])
    with rig.opened() as bench:
        assert math.isnan(bench.winch["A"].cable_length)


def test_limits_in_the_drive_do_not_know_the_zero(rig: Rig) -> None:
    with opened(rig, "absolute", "in_drive = true\n") as bench:
        with pytest.raises(NotPermitted, match=r"607Dh.*limits.in_drive = false"):
            bench.winch["A"].home(at=4.0)
        assert math.isnan(bench.winch["A"].cable_length)


def test_position_modes_go_where_the_length_says(rig: Rig) -> None:
    """607Ah is in the drive's counts, without the zero."""
    text = bench_text(rig.channel, device=_csp(rig.folder), encoder="absolute")
    with rig.open(text) as bench:
        assert bench.axes["A"].position_mode
        homed(bench, rig)


def _csp(folder: Path) -> str:
    """The generic drive, moved by positions."""
    home = folder / "by-position"
    home.mkdir()
    text = (GENERIC.parent / "device.toml").read_text(encoding="utf-8")
    text = text.replace('motion_mode = "CSV"', 'motion_mode = "CSP"').replace("0x60FF", "0x607A")
    (home / "device.toml").write_text(text, encoding="utf-8")
    (home / GENERIC.name).write_bytes(GENERIC.read_bytes())
    return str(home)
