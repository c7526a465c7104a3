"""The line in simulated time: polls, late answers, silence, commands, unplugging."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import pytest

from stream_rig import DEVICES, TIMEOUT, Rig, device
from winchkit.drivers.reading import InstrumentReading, Quality
from winchkit.drivers.stream.line import StreamLine
from winchkit.errors import ConnectionLost, DeviceRefused, FileError, NoReply, NotPermitted

RAMP = 0.5
"""Of the truth, N/s."""
TARED = ("hbm-aed-ascii", "hbm-aed-binary", "flintec-ldu", "and-ad-4406", "mettler-mt-sics")
ANSWERING = (*TARED, "sartorius-sbi")
POLLED = (
    "mantracourt-dsc-ascii",
    "hbm-aed-binary",
    "flintec-ldu",
    "mettler-mt-sics",
    "sartorius-sbi",
)


def ramp(time: float) -> float:
    return RAMP * (time - 90.0)


def resolution(name: str) -> float:
    """One digit of the simulated device in N, and what half of it is worth in time."""
    return {"and-ad-4406": 0.099, "mettler-mt-sics": 1e-4, "sartorius-sbi": 1e-4}.get(name, 0.1)


def true_when_sampled(name: str, readings: list[InstrumentReading]) -> bool:
    """Whether every usable reading is the truth at a moment within its uncertainty."""
    return all(
        abs(one.value - ramp(one.t_sample))
        <= resolution(name) / 2 + RAMP * (one.t_uncertainty + 2e-3)
        for one in readings
        if one.quality.usable
    )


@pytest.mark.parametrize("name", DEVICES)
def test_every_device_gives_the_truth_at_the_moment_it_names(name: str) -> None:
    rig = Rig(device(name), truth=ramp)
    rig.run(1.0)
    readings = rig.run(3.0)
    assert len(readings) == pytest.approx(3.0 / rig.instrument.period, abs=2)
    assert all(one.quality.usable for one in readings)
    assert true_when_sampled(name, readings)
    counters = rig.instrument.counters
    assert (counters.timeouts, counters.crc, counters.malformed, counters.late) == (0, 0, 0, 0)


@pytest.mark.slow
@pytest.mark.parametrize("name", DEVICES)
def test_silence_is_a_problem_and_ends_by_itself(name: str) -> None:
    rig = Rig(device(name))
    rig.run(1.0)
    rig.sim.inject("silence")
    assert rig.run(4.0) == []
    assert isinstance(rig.instrument.problem, NoReply)
    assert "check power, wiring, baud rate and address" in str(rig.instrument.problem)
    assert rig.instrument.counters.timeouts >= 2
    rig.sim.inject("recover")
    assert len(rig.run(3.0)) > 5
    assert rig.instrument.problem is None


def test_damage_on_the_line_is_distinguished_from_silence() -> None:
    rig = Rig(device("laumas-tlb-ascii"))
    rig.run(1.0)
    rig.sim.inject("bad checksum")
    assert rig.run(4.0) == []
    assert "answers with a wrong check sum" in str(rig.instrument.problem)


@pytest.mark.parametrize("name", POLLED)
def test_a_late_answer_is_never_taken_for_the_next(name: str) -> None:
    """Twice the longest reply is later than the time-out here, so every answer comes late."""
    rig = Rig(device(name, longest_reply=0.3), truth=ramp)
    rig.run(1.0)
    rig.sim.reply_delay = 0.25
    rig.sim.inject("late reply")
    late = rig.run(5.0)
    rig.sim.inject("recover")
    after = rig.run(2.0)
    assert late == []
    assert after
    assert true_when_sampled(name, after)
    assert rig.instrument.counters.timeouts > 2
    assert rig.instrument.counters.late > 2


def test_a_late_answer_within_the_time_out_is_flagged() -> None:
    rig = Rig(device("flintec-ldu"), truth=ramp)
    rig.run(0.5)
    rig.sim.reply_delay = 0.1
    rig.sim.inject("late reply")
    late = rig.run(1.0)
    assert len(late) > 3
    assert all(Quality.LATE in one.quality for one in late)
    assert true_when_sampled("flintec-ldu", late)
    assert all(one.t_uncertainty > 0.04 for one in late)


def test_mantracourt_takes_every_sample_exactly_once() -> None:
    """50 conversions a second, asked 100 times: by OLDVAL each is read once, none twice."""
    rig = Rig(device("mantracourt-dsc-ascii", rate=50.0), truth=ramp)
    rig.run(0.5)
    readings = rig.run(2.0)
    values = [one.value for one in readings]
    assert len(values) == pytest.approx(100, abs=2)
    steps = [after - before for before, after in pairwise(values)]
    assert steps == pytest.approx([RAMP / 50] * len(steps), abs=1.1e-3)
    assert rig.instrument.counters.duplicates == 0


def test_a_line_of_three_is_polled_fairly_and_each_by_its_address() -> None:
    rig = Rig(*[device("flintec-ldu")] * 3, truth=ramp)
    rig.run(2.0)
    counts = [one.counters.readings for one in rig.instruments]
    assert min(counts) > 0.9 * max(counts) > 0
    assert b"OP 1\r\n" in rig.sent
    assert b"OP 3\r\n" in rig.sent


def test_a_dead_device_leaves_the_others_their_rates() -> None:
    rig = Rig(*[device("mantracourt-dsc-ascii")] * 3)
    rig.simulated[1].inject("silence")
    rig.run(10.0)
    alive, dead, other = (one.counters for one in rig.instruments)
    assert dead.readings == 0
    # Each attempt takes the time-out, the next comes half a second later.
    expected = 100 * 10 * 0.5 / (0.5 + TIMEOUT)
    assert min(alive.readings, other.readings) > 0.8 * expected
    assert isinstance(rig.instruments[1].problem, NoReply)


@pytest.mark.parametrize("name", TARED)
def test_a_tare_is_answered_and_the_value_becomes_net(name: str) -> None:
    rig = Rig(device(name))
    rig.run(1.0)
    rig.command("tare")
    after = rig.run(2.0)
    assert after
    assert [one.value for one in after] == pytest.approx([0.0] * len(after), abs=0.05)


def test_a_device_that_says_so_is_known_to_be_tared() -> None:
    rig = Rig(device("and-ad-4406"))
    rig.run(1.0)
    assert rig.instrument.tared is False
    rig.command("tare")
    assert rig.instrument.tared is True
    rig.command("gross")
    assert rig.instrument.tared is False


@pytest.mark.parametrize("name", TARED)
def test_a_refused_command_is_an_error_that_quotes_the_answer(name: str) -> None:
    rig = Rig(device(name))
    rig.run(1.0)
    rig.sim.inject("refusal")
    with pytest.raises(DeviceRefused, match="it answers '"):
        rig.command("tare")
    rig.sim.inject("recover")
    assert rig.run(2.0)


@pytest.mark.parametrize("name", TARED)
def test_a_command_without_an_answer_is_an_error(name: str) -> None:
    rig = Rig(device(name))
    rig.run(1.0)
    rig.sim.inject("silence")
    with pytest.raises(NoReply):
        rig.command("tare")


def test_an_unknown_command_names_those_there_are() -> None:
    rig = Rig(device("flintec-ldu"))
    with pytest.raises(NotPermitted, match="'span'; its device file has tare, gross, zero"):
        rig.command("span")


@pytest.mark.parametrize("name", DEVICES)
def test_unplugged_and_plugged_in_again_within_a_second(name: str) -> None:
    rig = Rig(device(name), truth=ramp)
    rig.run(1.0)

    def plug(there: bool) -> Callable[[], None]:
        return lambda: setattr(rig, "plugged", there)

    rig.at(0.5, plug(there=False))
    rig.at(2.0, plug(there=True))
    start = rig.clock.time
    readings = rig.run(4.0)
    gap = [one.t_receive - start for one in readings if one.t_receive - start > 0.7]
    assert 2.0 < gap[0] < 3.0
    assert true_when_sampled(name, readings)
    assert rig.instrument.counters.reconnects >= 1
    assert rig.instrument.problem is None


def test_a_line_that_never_falls_silent_is_no_reason_to_hang() -> None:
    """A device that babbles without end: no reading, a reason, and the line goes on."""
    rig = Rig(device("mettler-mt-sics"), wire=lambda data: data)
    rig.run(1.0)
    babble = rig.output

    def endless() -> bytes:
        rig.clock.time += 1e-3
        rig.step(rig.clock.time)
        return b"\xff" * 7

    rig.output = endless  # type: ignore[method-assign]
    assert rig.run(5.0) == []
    assert isinstance(rig.instrument.problem, NoReply)
    rig.output = babble  # type: ignore[method-assign]
    assert rig.run(2.0)


def test_while_unplugged_the_reason_is_known_and_a_command_says_it() -> None:
    rig = Rig(device("flintec-ldu"))
    rig.plugged = False
    rig.run(1.0)
    assert isinstance(rig.instrument.problem, ConnectionLost)
    with pytest.raises(ConnectionLost, match="no such port"):
        rig.command("tare")


@pytest.mark.parametrize(
    ("kind", "flag"), [("overload", Quality.OVERLOAD), ("sensor break", Quality.FAULT)]
)
@pytest.mark.parametrize("name", DEVICES)
def test_alarms_are_flagged_and_no_number(name: str, kind: str, flag: Quality) -> None:
    rig = Rig(device(name))
    rig.run(1.0)
    rig.sim.inject(kind)
    rig.run(0.5)
    readings = rig.run(2.0)
    assert all(math.isnan(one.value) for one in readings)
    assert all(not one.quality.usable for one in readings)
    if name == "laumas-tlb-ascii":
        assert all(flag in one.quality for one in readings)


def test_an_instrument_that_sends_by_itself_must_be_alone() -> None:
    with pytest.raises(FileError, match="must be alone on its line"):
        Rig(device("laumas-tlb-ascii"), device("flintec-ldu"))


def test_a_power_cycled_device_gets_its_start_command_again() -> None:
    rig = Rig(device("hbm-aed-ascii"))
    rig.run(1.0)
    before = rig.sent.count(b"MSV?0;")
    rig.sim.receive(b"STP;", rig.clock.time)
    readings = rig.run(3.0)
    assert readings
    assert rig.sent.count(b"MSV?0;") == before + 1


def test_an_instrument_that_sends_gets_its_stop_command_at_the_end() -> None:
    rig = Rig(device("hbm-aed-ascii"))
    rig.run(0.5)
    rig.line.close()
    assert rig.sent[-1] == b"STP;"


def test_the_makers_setting_is_named_where_nothing_answers() -> None:
    rig = Rig(device("flintec-ldu"))
    rig.sim.inject("silence")
    rig.run(1.0)
    assert "at 115200 8N1 (its maker's setting is 9600 8N1)" in str(rig.instrument.problem)


def test_the_rig_serves_the_line_that_ships() -> None:
    assert isinstance(Rig(device("flintec-ldu")).line, StreamLine)
    assert len(ANSWERING) + 5 == len(DEVICES)
