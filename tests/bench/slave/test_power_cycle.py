"""The cable length after power cycles, kills and homings: right by the true shaft, or unknown."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from slave import Slave, State
from slave.held_key import HeldKey
from slave.rig import Rig, bench_text
from slave.wire import GENERIC
from winchkit.bench.bench import Bench
from winchkit.errors import DriveFault, LimitTripped, NotPermitted

_LENGTH = 3.9
_ARM = 2.957e-3
"""Cable of the profile per motor angle near 4 m, m/rad."""


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    slave = Slave.from_file(GENERIC, 1)
    slave.inject("counter begins anew", 0)
    return Rig(tmp_path, [slave])


def text(rig: Rig, encoder: str = "incremental", **limits: str) -> str:
    given = {"length": "0.5 m"} | limits
    del given["length"]
    found = bench_text(rig.channel, encoder=encoder, limits=given)
    return found + 'length = ["0.5 m", "4.3 m"]\n'


def opened(rig: Rig, encoder: str = "incremental", **limits: str) -> Bench:
    return rig.open(text(rig, encoder, **limits))


def homed_and_closed(rig: Rig, encoder: str = "incremental") -> None:
    """Homed, moved to 3.9 m and closed."""
    with opened(rig, encoder) as bench:
        winch = bench.winch["A"]
        winch.home(at=4.0)
        winch.move_to(_LENGTH)
        assert winch.cable_length == pytest.approx(_LENGTH, abs=2e-3)
        assert winch.snapshot.length_known


def require_unknown(bench: Bench, reason: str) -> None:
    """NaN with its flag and its reason, and no motion but a slow one that is held."""
    winch, slave_angle = bench.winch["A"], winch_angle(bench)
    assert math.isnan(winch.cable_length)
    assert not winch.snapshot.length_known
    (words,) = (str(item) for item in bench.snapshot.warnings if item.kind == "length unknown")
    assert reason in words
    for motion in (
        lambda: winch.move_to(3.9),
        lambda: winch.move_by(pay_out=0.01),
        lambda: winch.jog(wind_in=0.021),
        lambda: winch.jog(wind_in=0.01, duration=0.2),
    ):
        with pytest.raises(NotPermitted, match="home first"):
            motion()
    assert winch_angle(bench) == slave_angle


def winch_angle(bench: Bench) -> float:
    return bench.winch["A"].snapshot.motor_angle


def test_a_closed_record_is_the_length_of_the_next_process(rig: Rig) -> None:
    homed_and_closed(rig)
    with rig.opened() as bench:
        assert bench.winch["A"].cable_length == pytest.approx(_LENGTH, abs=1e-3)
        assert not bench.snapshot.warnings
        begun = rig.slaves[0].motor.angle
        bench.winch["A"].move_to(3.85)
        assert (rig.slaves[0].motor.angle - begun) * _ARM == pytest.approx(0.05, abs=2e-3)


@pytest.mark.parametrize("begins", ["zero", "same"])
def test_a_power_cycle_makes_the_length_of_an_incremental_encoder_unknown(
    rig: Rig, begins: str
) -> None:
    """Also where its counter begins at the very value at which it was closed."""
    homed_and_closed(rig)
    slave = rig.slaves[0]
    slave.inject("counter begins anew", 0 if begins == "zero" else slave.motion.counts())
    rig.power_cycle()
    with rig.opened() as bench:
        require_unknown(bench, "the drive was switched off since")
        key = HeldKey(rig, bench, pay_out=-0.02).press()
        begun = slave.motor.angle
        rig.wait(1.0)
        key.release()
        rig.wait(0.5)
        assert key.errors == []
        assert 0.01 < (slave.motor.angle - begun) * _ARM < 0.025
        bench.winch["A"].home(at=3.88)
        assert bench.winch["A"].snapshot.length_known
        bench.winch["A"].move_to(3.86)
    with rig.opened() as bench:
        assert bench.winch["A"].cable_length == pytest.approx(3.86, abs=1e-3)


def test_an_absolute_encoder_needs_no_record(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    homed_and_closed(rig, "absolute")
    rig.power_cycle()
    Path(rig.bench_file.with_suffix(".position.json")).unlink()
    with rig.opened() as bench:
        assert bench.winch["A"].cable_length == pytest.approx(_LENGTH, abs=1e-3)


def test_a_mapping_that_was_lost_says_that_the_drive_was_off(rig: Rig) -> None:
    homed_and_closed(rig)
    rig.slaves[0].inject("mapping lost")
    with rig.opened() as bench:
        require_unknown(bench, "1017h is 0h, and 32h was written")


@pytest.mark.parametrize(("moved", "known"), [(1.5e-3, True), (-1.5e-3, True), (3e-3, False)])
def test_a_winch_that_was_turned_while_closed_is_unknown(
    rig: Rig, moved: float, known: bool
) -> None:
    homed_and_closed(rig)
    rig.slaves[0].motor.angle += moved / _ARM
    with rig.opened() as bench:
        if known:
            assert bench.winch["A"].cable_length == pytest.approx(_LENGTH - moved, abs=1e-3)
        else:
            require_unknown(bench, "when it was closed")


def test_without_a_record_an_incremental_encoder_is_unknown(rig: Rig) -> None:
    with opened(rig) as bench:
        require_unknown(bench, "there is no record")


def test_another_drive_is_unknown(rig: Rig) -> None:
    homed_and_closed(rig)
    rig.slaves[0].objects.set(0x1018, 4, 4711)
    with rig.opened() as bench:
        require_unknown(bench, "another drive: its serial number (1018h:4) is 4711")


@pytest.mark.parametrize("encoder", ["incremental", "absolute"])
@pytest.mark.parametrize(
    ("index", "sub", "value", "reason"),
    [
        (0x607E, 0, 0x80, r"is 65536 (reversed by 607Eh) counts of 6064h and was 65536 when"),
        (0x6092, 1, 131_072, r"is 131072 counts of 6064h and was 65536 when it was homed"),
    ],
)
def test_a_count_of_another_size_or_sense_is_no_known_length(
    rig: Rig, encoder: str, index: int, sub: int, value: int, reason: str
) -> None:
    """The count is that of the record, and stands for another angle."""
    homed_and_closed(rig, encoder)
    rig.slaves[0].objects.set(index, sub, value)
    with opened(rig, encoder) as bench:
        require_unknown(bench, reason)
        bench.winch["A"].home(at=_LENGTH)
    with opened(rig, encoder) as bench:
        assert bench.winch["A"].cable_length == pytest.approx(_LENGTH, abs=1e-3)
        rig.slaves[0].objects.set(index, sub, {0x607E: 0, 0x6092: 65_536}[index])
        rig.slaves[0].inject("reboots")
        rig.wait(1.0)
        bench.reset()
        rig.wait(1.0)
        require_unknown(bench, "when it was homed")


@pytest.mark.parametrize("moving", [True, False])
def test_a_reboot_within_a_process_trips_and_leaves_the_length_unknown(
    rig: Rig, moving: bool
) -> None:
    with opened(rig) as bench:
        winch = bench.winch["A"]
        winch.home(at=4.0)
        key = HeldKey(rig, bench, pay_out=-0.1)
        if moving:
            key.press()
            rig.wait(1.0)
        rig.slaves[0].inject("reboots")
        rig.wait(1.0)
        key.release()
        assert "boot-up" in [trip.kind for trip in bench.snapshot.tripped]
        assert math.isnan(winch.cable_length)
        bench.reset()
        rig.wait(1.0)
        require_unknown(bench, "restarted")
        winch.home(at=3.0)
        winch.move_to(2.98)
        assert winch.cable_length == pytest.approx(2.98, abs=2e-3)


@pytest.mark.parametrize("after", [0.005, 0.02, 0.05, 0.1, 0.13])
@pytest.mark.parametrize("method", [None, 1])
def test_a_reboot_within_a_homing_is_its_error_and_a_reset_mends_it(
    rig: Rig, after: float, method: int | None
) -> None:
    with opened(rig) as bench:
        winch = bench.winch["A"]
        rig.clock.call_at(rig.time + after, lambda: rig.slaves[0].inject("reboots"))
        with pytest.raises(LimitTripped, match="restarted"):
            winch.home(at=4.0, method=method)
        booted = rig.time
        rig.wait(1.0)
        assert all(s.state is not State.ENABLED for s in rig.samples[0] if s.time > booted)
        assert math.isnan(winch.cable_length)
        bench.reset()
        winch.home(at=4.0)
        winch.move_to(3.98)
        assert winch.cable_length == pytest.approx(3.98, abs=2e-3)


@pytest.mark.parametrize("encoder", ["absolute", "incremental"])
def test_after_a_kill_in_motion_the_next_opening_says_so_and_wants_a_reset(
    rig: Rig, encoder: str
) -> None:
    rig.slaves[0].mend("counter begins anew")
    bench = opened(rig, encoder)
    bench.winch["A"].home(at=4.0)
    key = HeldKey(rig, bench, pay_out=-0.1).press()
    rig.wait(1.0)
    record = json.loads(Path(bench.spec.position_file).read_text())
    assert not record["winch"]["A"]["closed"]
    rig.kill(bench)
    key.release()
    rig.wait(1.0)
    for _ in range(2):  # it stays so until the reset, whatever opens the bench meanwhile
        with rig.opened() as again:
            (trip,) = again.snapshot.tripped
            assert trip.kind == "owner"
            assert "ended in motion" in str(trip)
            with pytest.raises(LimitTripped, match="ended in motion"):
                again.winch["A"].jog(wind_in=0.01)
            with pytest.raises(LimitTripped, match="ended in motion"):
                again.winch["A"].move_to(3.9)
    with rig.opened() as last:
        last.reset()
        if encoder == "incremental":
            require_unknown(last, "without closing its record")
        else:
            winch = last.winch["A"]
            moved = rig.slaves[0].motor.angle * _ARM
            assert winch.cable_length == pytest.approx(4.0 - moved, abs=0.01)
    with rig.opened() as free:
        assert not free.snapshot.tripped


def test_a_kill_at_rest_loses_nothing(rig: Rig) -> None:
    bench = opened(rig)
    bench.winch["A"].home(at=4.0)
    bench.winch["A"].move_to(_LENGTH)
    rig.wait(0.5)
    rig.kill(bench)
    rig.wait(1.0)
    with rig.opened() as again:
        assert not again.snapshot.tripped
        assert again.winch["A"].cable_length == pytest.approx(_LENGTH, abs=1e-3)


@pytest.mark.parametrize("damage", ["cut", "empty", "folder"])
def test_a_record_that_cannot_be_read_is_not_trusted(rig: Rig, damage: str) -> None:
    homed_and_closed(rig)
    record = rig.bench_file.with_suffix(".position.json")
    data = record.read_bytes()
    record.unlink()
    if damage == "folder":
        record.mkdir()
    else:
        record.write_bytes(data[:100] if damage == "cut" else b"")
    with rig.opened() as bench:
        assert [trip.kind for trip in bench.snapshot.tripped] == ["position record"]
        assert math.isnan(bench.winch["A"].cable_length)


def test_limits_unhomed_forbids_or_limits_the_jogs(rig: Rig) -> None:
    refused = pytest.raises(NotPermitted, match="forbids jogs too")
    with opened(rig, unhomed="none") as bench, refused:
        bench.winch["A"].jog(wind_in=0.001)
    with opened(rig, unhomed="50 mm/s") as bench:
        bench.winch["A"].jog(wind_in=0.05)
        with pytest.raises(NotPermitted, match=r"up to 0\.05 m/s"):
            bench.winch["A"].refresh(wind_in=0.051)
        rig.wait(1.0)


def test_homing_here_is_permitted_where_the_length_is_nonsense(rig: Rig) -> None:
    """A count of -10^9 would mean far more cable than the drum has: no length, and no move."""
    slave = rig.slaves[0]
    slave.inject("counter begins anew", -1_000_000_000)
    rig.power_cycle()
    with opened(rig, "absolute") as bench:
        winch = bench.winch["A"]
        require_unknown(bench, "more than the 5.561 m that its drum has")
        begun = slave.motor.angle
        winch.home(at=4.0)
        assert slave.motor.angle == pytest.approx(begun, abs=1e-3)
        assert winch.cable_length == pytest.approx(4.0, abs=2e-3)


@pytest.mark.parametrize("here", [4.6, 5.0, 0.4])
def test_homing_here_is_permitted_beyond_the_length_limits(rig: Rig, here: float) -> None:
    """Above 4.3 m, with fewer than two dead wraps, and below 0.5 m; nothing moves."""
    with opened(rig) as bench:
        winch, begun = bench.winch["A"], rig.slaves[0].motor.angle
        winch.home(at=here)
        assert winch.cable_length == pytest.approx(here, abs=2e-3)
        winch.home(at=4.0)
        assert rig.slaves[0].motor.angle == pytest.approx(begun, abs=1e-3)
        winch.move_to(3.98)


@pytest.mark.parametrize("here", [5.7, 298.0, -0.1])
def test_a_length_that_no_drum_has_is_refused_before_the_zero_is_moved(
    rig: Rig, here: float
) -> None:
    with opened(rig) as bench:
        winch = bench.winch["A"]
        winch.home(at=4.0)
        with pytest.raises(NotPermitted, match="its drum cannot have paid out"):
            winch.home(at=here)
        assert winch.cable_length == pytest.approx(4.0, abs=2e-3)


def test_every_bench_has_its_quick_stop_ramp(rig: Rig) -> None:
    """6085h of twice limits.acceleration, 1 m/s² here, at the motor; 65536 counts a turn."""
    with opened(rig) as bench:
        assert bench.axes["A"].objects.read(0x6085) * math.tau / 65536 * _ARM == pytest.approx(
            2.0, rel=0.01
        )
    with opened(rig, quick_stop="3 m/s^2") as bench:
        assert bench.axes["A"].objects.read(0x6085) * math.tau / 65536 * _ARM == pytest.approx(
            3.0, rel=0.01
        )


@pytest.mark.parametrize("encoder", ["incremental", "absolute"])
def test_a_homing_counts_where_the_disabled_drive_does_not_say_so(rig: Rig, encoder: str) -> None:
    rig.slaves[0].inject("homing forgotten")
    with opened(rig, encoder) as bench:
        bench.winch["A"].home(at=4.0)
        assert bench.winch["A"].cable_length == pytest.approx(4.0, abs=2e-3)
        assert not bench.snapshot.warnings
        bench.winch["A"].move_to(3.98)


@pytest.mark.parametrize("encoder", ["incremental", "absolute"])
def test_a_zero_that_is_not_what_was_asked_for_makes_the_length_unknown(
    rig: Rig, encoder: str
) -> None:
    """Whatever was known before: the drive attained its homing, and its zero has moved."""
    with opened(rig, encoder) as bench:
        winch = bench.winch["A"]
        winch.home(at=4.0)
        rig.slaves[0].inject("home offset ignored")
        with pytest.raises(DriveFault, match="may not add its home offset"):
            winch.home(at=3.0)
        rig.wait(0.1)
        require_unknown(bench, "before the length by it was known")
    with opened(rig, encoder) as bench:
        require_unknown(bench, "before the length by it was known")
