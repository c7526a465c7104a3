"""The whole loop in the terminal: run, diagnose, plan, run, diagnose, add, ledger, control.

In simulated time: ``sim record`` stands for ``run``, and the winch is sent to its lengths by the
map that a bench uses, with the plant alone behind it.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest

from command_line import invoke
from model_files import answer
from winchkit.bench.control.cable import CableMap
from winchkit.catalog import find
from winchkit.effects import terms_of
from winchkit.estimation.cable_state import CableEstimator, Sample
from winchkit.schema.read import read_profile, read_simbench
from winchkit.sim.bench import hiding
from winchkit.sim.live.bench_file import write_bench
from winchkit.sim.plant.plant import WinchPlant
from winchkit.sim.plant.servo import DriveCommand

_STEPS = """\
[[step]]
ask = "hang the {load} load"
load_mass = "{load}"
[[step]]
to = "3.15 m"
speed = "0.2 m/s"
[[step]]
hold = "2 s"
[[step]]
to = "3 m"
speed = "0.2 m/s"
[[step]]
hold = "2 s"
"""
TIGHT = 'schema = 1\nkind = "programme"\nname = "tight"\nrepeat = 2\n' + "".join(
    _STEPS.format(load=load) for load in ("10 kg", "20 kg")
)
"""Two loads over a hand's breadth of cable: what yields, and not where."""
SHORT = Path(__file__).parents[3] / "examples" / "short.toml"
BENCH = "spiral-bench"


@dataclass(frozen=True)
class Case:
    """Something hidden, a first programme that leaves open what it is, and what closes it."""

    physics: str
    first: str
    open: frozenset[str]
    """What the first answer cannot distinguish, among others."""
    name: str
    output: str
    """That the effect changes."""


CASES = {
    "cable or frame": Case(
        "soft frame, stiffness=60 kN/m",
        TIGHT,
        frozenset({"frame-compliance", "cable-elongation-linear"}),
        "frame-compliance",
        "cable_length",
    ),
    "cell or pulleys": Case(
        "stretched cell",
        SHORT.read_text(),
        frozenset({"cell-gain", "cell-offset"}),
        "cell-gain",
        "tension",
    ),
    "layers or radius": Case(
        "thick layers",
        SHORT.read_text(),
        frozenset({"layer-thickness", "drum-radius", "gear-ratio"}),
        "layer-thickness",
        "cable_length",
    ),
}
SHORTEST = "layers or radius"
"""The case that ``.ci/run`` has; the others are run by ``pytest -m campaign``."""


def record(programme: Path, physics: str, folder: Path, seed: int) -> list[str]:
    asked = ("--hidden", physics, "--out", folder, "--seed", seed)
    told = answer("sim", "record", BENCH, programme, *asked)
    return [run["path"] for run in told["runs"]]


def errors(profile: Path, physics: str, load: float) -> tuple[float, float]:
    """Of length (m) and tension (N), the largest after moves to three lengths with a profile."""
    declared = hiding(read_simbench(find("sim", BENCH)), [physics])
    nominal, better = read_profile(find("profiles", "bench-spiral")), read_profile(profile)
    now = CableEstimator(better, terms_of(better), load * 9.80665)
    cable = CableMap.of(now)
    plant = WinchPlant(nominal, declared.truth["A"], seed=1, noise=declared.noise)
    plant.hang(load)
    missed, force = 0.0, 0.0
    for target in (3.0, 1.0, 2.0):
        angle = plant.motor_angle
        for _ in range(3):
            step = (cable.motor_angle(target) - angle) / 400
            for _ in range(400):
                angle += step
                advance(plant, cable, angle)
            for _ in range(200):
                advance(plant, cable, angle)
        seen = plant.measure()
        missed = max(missed, abs(plant.cable_length - target))
        force = max(force, abs(seen.tension + cable.correction - plant.load))
    return missed, force


def advance(plant: WinchPlant, cable: CableMap, angle: float) -> None:
    """A hundredth of a second at a motor angle, and what the cable's map makes of it."""
    plant.advance(0.01, DriveCommand(angle=angle))
    seen = plant.measure()
    cable.update(Sample(plant.time, plant.motor_angle, plant.motor_velocity, cell=seen.tension))


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(case, id=name, marks=() if name == SHORTEST else pytest.mark.campaign)
        for name, case in CASES.items()
    ],
)
def test_the_loop_ends_in_one_name_and_a_winch_that_ends_where_it_is_sent(
    case: Case, tmp_path: Path
) -> None:
    first, plan = tmp_path / "first.toml", tmp_path / "next.toml"
    first.write_text(case.first)
    bench = write_bench(read_simbench(find("sim", BENCH)).bench, tmp_path / "bench.toml")
    nominal = find("profiles", "bench-spiral")
    runs = record(first, case.physics, tmp_path / "first", 0)

    before = answer("diagnose", *runs, "-p", nominal)
    (step,) = before["steps"]
    assert set(step["effects"]) >= case.open
    assert {frozenset(run["separates"]) for run in before["next_runs"]}

    planned = answer("plan", *runs, "-p", nominal, "-b", bench, "-o", plan)
    best = planned["offers"][0]["separates"]
    assert max(pair["power"] for pair in best) > 0.9
    runs += record(plan, case.physics, tmp_path / "next", 1)

    after = answer("diagnose", *runs, "-p", nominal)
    assert after["verdict"] == "explained"
    assert [step["effects"] for step in after["steps"]] == [[case.name]]

    better = tmp_path / "better.toml"
    added = answer("add", case.name, "-p", nominal, "--fit", *runs, "-o", better)
    fitted = added["outputs"][case.output]
    # Held out, the first programme alone must predict the one further run.
    assert fitted["rms_after"] < 1.1 * fitted["noise_rms"] < fitted["heldout_rms_before"]
    assert fitted["heldout_rms_after"] < 0.5 * fitted["heldout_rms_before"]
    (noted,) = answer("ledger", "-p", better)["steps"]
    assert (noted["did"], noted["effect"]) == ("add", case.name)
    assert noted["after"][case.output] == pytest.approx(fitted["heldout_rms_after"])
    assert case.name in invoke("ledger", "-p", better).stdout

    bare, good = (errors(path, case.physics, 20.0) for path in (nominal, better))
    at = 0 if case.output == "cable_length" else 1
    assert good[at] < 0.35 * bare[at]
