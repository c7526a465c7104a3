"""Each way to stop is used as soon as the one before is known not to be heard."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from winchkit.bench.control.stop_escalation import (
    STOP_TABLE,
    StopEscalation,
    StopEvidence,
    StopMethod,
)

CYCLE = 0.004
HEARD = StopEvidence(left=False, hears_pdos=True, hears_sdos=True)
LEFT = StopEvidence(left=True, hears_pdos=True, hears_sdos=True)


def when(seen: StopEvidence, *, nmt: bool = False, cycle: float = CYCLE) -> dict[StopMethod, float]:
    """The time of the first use of each method, with the same evidence in every cycle."""
    escalation, now, found = StopEscalation(), 0.0, {}
    escalation.begin(now, nmt=nmt)
    while now < 1.0:
        method = escalation.step(now, seen)
        if method is not None:
            found.setdefault(method, now)
        now += cycle
    return found


def test_a_drive_that_leaves_ends_the_escalation() -> None:
    escalation = StopEscalation()
    escalation.begin(0.0)
    assert escalation.step(0.0, HEARD) is StopMethod.PDO
    assert escalation.step(CYCLE, LEFT) is None
    assert escalation.method is None


def test_a_drive_that_answers_and_stays_enabled_gets_sdo_after_four_answers() -> None:
    found = when(HEARD)
    assert found[StopMethod.PDO] == 0.0
    assert 4 * CYCLE <= found[StopMethod.SDO] <= 6 * CYCLE
    assert found[StopMethod.SILENCE] - found[StopMethod.SDO] <= 0.03
    assert StopMethod.NMT not in found


def test_a_drive_out_of_operational_gets_sdo_at_once() -> None:
    assert when(StopEvidence(False, hears_pdos=False, hears_sdos=True))[StopMethod.SDO] == 0.0


def test_a_stopped_drive_is_left_to_silence_at_once() -> None:
    seen = StopEvidence(False, hears_pdos=False, hears_sdos=False)
    assert when(seen)[StopMethod.SILENCE] == 0.0
    assert when(seen, nmt=True)[StopMethod.NMT] == 0.0


def test_nmt_stop_is_only_for_drives_that_were_seen_to_stop_on_it() -> None:
    assert StopMethod.NMT in when(HEARD, nmt=True)
    assert StopMethod.NMT not in when(HEARD, nmt=False)


@given(cycle=st.sampled_from([0.001, 0.002, 0.004, 0.01, 0.02]), nmt=st.booleans())
def test_silence_comes_within_a_time_that_leaves_room_for_the_watchdog(
    cycle: float, nmt: bool
) -> None:
    found = when(HEARD, nmt=nmt, cycle=cycle)
    order = sorted(found, key=lambda method: found[method])
    assert order == sorted(order)
    longest = sum(row.timeout + (row.syncs + 2) * cycle for row in STOP_TABLE)
    assert found[StopMethod.SILENCE] <= longest
