"""Causes in messages, each provoked on the independent slave."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from slave.held_key import HeldKey
from slave.rig import Rig, bench_text
from slave_bench import served, write_bench
from winchkit.bench.bench import Bench
from winchkit.errors import DeviceRefused, NoReply, NotPermitted


def _first_trip(rig: Rig, bench: Bench) -> str:
    key = HeldKey(rig, bench).press()
    rig.until(lambda: bool(bench.snapshot.tripped), within=3.0)
    key.release()
    return str(bench.snapshot.tripped[0])


@pytest.mark.parametrize("factor", [-1.0, -0.5])
def test_a_reversed_motor_is_called_one(rig: Rig, factor: float) -> None:
    with rig.opened() as bench:
        rig.slaves[0].inject("follows wrongly", factor)
        said = _first_trip(rig, bench)
    assert "the motor turns against its command" in said
    assert "reversed" in said
    assert "slow down" not in said


@pytest.mark.parametrize(
    ("fault", "value", "said"),
    [
        ("driven by its load", 7.0, "the motor turns against its command"),
        ("follows wrongly", 0.2, "the motor does not turn as commanded"),
    ],
)
def test_a_motion_that_is_missing_is_called_what_it_is(
    rig: Rig, fault: str, value: float, said: str
) -> None:
    with rig.opened() as bench:
        key = HeldKey(rig, bench, pay_out=0.02).press()
        rig.wait(1.5)
        rig.slaves[0].inject(fault, value)
        rig.until(lambda: bool(bench.snapshot.tripped), within=5.0)
        key.release()
        assert said in str(bench.snapshot.tripped[0])


def test_a_drive_that_keeps_its_speed_is_not_called_reversed(rig: Rig) -> None:
    with rig.opened() as bench:
        key = HeldKey(rig, bench).press()
        rig.wait(1.0)
        rig.slaves[0].inject("rpdo unheard")
        key.release()
        rig.until(lambda: bool(bench.snapshot.tripped), within=3.0)
        said = str(bench.snapshot.tripped[0])
    assert "does not slow down as commanded" in said
    assert "reversed" not in said


@pytest.mark.parametrize(
    ("mechanism", "said", "not_said"),
    [
        ("heartbeat", "the drive's heartbeat is gone", "guarding"),
        ("guarding", "does not answer node guarding", "heartbeat"),
    ],
)
def test_what_is_missing_of_a_drive_is_what_supervises_it(
    tmp_path: Path, mechanism: str, said: str, not_said: str
) -> None:
    with served(write_bench(tmp_path, host_loss=mechanism)) as bench, bench.open() as opened:
        bench.slave.inject("heartbeat lost")
        found = _first_trip(bench.rig, opened)
    assert said in found
    assert not_said not in found


def test_two_nodes_with_one_number_do_not_open(rig: Rig) -> None:
    rig.wait(0.3)
    slave = rig.slaves[0]
    slave.inject("two nodes with one number")
    with pytest.raises(DeviceRefused, match=r"node 1: two nodes have this number: \d+ requests"):
        rig.open()
    assert slave.network.state.name == "PRE_OPERATIONAL", "no PDO of either is in use"
    slave.mend_all()
    with rig.opened() as bench:
        bench.winch["A"].move_by(pay_out=0.01)


def test_two_nodes_of_which_one_is_slow_are_no_missing_answer(rig: Rig) -> None:
    """The second answer comes after the next request: the client takes it for that request's."""
    rig.wait(0.3)
    slave = rig.slaves[0]
    slave.inject("two nodes with one number")
    slave.twin.inject("sdo delayed", 0.003)
    with pytest.raises(DeviceRefused, match="two nodes have this number"):
        rig.open()


def test_a_dead_drive_is_no_second_node(rig: Rig) -> None:
    rig.slaves[0].inject("sdo unheard")
    with pytest.raises(NoReply, match="check power, wiring, bit rate and node id"):
        rig.open()


@pytest.mark.parametrize("known", [0, None])
def test_a_mode_that_only_the_device_file_leaves_out(tmp_path: Path, known: int | None) -> None:
    """6502h is absent or 0: what the drive has is not known, and the message does not say it is."""
    path = write_bench(tmp_path)
    with served(path) as bench:
        text = bench.device.read_text()
        bench.device.write_text(re.sub(r"modes = \[.*?\]", 'modes = ["CSV"]', text, flags=re.S))
        if known is None:
            bench.slave.objects.remove(0x6502)
        else:
            bench.slave.objects.set(0x6502, 0, known)
        with bench.open() as opened, pytest.raises(NotPermitted) as refused:
            opened.winch["A"].home(35)
    said = str(refused.value)
    assert "its device file does not list HM" in said
    assert "the drive has no mode" not in said


def test_a_mode_that_the_drive_itself_lacks(tmp_path: Path) -> None:
    with served(write_bench(tmp_path)) as bench:
        supported = bench.slave.objects.get(0x6502, 0)
        bench.slave.objects.set(0x6502, 0, supported & ~(1 << 5))
        with bench.open() as opened, pytest.raises(NotPermitted, match="the drive has no mode HM"):
            opened.winch["A"].home(35)


def test_a_slow_opening_says_what_it_waits_for(
    rig: Rig, capsys: pytest.CaptureFixture[str]
) -> None:
    rig.wait(0.3)
    rig.slaves[0].inject("sdo delayed", 0.3)
    begun = rig.time
    with rig.opened():
        took = rig.time - begun
    assert took > 20.0
    lines = re.findall(r"winch A .*: setting up drive 1 of 1: (\d+) SDO", capsys.readouterr().err)
    assert len(lines) >= int(took / 6.0), "a line every 5 s, and one answer later"
    rig.slaves[0].mend_all()
    with rig.opened():
        pass
    assert "setting up" not in capsys.readouterr().err, "a quick opening says nothing"


def test_an_answer_that_is_too_late_is_called_late_and_the_file_says_how_long(
    rig: Rig,
) -> None:
    rig.wait(0.3)
    rig.slaves[0].inject("sdo delayed", 0.7)
    text = bench_text(rig.channel)
    words = (
        r'no answer within 0\.5 s; it came after 0\.7 s: set sdo_timeout in \[bus\.can\] .*"1\.4 s"'
    )
    with pytest.raises(NoReply, match=words):
        rig.open(text)
    rig.wait(2.0)
    with rig.opened(text.replace("heartbeat =", 'sdo_timeout = "1.4 s"\nheartbeat =')) as bench:
        rig.slaves[0].mend_all()
        bench.winch["A"].move_by(pay_out=0.01)


def test_a_drive_that_has_not_answered_yet_may_be_slow(rig: Rig) -> None:
    rig.wait(0.3)
    rig.slaves[0].inject("sdo delayed", 30.0)
    words = r"check power, .*, and for a slow drive set sdo_timeout in \[bus\.can\]"
    with pytest.raises(NoReply, match=rf"no answer within 0\.5 s; {words}"):
        rig.open()


STRAYS = {
    "write of 6040h": "6040600000000000",
    "write of the same object": "607C600000000000",
    "read of 6041h": "4B41600037060000",
    "abort of 6040h": "8040600022000008",
}


@pytest.mark.parametrize("stray", STRAYS)
@pytest.mark.parametrize("after", [0.005, 0.02])
def test_a_transfer_takes_its_own_reply_only(rig: Rig, stray: str, after: float) -> None:
    with rig.opened() as bench:
        node = bench.axes["A"].objects
        node.write(0x607C, 0, 4711)
        rig.slaves[0].inject("sdo delayed", 0.03)
        frame = bytes.fromhex(STRAYS[stray])
        rig.clock.call_at(rig.time + after, lambda: rig.from_stranger(0x581, frame))
        assert node.read(0x607C) == 4711
        rig.clock.call_at(rig.time + after, lambda: rig.from_stranger(0x581, frame))
        if stray != "write of the same object":  # which is its own
            node.write(0x607C, 0, 12)
            assert node.read(0x607C) == 12
        assert not bench.snapshot.tripped
