"""Every example does what it claims."""

from __future__ import annotations

import math
import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from snippets import ROOT
from winchkit.catalog import find
from winchkit.diagnosis.diagnose import diagnose
from winchkit.effects import load_catalogue
from winchkit.effects.reference_motion import STANDARD_PROFILE, standard_motion
from winchkit.effects.term import Term
from winchkit.model.line import Line
from winchkit.runs.run import Run
from winchkit.schema.read import read_profile, read_programme, read_simbench
from winchkit.sim.record import simulate

EXAMPLES = ROOT / "examples"


def recorded(bench: str, programme: str | Path, **options: Any) -> list[Run]:
    declared = read_simbench(find("sim", bench))
    profiles = {
        name: read_profile(find("profiles", wiring.profile))
        for name, wiring in declared.bench.winch.items()
    }
    return list(simulate(declared, profiles, read_programme(str(programme)), **options))


def test_every_example_is_known_here() -> None:
    files = {path.name for path in EXAMPLES.iterdir() if path.is_file()}
    toml = {"ladder.toml", "short.toml", "stroke.toml", "winding-device.toml"}
    toml |= {"robot-rectangle.toml", "robot-star.toml", "robot-poses.toml"}
    assert files == {"better_position.py", "heave.py", "my_effect.py"} | toml


def test_ones_own_effect_explains_what_the_catalogue_cannot() -> None:
    runs = recorded("five-cornered-drum", find("sim", "programme-demo"))
    profile = read_profile(find("profiles", "bench-spiral"))
    known = diagnose(runs, profile).diagnosis
    assert known.verdict == "unknown"
    assert not any(step.certain for step in known.steps)
    assert any((w.variable, w.order) == ("drum_angle", 5) for w in known.where)
    own = diagnose(runs, profile, load_catalogue([EXAMPLES / "my_effect.py"])).diagnosis
    assert own.verdict == "explained"
    assert [step.effects for step in own.steps] == [("drum-corners",)]
    # The simulator's declaration says 0.3 mm.
    found = own.steps[0].parameters["drum-corners"]["amplitude"]
    assert found.value == pytest.approx(0.3e-3, rel=0.1)


def test_ones_own_effect_vanishes_at_its_null_and_carries_its_derivative() -> None:
    effect = load_catalogue([EXAMPLES / "my_effect.py"])["drum-corners"]
    motion = standard_motion()
    bare = Line(STANDARD_PROFILE).predict(motion)
    null = Line(STANDARD_PROFILE, (Term(effect, effect.null).modifier(),)).predict(motion)
    for name, values in bare.items():
        assert np.array_equal(null[name], values)
    wave = Line(STANDARD_PROFILE, (Term(effect, {"amplitude": 1e-4, "phase": 0.7}).modifier(),))
    step = 1e-4
    for angle in (3.0, 40.0, 41.3):
        change = wave.cable_length(angle + step) - wave.cable_length(angle - step)
        assert wave.arm(angle) == pytest.approx(-change / (2 * step), rel=1e-4)


def test_the_heave_follows_the_waves(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    module = runpy.run_path(str(EXAMPLES / "heave.py"))
    run = module["main"](tmp_path / "heave.csv", duration=3.0)
    length = run["cable_length"][np.isfinite(run["cable_length"])]
    # A speed 2πa/T·sin(2πt/T) winds in by 2a and pays out again; the instrument adds its noise.
    assert np.ptp(length) == pytest.approx(2 * module["AMPLITUDE"], rel=0.1)
    middle = float(np.median(run["tension"]))
    # Under 10 kg the tension swings by m·a(2π/T)².
    swing = 10.0 * module["AMPLITUDE"] * (2 * math.pi / module["PERIOD"]) ** 2
    assert middle == pytest.approx(10.0 * 9.80665, rel=0.02)
    assert np.ptp(run["tension"]) / 2 == pytest.approx(swing, abs=5.0)
    assert f"heave.csv: {len(run)} rows" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("bench", "effect", "before"),
    [
        # The simulator's declarations; what a straight calculation says of the error at 10 kg.
        pytest.param(
            "demo-elastic-rope",
            'id = "cable-elongation-linear"\naxial_stiffness = "300 kN"',
            0.8e-3,
            marks=pytest.mark.campaign,
        ),
        ("soft-frame", 'id = "frame-compliance"\nstiffness = "60 kN/m"', 1.6e-3),
        pytest.param(
            "demo-fat-drum",
            'id = "drum-radius"\nradius_error = "0.15 mm"',
            2.5e-3,
            marks=pytest.mark.campaign,
        ),
    ],
)
def test_a_winch_ends_where_it_was_sent_once_its_profile_knows(
    bench: str, effect: str, before: float, tmp_path: Path
) -> None:
    module = runpy.run_path(str(EXAMPLES / "better_position.py"))
    declared = read_simbench(find("sim", bench))
    bare = find("profiles", "bench-spiral")
    better = tmp_path / "better.toml"
    better.write_text(f"{Path(bare).read_text()}\n[[effect]]\n{effect}\n")
    off = [max(map(abs, module["position_errors"](declared, p))) for p in (bare, better)]
    assert off[0] > 0.8 * before
    assert off[1] < 0.15e-3


@pytest.mark.parametrize(
    ("programme", "masses", "stroke"),
    [("ladder", [8.0, 16.0, 24.0, 8.0, 16.0, 24.0], (0.8, 3.9)), ("stroke", [10.0], (3.7, 4.0))],
)
def test_programmes_run(programme: str, masses: list[float], stroke: tuple[float, float]) -> None:
    runs = recorded("spiral-bench", EXAMPLES / f"{programme}.toml", rate=10.0)
    assert [run.load_mass for run in runs] == masses
    for run in runs:
        assert run.metadata["programme"] == programme
        assert run["cable_length"].min() == pytest.approx(stroke[0], abs=0.01)
    longest = max(run["cable_length"].max() for run in runs)
    assert longest == pytest.approx(stroke[1], abs=0.01)
