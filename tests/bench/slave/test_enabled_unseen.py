"""A drive that answers no SYNC, and that somebody enables meanwhile: its state is read by SDO.

A pre-operational drive processes no PDO and sends none, but it answers SDOs (CiA 301), so that
another master can enable it. The state of the drive is the slave's own, at every step of 1 ms.
"""

from __future__ import annotations

import pytest

from slave import State
from slave.held_key import jogging
from slave.rig import Rig

_FIRST_STOP = 0.15
"""The longest that a drive may be enabled without a command, s."""
_PRE_OPERATIONAL = ("pre-operational by a stranger", "goes pre-operational")


def longest_enabled(rig: Rig, begin: float) -> float:
    """Longest time without a break in operation enabled since ``begin``, s."""
    longest = 0.0
    since: float | None = None
    for sample in rig.samples[0]:
        if sample.time < begin:
            continue
        if sample.state is not State.ENABLED:
            since = None
            continue
        since = sample.time if since is None else since
        longest = max(longest, sample.time - since)
    return longest


@pytest.mark.parametrize("delay", [0.001, 0.03, 0.4])
@pytest.mark.parametrize("enabled_by", ["second master enables", "enables itself"])
@pytest.mark.parametrize("unseen", [*_PRE_OPERATIONAL, "tpdo lost"])
def test_a_drive_at_rest_that_answers_no_sync(
    rig: Rig, unseen: str, enabled_by: str, delay: float
) -> None:
    with rig.opened() as bench:
        rig.wait(0.2)
        rig.slaves[0].inject(unseen)
        rig.wait(delay)
        for _ in range(2):  # the second time after it was already stopped by SDO once
            begin = rig.time
            rig.slaves[0].inject(enabled_by)
            assert rig.slaves[0].power.state is State.ENABLED
            rig.wait(0.6)
            assert longest_enabled(rig, begin) < _FIRST_STOP
        assert bench.snapshot.tripped or bench.snapshot.blocked
        rig.slaves[0].mend_all()
        rig.wait(0.3)
        bench.reset()
        jogging(rig, bench).release()


@pytest.mark.parametrize("unseen", _PRE_OPERATIONAL)
def test_a_drive_that_went_pre_operational_in_motion(rig: Rig, unseen: str) -> None:
    with rig.opened() as bench:
        key = jogging(rig, bench)
        rig.slaves[0].inject(unseen)
        rig.wait(1.0)
        key.release()
        begin = rig.time
        rig.slaves[0].inject("second master enables")
        assert rig.slaves[0].power.state is State.ENABLED
        rig.wait(0.6)
        assert longest_enabled(rig, begin) < _FIRST_STOP


def requests_from_here(rig: Rig, begin: float, others: list[bytes]) -> list[bytes]:
    """SDO requests to the drive since ``begin`` that are not those of somebody else."""
    found = [f.data for time, f in rig.frames if time > begin and f.identifier == 0x601]
    for data in (*others, *others):  # they arrive at the drive and at the host
        found.remove(data)
    return found


def test_a_transfer_of_somebody_else_is_not_disturbed(rig: Rig) -> None:
    """A maker's tool writes a firmware to a pre-operational drive, beside an open bench."""
    with rig.opened():
        rig.wait(0.2)
        rig.slaves[0].inject("pre-operational by a stranger")
        rig.wait(0.3)
        begin, sent = rig.time, [bytes.fromhex("C2501F0100000100")]
        rig.from_stranger(0x601, sent[0])
        rig.wait(0.02)
        begun = len(requests_from_here(rig, begin, sent))
        assert begun <= 1, "one may have been under way"
        for number in range(1, 100):
            sent.append(bytes((number, *range(7))))
            rig.from_stranger(0x601, sent[-1])
            rig.wait(0.02)
        assert len(requests_from_here(rig, begin, sent)) == begun
        rig.wait(1.5)
        assert len(requests_from_here(rig, begin, sent)) > begun, "the state is read again"


def test_a_control_word_within_a_transfer_is_answered_by_a_quick_stop(rig: Rig) -> None:
    with rig.opened():
        rig.wait(0.2)
        rig.slaves[0].inject("pre-operational by a stranger")
        rig.wait(0.3)
        rig.from_stranger(0x601, bytes.fromhex("40001F0100000000"))
        rig.wait(0.1)
        begin = rig.time
        for word in (0x06, 0x07, 0x0F):
            rig.from_stranger(0x601, bytes((0x2B, 0x40, 0x60, 0x00, word, 0, 0, 0)))
        rig.until(lambda: rig.slaves[0].power.state is State.ENABLED, within=0.1)
        rig.wait(0.6)
        assert 0.0 < longest_enabled(rig, begin) < 0.02


def test_a_drive_that_answers_is_asked_nothing_by_sdo(rig: Rig) -> None:
    with rig.opened() as bench:
        key = jogging(rig, bench)
        begin = rig.time
        rig.wait(0.5)
        key.release()
        rig.wait(2.0)
        assert not bench.snapshot.tripped
        assert not [f for t, f in rig.frames if t > begin and f.identifier == 0x601]
