"""Motions through the real control loop with a fake drive, in simulated time; a drive's search."""

from __future__ import annotations

import math
from dataclasses import dataclass

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fake_axis import CYCLE, Rig, StraightLine
from winchkit.bench.control.cable import CableMap
from winchkit.bench.control.dead_man import DEAD_MAN, DeadMan
from winchkit.bench.control.homing_motion import HomingMotion
from winchkit.bench.control.motion import Jog, PlannedMove, Trim
from winchkit.bench.control.snapshot import Phase
from winchkit.drivers.can.cia402.modes import HomingState
from winchkit.drivers.can.cia402.state_machine import DriveState
from winchkit.errors import NotPermitted
from winchkit.schema.bench import LimitSpec

LIMITS = LimitSpec(0.5, 1.0, (0.5, 9.0))
ENERGISING = {0x06, 0x07}


def test_a_jog_without_refresh_ends_by_itself_and_disables() -> None:
    rig = Rig(LIMITS)
    rig.jog(0.1, DEAD_MAN)
    rig.run(0.15)
    assert rig.speeds[-1] == pytest.approx(0.1)
    rig.run(0.3)
    assert rig.axes["A"].velocity == 0
    assert rig.controller().phase is Phase.DISABLED
    assert rig.axes["A"].state is DriveState.SWITCH_ON_DISABLED
    moved = 4.0 - rig.cable().at(rig.axes["A"].angle)[0]
    assert 0 < moved <= 0.1 * (DEAD_MAN + 0.1)


def test_a_refreshed_jog_goes_on_and_its_speed_ramps() -> None:
    rig = Rig(LIMITS)
    source = rig.jog(0.3, DEAD_MAN)
    for _ in range(20):
        source.dead_man.refresh(rig.now, rig.now + DEAD_MAN)
        rig.run(0.1)
    assert rig.speeds[-1] == pytest.approx(0.3)
    changes = [abs(b - a) for a, b in zip(rig.speeds, rig.speeds[1:], strict=False)]
    assert max(changes) <= LIMITS.acceleration * CYCLE * 1.001


def test_a_jog_slows_down_before_a_length_limit() -> None:
    rig = Rig(LimitSpec(0.5, 1.0, (3.8, 9.0)))
    source = rig.jog(0.5, DEAD_MAN)
    for _ in range(20):
        source.dead_man.refresh(rig.now, rig.now + DEAD_MAN)
        rig.run(0.1)
    length = rig.cable().at(rig.axes["A"].angle)[0]
    assert 3.8 - 1e-3 <= length < 3.81
    assert not rig.supervisor.tripped


@given(
    cycles=st.lists(
        st.tuples(
            st.sampled_from([0.0, 0.0, 0.1, -0.1, 0.5, -0.7]),
            st.sampled_from([CYCLE, CYCLE, 0.0, 0.1, 0.3]),
            st.sampled_from([0.0, -900.0, -996.0, 690.0, 699.0, 900.0, math.nan]),
            st.booleans(),
        ),
        max_size=40,
    ),
    limited=st.booleans(),
)
def test_a_jog_commands_the_plain_formula(
    cycles: list[tuple[float, float, float, bool]], limited: bool
) -> None:
    """To the requested speed, within that from which it stops 2 mm before a limit, by the ramp."""
    limits = LimitSpec(0.5, 1.0, (0.5, 9.0) if limited else None)
    time, speed, before, over = 1.0, 0.0, None, False
    dead_man = DeadMan(2.0)
    source = Jog(CableMap(StraightLine()), limits, 0.0, dead_man)
    source.start(time, 0.0, 0.0)
    for wanted, step, angle, live in cycles:
        time += step
        source.request(wanted)
        if live and not over:
            dead_man.refresh(time, time + 1.0)
        else:
            dead_man.end("released")
        over = over or not live
        requested = 0.0 if over else max(-0.5, min(0.5, wanted))
        if limited:
            length = 4.0 - 0.005 * angle
            room = (length - 0.5 if requested > 0 else 9.0 - length) - 0.002
            room = room if room > 0.0 else 0.0
            most = math.sqrt(0.06**2 + 2 * room) - 0.06
            requested = math.copysign(min(abs(requested), most), requested)
        change = 0.0 if before is None else time - before
        speed += max(-change, min(change, requested - speed))
        before = time
        target = source.target(time, angle, time)
        assert target.winding_speed == pytest.approx(speed, abs=1e-12)
        assert target.velocity == pytest.approx(speed / 0.005, abs=1e-9)
        assert target.done is (over and target.winding_speed == 0.0)
        assert not target.start


@pytest.mark.parametrize("pays_out", [True, False])
@pytest.mark.parametrize(
    ("speed", "acceleration", "response", "lag"),
    [
        (0.45, 1.5, 0.06, 0.027),
        (0.45, 1.5, 0.06, 0.001),
        (0.1, 0.3, 0.06, 0.027),
        (1.0, 3.0, 0.1, 0.045),
        (1.0, 1.0, 0.2, 0.08),
        (0.6, 2.0, 0.02, 0.009),
    ],
)
def test_a_held_jog_stays_within_its_length_whatever_lag_is_declared(
    speed: float, acceleration: float, response: float, lag: float, pays_out: bool
) -> None:
    """Cases 172/91 and 172/148: at 0.45 m/s a lag of 27 ms ran past the limit, and tripped."""
    limits = LimitSpec(speed, acceleration, (3.0, 5.0), response_time=response)
    rig = Rig(limits)
    rig.axes["A"].lag = lag
    source = rig.jog(-speed if pays_out else speed, DEAD_MAN)
    lengths = []
    for _ in range(round((1.0 / speed + speed / acceleration + 1.0) / 0.1)):
        source.dead_man.refresh(rig.now, rig.now + DEAD_MAN)
        rig.run(0.1)
        lengths.append(4.0 - 0.005 * rig.axes["A"].angle)
    assert not rig.supervisor.tripped
    assert min(lengths) >= 3.0 - 1e-3
    assert max(lengths) <= 5.0 + 1e-3
    assert abs(lengths[-1] - (5.0 if pays_out else 3.0)) < 0.015, "it goes as far as it may"


@pytest.mark.parametrize("position_mode", [False, True])
@pytest.mark.parametrize("target", [3.0, 4.8, 4.0])
def test_a_move_arrives(target: float, position_mode: bool) -> None:
    rig = Rig(LIMITS)
    rig.axes["A"].position_mode = position_mode
    move = PlannedMove(StraightLine(), LIMITS, target, speed=0.4)
    move.prepare(0.0)
    rig.controller().begin(move)
    rig.run(move.duration + 1.2)
    length = 4.0 - 0.005 * rig.axes["A"].angle
    assert length == pytest.approx(target, abs=1e-3)
    assert max(map(abs, rig.speeds)) <= 0.5
    assert rig.controller().done
    assert rig.controller().phase is Phase.DISABLED


class SoftLine(StraightLine):
    """The same, and the cable is longer once the winch has come to where it was sent."""

    longer = 0.0

    def cable_length(self, motor_angle: float) -> float:
        return super().cable_length(motor_angle) + self.longer


@pytest.mark.parametrize("longer", [8e-3, -8e-3, 5e-5, 0.5])
def test_a_trim_corrects_what_the_cable_became_on_the_way(longer: float) -> None:
    """Small corrections at rest; what is within 0.1 mm, or beyond belief, is left alone."""
    rig, line = Rig(LIMITS), SoftLine()
    move = PlannedMove(line, LIMITS, 3.0, trim=Trim(CableMap(line), 3.0, LIMITS))
    move.prepare(0.0)
    rig.controller().begin(move)
    rig.run(move.duration / 2)
    line.longer = longer
    rig.run(move.duration / 2 + 4.0)
    left = 4.0 - 0.005 * rig.axes["A"].angle + longer - 3.0
    corrected = 1e-4 < abs(longer) < 0.1
    assert left == pytest.approx(0.0 if corrected else longer, abs=1.5e-4)
    assert rig.controller().phase is Phase.DISABLED
    changes = [abs(b - a) for a, b in zip(rig.speeds, rig.speeds[1:], strict=False)]
    assert max(changes) <= LIMITS.acceleration * CYCLE * 1.1


def test_a_held_move_stays_enabled_until_stopped() -> None:
    rig = Rig(LIMITS)
    move = PlannedMove(StraightLine(), LIMITS, 3.5, holds=True)
    move.prepare(0.0)
    rig.controller().begin(move)
    rig.run(move.duration + 2.0)
    assert rig.controller().done
    assert rig.axes["A"].state is DriveState.OPERATION_ENABLED
    rig.controller().run_down()
    rig.run(0.1)
    assert rig.controller().phase is Phase.DISABLED


def test_a_move_during_a_jog_waits_for_rest_and_no_speed_jumps() -> None:
    rig = Rig(LIMITS)
    rig.jog(0.3, hold=1.0)
    rig.run(0.5)
    move = PlannedMove(StraightLine(), LIMITS, 4.2)
    rig.controller().begin(move)
    rig.run(4.0)
    assert 4.0 - 0.005 * rig.axes["A"].angle == pytest.approx(4.2, abs=1e-3)
    changes = [abs(b - a) for a, b in zip(rig.speeds, rig.speeds[1:], strict=False)]
    assert max(changes) <= 0.02


@settings(max_examples=60, deadline=None)
@given(
    orders=st.lists(
        st.tuples(st.sampled_from(["jog", "stop", "run_down", "wait"]), st.floats(0.0, 0.3)),
        min_size=1,
        max_size=12,
    )
)
def test_after_a_stop_nothing_energises_whatever_came_before(
    orders: list[tuple[str, float]],
) -> None:
    rig = Rig(LIMITS)
    for order, duration in orders:
        if order == "jog":
            rig.jog(0.4, hold=0.5)
        elif order == "stop":
            rig.controller().stop()
        elif order == "run_down":
            rig.controller().run_down()
        rig.run(duration)
    axis = rig.axes["A"]
    rig.controller().stop()
    before = len(axis.words)
    rig.run(3.0)
    assert not ENERGISING & set(axis.words[before:])
    assert 0x0F not in axis.words[before:]
    assert axis.state is DriveState.SWITCH_ON_DISABLED
    assert rig.controller().phase is Phase.DISABLED


@settings(max_examples=40, deadline=None)
@given(moment=st.floats(0.0, 1.0))
def test_a_run_down_with_stale_feedback_becomes_a_quick_stop(moment: float) -> None:
    """0Fh is repeated during a ramp for five SYNCs without a status word, and then no more."""
    rig = Rig(LIMITS)
    rig.jog(0.5, hold=1.0)
    rig.run(moment)
    axis = rig.axes["A"]
    axis.alive = False
    rig.controller().run_down()
    rig.step(7)
    before = len(axis.words)
    rig.run(0.2)
    assert not {0x06, 0x07, 0x0F} & set(axis.words[before:])


@pytest.mark.parametrize("late", [0, 1, 3])
@pytest.mark.parametrize("speed", [0.02, 0.5])
@pytest.mark.parametrize("joins", [True, False])
def test_a_command_after_a_ramp_that_became_a_quick_stop_waits_for_the_stop(
    joins: bool, speed: float, late: int
) -> None:
    """A winch that is taken over answers late: the quick stop is the bench's own, and ends first.

    The drive receives the quick stop, and its answers are lost for ``late`` cycles more.
    """
    rig = Rig(LIMITS)
    rig.jog(speed, hold=1.0)
    rig.run(0.9)
    axis = rig.axes["A"]
    axis.alive = False
    rig.controller().run_down()
    rig.step(7)
    assert axis.words[-1] == 0x02
    axis.state = DriveState.QUICK_STOP_ACTIVE
    before = len(axis.words)
    length = rig.cable().at(axis.angle)[0]
    if joins:
        rig.jog(-0.1, hold=30.0)
    else:
        rig.controller().begin(
            PlannedMove(rig.cable(), rig.limits, length=length + 0.05, speed=0.1)
        )
    rig.step(late)
    axis.alive = True
    rig.run(8.0)
    assert not rig.supervisor.tripped
    words = axis.words[before:]
    assert 0x06 in words, "it is disabled and enabled again"
    assert 0x0F not in words[: words.index(0x06)], "no quick stop is revoked"
    if joins:
        assert rig.speeds[-1] == pytest.approx(-0.1), "the new command is carried out"
    else:
        assert rig.cable().at(axis.angle)[0] == pytest.approx(length + 0.05, abs=1e-3)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"length": 9.5}, "beyond the limits"),
        ({"length": 5.0, "speed": 0.6}, "limit of 0.5 m/s"),
        ({"length": 5.0, "acceleration": -1.0}, "limit of 1 m/s"),
        ({"length": math.nan}, "beyond the limits"),
    ],
)
def test_moves_beyond_the_limits_are_refused(arguments: dict[str, float], words: str) -> None:
    with pytest.raises(NotPermitted, match=words):
        PlannedMove(StraightLine(), LIMITS, **arguments)  # type: ignore[arg-type]


@settings(max_examples=80, deadline=None)
@given(pause=st.floats(0.0, 0.6), order=st.sampled_from(["expire", "stop", "run_down"]))
def test_a_new_press_moves_again_whenever_it_comes(pause: float, order: str) -> None:
    rig = Rig(LIMITS)
    rig.jog(0.1, hold=0.3)
    rig.run(0.25)
    if order == "stop":
        rig.controller().stop()
    elif order == "run_down":
        rig.controller().run_down()
    rig.run(pause)
    before = rig.axes["A"].angle
    rig.jog(0.1, hold=0.7)
    rig.run(0.5)
    assert rig.axes["A"].angle - before > 0.1 * 0.2 / 0.005
    rig.run(2.0)
    assert rig.controller().phase is Phase.DISABLED
    assert rig.controller().done


ARM = 0.005


@dataclass
class Searching:
    """A drive's word on its homing."""

    homing: HomingState = HomingState.RUNNING


def search(
    axis: Searching, farthest: float = math.inf, speed: float = 10.0, cycles: int = 400
) -> tuple[HomingMotion, int]:
    """Turn at a speed (rad/s) until it is over; the motion and the cycles that it took."""
    motion = HomingMotion(axis, CableMap(StraightLine()), farthest)
    motion.start(0.0, 0.0, 0.0)
    for cycle in range(1, cycles):
        target = motion.target(cycle * CYCLE, speed * cycle * CYCLE, 0.0)
        assert target.start, "bit 4 stays set"
        assert target.winding_speed == pytest.approx(speed * ARM)
        if target.done:
            return motion, cycle
    return motion, cycles


def test_a_homing_of_before_counts_only_after_a_while() -> None:
    motion, cycles = search(Searching(HomingState.DONE))
    assert not motion.failure
    assert 0.05 < cycles * CYCLE < 0.1


def test_a_drive_that_fails_is_accepted() -> None:
    motion, _ = search(Searching(HomingState.FAILED))
    assert "failed" in motion.failure


def test_a_search_that_finds_nothing_ends() -> None:
    motion, cycles = search(Searching(), farthest=0.03)
    assert "no zero was found" in motion.failure
    assert cycles * CYCLE * 10.0 * ARM == pytest.approx(0.03, abs=3e-4)


def test_a_search_without_limits_goes_on() -> None:
    motion, cycles = search(Searching())
    assert cycles == 400
    assert not motion.failure


@pytest.mark.parametrize("jump", [50.0, -1000.0])
def test_the_new_zero_is_no_motion(jump: float) -> None:
    axis = Searching()
    motion = HomingMotion(axis, CableMap(StraightLine()), 0.5)
    motion.start(0.0, 0.0, 0.0)
    motion.target(CYCLE, 0.01, 0.0)
    assert motion.target(2 * CYCLE, jump, 0.0).winding_speed == 0.0
    assert not motion.failure
