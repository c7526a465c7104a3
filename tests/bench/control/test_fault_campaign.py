"""The fault campaign in small: each case is judged from the truth, on both kinds of drives."""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest

import fault_campaign
from fault_cases.case import NOISE_KNOWN, Case, Planned, cases
from fault_cases.judge import judge
from fault_cases.kinds import KINDS
from fault_cases.play import play

CAMPAIGN = pytest.mark.campaign


def case(kind: str, **changes: object) -> Case:
    """A jog that one lasting fault meets."""
    first = KINDS[kind]
    plain = Case(
        seed="small/1",
        winches=1,
        motion="jog",
        speed=0.2,
        paying_out=first.moving == "out",
        faults=(Planned(kind, "A", 0.6, None),),
        resets_early=False,
    )
    return replace(plain, **changes)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("kind", "independent", "resets_early"),
    [
        ("enable input open", True, True),
        ("second master: 6040h = 00h", False, False),
        ("cell silent", False, True),
        ("counter reset", True, False),
        pytest.param("stranger: NMT pre-operational", True, False, marks=CAMPAIGN),
        pytest.param("computer stalls 0.5 s", True, False, marks=CAMPAIGN),
        pytest.param("exception in the loop", True, False, marks=CAMPAIGN),
        pytest.param("guarding polls lost", True, False, marks=CAMPAIGN),
        pytest.param("TPDOs lost", True, True, marks=CAMPAIGN),
        pytest.param("SYNC lost", False, False, marks=CAMPAIGN),
        pytest.param("cut wire", True, False, marks=CAMPAIGN),
        pytest.param("over-tension", False, False, marks=CAMPAIGN),
        pytest.param("released", True, False, marks=CAMPAIGN),
    ],
)
def test_a_fault_stops_the_winch_and_nothing_moves_again(
    kind: str, independent: bool, resets_early: bool
) -> None:
    verdict = judge(play(case(kind, independent=independent, resets_early=resets_early)))
    assert verdict.good, verdict


def test_a_winch_that_goes_on_is_found() -> None:
    """The judge does not depend on what winchkit says: here nothing must stop, and nothing does."""
    record = play(case("recorder fails"))
    assert judge(record).good
    blamed = replace(record.case, faults=(Planned("cut wire", "A", 0.6, None),))
    record.case = blamed
    record.onsets = [(blamed.faults[0], record.onsets[0][1])]
    verdict = judge(record)
    assert "followed set-points" in verdict.stopped
    assert "enabled" in verdict.moved_after_trip
    assert verdict.cause == "nothing was told"


def test_a_length_that_is_wrong_is_found() -> None:
    """A counter that begins anew makes it unknown; shown as known it would be a failure."""
    released = Planned("released", "A", 0.6, None)
    reset = Planned("counter reset at rest", "A", 1.6, None)
    record = play(case("counter reset at rest", faults=(released, reset), independent=True))
    assert judge(record).good, judge(record)
    shown, true = record.lengths["A"]
    assert math.isnan(shown)
    record.lengths["A"] = true + 0.011, true
    assert "is shown as known" in judge(record).length
    kept = play(case("recorder fails", independent=True)).lengths["A"]
    assert kept[0] == pytest.approx(kept[1], abs=1e-3)


@pytest.mark.parametrize("independent", [True, pytest.param(False, marks=CAMPAIGN)])
def test_a_frame_that_no_drive_receives_is_received_by_the_host(independent: bool) -> None:
    """A drive that is off the bus for 20 ms (case 172/138) stays operational; the host stops it."""
    kind = "stranger: NMT pre-operational"
    silence = Planned("drive silent", "A", 0.600, 0.02)
    for after, unheard in ((0.005, True), (0.05, False)):
        stranger = Planned(kind, "A", silence.at + after, None)
        record = play(case(kind, faults=(silence, stranger), independent=independent))
        assert (record.unheard == [stranger]) == unheard
        assert record.trips
        assert judge(record).good, judge(record)
        ends = [s.follows for s in record.truth["A"] if s.time < record.mended][-1]
        assert not ends, "the truth: it is stopped, by itself or by the host"


def test_a_drive_that_refuses_stops_by_sdo_is_not_taken_for_two_nodes() -> None:
    """Case 8123/35: its replies to the stops came beside those to the reset."""
    lost, refuses = Planned("SYNC lost", "A", 1.18, None), Planned("sdo refused", "A", 1.34, 0.3)
    both = case("SYNC lost", motion="move", speed=0.15, faults=(lost, refuses), independent=True)
    verdict = judge(play(replace(both, resets_early=True)))
    assert verdict.good, verdict
    assert verdict.recovered, verdict.refusal


def test_a_case_is_the_same_whenever_it_is_played() -> None:
    """With cells that lose connections, whose transactions start at a number of the loop's time."""
    again = case("cell: short", independent=True)
    first, second = play(again), play(again)
    assert first.truth == second.truth
    assert (first.trips, first.log_end) == (second.trips, second.log_end)


def test_processes_give_the_same_verdicts_in_the_same_order() -> None:
    found = [case("cut wire"), case("released")]
    alone, together = list(fault_campaign.each(found, 1)), list(fault_campaign.each(found, 2))
    assert [repr(item) for item in together] == [repr(item) for item in alone]
    assert [item[0] for item in together] == found


@pytest.mark.parametrize("rest", [0.2, NOISE_KNOWN])
def test_a_cell_that_freezes_as_the_load_touches_down_is_detected_by_its_known_noise(
    rest: float,
) -> None:
    slack, frozen = Planned("slack", "A", 0.6, None), Planned("cell frozen", "A", 0.67, None)
    record = play(case("slack", faults=(slack, frozen), rest=rest))
    assert judge(record).good, judge(record)
    known = rest == NOISE_KNOWN
    assert [kind for kind, _ in record.trips] == (["cell frozen"] if known else [])
    if known:
        assert record.tripped_at - record.onsets[1][1] < 0.15
        return
    record.case = replace(record.case, rest=NOISE_KNOWN)
    assert "followed set-points" in judge(record).stopped, "no exemption where the noise is known"


def test_after_a_motion_that_ended_before_the_condition_was_due_the_next_refusal_names_it() -> None:
    """A programme's move ends 0.36 s after the cell refuses; its reading is stale after 0.40 s."""
    refuses = Planned("cell refuses", "A", 1.0047, None)
    moves = case("cell refuses", motion="programme", speed=0.45, paying_out=True, faults=(refuses,))
    record = play(moves)
    assert judge(record).good, judge(record)
    assert not record.trips, "a condition latches where it forbids a motion under way"
    assert record.moved_again
    words = record.refused
    for wrong in ([], [(moment, "no reason") for moment, _ in words]):
        record.refused = wrong
        assert judge(record).cause == "nothing was told"


def test_a_drive_that_receives_no_stop_has_the_bound_of_the_fault_that_blocks_it() -> None:
    """The drive falls silent 7 ms before the trip of a wrong answer of its cell is due."""
    wrong, silent = (
        Planned("cell: wrong unit", "A", 0.449, None),
        Planned("drive silent", "A", 0.811, None),
    )
    record = play(case("cell: wrong unit", motion="move", speed=0.05, faults=(wrong, silent)))
    verdict = judge(record)
    assert verdict.good, verdict
    assert 0.43 < verdict.reaction < 0.362 + 0.15, "of the second fault's onset"
    record.onsets = record.onsets[:1]
    assert "followed set-points" in judge(record).stopped, "one fault has the first's bound"


@pytest.mark.parametrize(
    "words", [("--case", "203"), ("--case", "a/b"), ("--case", "1/-1"), ("--cases", "0")]
)
def test_a_wrong_argument_is_refused_in_words(
    words: tuple[str, str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["fault_campaign.py", *words])
    with pytest.raises(SystemExit) as ended:
        fault_campaign.main()
    assert ended.value.code == 2
    assert f"argument {words[0]}: '{words[1]}' is no " in capsys.readouterr().err


def running(group: int) -> int:
    """Processes of a group that have not ended."""
    number = 0
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            state, _, of_group = stat.read_text().rpartition(") ")[2].split()[:3]
            number += of_group == str(group) and state != "Z"
    return number


def reaches(group: int, low: int, high: int) -> bool:
    """Whether so many processes of a group run within 20 s."""
    for _ in range(400):
        if low <= running(group) <= high:
            return True
        time.sleep(0.05)
    return False


@pytest.mark.skipif(sys.platform != "linux", reason="counts processes in /proc")
def test_ctrl_c_ends_every_process() -> None:
    words = [sys.executable, fault_campaign.__file__, "--cases", "40", "--jobs", "2"]
    with subprocess.Popen(words, stderr=subprocess.PIPE, start_new_session=True) as campaign:
        try:
            assert reaches(campaign.pid, 3, 9), "it has begun its two processes"
            time.sleep(1.0)
            os.killpg(campaign.pid, signal.SIGINT)
            assert campaign.wait(20.0) == 130
            assert reaches(campaign.pid, 0, 0), "a process of the campaign goes on"
        finally:
            with suppress(ProcessLookupError):
                os.killpg(campaign.pid, signal.SIGKILL)


def test_the_same_seed_draws_the_same_cases() -> None:
    assert cases(50, 3) == cases(50, 3)
    assert cases(50, 3) != cases(50, 4)
    assert {c.faults[0].kind for c in cases(len(KINDS), 1)} <= set(KINDS)
    real = [c for c in cases(100, 1, real_time_share=0.05) if c.real_time]
    assert len(real) == 5
    assert all(KINDS[fault.kind].real_time for c in real for fault in c.faults)
