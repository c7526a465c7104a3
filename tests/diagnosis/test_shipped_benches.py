"""Every shipped winch bench: what its file says that it hides is found from its two motions."""

from pathlib import Path

import pytest

from winchkit.catalog import find
from winchkit.diagnosis.diagnose import diagnose
from winchkit.runs.run import Run
from winchkit.schema.read import read_profile, read_programme, read_simbench
from winchkit.sim.bench import profiles_of
from winchkit.sim.record import simulate

FOLDER = Path(find("sim", "programme-demo")).parent
PROGRAMMES = ("programme-demo-fast", "programme-demo-slow")


def hiding() -> list[str]:
    """Benches of one winch that say what answers their hidden physics."""
    found = []
    for path in sorted(FOLDER.glob("*.toml")):
        if "answers" in path.read_text() and len(read_simbench(path).bench.winch) == 1:
            found.append(path.stem)
    return found


def recorded(name: str) -> list[Run]:
    bench = read_simbench(find("sim", name))
    profiles = profiles_of(bench)
    return [
        run
        for programme in PROGRAMMES
        for run in simulate(
            bench, profiles, read_programme(find("sim", programme)), seed=0, rate=50.0
        )
    ]


SIZES = {
    "demo-elastic-rope": ("axial_stiffness", 300e3, "N"),
    "demo-stretched-cell": ("gain_error", 0.02, "1"),
    "demo-motor-drag": ("torque", 0.025, "N m"),
}
"""Parameters of the simulation, expected values, and their unit."""
ELSEWHERE = "five-cornered-drum"
"""Whose diagnosis, the longest, tests/repository/test_examples.py has in ``.ci/run``."""


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.campaign if name == ELSEWHERE else ())
        for name in hiding()
    ],
)
def test_what_a_bench_hides_is_found(name: str) -> None:
    bench = read_simbench(find("sim", name))
    (winch,) = bench.bench.winch.values()
    answers = {a for truth in bench.truth.values() for one in truth.hidden for a in one.answers}
    found = diagnose(recorded(name), read_profile(find("profiles", winch.profile))).diagnosis
    told = {effect for step in found.steps for effect in step.effects}
    certain = {step.effects[0] for step in found.steps if step.certain}
    if answers:
        assert found.verdict == "explained"
        assert answers <= told
        assert certain <= answers
        assert len(found.steps) == len(answers)
        assert all(len(step.effects) <= 4 for step in found.steps)
        assert found.unexplained_share < 0.1
        for output in found.outputs.values():
            assert output.noise_rms is not None
            assert output.heldout_rms_after < 1.3 * output.noise_rms
            assert output.heldout_rms_after <= 1.02 * output.heldout_rms_before
        if name in SIZES:
            parameter, true, unit = SIZES[name]
            (answer,) = answers
            estimate = found.steps[0].parameters[answer][parameter]
            assert estimate.unit == unit
            assert abs(estimate.value - true) < 5 * estimate.std
            assert estimate.std < 0.1 * true
    else:
        assert found.verdict != "adequate"
        assert not certain
