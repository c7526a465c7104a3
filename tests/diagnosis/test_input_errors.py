"""Without a known load the torque is predicted from the cell: which of both is wrong is not known.

Runs are made by the physics of the campaign, which knows no code of the model.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from campaign.bench import Bench, draw_bench
from campaign.record import record
from campaign.truth import Hidden
from campaign.winch import write_profile
from winchkit.diagnosis.diagnose import diagnose
from winchkit.diagnosis.results import Step
from winchkit.runs.read import read_run
from winchkit.schema.read import read_profile

SEED = 58


def blind_bench() -> Bench:
    """The first bench of a seed on which no load is known."""
    attempts = (
        draw_bench(np.random.default_rng([SEED, attempt]), repeats=True, small=True)
        for attempt in range(100)
    )
    return next(bench for bench in attempts if bench.load == "cell")


def steps(hidden: Hidden, folder: Path) -> tuple[Step, ...]:
    bench = blind_bench()
    write_profile(bench.winch, folder / "winch.toml")
    paths = record(np.random.default_rng(SEED), bench, hidden, folder)
    runs = [read_run(path) for path in paths]
    return diagnose(runs, read_profile(folder / "winch.toml")).diagnosis.steps


@pytest.mark.parametrize(
    ("hidden", "both"),
    [
        ({"cell-gain": {"gain_error": 0.04}}, {"cell-gain", "torque-constant"}),
        ({"torque-constant": {"gain_error": 0.04}}, {"cell-gain", "torque-constant"}),
        ({"cell-offset": {"offset": 8.0}}, {"cell-offset", "motor-coulomb-asymmetry"}),
    ],
    ids=["span", "torque constant", "zero"],
)
def test_an_error_of_the_cell_is_in_one_set_with_that_of_the_torque(
    hidden: Hidden, both: set[str], tmp_path: Path
) -> None:
    (step,) = steps(hidden, tmp_path)
    assert both <= set(step.effects)
    assert not step.certain
    ((effect, values),) = hidden.items()
    ((parameter, true),) = values.items()
    found = step.parameters[effect][parameter]
    assert found.value == pytest.approx(true, abs=4 * found.std)
    assert found.std < 0.1 * abs(true)
    assert {place.output for place in step.place} == {"motor_torque"}
