"""A miniature of benchmarks/diagnosis_family.py, and its physics against closed forms."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from campaign.family.answers import answer
from campaign.family.base import draw_base
from campaign.family.case import write_case
from campaign.family.friction import ELEMENTS, LAWS, Shape, sense
from campaign.family.machine import STEP, Friction, show_fine
from campaign.family.places import is_certain, places
from campaign.family.relation_score import relation_table, violations
from campaign.family.relations import RELATIONS, write_files
from campaign.family.run import CASES, Job, run_job
from campaign.family.score import changes, failures, judge, table
from campaign.truth import G
from campaign.winch import Winch
from winchkit import compare, read_profile, read_run
from winchkit.arrays import Array

TIME = np.arange(0.0, 4.0, STEP)
DISTANCE = 0.05
WINCH = Winch("grooved", 0.05, 0.004, 10.0, 1, 0.0, 5.0, 6.0, 0.0, 90.0, (180.0,), 0.0)


def swing(amplitude: float) -> Array:
    """Speed of a sine of one period a second."""
    return 2 * np.pi * amplitude * np.cos(2 * np.pi * TIME)


def test_dahl_at_constant_speed_is_an_exponential_of_the_way() -> None:
    got = sense("dahl", np.full_like(TIME, 0.03), STEP, Shape(distance=DISTANCE))
    assert np.allclose(got, 1 - np.exp(-0.03 * TIME / DISTANCE), atol=1e-12)


@pytest.mark.parametrize("ratio", [0.3, 1.0, 4.0])
def test_the_limit_cycle_of_dahl_peaks_at_the_hyperbolic_tangent(ratio: float) -> None:
    # From −F* to F* over twice the amplitude A: F* = 1 − (1 + F*) exp(−2 A/δ) = tanh(A/δ).
    got = sense("dahl", swing(ratio * DISTANCE), STEP, Shape(distance=DISTANCE))
    last = got[TIME >= 3.0]
    assert np.ptp(last) / 2 == pytest.approx(np.tanh(ratio), rel=1e-3)


def test_maxwell_slip_loads_by_springs_and_obeys_masing() -> None:
    def first(way: Array) -> Array:
        spans = [(of * DISTANCE, share) for of, share in ELEMENTS]
        return np.sum([share * np.minimum(way / end, 1.0) for end, share in spans], axis=0)

    speed = np.where(TIME < 2.0, 0.1, -0.1)
    got = sense("maxwell-slip", speed, STEP, Shape(distance=DISTANCE))
    there, back = TIME < 2.0, TIME >= 2.0
    assert np.allclose(got[there], first(0.1 * TIME[there]), atol=1e-12)
    # A branch after a reversal is the first one, twice as large in force and way.
    turned = 0.1 * (TIME[back] - TIME[back][0])
    assert np.allclose(got[back], 1 - 2 * first(turned / 2), atol=1e-12)


def test_lugre_slides_at_the_stribeck_curve_and_its_steps_are_fine_enough() -> None:
    shape = Shape(distance=0.02, static=1.4, stribeck=0.1)
    slid = sense("lugre", np.full_like(TIME, 0.08), STEP, shape)
    assert slid[-1] == pytest.approx(1 + 0.4 * np.exp(-0.64), rel=1e-5)
    coarse = sense("lugre", swing(0.1), STEP, shape)
    fine_time = np.arange(0.0, 4.0, STEP / 8)
    fine = sense("lugre", 0.2 * np.pi * np.cos(2 * np.pi * fine_time), STEP / 8, shape)
    assert np.abs(coarse - fine[::8][: len(coarse)]).max() < 2e-3


@pytest.mark.parametrize("law", LAWS)
def test_friction_takes_work_out_of_every_cycle(law: str) -> None:
    speed = swing(0.4)
    shape = Shape(scale=0.05, distance=0.02, static=1.3, stribeck=0.1, back=0.6)
    force = sense(law, speed, STEP, shape)
    whole = TIME >= 2.0
    work = np.sum((force * speed)[whole]) * STEP
    assert 0.5 < work / (np.sum(np.abs(speed)[whole]) * STEP) <= 1.3


@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_a_winch_at_constant_speed_is_statics(way: float) -> None:
    motor = way * 20.0 * TIME
    radius = np.hypot(0.05, 0.004 / (2 * np.pi))
    parts = [Friction("pulley", "sharp", 0.02), Friction("gear", "sharp", 0.1)]
    parts.append(Friction("motor", "sharp", 0.3, viscosity=0.01))
    got = show_fine(WINCH, motor, 30.0, parts)
    # Around half a turn the bearing has T0 + T1: T1 (1 − μ s) = T0 (1 + μ s).
    tension = 30.0 * G * (1 + 0.02 * way) / (1 - 0.02 * way)
    torque = tension * radius / 10 * 0.9**-way + 0.3 * way + 0.01 * 20 * way
    inside = slice(5, -5)
    assert np.allclose(got.tension[inside], tension, rtol=1e-6)
    assert np.allclose(got.motor_torque[inside], torque, rtol=1e-6)
    assert np.allclose(got.cable_length, 5.0 - way * 2.0 * TIME * radius, atol=1e-9)


@pytest.mark.parametrize("kind", CASES)
def test_a_case_is_the_same_for_the_same_seed(kind: str) -> None:
    one, two = (Job(kind, 3, 1, 60.0).case() for _ in range(2))
    assert one.truth == two.truth
    assert all(
        np.array_equal(a.channels[name], b.channels[name])
        for a, b in zip(one.runs, two.runs, strict=True)
        for name in a.channels
    )


@pytest.mark.parametrize(("kind", "index"), [("friction", 2), ("garbage", 0), ("profiles", 0)])
def test_an_answer_is_a_line_that_the_scores_can_read(kind: str, index: int) -> None:
    line = run_job(Job(kind, 1, index, 60.0))
    assert line["verdict"] not in {"crash", "timeout", "refused"}
    line = json.loads(json.dumps(line))
    assert not judge(line)["failed"]
    assert "verdicts" in table([line])
    assert changes([line], [line]) == []
    assert all(str(line["seed"]) in text for text in failures([line]))
    other = {**line, "verdict": "other"}
    assert len(changes([other], [line])) == 1


def test_what_takes_too_long_is_a_timeout_and_what_fails_a_crash(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    runs, profile = write_case(Job("friction", 1, 2, 60.0).case(), tmp_path)
    assert answer(runs, profile, 0.01)["verdict"] == "timeout"

    def fail(*_: object) -> None:
        raise RecursionError("of each rival in turn")

    monkeypatch.setattr("winchkit.diagnose", fail, raising=False)
    got = answer(runs, profile, 60.0)
    assert got["verdict"] == "crash"
    assert "of each rival" in got["text"]


def test_the_place_of_a_step_is_what_it_says_or_that_of_its_effects() -> None:
    said = {"effects": ["x"], "place": [{"part": "motor", "output": "motor_torque"}]}
    assert places(said) == {("motor", "motor_torque", "")}
    old = {"effects": ["pulley-capstan", "gear-efficiency"]}
    assert places(old) == {("pulley", "tension", ""), ("gear", "motor_torque", "")}
    assert is_certain({"effects": ["a"]})
    assert not is_certain({"effects": ["a"], "certain": False})
    assert not is_certain({"effects": ["a", "b"]})


@pytest.mark.parametrize("relation", [name for name, r in RELATIONS.items() if r.exact][1:])
def test_errors_are_the_same_for_the_same_information(relation: str, tmp_path: Path) -> None:
    base, random = draw_base((2, 5), 5), np.random.default_rng(1)
    errors = []
    for name in ("twice", relation):
        paths, profile = write_files(RELATIONS[name].files(base, random), tmp_path / name)
        told = compare([read_run(path) for path in paths], read_profile(profile)).to_json()
        errors.append([output["rms"] for output in told["outputs"].values()])
    assert errors[1] == pytest.approx(errors[0], rel=1e-5)


def test_further_repeats_and_loads_leave_the_files_as_they_are() -> None:
    base = draw_base((2, 5), 5)
    once, twice, more = base.runs(1), base.runs(2), base.runs(2, further=True)
    assert (2 * len(once), len(twice) + 2) == (len(twice), len(more))
    for a, b, c in zip(once, twice, more, strict=False):
        assert np.array_equal(a.channels["tension"], b.channels["tension"])
        assert np.array_equal(b.channels["tension"], c.channels["tension"])
    other = base.runs(1, noise=1)[0].channels["tension"]
    same = np.resize(once[0].channels["tension"], other.shape)
    assert not np.array_equal(other, same)


def test_a_name_that_is_lost_replaced_or_doubtful_is_a_violation() -> None:
    def told(verdict: str, *sets: list[str], value: float = 1.0) -> dict[str, Any]:
        size = {"size": {"value": value, "std": 0.01}}
        steps = [{"effects": s, "values": {s[0]: size}} for s in sets]
        return {"verdict": verdict, "steps": steps, "text": "", "detectable": {}}

    base, exact = told("explained", ["a"]), "stamps 1 ns"
    kept = violations(base, told("explained", ["a"]), exact)
    assert not any(kept[k] for k in ("failed", "lost", "uncertain", "another", "silent", "outside"))
    assert violations(base, told("unknown"), exact)["lost"] == ["a"]
    assert violations(base, told("unknown"), exact)["silent"]
    assert violations(base, told("explained", ["a", "b"]), exact)["uncertain"] == ["a"]
    assert violations(base, told("explained", ["b"]), exact)["another"] == ["b"]
    assert violations(base, told("explained", ["a"], ["b"]), "three times")["another"] == []
    assert len(violations(base, told("explained", ["a"], value=1.1), exact)["outside"]) == 1
    assert violations(base, told("crash"), exact) == {"failed": True}
    # A name that is hardly detectable may go with other noise, and may not with the same.
    small = base | {"detectable": {"a": {"size": 0.9}}}
    assert violations(small, told("adequate"), "another noise")["lost"] == []
    assert violations(small, told("adequate"), exact)["lost"] == ["a"]
    relations = dict.fromkeys(list(RELATIONS)[1:], told("unknown"))
    line = base | {"seed": 1, "truth": {"words": "x"}, "relations": relations}
    assert "stamps 1 ns" in relation_table([line])


RELATED = ("twice", "stamps 1 us", "another unit", "sign and direction", "constant channel")


@pytest.mark.slow
def test_the_same_information_has_the_same_name(tmp_path: Path) -> None:
    """Jittered stamps, another unit, sign and a constant channel at once; one by one above.

    Orders and clocks of runs are those of tests/diagnosis/verdict/test_decision.py.
    """
    base = draw_base((1, 2), 2)
    plain, stamps, unit, sign, constant = (
        RELATIONS[name].files(base, np.random.default_rng(1)) for name in RELATED
    )
    runs = [
        replace(
            turned,
            channels=turned.channels
            | {"time": late.channels["time"], "temperature": warm.channels["temperature"]},
        )
        for turned, late, warm in zip(sign.runs, stamps.runs, constant.runs, strict=True)
    ]
    changed = replace(sign, runs=runs, units=unit.units)
    first, other = (
        answer(*write_files(files, tmp_path / name), 60.0)
        for name, files in (("plain", plain), ("changed", changed))
    )
    assert first["verdict"] == "explained"
    found = violations(first, other, "stamps 1 us")
    assert not any(w for key, w in found.items() if key != "values"), found
