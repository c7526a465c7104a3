"""Values refitted to the simulated motion, on motions whose torque is a closed form."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from model_files import invoke
from winchkit import read_profile, write_run
from winchkit.dynamics.refit import MotionFit, refit_to_motion
from winchkit.effects.bind import terms_of
from winchkit.effects.catalogue import load_catalogue
from winchkit.effects.term import Term
from winchkit.errors import RunError, UsageError
from winchkit.runs.run import Channel, Run

INERTIA, COULOMB, VISCOUS = 2e-3, 0.05, 4e-3
TRUE = {"inertia": INERTIA, "torque": COULOMB, "viscosity": VISCOUS}


def recorded(seed: int, stops: bool = False, noise: float = 1e-3) -> Run:
    """J ω' + c + b ω of ω = 6 + 5 sin 2πt/3, never at rest, or of 5 sin 2πt/3 with its sign.

    At a reversal the torque steps, which a sample of 5 ms rounds.
    """
    time = np.arange(0.0, 12.0, 0.005 if stops else 0.01)
    bias = 0.0 if stops else 6.0
    turned = 2 * np.pi / 3
    speed = bias + 5 * np.sin(turned * time)
    angle = bias * time + 5 / turned * (1 - np.cos(turned * time))
    torque = INERTIA * 5 * turned * np.cos(turned * time) + VISCOUS * speed
    torque = torque + COULOMB * np.sign(speed)
    seen = np.random.default_rng(seed).normal(0.0, noise, len(time))
    channels = {
        "motor_angle": Channel(angle + seen, "rad"),
        "motor_velocity": Channel(speed, "rad/s"),
        "motor_torque": Channel(torque, "N m"),
    }
    return Run(f"r{seed}", time, channels)


def axis(folder: Path, share: float) -> Path:
    """An axis whose values are a share of the true ones."""
    path = folder / "axis.toml"
    path.write_text(
        f"""schema = 1
kind = "axis"
name = "axis"
[[effect]]
id = "rotor-inertia"
inertia = "{share * INERTIA} kg m^2"
[[effect]]
id = "motor-coulomb"
torque = "{share * COULOMB} N m"
[[effect]]
id = "motor-viscous"
viscosity = "{share * VISCOUS} N m s"
""",
        encoding="utf-8",
    )
    return path


def fitted(folder: Path, share: float, runs: list[Run]) -> MotionFit:
    profile = read_profile(axis(folder, share))
    return refit_to_motion(runs, profile, terms_of(profile, None))


@pytest.mark.parametrize("stops", [False, True], ids=["one direction", "with reversals"])
def test_wrong_values_become_those_that_make_the_motion(stops: bool, tmp_path: Path) -> None:
    found = fitted(tmp_path, 0.75, [recorded(1, stops)])
    for term, std in zip(found.terms, found.std, strict=True):
        for name, deviation in std.items():
            assert term.values[name] == pytest.approx(TRUE[name], rel=0.02, abs=4 * deviation)
            assert deviation < 0.05 * TRUE[name]
    assert found.rms_after < 0.1 * found.rms_before
    assert found.rms_after < 0.02


def test_the_stated_deviations_are_those_of_the_values_over_repeats(tmp_path: Path) -> None:
    found = [fitted(tmp_path, 0.95, [recorded(seed, noise=0.05)]) for seed in range(6)]
    for place in range(3):
        (name,) = found[0].std[place]
        values = [one.terms[place].values[name] for one in found]
        stated = np.mean([one.std[place][name] for one in found])
        assert np.mean(values) == pytest.approx(TRUE[name], abs=4 * np.std(values) / 10**0.5)
        assert 0.3 < stated / np.std(values, ddof=1) < 3.0


def test_effects_of_instruments_stay_as_they_are(tmp_path: Path) -> None:
    profile = read_profile(axis(tmp_path, 0.95))
    cell = Term(load_catalogue()["cell-gain"], {"gain_error": 0.02})
    found = refit_to_motion([recorded(1)], profile, [*terms_of(profile, None), cell])
    assert found.terms[-1] == cell
    assert not found.std[-1]


def test_what_cannot_be_fitted_is_said(tmp_path: Path) -> None:
    profile = read_profile(axis(tmp_path, 1.0))
    with pytest.raises(UsageError, match="nothing to fit"):
        refit_to_motion([recorded(1)], profile, [])
    run = recorded(1)
    without = Run("r", run.time, {"motor_angle": run.channels["motor_angle"]})
    with pytest.raises(RunError, match="motor_torque"):
        refit_to_motion([without], profile, terms_of(profile, None))


def test_the_command_writes_the_values_of_the_motion(tmp_path: Path) -> None:
    source, run, out = axis(tmp_path, 0.9), tmp_path / "r1.csv", tmp_path / "better.toml"
    write_run(recorded(1, stops=True), run)
    done = invoke(
        "add", "motor-viscous", "--fit", run, "-p", source, "--refit", "motion", "-o", out
    )
    assert done.exit_code == 0
    assert "simulated from the measured torque, the motion is off by" in done.stdout
    values = {term.effect.id: term.values for term in terms_of(read_profile(out), None)}
    assert values["motor-viscous"]["viscosity"] == pytest.approx(VISCOUS, rel=0.02)
