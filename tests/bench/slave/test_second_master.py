"""Commands that somebody else sends to a drive of the bench: heard on the bus, a latched trip.

What the drive makes of such a command may not show in its status word: our own next RPDO takes it
back within a cycle, or it is a target that counts from the next SYNC on.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from slave import Slave, State
from slave.held_key import jogging, observe, since
from slave.rig import CYCLE, Rig, bench_text
from slave.wire import GENERIC
from winchkit.errors import LimitTripped

_WITHIN = 0.15
"""Of the first stop, s."""
_TOLD = 0.06
"""A held key asks every 50 ms, s."""

Frame = tuple[int, bytes]


def write(index: int, value: int, size: int = 4, sub: int = 0, node: int = 1) -> Frame:
    """An expedited SDO download (CiA 301)."""
    head = bytes((0x23 | (4 - size) << 2, index & 0xFF, index >> 8, sub))
    return 0x600 + node, head + value.to_bytes(4, "little")


COMMANDS: dict[str, Frame] = {
    "6040h = 06h": write(0x6040, 0x06, 2),
    "6040h = 0Fh": write(0x6040, 0x0F, 2),
    "6060h = 3": write(0x6060, 3, 1),
    "6071h": write(0x6071, 0, 2),
    "607Ah": write(0x607A, 100),
    "60FFh": write(0x60FF, 0),
    "6081h": write(0x6081, 1000),
    "the host is watched no more": write(0x1016, 0, sub=1),
    "a maker's own object": write(0x2000, 1000),
    "segmented download": (0x601, bytes.fromhex("2140600004000000")),
    "block download": (0x601, bytes.fromhex("C2FF600004000000")),
    "RPDO 1": (0x201, bytes.fromhex("0600090000000000")),
    "NMT start": (0x000, bytes((0x01, 1))),
    "NMT stop": (0x000, bytes((0x02, 1))),
    "NMT pre-operational, all": (0x000, bytes((0x80, 0))),
    "NMT reset": (0x000, bytes((0x81, 1))),
    "heartbeat of the host": (0x77F, bytes((0x05,))),
}
HARMLESS: dict[str, Frame] = {
    "read 6041h": (0x601, bytes.fromhex("4041600000000000")),
    "read a segment": (0x601, bytes.fromhex("6000000000000000")),
    "block upload": (0x601, bytes.fromhex("A008100040000000")),
    "block upload begins": (0x601, bytes.fromhex("A300000000000000")),
    "abort": (0x601, bytes.fromhex("8041600000000405")),
    "too short": (0x601, bytes.fromhex("2B4060")),
    "write to another node": write(0x6040, 0x06, 2, node=2),
    "RPDO of another node": (0x202, bytes(8)),
    "NMT of another node": (0x000, bytes((0x02, 2))),
    "NMT, too short": (0x000, bytes((0x02,))),
    "heartbeat of another node": (0x702, b"\x05"),
}


def test_a_word_that_the_next_rpdo_takes_back_is_a_trip(rig: Rig) -> None:
    """The status word says operation enabled before and after: no cycle shows anything else."""
    with rig.opened() as bench:
        key = jogging(rig, bench)
        start = rig.time
        rig.from_stranger(*COMMANDS["6040h = 0Fh"])
        rig.wait(0.5)
        seen = observe(rig, key, start)
        assert "SDO write of 6040h of node 1" in seen.cause
        key.release()
    assert seen.left <= 3 * CYCLE


@pytest.mark.parametrize(("word", "named"), [(0x02, True), (0x06, False)])
def test_a_quick_stop_of_somebody_else_may_be_a_winchkit_stop(
    rig: Rig, word: int, named: bool
) -> None:
    """One that found no owner yet, while the bench was being opened."""
    with rig.opened() as bench:
        rig.from_stranger(*write(0x6040, word, 2))
        rig.until(lambda: bool(bench.snapshot.tripped), within=1.0)
        assert ("as of a `winchkit stop`" in str(bench.snapshot.tripped[0])) is named


@pytest.mark.slow
@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_of_somebody_else_is_a_latched_trip(rig: Rig, name: str) -> None:
    with rig.opened() as bench:
        key = jogging(rig, bench)
        start = rig.time
        rig.from_stranger(*COMMANDS[name])
        rig.wait(1.5)
        seen = observe(rig, key, start)
        assert "somebody else commands the drive" in seen.cause
        assert seen.told <= _TOLD
        assert bench.snapshot.tripped[0].kind == "second master"
        assert not since(rig, start + 1.0).moved
        key.release()
        bench.reset()
        rig.wait(1.0)
        again = rig.time
        fresh = jogging(rig, bench)
        assert since(rig, again).moved
        fresh.release()
        rig.wait(0.5)
    assert seen.left <= _WITHIN


def test_who_reads_or_speaks_to_others_is_let_be(rig: Rig) -> None:
    with rig.opened() as bench:
        key = jogging(rig, bench)
        for name, frame in HARMLESS.items():
            for _ in range(5):
                rig.from_stranger(*frame)
                rig.wait(0.02)
            rig.wait(0.2)
            assert not key.errors, name
            assert not bench.snapshot.tripped, name
            assert rig.slaves[0].power.state is State.ENABLED, name
        key.release()
        rig.wait(0.5)


def test_at_rest_it_is_a_trip_too_and_the_reset_sets_the_drive_up_anew(rig: Rig) -> None:
    objects = rig.slaves[0].objects
    with rig.opened() as bench:
        rig.wait(0.3)
        watched = objects.get(0x1016, 1)
        assert watched
        rig.from_stranger(*COMMANDS["the host is watched no more"])
        rig.wait(0.1)
        assert not objects.get(0x1016, 1)
        with pytest.raises(LimitTripped, match=r"SDO write of 1016h:1 of node 1"):
            bench.winch["A"].jog(pay_out=0.1)
        bench.reset()
        assert objects.get(0x1016, 1) == watched


def test_an_rpdo_that_cannot_be_switched_off_is_listened_to(tmp_path: Path) -> None:
    device = tmp_path / "fixed-rpdo"
    shutil.copytree(GENERIC.parent, device)
    eds = device / GENERIC.name
    text = eds.read_text(encoding="utf-8")
    head, place, rest = text.partition("[1402sub1]")
    rest = rest.replace("AccessType=rw", "AccessType=ro", 1)
    rest = rest.replace("$NODEID+0x80000400", "$NODEID+0x400", 1)
    eds.write_text(head + place + rest, encoding="utf-8")
    rig = Rig(tmp_path, [Slave.from_file(eds, 1)])
    with rig.opened(bench_text(rig.channel, device=str(device / "device.toml"))) as bench:
        key = jogging(rig, bench)
        start = rig.time
        rig.from_stranger(0x401, bytes(8))
        rig.wait(0.5)
        seen = observe(rig, key, start)
        assert "RPDO 3 to node 1" in seen.cause
        key.release()
    assert seen.left <= _WITHIN


def test_a_master_that_goes_on_keeps_a_reset_from_succeeding(rig: Rig) -> None:
    goes_on = True

    def send() -> None:
        if goes_on:
            rig.from_stranger(*COMMANDS["60FFh"])
            rig.clock.call_at(rig.time + 0.1, send)

    with rig.opened() as bench:
        send()
        rig.wait(0.3)
        with pytest.raises(LimitTripped, match=r"still blocked.*somebody else"):
            bench.reset()
        goes_on = False
        rig.wait(0.2)
        bench.reset()
        assert not bench.snapshot.tripped


def test_frames_of_two_benches_on_one_bus_are_those_of_their_own_drives(tmp_path: Path) -> None:
    """What is sent to the winch beside this one, by its own bench, is not a foreign command."""
    rig = Rig(tmp_path, [Slave.from_file(GENERIC, number) for number in (1, 2)])
    with rig.opened() as bench:
        jogging(rig, bench, winch="A")
        rig.from_stranger(*write(0x6040, 0x06, 2, node=2))
        rig.wait(0.1)
        (trip,) = bench.snapshot.tripped
        assert (trip.kind, trip.winch) == ("second master", "B")


def test_a_heartbeat_with_an_unknown_state_is_a_trip_and_ends_no_loop(rig: Rig) -> None:
    with rig.opened() as bench:
        rig.wait(0.3)
        rig.from_stranger(0x701, b"\x06")
        rig.wait(0.02)
        assert bench.loop.broken is None
        (trip,) = bench.snapshot.tripped
        assert trip.kind == "nmt"
        assert "state 06h" in str(trip)
