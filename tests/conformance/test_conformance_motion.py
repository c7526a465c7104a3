"""A whole bench on a bus: jog and stop in time, and what stops it."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import pytest

from bus_rig import Rig, Seen
from drive_server import NODE
from winchkit.bench.bench import Bench
from winchkit.bench.control.dead_man import DEAD_MAN
from winchkit.errors import DriveFault, LimitTripped

pytestmark = pytest.mark.realtime

ARM = 0.06 / 20.4
"""Of bench-spiral, first turn: cable per motor angle, m/rad."""


@pytest.fixture
def bench(rig: Rig) -> Iterator[Bench]:
    with rig.bench() as opened:
        yield opened


def commands(frames: list[Seen]) -> list[Seen]:
    return [f for f in frames if f.identifier == 0x200 + NODE and len(f.data) == 6]


def targets(frames: list[Seen]) -> list[int]:
    """Target velocities that the host has sent, in counts."""
    sent = commands(frames)
    return [int.from_bytes(frame.data[2:6], "little", signed=True) for frame in sent]


def syncs_after(frames: list[Seen], begin: float) -> int:
    return sum(frame.identifier == 0x080 and frame.time > begin for frame in frames)


def test_a_jog_moves_and_ends_by_its_dead_man(rig: Rig, bench: Bench) -> None:
    winch = bench.winch["A"]
    before = winch.cable_length
    winch.jog(pay_out=0.2, hold=1.0)
    rig.until(lambda: abs(rig.drive.see()["velocity"]) > 20)
    rig.forget()
    begin = bench.clock.now()
    winch.refresh(hold=DEAD_MAN)
    winch.wait()
    frames = rig.witness.frames
    sent = targets(frames)
    assert all(target <= 0 for target in sent), "it pays out, and never the other way"
    peak = min(sent)
    assert peak < 0
    falls = len(sent) - 1 - sent[::-1].index(peak)
    until_falling = [frame for frame in frames if frame.time <= commands(frames)[falls].time]
    # It is not refreshed any more: it ends after the dead-man's time, looked at once a cycle.
    assert syncs_after(until_falling, begin) <= DEAD_MAN / rig.transport.cycle + 2
    assert all(later >= earlier for earlier, later in itertools.pairwise(sent[falls:]))
    # The drum's growth adds a thousandth a turn.
    turned = rig.drive.see()["angle"]
    assert winch.cable_length - before == pytest.approx(-turned * ARM, rel=0.02)
    assert turned < -1.0
    rig.until(lambda: rig.state() == "SWITCH_ON_DISABLED")
    assert abs(rig.drive.see()["velocity"]) < 0.05


def test_the_ramp_of_a_jog_keeps_the_limits(rig: Rig, bench: Bench) -> None:
    bench.winch["A"].jog(pay_out=0.3, duration=0.5)
    sent = targets(rig.witness.frames)
    counts_per_speed = 65536 / 6.283185307 / ARM
    assert min(sent) >= -0.3 * counts_per_speed * 1.02
    steps = [abs(later - earlier) for earlier, later in itertools.pairwise(sent)]
    assert max(steps) <= 1.5 * rig.transport.cycle * counts_per_speed * 1.05


def test_a_stop_takes_effect_within_two_cycles(rig: Rig, bench: Bench) -> None:
    winch = bench.winch["A"]
    winch.jog(pay_out=0.3, hold=1.0)
    rig.until(lambda: abs(rig.drive.see()["velocity"]) > 50)
    rig.forget()
    begin = bench.clock.now()
    bench.stop_now(wait=False)
    bench.wait_at_rest(bench.winch)
    frames = rig.witness.frames
    stops = [f for f in frames if f.identifier == 0x200 + NODE and f.data[:2] == b"\x02\x00"]
    assert stops
    until_stop = [frame for frame in frames if frame.time <= stops[0].time]
    assert syncs_after(until_stop, begin) <= 2
    assert not {0x06, 0x07, 0x0F} & set(rig.witness.words()[rig.witness.words().index(0x02) :])
    seen = rig.drive.see()
    states = [state for _, state, _ in seen["record"]]
    assert states[-2:] == ["QUICK_STOP_ACTIVE", "SWITCH_ON_DISABLED"]
    # The drive's own ramp (6085h) from the speed that it had.
    at, _, speed = next(row for row in seen["record"] if row[1] == "QUICK_STOP_ACTIVE")
    ramp = abs(speed) / (rig.drive.number(0x6085) * 6.283185307 / 65536)
    assert seen["at_rest_since"] - at <= ramp + 0.05 + 2 * seen["worst_gap"]


def test_a_fault_trips_the_bench_and_a_reset_enables_nothing(rig: Rig, bench: Bench) -> None:
    winch = bench.winch["A"]
    winch.jog(pay_out=0.1, hold=1.0)
    rig.until(lambda: rig.state() == "OPERATION_ENABLED")
    rig.drive.inject("following error")
    with pytest.raises(DriveFault, match="8611h following error"):
        winch.wait()
    rig.forget()
    bench.reset()
    assert rig.states()[-1] == "SWITCH_ON_DISABLED"
    assert not {0x06, 0x07, 0x0F} & set(rig.witness.words())
    winch.jog(pay_out=0.1, duration=0.2)


def test_a_restart_is_latched_and_commissioned_again_by_a_reset(rig: Rig, bench: Bench) -> None:
    winch = bench.winch["A"]
    winch.jog(pay_out=0.1, hold=1.0)
    rig.until(lambda: rig.state() == "OPERATION_ENABLED")
    rig.drive.inject("reboot")
    with pytest.raises(LimitTripped, match="reset"):
        winch.wait()
    rig.until(lambda: rig.state() == "SWITCH_ON_DISABLED")
    with pytest.raises(LimitTripped, match="latched"):
        winch.jog(pay_out=0.1)
    bench.reset()
    assert rig.drive.number(0x1A00) == 3
    winch.jog(pay_out=0.1, duration=0.2)
    assert not bench.snapshot.tripped


def test_the_end_of_the_loop_stops_the_drive(rig: Rig, bench: Bench) -> None:
    """The host's heartbeat comes from the control loop, and from nothing that outlives it."""
    bench.winch["A"].jog(pay_out=0.2, hold=1.0)
    rig.until(lambda: abs(rig.drive.see()["velocity"]) > 30)
    bench.loop.close()
    rig.until(lambda: rig.state() == "SWITCH_ON_DISABLED")
    assert abs(rig.drive.see()["velocity"]) < 0.05
