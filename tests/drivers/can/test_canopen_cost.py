"""The benchmark of CANopen's cost runs, in small, and loses no frame."""

from __future__ import annotations

from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).parents[3] / "benchmarks"


def test_costs_are_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    from can_cost.cycle import cost_of_cycle
    from can_cost.decoding import cost_of_decoding

    decoding = cost_of_decoding(count=100, rounds=3)
    assert decoding["pdo_map_over_feedback"] > 1.0
    assert decoding["pdo_map_us"] > decoding["feedback_us"] > decoding["decoded_us"] > 0.0
    cycle = cost_of_cycle(axes=2, cycles=20)
    assert cycle["cycle_us"] == cycle["step_us"] + cycle["receive_us"]
    assert cycle["step_us"] > 0.0


@pytest.mark.realtime
def test_no_frame_is_lost_in_real_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    from can_cost.cycle import lateness_of_cycle

    lateness = lateness_of_cycle(0.5, axes=2)
    assert lateness["lost"] == 0
    assert lateness["p50_ms"] <= lateness["p99_ms"] <= lateness["max_ms"]
