"""``known`` makes a WinchInput by position: every value stands in the field of its name."""

from __future__ import annotations

import math
from types import SimpleNamespace as Made
from typing import Any

import pytest

from winchkit.bench.control.conditions import CONDITIONS, Condition
from winchkit.bench.control.observation import FACTS, WinchInput, facts_of
from winchkit.bench.control.snapshot import Phase
from winchkit.bench.control.winch_state import known
from winchkit.drivers.can.cia402.state_machine import DriveState

NOW = 100.0
RESUMED = 1.0
CELL, LENGTH = (
    Made(value=7.0, received=99.9, max_age=1.0),
    Made(value=4.5, received=99.9, max_age=1.0),
)
SENSORS = {"cell": CELL, "length": LENGTH}


def parts(*, faulty: bool) -> Any:
    """A winch whose parts answer with values that no other part has."""
    state = DriveState.FAULT if faulty else DriveState.OPERATION_ENABLED
    feedback = Made(angle=3.0, velocity=2.0, time=99.5, sync=8, state=state)
    axis = Made(
        feedback=feedback,
        heartbeat=Made(
            missing="gone", lost=lambda now, resumed: (now, resumed) == (NOW, RESUMED), boot_ups=11
        ),
        operational=faulty,
        mode_kept="mode kept",
        fault_text="fault text",
        nmt_text="NMT text",
        second_master=Made(heard="second master"),
        position_doubt="",
        position_jump="position jump",
        position=Made(disagreement="disagreement"),
        alarms=(0x4210,),
        emergencies=Made(standing="alarm text"),
    )
    controller = Made(
        phase=Phase.DISABLED if faulty else Phase.MOVING,
        follows=True,
        commanded=0.25,
        tracking=lambda angle, arm: (10 * angle, 10 * arm),
        way=lambda angle, arm: ("way", angle, arm),
        take_uncommanded=lambda: "uncommanded",
    )
    return Made(
        axis=axis,
        controller=controller,
        cable=Made(has_effects=False, at=lambda angle: (angle + 1.0, 0.5)),
        capacity=(-math.inf, math.inf),
        frozen=Made(unstable="unstable", update=lambda *_, **__: "frozen"),
        sensors={"cell": Made(latest=None)},
        load=Made(tension=lambda *_: 0.0),
        instruments=lambda _resumed: SENSORS,
    )


@pytest.mark.parametrize("faulty", [False, True])
def test_every_value_stands_in_the_field_of_its_name(faulty: bool) -> None:
    winch = parts(faulty=faulty)
    found = known(winch, NOW, sync=10, resumed=RESUMED)
    expected = {
        "feedback_age": 0.5,
        "missed_syncs": 1,
        "heartbeat_lost": "gone",
        "boot_ups": 11,
        "operational": faulty,
        "mode_kept": "mode kept",
        "fault": "fault text" if faulty else "",
        "winding_speed": 1.0,
        "commanded": 0.25,
        "cable_length": 4.0,
        "moving": not faulty,
        "tension": CELL,
        "nmt": "" if faulty else "NMT text",
        "uncommanded": "uncommanded",
        "second_master": "second master",
        "disabled": faulty,
        "follows": True,
        "target_speed": 30.0,
        "following_error": 5.0,
        "way": ("way", 3.0, 0.5),
        "length": 4.5,
        "emergencies": () if faulty else (0x4210,),
        "emergency_text": "" if faulty else "alarm text",
        "unstable": "unstable",
        "frozen": "frozen",
        "length_doubt": "",
        "position_jump": "position jump",
        "position_disagreement": "disagreement",
        "sensors": SENSORS,
        "now": NOW,
        "feedback": winch.axis.feedback,
    }
    assert found._asdict() == expected
    assert tuple(expected) == WinchInput._fields
    assert facts_of(found) == tuple(expected[name] for name in FACTS)


def test_no_condition_has_both_by_facts_and_when() -> None:
    """The supervisor leaves a condition on facts out while the facts stay, whatever is moving."""
    assert any(row.by_facts for row in CONDITIONS)
    assert not any(row.by_facts and row.when for row in CONDITIONS)
    nothing: Any = None
    with pytest.raises(ValueError, match="'fault' has both by_facts and when"):
        Condition("fault", "", "", nothing, nothing, by_facts=True, when="moving")
