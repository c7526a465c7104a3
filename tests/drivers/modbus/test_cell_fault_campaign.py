"""Every device file with registers against every fault, in simulated time: never a wrong number."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from cell_campaign.case import FAULTS, Plan, modbus_devices, play, spec_of
from cell_faults import plans
from winchkit.drivers.counters import Counters
from winchkit.drivers.modbus.consistency import Consistency
from winchkit.drivers.modbus.decoder import RegisterDecoder
from winchkit.drivers.modbus.frames import AnswerGate
from winchkit.drivers.modbus.late_replies import LateReplies

DEVICES = modbus_devices()
LINES = [pytest.param(True, id="rtu"), pytest.param(False, id="tcp")]

RISES: dict[str, Callable[[Counters], int]] = {
    "late": lambda c: c.late,
    "short": lambda c: c.malformed,
    "wrong unit": lambda c: c.timeouts,
    "damaged": lambda c: c.crc + c.malformed + c.late + c.timeouts,
    "garbage": lambda c: c.resynchronised,
    "garbage behind": lambda c: c.resynchronised,
    "cut off": lambda c: c.malformed,
    "split": lambda c: c.readings,
    "twice": lambda c: c.late,
    "echo": lambda c: c.malformed,
    "only echo": lambda c: c.malformed,
    "silence": lambda c: c.timeouts,
    "exception": lambda c: c.exceptions,
    "unplug": lambda c: c.reconnects,
    "overload": lambda c: c.readings,
    "nan": lambda c: c.readings,
}
"""The counter that says what went wrong."""
ON_TCP: dict[str, Callable[[Counters], int]] = {
    "late": lambda c: c.timeouts and c.reconnects,
    "wrong unit": lambda c: c.malformed,
    "garbage": lambda c: c.malformed,
    "garbage behind": lambda c: c.malformed,
    "damaged": lambda c: c.malformed + c.timeouts,
}
"""After a timeout the connection is a new one, and a late answer is never heard; a frame that does
not begin where it should is no frame."""


def test_every_fault_has_its_counter() -> None:
    assert set(RISES) == set(FAULTS)


@pytest.mark.parametrize("rtu", LINES)
@pytest.mark.parametrize("device", DEVICES)
def test_each_fault_is_counted_and_reports_no_wrong_number(device: str, rtu: bool) -> None:
    modbus = spec_of(device).modbus
    share = 0.2 if modbus.status_read is None else 0.1
    for fault in FAULTS:
        outcome = play(Plan(device, rtu, f"{device}/{fault}", (fault,), share, seconds=4.0))
        assert outcome.wrong == [], fault
        if fault not in outcome.faults:
            continue
        rises = RISES[fault] if rtu else ON_TCP.get(fault, RISES[fault])
        assert rises(outcome.counters) > 0, (fault, outcome.counters)
        assert outcome.numbers > 0, fault
        assert outcome.bystander > 25, fault


@pytest.mark.parametrize("rtu", LINES)
def test_a_line_that_is_unplugged_is_read_again_within_a_second(rtu: bool) -> None:
    plan = Plan("laumas-tlb", rtu, "gap", ("unplug",), share=0.1, seconds=20.0)
    outcome = play(plan)
    assert outcome.counters.reconnects > 5
    assert 0.05 < outcome.longest_gap < 1.0


@pytest.mark.parametrize("rtu", LINES)
def test_a_dead_device_leaves_the_others_their_rates(rtu: bool) -> None:
    outcome = play(Plan("laumas-tlb", rtu, "dead", ("silence",), share=1.0, seconds=20.0))
    assert outcome.readings == 0
    assert outcome.bystander > 0.8 * 20 * 20
    assert outcome.longest_gap < 0.25


@pytest.mark.parametrize("device", [name for name in DEVICES if "temperature" not in name])
def test_an_overload_is_flagged_and_is_no_number(device: str) -> None:
    modbus = spec_of(device).modbus
    assert modbus is not None
    outcome = play(Plan(device, True, device, ("overload",), share=0.2, seconds=4.0))
    flag = "overload" if "overload" in modbus.status else "fault"
    assert outcome.flags[flag] > 0
    assert outcome.numbers < outcome.readings


@pytest.mark.parametrize("rtu", LINES)
@pytest.mark.parametrize("device", DEVICES)
def test_a_word_order_that_is_wrong_in_the_file_is_reported(device: str, rtu: bool) -> None:
    modbus = spec_of(device).modbus
    if all(item.type in ("u16", "i16") for item in modbus.field):
        pytest.skip("one register has no order of words")
    outcome = play(Plan(device, rtu, f"{device}/swap", (), seconds=4.0, swapped=True))
    assert outcome.readings > 30
    assert outcome.flags["mismatch"] == outcome.readings
    assert outcome.numbers == 0


@pytest.mark.parametrize("largest", [3, 15, 100])
@pytest.mark.parametrize("device", DEVICES)
def test_a_wrong_word_order_reports_no_number_of_an_empty_cell(device: str, largest: int) -> None:
    """Few counts with their words turned are many, and within what the device can show."""
    modbus = spec_of(device).modbus
    if any(item.type in ("u16", "i16", "f32") for item in modbus.field):
        pytest.skip("one register has no order of words; floats are told by themselves")
    plan = Plan(device, True, f"{device}/few", (), seconds=4.0, swapped=True, largest=largest)
    outcome = play(plan)
    assert [text for text in outcome.wrong if "never" in text] == [], "numbers that it never had"
    assert outcome.flags["mismatch"] > 0.8 * outcome.readings
    right = play(replace(plan, swapped=False))
    assert right.flags["mismatch"] == 0
    assert [text for text in right.wrong if "never" in text] == []
    assert right.numbers == right.readings > 60


def test_a_large_number_is_accepted_once_the_order_is_known() -> None:
    """655 363 counts turned are 196 618: either may be, until another number decides."""
    decoder = RegisterDecoder(spec_of("laumas-tlb"))
    told = {
        counts: decoder.word_order([0, *(counts >> 16, counts & 0xFFFF) * 2, 0, 0])
        for counts in (0, 7, 9_817, 196_618, 655_363, 999_999)
    }
    assert told == {0: None, 7: None, 9_817: True, 196_618: None, 655_363: False, 999_999: True}
    trust = Consistency(floats=False)
    assert trust.take(True, told[655_363]) is None
    assert trust.take(True, told[196_618]) is True
    assert trust.take(True, told[9_817]) is True
    assert trust.take(True, told[655_363]) is True


def test_random_sequences_give_no_wrong_number() -> None:
    """A small share of ``benchmarks/cell_faults.py --cases 10000``."""
    outcomes = [play(plan) for plan in plans(84, seed=2)]
    assert [o.wrong[0] for o in outcomes if o.wrong] == []
    assert sum(o.numbers for o in outcomes) > 800
    assert min(o.bystander for o in outcomes) > 25


def test_without_the_gate_there_are_wrong_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    """The campaign would notice: whatever decodes as an answer is let through here."""
    monkeypatch.setattr(AnswerGate, "received", lambda _self, data: data)
    monkeypatch.setattr(LateReplies, "unanswered", lambda _self, _count, _now: None)
    outcomes = [play(Plan("laumas-tlb", True, str(k), ("late",))) for k in range(3)]
    assert sum(len(o.wrong) for o in outcomes) > 0
