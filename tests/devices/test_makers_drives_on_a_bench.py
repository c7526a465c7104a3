"""What a bench makes of counters that wrap, of whole rpm, and of a second producer of SYNC."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import pytest

from slave import Declared, Slave, State
from slave.held_key import HeldKey
from slave.rig import Rig, bench_text
from slave.wire import GENERIC
from winchkit.drivers.can.cia402.standstill import Standstill
from winchkit.drivers.can.cia402.units import CountScale
from winchkit.errors import NotPermitted

RPM = 2 * math.pi / 60


def wrapping(folder: Path) -> Path:
    """The generic drive with a counter of 20 bits, 16 turns; returns its folder."""
    home = folder / "wraps"
    home.mkdir()
    text = (GENERIC.parent / "device.toml").read_text(encoding="utf-8")
    text = text.replace('"generic-cia402.eds"', f'"{GENERIC}"')
    text = text.replace("[servo]", f"[servo]\nposition_wraps = [{-(2**19)}, {2**19 - 1}]")
    (home / "device.toml").write_text(text, encoding="utf-8")
    return home


@pytest.mark.slow
@pytest.mark.parametrize(("way", "sign"), [(0.15, 1), (-0.15, -1)])
def test_the_cable_length_goes_on_where_the_counter_wraps(
    tmp_path: Path, way: float, sign: int
) -> None:
    """A counter of 20 bits wraps after 16 turns; the shaft's true angle is the slave's."""
    slave = Slave.from_file(GENERIC, 1, declared=Declared(counter_bits=20))
    rig = Rig(tmp_path, [slave])
    home = wrapping(tmp_path)
    with rig.opened(bench_text(rig.channel, device=str(home))) as bench:
        winch = bench.winch["A"]
        start, begun = slave.motor.angle, winch.snapshot.motor_angle
        length = winch.cable_length
        key = HeldKey(rig, bench, pay_out=way).press()
        lengths = []
        for _ in range(400):
            rig.wait(0.01)
            lengths.append(winch.cable_length)
        key.release()
        rig.wait(1.0)
        assert key.errors == []
        turns = (slave.motor.angle - start) / (2 * math.pi)
        assert abs(turns) > 25, "it crossed the end twice at least"
        shown = winch.snapshot.motor_angle - begun
        assert shown == pytest.approx(slave.motor.angle - start, abs=0.01)
        steps = [after - before for before, after in itertools.pairwise(lengths)]
        assert max(map(abs, steps)) < 0.01, "the length never jumps"
        assert (lengths[-1] - length) * sign > 0.5
        assert winch.snapshot.length_known


def test_a_move_past_the_end_of_the_counter_is_refused_before_it_begins(tmp_path: Path) -> None:
    """In CSP: 16 turns from end to end are 0.3 m of cable, and the drive stands in the middle."""
    slave = Slave.from_file(GENERIC, 1, declared=Declared(counter_bits=20))
    rig = Rig(tmp_path, [slave])
    home = wrapping(tmp_path)
    file = home / "device.toml"
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace('motion_mode = "CSV"', 'motion_mode = "CSP"'), encoding="utf-8")
    with rig.opened(bench_text(rig.channel, device=str(home))) as bench:
        begun = slave.motor.angle
        with pytest.raises(NotPermitted, match="beyond the end of the drive's counter"):
            bench.winch["A"].move_by(pay_out=0.3)
        rig.wait(0.5)
        assert slave.motor.angle == begun
        bench.winch["A"].move_by(pay_out=0.1)
        assert abs(slave.motor.angle - begun) > 30.0


@pytest.mark.slow
def test_a_length_that_is_not_known_is_reported_and_no_move_goes_by_it(tmp_path: Path) -> None:
    """Nothing is heard of the drive for longer than its counter of 16 turns takes to wrap."""
    slave = Slave.from_file(GENERIC, 1, declared=Declared(counter_bits=20))
    rig = Rig(tmp_path, [slave])
    with rig.opened(bench_text(rig.channel, device=str(wrapping(tmp_path)))) as bench:
        winch = bench.winch["A"]
        assert winch.snapshot.length_known
        slave.inject("tpdo lost")
        rig.wait(2.0)
        slave.mend("tpdo lost")
        rig.wait(0.1)
        assert math.isnan(winch.cable_length)
        assert not winch.snapshot.length_known
        assert any("length is not known" in str(item) for item in bench.snapshot.warnings)
        if bench.snapshot.tripped:
            bench.reset()
        begun = slave.motor.angle
        with pytest.raises(NotPermitted, match="home first") as refused:
            winch.move_to(1.0)
        assert refused.value.exit_code == 5
        with pytest.raises(NotPermitted, match="home first"):
            winch.move_by(pay_out=0.01)
        with pytest.raises(NotPermitted, match="home first"):
            winch.jog(wind_in=0.05, duration=0.2)
        rig.wait(0.3)
        assert slave.motor.angle == begun
        winch.home(at=3.9)
        assert winch.snapshot.length_known
        assert winch.cable_length == pytest.approx(3.9, abs=2e-3)
        winch.jog(wind_in=0.05, duration=0.2)
        winch.move_to(3.88)


@pytest.mark.slow
@pytest.mark.parametrize("ends", ["closed", "killed at rest", "killed in motion", "switched off"])
def test_turns_that_an_earlier_process_counted_are_known_to_the_next_one_or_unknown(
    tmp_path: Path, ends: str
) -> None:
    """The drive's count is off by a whole range; the record has it while the count goes on."""
    slave = Slave.from_file(GENERIC, 1, declared=Declared(counter_bits=20))
    rig = Rig(tmp_path, [slave])
    home = wrapping(tmp_path)
    bench = rig.open(bench_text(rig.channel, device=str(home)))
    length, angle = bench.winch["A"].cable_length, slave.motor.angle
    key = HeldKey(rig, bench, pay_out=0.15).press()
    rig.wait(4.0)
    if ends == "killed in motion":
        rig.kill(bench)
    key.release()
    rig.wait(1.0)
    if ends == "killed at rest":
        rig.kill(bench)
    elif ends != "killed in motion":
        assert bench.winch["A"].snapshot.length_known
        bench.close()
    if ends == "switched off":
        slave.inject("switched off")
        slave.mend("switched off")
    rig.wait(1.0)
    assert abs(slave.motor.angle - angle) > 16 * 2 * math.pi
    with rig.opened() as again:
        winch = again.winch["A"]
        if again.snapshot.tripped:
            again.reset()
        if ends in ("closed", "killed at rest"):
            way = winch.length_at(slave.motor.angle) - winch.length_at(angle)
            assert winch.cable_length - length == pytest.approx(way, abs=2e-3)
            return
        assert not winch.snapshot.length_known
        assert math.isnan(winch.cable_length)
        with pytest.raises(NotPermitted, match="home first"):
            winch.move_by(pay_out=0.01)
        winch.home(at=3.9)
        assert winch.cable_length == pytest.approx(3.9, abs=2e-3)
    with rig.opened() as last:
        assert last.winch["A"].snapshot.length_known


def test_a_counter_within_its_range_is_known_to_the_next_process(tmp_path: Path) -> None:
    slave = Slave.from_file(GENERIC, 1, declared=Declared(counter_bits=20))
    rig = Rig(tmp_path, [slave])
    with rig.opened(bench_text(rig.channel, device=str(wrapping(tmp_path)))) as bench:
        bench.winch["A"].jog(pay_out=0.05, duration=0.5)
        length = bench.winch["A"].cable_length
    with rig.opened() as again:
        assert again.winch["A"].cable_length == pytest.approx(length, abs=1e-3)


@pytest.mark.parametrize("noise", [(0, 1, 0, -1), (1, -1), (1, 1, 0)])
def test_one_rpm_of_noise_is_rest_where_whole_rpm_are_shown(noise: tuple[int, ...]) -> None:
    """606Ch in whole rpm: a count is 0.105 rad/s; the position stands still."""
    standstill = Standstill(CountScale(angle=1e-4, velocity=RPM, torque=1e-3))
    still = [standstill.take(0.004 * k, 5.0, noise[k % len(noise)] * RPM) for k in range(50)]
    assert all(still)


def test_a_speed_below_one_count_is_seen_by_the_position() -> None:
    """0.1 rad/s is shown as 0 or 1 rpm; in 0.1 s the motor has turned by 10 mrad."""
    standstill = Standstill(CountScale(angle=1e-4, velocity=RPM, torque=1e-3))
    moving = [standstill.take(0.004 * k, 0.1 * 0.004 * k, RPM * (k % 2)) for k in range(200)]
    assert not any(moving[10:])
    at = 0.1 * 0.004 * 199
    after = [standstill.take(0.8 + 0.004 * k, at, 0.0) for k in range(1, 50)]
    assert after[-1]
    assert after.index(True) * 0.004 == pytest.approx(0.04, abs=0.02)


def test_a_drive_with_noise_in_whole_rpm_is_disabled_after_a_motion(tmp_path: Path) -> None:
    declared = Declared(velocity_unit=RPM, velocity_resolution=RPM)
    slave = Slave.from_file(GENERIC, 1, declared=declared)
    publish = slave.motion.publish

    def noisy() -> None:
        publish()
        slave.objects.set(
            0x606C, 0, slave.objects.get(0x606C) + (-1, 0, 1)[round(slave.time * 1e3) % 3]
        )

    slave.motion.publish = noisy  # type: ignore[method-assign]
    rig = Rig(tmp_path, [slave])
    home = tmp_path / "rpm"
    home.mkdir()
    text = (GENERIC.parent / "device.toml").read_text(encoding="utf-8")
    text = text.replace('"generic-cia402.eds"', f'"{GENERIC}"')
    text = text.replace('speed_unit = "increments/s"', 'speed_unit = "rpm"')
    (home / "device.toml").write_text(text, encoding="utf-8")
    with rig.opened(bench_text(rig.channel, device=str(home))) as bench:
        bench.winch["A"].move_by(pay_out=0.05)
        assert slave.power.state is not State.ENABLED


def test_a_second_sync_producer_is_a_warning_at_once(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    with rig.opened() as bench:
        assert not bench.snapshot.warnings
        rig.from_stranger(0x080, b"")
        rig.wait(0.05)
        (warning,) = bench.snapshot.warnings
        assert "1 SYNC frames that were not sent here" in str(warning)
        assert not bench.snapshot.tripped
