"""Values refitted to the simulated motion, on motions whose torque is a closed form."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from command_line import done, invoke
from winchkit import add, read_profile, write_run
from winchkit.dynamics import refit
from winchkit.dynamics.balance import Balance
from winchkit.dynamics.comparison import simulated_errors
from winchkit.dynamics.forward import Setup, motion_of
from winchkit.dynamics.integration import SimulatedMotion
from winchkit.dynamics.refit import MotionFit, refit_to_motion
from winchkit.effects.bind import terms_of
from winchkit.effects.catalogue import load_catalogue
from winchkit.effects.term import Term
from winchkit.errors import RunError, UsageError
from winchkit.runs.run import Channel, Run
from winchkit.schema.profiles.winch import WinchProfile

INERTIA, COULOMB, VISCOUS = 2e-3, 0.05, 4e-3
TRUE = {"inertia": INERTIA, "torque": COULOMB, "viscosity": VISCOUS}


def recorded(
    seed: int,
    stops: bool = False,
    noise: float = 1e-3,
    torque_noise: float = 0.0,
    seconds: float = 6.0,
) -> Run:
    """J ω' + c + b ω of ω = 6 + 5 sin 2πt/3, never at rest, or of 5 sin 2πt/3 with its sign.

    At a reversal the torque steps, which a sample of 5 ms rounds.
    """
    time = np.arange(0.0, seconds, 0.005 if stops else 0.01)
    bias = 0.0 if stops else 6.0
    turned = 2 * np.pi / 3
    speed = bias + 5 * np.sin(turned * time)
    angle = bias * time + 5 / turned * (1 - np.cos(turned * time))
    torque = INERTIA * 5 * turned * np.cos(turned * time) + VISCOUS * speed
    torque = torque + COULOMB * np.sign(speed)
    random = np.random.default_rng(seed)
    seen = random.normal(0.0, noise, len(time))
    # Noise of a correlation time of 0.1 s: exp(-0.1) from sample to sample of 10 ms.
    white = random.normal(0.0, torque_noise * (1 - np.exp(-0.2)) ** 0.5, len(time))
    torque = torque + lfilter([1.0], [1.0, -np.exp(-0.1)], white)
    channels = {
        "motor_angle": Channel(angle + seen, "rad"),
        "motor_velocity": Channel(speed, "rad/s"),
        "motor_torque": Channel(torque, "N m"),
    }
    return Run(f"r{seed}", time, channels)


def reversed_torque(run: Run) -> Run:
    torque = Channel(-run["motor_torque"], "N m")
    return replace(run, channels={**run.channels, "motor_torque": torque})


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


@pytest.mark.parametrize(
    "noises", [(0.05, 0.0), (1e-3, 2e-3)], ids=["of the angle", "of the torque"]
)
def test_the_stated_deviations_are_those_of_the_values_over_repeats(
    noises: tuple[float, float], tmp_path: Path
) -> None:
    """Noise of the torque is integrated twice: the errors of a motion are as long as the run."""
    found = [fitted(tmp_path, 0.95, [recorded(seed, False, *noises)]) for seed in range(6)]
    for place in range(3):
        (name,) = found[0].std[place]
        values = [one.terms[place].values[name] for one in found]
        stated = np.mean([one.std[place][name] for one in found])
        assert np.mean(values) == pytest.approx(TRUE[name], abs=4 * np.std(values) / 10**0.5)
        # Six motions scatter by chance: the inertia less than half as much as 14 of them, whose
        # scatter is two thirds of what is stated.
        assert 0.5 < stated / np.std(values, ddof=1) < 6.0


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


def test_a_wrong_sign_is_named_and_nothing_is_written(tmp_path: Path) -> None:
    source, run, out = axis(tmp_path, 0.9), tmp_path / "r1.csv", tmp_path / "better.toml"
    write_run(reversed_torque(recorded(1, stops=True)), run)
    command = ("add", "motor-viscous", "--fit", run, "-p", source, "-o", out)
    for result in (
        invoke(*command, "--refit", "motion"),
        invoke("compare", run, "-p", source, "--forward"),
    ):
        assert result.exit_code == 3
        assert "motor_torque: the sign looks inverted" in result.stderr
        assert "--column 'motor_torque=-motor_torque [N m]'" in result.stderr
        assert "inertia" not in result.stderr
    assert not out.exists()
    assert "motor_torque: the sign looks inverted" in " ".join(invoke(*command).stdout.split())


def test_no_point_is_simulated_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A step begins with the motion at which the one before ended."""
    seen = []

    def counted(
        profile: WinchProfile, terms: Sequence[Term], setup: Setup, tolerance: float, law: Balance
    ) -> SimulatedMotion:
        values = tuple(value for term in terms for value in term.values.values())
        seen.append((*values, setup.time[0], setup.time[-1], setup.angle, setup.speed))
        return motion_of(profile, terms, setup, tolerance, law)

    monkeypatch.setattr(refit, "motion_of", counted)
    monkeypatch.setattr(
        refit._Shooting, "_deviations", lambda _, jacobian, *__: np.ones(jacobian.shape[1])
    )
    fitted(tmp_path, 0.9, [recorded(1)])
    assert len(seen) == len(set(seen))


def test_values_that_simulate_worse_are_not_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    profile, run = read_profile(axis(tmp_path, 0.9)), recorded(1, stops=True)
    monkeypatch.setattr(MotionFit, "rms_before", 0.0)
    with pytest.raises(UsageError, match="those of the prediction, which are the better ones"):
        add("motor-viscous", [run], profile, refit="motion")


def test_missing_torque_at_the_ends_is_cut_and_a_long_gap_is_named(tmp_path: Path) -> None:
    profile, run = read_profile(axis(tmp_path, 1.0)), recorded(1, seconds=12.0)

    def without(*rows: slice) -> Run:
        torque = run["motor_torque"].copy()
        for one in rows:
            torque[one] = np.nan
        return replace(run, channels={**run.channels, "motor_torque": Channel(torque, "N m")})

    (error,) = simulated_errors([without(slice(0, 5), slice(600, 605), slice(-3, None))], profile)
    assert len(error.time) == len(run) - 8
    assert error.rms < 0.05
    with pytest.raises(RunError, match=r"motor_torque: no value for 0\.21 s from 5\.99 s on"):
        simulated_errors([without(slice(600, 620))], profile)
    late = replace(run, time=run.time + 5 * (np.arange(len(run)) > 599))
    with pytest.raises(RunError, match=r"motor_torque: no value for 5\.01 s from 5\.99 s on"):
        simulated_errors([late], profile)


def test_the_command_writes_the_values_of_the_motion(tmp_path: Path) -> None:
    source, run, out = axis(tmp_path, 0.9), tmp_path / "r1.csv", tmp_path / "better.toml"
    write_run(recorded(1, stops=True), run)
    result = done(
        "add", "motor-viscous", "--fit", run, "-p", source, "--refit", "motion", "-o", out
    )
    text = " ".join(result.stdout.split())
    assert "simulated from the measured torque, the motion is off by" in text
    (error,) = simulated_errors([recorded(1, stops=True)], read_profile(out))
    until = error.meaningful_until
    said = "the comparison means nothing" if until else "to the end"
    assert said in text
    values = {term.effect.id: term.values for term in terms_of(read_profile(out), None)}
    assert values["motor-viscous"]["viscosity"] == pytest.approx(VISCOUS, rel=0.02)
