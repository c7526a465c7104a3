"""Which runs can be compared with a profile at all, and what each fault says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from diagnosis_runs import GROOVED, NOISE, Ride, made, with_channel, without
from winchkit.diagnosis.data.validation import validate_runs, without_constants
from winchkit.errors import FileError, RunError
from winchkit.runs.run import Run
from winchkit.schema.profiles.winch import GearboxSpec

GOOD = replace(made(0), path="lift.csv")
OUTPUTS = ("cable_length", "tension", "motor_torque")


def faults(*runs: Run) -> list[str]:
    with pytest.raises(RunError) as caught:
        validate_runs(runs, GROOVED)
    return [str(fault) for fault in caught.value.faults]


def changed(name: str, change: Callable[[np.ndarray], np.ndarray], unit: str = "N") -> Run:
    return with_channel(GOOD, name, change(GOOD[name].copy()), unit)


def holed(share: float) -> Callable[[np.ndarray], np.ndarray]:
    def change(values: np.ndarray) -> np.ndarray:
        values[: round(share * len(values))] = np.nan
        return values

    return change


def cut(run: Run, samples: int) -> Run:
    channels = {k: replace(c, values=c.values[:samples]) for k, c in run.channels.items()}
    return replace(run, time=run.time[:samples], channels=channels)


def test_a_good_run_is_admitted_without_a_word() -> None:
    assert validate_runs([GOOD], GROOVED) == []


@pytest.mark.parametrize(
    ("run", "said"),
    [
        (
            without(GOOD, "motor_angle"),
            "lift.csv: no column 'motor_angle [rad]'; it has time, cable_length, tension",
        ),
        (cut(GOOD, 49), "lift.csv: only 49 samples; at least 50 are needed"),
        (without(GOOD, *OUTPUTS), "lift.csv: no column to compare; it needs at least one of"),
        (
            changed("motor_angle", np.zeros_like, "rad"),
            "lift.csv: column 'motor_angle': constant at 0 rad: nothing moves in this run",
        ),
        (
            changed("tension", lambda v: np.full_like(v, 12.5)),
            "lift.csv: column 'tension': constant at 12.5 in all 400 samples: the instrument",
        ),
        (
            changed("cable_length", holed(0.6), "m"),
            "lift.csv: column 'cable_length': 240 of 400 samples are NaN; remove it",
        ),
        (
            changed("tension", holed(1.0)),
            "lift.csv: column 'tension': 400 of 400 samples are NaN; remove it",
        ),
        (
            changed("cable_length", lambda v: 4.0 + 3 * (v - 4.0), "m"),
            "lift.csv: column 'cable_length': changes by 3 times what profile 'grooved' predicts",
        ),
        (
            changed("cable_length", lambda v: 8.0 - v, "m"),
            "another direction: check gearbox.ratio, gearbox.direction and drum.winding_radius",
        ),
        (
            replace(without(GOOD, "cable_length"), metadata={"profile": "other"}),
            "lift.csv: metadata profile: recorded with profile 'other', compared with 'grooved'",
        ),
    ],
    ids=[
        "no angle",
        "too short",
        "nothing to compare",
        "stands still",
        "dead cell",
        "half of it missing",
        "all of it missing",
        "another ratio",
        "another direction",
        "another profile",
    ],
)
def test_every_fault_says_where_and_what(run: Run, said: str) -> None:
    (fault,) = faults(run)
    assert fault.startswith("lift.csv: ")
    assert said in fault


def test_fifty_samples_and_half_of_the_values_are_enough() -> None:
    validate_runs([cut(made(0, ride=Ride(period=1.0)), 50)], GROOVED)
    validate_runs([changed("cable_length", holed(0.49), "m")], GROOVED)


def test_all_faults_of_all_runs_come_at_once() -> None:
    dead = replace(changed("tension", np.zeros_like), path="a.csv", name="a")
    other = replace(cut(made(1), 10), path="b.csv")
    said = faults(dead, other, GOOD, replace(GOOD, path="c.csv"))
    assert [text.split(":")[0] for text in said] == ["a.csv", "b.csv", "c.csv"]
    assert said[2] == "c.csv: holds the same samples as lift.csv; give it once"


def test_the_same_samples_with_other_clocks_are_the_same_run() -> None:
    """A copy as a repeat would show no noise at all."""
    later = replace(GOOD, path="copy.csv", time=GOOD.time + 100.0)
    (fault,) = faults(GOOD, later)
    assert "holds the same samples as lift.csv" in fault


def test_no_run_at_all() -> None:
    with pytest.raises(FileError, match="no run given"):
        validate_runs([], GROOVED)


def test_a_constant_load_is_a_weight_and_no_fault() -> None:
    known_weight = with_channel(GOOD, "load", np.full(400, 98.0))
    assert validate_runs([known_weight], GROOVED) == []


def test_a_tension_that_has_to_serve_as_the_load_is_said() -> None:
    unweighed = replace(made(1), metadata={})
    (note,) = validate_runs([unweighed], GROOVED)
    assert note.startswith("tension is not compared but taken as the load")
    assert validate_runs([unweighed, GOOD], GROOVED) == [], "one states it"


def test_a_small_stroke_is_not_taken_for_another_winch() -> None:
    """A stroke of millimetres under a long stretch says nothing of the ratio."""
    creeping = made(0, ride=Ride(stroke=0.05), noise={"cable_length": 3e-4})
    assert validate_runs([creeping], GROOVED) == []


def test_another_winch_is_recognised_by_its_length_and_not_by_its_name() -> None:
    renamed = replace(GOOD, metadata={**GOOD.metadata, "profile": "older-name"})
    assert validate_runs([renamed], GROOVED) == [
        f"{GOOD.name}: recorded with profile 'older-name', compared with 'grooved'"
    ]
    other = replace(GROOVED, gearbox=GearboxSpec(10.0))
    with pytest.raises(RunError, match=r"changes by 0\.49 times what profile 'grooved' predicts"):
        validate_runs([GOOD], other)
    with pytest.raises(RunError, match="in 1 more of the runs") as both:
        validate_runs([GOOD, made(7)], other)
    assert len(both.value.faults) == 1
    turned = with_channel(made(8), "cable_length", -made(8)["cable_length"])
    with pytest.raises(RunError) as mixed:
        validate_runs([GOOD, turned], other)
    assert len(mixed.value.faults) == 2, "a sign is not said to be a factor"


def test_notes_count_what_is_missing() -> None:
    lost = np.arange(400) % 40 == 39
    few = with_channel(GOOD, "tension", np.where(lost, np.nan, GOOD["tension"]))
    assert validate_runs([few], GROOVED) == ["NaN samples not compared: tension 10"]
    other = with_channel(made(7), "tension", np.where(lost, np.nan, made(7)["tension"]))
    both = validate_runs([few, other], GROOVED)
    assert both == ["NaN samples not compared: tension 20 in 2 runs"]


def test_every_output_can_stand_alone() -> None:
    for output in OUTPUTS:
        alone = made(0, noise={output: NOISE[output]})
        assert list(alone) == ["motor_angle", output]
        assert validate_runs([alone], GROOVED) == []


def test_a_channel_that_is_constant_in_one_run_is_left_out_there() -> None:
    """A torque in steps of 1.5 N m does not change in a run of a small load; the others measure."""
    coarse = replace(changed("motor_torque", lambda v: np.full_like(v, 19.5), "N m"), name="low")
    runs, found = without_constants([GOOD, coarse])
    assert set(runs[0]) == set(GOOD)
    assert set(runs[1]) == set(GOOD) - {"motor_torque"}
    (finding,) = found
    assert (finding.code, finding.run, finding.channel) == ("constant", "low", "motor_torque")
    assert finding.value == 19.5
    assert without_constants([coarse, coarse])[1] == [], "in all runs: refused as before"


def test_a_run_at_rest_keeps_its_constant_reading() -> None:
    rest = replace(
        with_channel(
            changed("tension", lambda v: np.full_like(v, 12.5)),
            "motor_angle",
            np.zeros(len(GOOD)),
            "rad",
        ),
        name="rest",
    )
    assert "tension" in without_constants([GOOD, rest])[0][1]
