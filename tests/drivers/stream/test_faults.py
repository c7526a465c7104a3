"""Random fault sequences in simulated time over every device: no wrong number, ever."""

from __future__ import annotations

from random import Random

import pytest

from stream_campaign import KINDS, campaign
from stream_rig import DEVICES


@pytest.mark.parametrize("name", DEVICES)
def test_no_fault_sequence_brings_a_wrong_number(name: str) -> None:
    found = campaign(name, Random(f"streams/{name}"), cases=8)
    assert found.wrong == []
    assert found.readings > 30
    assert found.counted, "some counter has risen"


def test_the_faults_are_those_of_the_issue() -> None:
    assert {"late reply", "silence", "garbage", "bad checksum", "half line", "echo"} <= set(KINDS)
