"""A small share of ``benchmarks/modbus_campaign.py``: libmodbus behind lines that fail."""

from __future__ import annotations

import argparse
import asyncio
import os
import shutil
from pathlib import Path
from typing import Any

import pytest

import modbus_campaign
from modbus_campaign import CASES, Judge, play
from modbus_peers.faulty_line import COPY_REQUESTS, FaultyLine
from winchkit.drivers.modbus.late_replies import LateReplies
from winchkit.drivers.modbus.tcp_frames import TcpAnswerGate
from winchkit.drivers.reading import InstrumentReading, Quality

pytestmark = [
    pytest.mark.skipif(os.name != "posix", reason="pseudo-terminals"),
    pytest.mark.skipif(
        not Path("/usr/include/modbus/modbus.h").is_file()
        or (shutil.which("gcc") or shutil.which("cc")) is None,
        reason="libmodbus is missing: apt-get install libmodbus-dev gcc",
    ),
]


@pytest.mark.realtime
def test_lines_that_fail_publish_no_wrong_number() -> None:
    """In real time, beside other tests: the line counts requests, so its lateness is no fault."""
    found: dict[str, Any] = play(3000, seed=11, share=0.1, seconds=10.0)
    assert found["wrong"] == []
    assert found["numbers"] > 200
    assert sum(found["faults"].values()) > 50
    for case in found["cases"]:
        assert case["numbers"] > 0, case


@pytest.mark.realtime
def test_the_campaign_sees_a_late_reply_that_is_taken_for_an_answer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Without the memory of outstanding replies and with one length there are wrong numbers."""
    monkeypatch.setattr(LateReplies, "unanswered", lambda _self, _count, _now: None)
    monkeypatch.setattr(LateReplies, "came", lambda _self, _count, _now: None)
    monkeypatch.setattr(LateReplies, "_lengths", lambda _self, b: range(b.count, b.count + 1))
    monkeypatch.setattr(TcpAnswerGate, "_holds_a_head", lambda *_: False)
    rtu = [case for case in CASES if case.kind == "rtu" and case.layout != "dsc"]
    found = play(4000, seed=12, share=0.3, seconds=8.0, cases=rtu)
    assert found["wrong_numbers"] != 0


@pytest.mark.parametrize(("late", "wrong"), [(0.0, 0), (0.004, 0), (0.02, 2), (5.0, 2)])
def test_the_judge_knows_a_number_by_its_age(late: float, wrong: int) -> None:
    """Asked for at 100 s, received 2 ms later, by a device that converts each 3 ms."""
    ticks = round((100.001 - late) / modbus_campaign.TICK) % modbus_campaign.MODULUS
    value = (modbus_campaign.OFFSET + ticks) * 0.01
    judge = Judge(CASES[0])
    judge(InstrumentReading(value, value, 0.0, Quality.GOOD, 100.0, 100.002, 99.9995, 0.0035))
    assert len(judge.wrong) == wrong


@pytest.mark.parametrize(("later", "copies"), [(0, 2), (COPY_REQUESTS, 2), (COPY_REQUESTS + 1, 1)])
def test_a_line_that_is_late_leaves_out_a_copy(later: int, copies: int) -> None:
    """So many requests were passed on meanwhile; no client can distinguish it."""
    options = argparse.Namespace(
        kind="rtu", share=1.0, timeout=0.03, latest=0.3, copy_within=1e-4, seed=1, without=()
    )
    sent: list[bytes] = []

    async def one_reply() -> FaultyLine:
        line = FaultyLine(options)
        line.faults = ["copy"]
        line.to_client = sent.append
        line.reply(b"reply")
        line.requests += later
        await asyncio.sleep(0.02)
        return line

    line = asyncio.run(one_reply())
    assert sent == [b"reply"] * copies
    assert line.done["copy left out"] == 2 - copies
