"""The table of modes against the standard's numbers, and each mode's own bits and targets."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hand_made import RPDO, SCALE, TPDO, HandMade, codec
from winchkit.drivers.can.cia402.command import SetPoint
from winchkit.drivers.can.cia402.modes import (
    MODES,
    HomingState,
    homing_state,
    mode_named,
    modes_of,
    status_words,
)
from winchkit.drivers.can.cia402.state_machine import RequestedState
from winchkit.errors import FileError, NotPermitted

ENABLED = 0x0237


@pytest.mark.parametrize(
    ("name", "number", "bit", "target"),
    [
        ("PP", 1, 0, (0x607A, 0)),
        ("PV", 3, 2, (0x60FF, 0)),
        ("PT", 4, 3, (0x6071, 0)),
        ("HM", 6, 5, None),
        ("IP", 7, 6, (0x60C1, 1)),
        ("CSP", 8, 7, (0x607A, 0)),
        ("CSV", 9, 8, (0x60FF, 0)),
        ("CST", 10, 9, (0x6071, 0)),
    ],
)
def test_numbers_of_the_standard(
    name: str, number: int, bit: int, target: tuple[int, int] | None
) -> None:
    row = MODES[name]
    assert (row.number, row.bit, row.target) == (number, bit, target)
    assert mode_named(number) == name


def test_supported_modes_are_the_bits_of_6502h() -> None:
    assert modes_of(0x3AD) == ("PP", "PV", "PT", "HM", "CSP", "CSV", "CST")
    assert modes_of(0b1100101) == ("PP", "PV", "HM", "IP")
    assert modes_of(0) == ()


def test_bits_mean_what_the_mode_says() -> None:
    assert status_words("PP", 0x3437) == (
        "target reached",
        "set-point acknowledged",
        "following error",
    )
    assert status_words("CSV", 0x3437) == ("follows the command",)
    assert status_words("PV", 0x18B7) == ("warning", "internal limit active", "speed zero")


@pytest.mark.parametrize(
    ("bits", "state"),
    [
        (0x0000, HomingState.RUNNING),
        (0x0400, HomingState.INTERRUPTED),
        (0x1000, HomingState.ATTAINED),
        (0x1400, HomingState.DONE),
        (0x2000, HomingState.FAILED_MOVING),
        (0x2400, HomingState.FAILED),
        (0x3400, HomingState.FAILED),
    ],
)
def test_homing_by_bits_13_12_and_10(bits: int, state: HomingState) -> None:
    assert homing_state(ENABLED | bits) is state
    assert state.over == (state in (HomingState.DONE, HomingState.FAILED))


def words_and_targets(frames: dict[int, bytes]) -> tuple[int, int, int]:
    """Control word, target velocity and target position of what was sent."""
    word, velocity = struct.unpack("<Hi", frames.get(0x201, b"\0" * 6))
    (position,) = struct.unpack("<i", frames.get(0x301, b"\0" * 4))
    return word, velocity, position


def test_targets_go_only_to_a_drive_that_is_enabled() -> None:
    """While it climbs it gets zero and its place, so that it starts from rest."""
    made = HandMade("CSP")
    for status, word in ((0x0250, 0x06), (0x0231, 0x07), (0x0233, 0x0F)):
        made.answer(status, angle=2.0, mode=8)
        made.axis.send(RequestedState.ENABLE, velocity=5.0, angle=9.0, torque=1.0)
        assert words_and_targets(made.sent()) == (word, 0, 2000)
    made.answer(ENABLED, angle=2.0, mode=8)
    made.axis.send(RequestedState.ENABLE, velocity=5.0, angle=9.0)
    assert words_and_targets(made.sent())[::2] == (0x0F, 9000)
    for requested in (
        RequestedState.DISABLE,
        RequestedState.STOP,
        RequestedState.HALT,
        RequestedState.RESET,
    ):
        made.answer(ENABLED, angle=3.0, mode=8)
        made.axis.send(requested, velocity=5.0, angle=9.0)
        assert words_and_targets(made.sent())[1:] == (0, 3000)


def test_halt_is_bit_8_of_an_enabled_drive_only() -> None:
    made = HandMade()
    made.enable()
    made.answer(ENABLED, velocity=3.0)
    assert made.axis.send(RequestedState.HALT) == 0x10F
    made.answer(0x0233)
    assert made.axis.send(RequestedState.HALT) == 0x02


@pytest.mark.parametrize("mode", ["PT", "CST"])
def test_torque_is_a_per_mille_of_the_rated_one(mode: str) -> None:
    made = HandMade(mode)
    made.answer(ENABLED, mode=MODES[mode].number)
    made.axis.send(RequestedState.ENABLE, torque=-2.5)
    target, offset = struct.unpack("<hh", made.sent()[0x401])
    assert target == round(-2.5 / SCALE.torque)
    assert offset == 0
    made.answer(ENABLED, mode=MODES[mode].number)
    made.axis.send(RequestedState.STOP, torque=-2.5)
    assert made.sent()[0x401] == bytes(4)


def test_torque_and_speed_are_fed_forward_where_they_are_mapped() -> None:
    made = HandMade("CSP", rpdo=(codec(1, 0x6040, 0x607A), codec(2, 0x60B1, 0x60B2)))
    made.answer(ENABLED, mode=8)
    made.axis.send(RequestedState.ENABLE, angle=1.0, velocity=0.5, torque=0.2)
    assert struct.unpack("<ih", made.sent()[0x301]) == (500, 20)


def test_interpolated_position_sets_bit_4_while_it_follows() -> None:
    made = HandMade("IP")
    assert made.axis.position_mode
    made.answer(ENABLED, mode=7, angle=1.0)
    assert made.axis.send(RequestedState.ENABLE, angle=1.5) == 0x1F
    assert struct.unpack("<i", made.sent()[0x501]) == (1500,)
    made.answer(ENABLED, mode=7, angle=1.0)
    assert made.axis.send(RequestedState.DISABLE) == 0x02


def test_homing_starts_by_bit_4_on_command() -> None:
    made = HandMade("HM", rpdo=(RPDO[0],))
    for start, word in ((False, 0x0F), (True, 0x1F), (True, 0x1F)):
        made.answer(ENABLED, mode=6)
        assert made.axis.send(RequestedState.ENABLE, start=start) == word
    made.answer(ENABLED | 0x1400, mode=6)
    assert made.axis.homing is HomingState.DONE
    made.answer(0x0233, mode=6)
    assert made.axis.send(RequestedState.ENABLE, start=True) == 0x0F


class ProfilePositioner:
    """A drive's side of the handshake: takes the target that stands at a rising bit 4.

    The control word comes in a PDO before that of the target, and acts first.
    """

    def __init__(self, delay: int) -> None:
        self.taken: list[int] = []
        self.acknowledges = False
        self._target = self._last = 0
        self._answers = [False] * delay

    def step(self, bits: int, target: int) -> int:
        if bits & 0x10 and not self._last & 0x10:
            self.taken.append(self._target)
        self.acknowledges = bool(bits & 0x10)
        self._last, self._target = bits, target
        self._answers.append(self.acknowledges)
        return 0x1000 if self._answers.pop(0) else 0


@given(
    targets=st.lists(st.integers(-1000, 1000), min_size=1, max_size=6),
    delay=st.integers(0, 3),
    patience=st.integers(12, 20),
)
def test_every_set_point_is_taken_once_and_whole(
    targets: list[int], delay: int, patience: int
) -> None:
    point, drive, status = SetPoint(), ProfilePositioner(delay), 0
    point.reset(0)
    for target in targets:
        for _ in range(patience):
            bits, offered = point.step(target, status)
            assert bits in (0, 0x30)
            status = drive.step(bits, offered)
    wanted = [b for a, b in zip([0, *targets], targets, strict=False) if a != b]
    assert drive.taken == wanted


def test_a_move_that_is_not_asked_for_is_not_made() -> None:
    """Enabling in PP offers no set-point until a target differs from where it stands."""
    made = HandMade("PP")
    made.answer(0x0233, angle=2.0, mode=1)
    made.axis.send(RequestedState.ENABLE)
    for noise in (0.0, 0.001, -0.001, 0.002):
        made.answer(ENABLED, angle=2.0 + noise, mode=1)
        assert made.axis.send(RequestedState.ENABLE) == 0x0F
    words = []
    for status in (ENABLED, ENABLED, ENABLED | 0x1000, ENABLED | 0x1000, ENABLED):
        made.answer(status, angle=2.0, mode=1)
        words.append(made.axis.send(RequestedState.ENABLE, angle=4.0))
        assert words_and_targets(made.sent())[2] == 4000
    assert words == [0x0F, 0x3F, 0x0F, 0x0F, 0x0F]


@pytest.mark.parametrize(
    ("mode", "rpdo", "words"),
    [
        ("CSV", (codec(1, 0x6040),), "lacks 60FFh, which CSV needs"),
        ("IP", (RPDO[0],), "lacks 60C1h:1, which IP needs"),
        ("CSP", (codec(1, 0x607A),), "lacks 6040h, which CSP needs"),
        ("CSV", (RPDO[0], codec(2, 0x6083)), "maps 6083h, which nothing fills"),
    ],
)
def test_mappings_that_cannot_carry_the_mode_are_refused(
    mode: str, rpdo: tuple[object, ...], words: str
) -> None:
    with pytest.raises(FileError, match=words):
        HandMade(mode, tpdo=TPDO, rpdo=rpdo)  # type: ignore[arg-type]


def test_a_mode_is_changed_only_while_the_drive_cannot_move() -> None:
    made = HandMade()
    made.answer(ENABLED)
    with pytest.raises(NotPermitted, match="while the drive is operation enabled and at rest"):
        made.axis.switch_mode("CSP")
    made.answer(0x0250, velocity=2.0)
    with pytest.raises(NotPermitted, match="switch on disabled and moving"):
        made.axis.switch_mode("CSP")
    assert made.axis.mode == "CSV"
    assert made.bus.sent == []


@pytest.mark.parametrize(("mode", "number"), [("PP", 1), ("HM", 6)])
def test_running_down_halts_a_motion_that_the_drive_makes_itself(mode: str, number: int) -> None:
    made = HandMade(mode)
    made.enable()
    for requested, word in (
        (RequestedState.RUN_DOWN, 0x10F),
        (RequestedState.STOP, 0x02),
        (RequestedState.DISABLE, 0x02),
    ):
        made.answer(ENABLED, velocity=2.0, mode=number)
        assert made.axis.send(requested, angle=5.0, start=True) == word


@pytest.mark.parametrize("requested", [RequestedState.RUN_DOWN, RequestedState.HALT])
def test_a_torque_cannot_be_run_down_so_it_is_a_quick_stop(requested: RequestedState) -> None:
    """At zero torque a hanging load would fall."""
    made = HandMade("CST")
    made.answer(ENABLED, velocity=2.0, mode=10)
    assert made.axis.send(requested, torque=1.0) == 0x02
