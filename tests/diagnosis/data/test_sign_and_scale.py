"""A wrong sign or unit of a channel is named as such; effects and clean runs are not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from diagnosis_runs import GROOVED, SPIRAL, Ride, made, recorded, term, with_channel, without
from winchkit.diagnosis.compare import compare
from winchkit.diagnosis.data.sign_and_scale import mending_column, sign_and_scale
from winchkit.diagnosis.data.validation import validate_runs
from winchkit.diagnosis.diagnose import diagnose
from winchkit.effects.catalogue import Catalogue, load_catalogue
from winchkit.errors import RunError
from winchkit.runs.run import Run
from winchkit.runs.sanity.finding import Finding
from winchkit.schema.profiles.winch import EffectTable, WinchProfile

FACTORS = {
    1000.0: "power of ten",
    1e-3: "power of ten",
    100.0: "power of ten",
    9.80665: "kilogram",
    1 / 9.80665: "kilogram",
    2.0**15: "counts",
}
OF_TENSION = {
    2 * pi: "2π", 180 / pi: "degrees", 60.0: "60", 25.4: "inches", 4.4482: "pounds-force",
}  # fmt: skip
OF_TORQUE = {
    4.4482: "no known constant", 60.0: "no known constant", 8.8507: "inch-pounds",
    1 / 0.0070615: "inch-ounces", 10.197: "kilogram-force centimetres",
}  # fmt: skip
OUTPUTS = ("tension", "motor_torque")


def scaled(run: Run, name: str, factor: float) -> Run:
    return with_channel(run, name, run[name] * factor, run.channels[name].unit)


def codes(runs: Sequence[Run], profile: WinchProfile = GROOVED) -> list[tuple[str, str]]:
    return [(finding.channel, finding.code) for finding in sign_and_scale(runs, profile)]


@given(
    st.integers(0, 2**31), st.floats(2.0, 60.0), st.floats(20.0, 500.0), st.sampled_from(OUTPUTS)
)
@settings(max_examples=40, deadline=None)
def test_an_inverted_sign_is_named(seed: int, mass: float, stroke: float, name: str) -> None:
    run = made(seed, SPIRAL, load_mass=mass, ride=Ride(stroke=stroke))
    assert codes([run], SPIRAL) == []
    assert codes([scaled(run, name, -1.0)], SPIRAL) == [(name, "inverted-sign")]


@pytest.mark.parametrize(
    ("name", "factor", "words"),
    [
        (name, *item)
        for name, own in zip(OUTPUTS, (OF_TENSION, OF_TORQUE), strict=True)
        for item in (FACTORS | own).items()
    ],
)
def test_a_wrong_unit_is_named(name: str, factor: float, words: str) -> None:
    (finding,) = sign_and_scale([scaled(made(3), name, factor)], GROOVED)
    assert (finding.channel, finding.code) == (name, "wrong-factor")
    assert finding.value == pytest.approx(factor, rel=0.02)
    assert words in finding.text


def test_a_factor_that_no_constant_is_near() -> None:
    (finding,) = sign_and_scale([scaled(made(3), "tension", 3.6)], GROOVED)
    assert "no known constant" in finding.text


def test_both_a_wrong_sign_and_a_wrong_unit() -> None:
    (finding,) = sign_and_scale([scaled(made(3), "motor_torque", -1000.0)], GROOVED)
    assert finding.code == "inverted-sign"
    assert "power of ten" in finding.text


@pytest.mark.parametrize(("factor", "words"), [(-1.0, "inverted"), (1 / 9.80665, "kilograms")])
def test_a_wrong_load_is_blamed_once(factor: float, words: str) -> None:
    run = made(3)
    run = with_channel(run, "load", np.full(len(run), 98.0665 * factor))
    (finding,) = sign_and_scale([run], GROOVED)
    assert finding.channel == "load"
    assert finding.value == pytest.approx(factor, rel=0.02)
    assert words in finding.text


@pytest.mark.parametrize("name", OUTPUTS)
@pytest.mark.parametrize("factor", [-1.0, 1000.0])
def test_without_a_load_either_of_tension_and_torque_may_be_wrong(name: str, factor: float) -> None:
    run = scaled(made(3, load_mass=10.0), name, factor)
    found = sign_and_scale([replace(run, metadata={})], GROOVED)
    assert {f.channel for f in found} == set(OUTPUTS)
    (own,) = (f for f in found if f.channel == name)
    assert own.value == pytest.approx(factor, rel=0.02)


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        ("torque-constant", {"relative_error": 0.3}),
        ("motor-coulomb", {"torque": 0.3}),
        ("motor-viscous", {"viscosity": 3e-3}),
        ("rotor-inertia", {"inertia": 1e-3}),
        ("cell-gain", {"relative_error": -0.25}),
        ("cell-offset", {"offset": 40.0}),
        ("cable-weight", {"mass_per_length": 0.5}),
    ],
)
def test_a_large_effect_is_no_wrong_unit(effect: str, values: dict[str, float]) -> None:
    assert codes([made(seed, GROOVED, [term(effect, **values)]) for seed in range(4)]) == []


def test_a_cell_that_was_tared_under_the_load_has_no_wrong_unit() -> None:
    run = made(3)
    assert codes([with_channel(run, "tension", run["tension"] - 98.0665)]) == []


def test_slopes_that_differ_from_run_to_run_are_no_wrong_unit() -> None:
    """As of a cell that was zeroed anew under a constant load: one is near that of pounds."""
    runs = [made(seed) for seed in range(4)]
    pounds, others = 0.45359, (0.95, 1.3, 1.1)
    alone = scaled(runs[0], "tension", pounds)
    assert codes([alone, *runs[1:]]) == [("tension", "wrong-factor")]
    pairs = zip(runs[1:], others, strict=True)
    assert codes([alone, *(scaled(run, "tension", share) for run, share in pairs)]) == []


def test_factors_that_differ_from_run_to_run_are_no_unit() -> None:
    """Of two runs one near feet and metres, the other near pounds and kilograms."""
    runs = [made(seed) for seed in range(2)]
    same = [scaled(run, "tension", 0.3048) for run in runs]
    assert codes(same) == [("tension", "wrong-factor")] * 2
    assert codes([same[0], scaled(runs[1], "tension", 0.45359)]) == []


@pytest.mark.parametrize("ripple", [0.0, 0.05, 0.2])
def test_a_unit_beside_an_effect_that_scatters_the_slopes_is_named(ripple: float) -> None:
    """A ripple of the torque (N m) with another phase in every run: slopes of 9.2 to 10.7."""
    runs = []
    for seed in range(6):
        run = scaled(made(seed, load_mass=10.0 + 3 * seed), "tension", 1 / 9.80665)
        torque = run["motor_torque"] + ripple * np.sin(run["motor_angle"] / 5 + seed)
        runs.append(replace(with_channel(run, "motor_torque", torque), metadata={}))
    found = sign_and_scale(runs, GROOVED)
    assert [f.code for f in found] == ["wrong-factor"] * 2 * len(runs)
    assert all("kilogram" in f.text for f in found)


def joint(seed: int, sign: float) -> tuple[Run, WinchProfile]:
    """A joint without a load: inertia, friction, gravity over its angle, an offset."""
    random = np.random.default_rng(seed)
    time = np.arange(4000) / 100
    angle = 1.2 * np.sin(0.9 * time) + 0.4 * np.sin(2.3 * time + 1)
    rate, bend = np.gradient(angle, time), np.gradient(np.gradient(angle, time), time)
    torque = 0.4 * bend + 0.3 * rate + 0.5 * np.sign(rate) + 4 * np.cos(angle) + 1
    torque += random.normal(0, 0.3, len(time))
    run = made(0, load_mass=None)
    run = replace(run, time=time, metadata={"load_mass": "0 kg"}, channels={})
    run = with_channel(run, "motor_angle", angle, "rad")
    return with_channel(run, "motor_torque", sign * torque, "N m"), GROOVED


@given(st.integers(0, 2**31))
@settings(max_examples=20, deadline=None)
def test_friction_and_inertia_determine_the_sign_without_a_load(seed: int) -> None:
    assert codes([joint(seed, 1.0)[0]]) == []
    assert codes([joint(seed, -1.0)[0]]) == [("motor_torque", "inverted-sign")]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_friction_of_runs_in_one_direction_each_determines_the_sign(sign: float) -> None:
    """A ladder of speeds: the friction of a run is an offset that follows its direction."""
    random = np.random.default_rng(3)
    runs = []
    for index, speed in enumerate((0.2, 0.5, 1.0, 2.0, -0.2, -0.5, -1.0, -2.0)):
        time = np.arange(600) / 100
        torque = np.full(600, 0.5 * np.sign(speed) + 0.2 * speed) + random.normal(0, 0.05, 600)
        run = replace(
            made(0, load_mass=None), time=time, channels={}, metadata={"load_mass": "0 kg"}
        )
        run = with_channel(run, "motor_angle", speed * time, "rad")
        run = with_channel(run, "motor_torque", sign * torque, "N m")
        runs.append(replace(run, name=f"speed-{index}"))
    found = sign_and_scale(runs, GROOVED)
    assert {f.code for f in found} == (set() if sign > 0 else {"inverted-sign"})
    assert len({f.text for f in found}) == (sign < 0)


def test_a_sign_and_a_factor_are_found_where_inertia_follows_the_angle() -> None:
    """One sine: gravity, inertia and angle are nearly collinear, and no slope is determined."""
    known = replace(GROOVED, effect=(EffectTable("motor-cogging", GRAVITY),))
    run, time = joint(4, 1.0)[0], np.arange(4000) / 100
    angle = 0.8 * np.sin(0.7 * time) - np.pi / 2
    torque = -0.28 * (4 * np.cos(angle) + 0.1 * np.sign(np.gradient(angle)))
    run = with_channel(
        with_channel(run, "motor_angle", angle, "rad"), "motor_torque", torque, "N m"
    )
    (found,) = sign_and_scale([run], known)
    assert (found.code, found.channel) == ("inverted-sign", "motor_torque")
    assert found.value == pytest.approx(-0.28, rel=0.05)
    column = mending_column(found)
    assert column.startswith("motor_torque=-motor_torque*3.")
    assert column.endswith(" [N m]")


@pytest.mark.parametrize(
    ("channel", "slope", "column"),
    [
        ("motor_velocity", 0.0999, "motor_velocity=motor_velocity*10 [rad/s]"),
        ("velocity", 1e-3, "velocity=velocity*1000 [m/s]"),
        ("left.motor_velocity", 10.01, "left.motor_velocity=left.motor_velocity*0.1 [rad/s]"),
    ],
)
def test_a_velocity_of_a_wrong_unit_is_corrected_by_an_import(
    channel: str, slope: float, column: str
) -> None:
    assert mending_column(Finding("wrong-factor", "run", channel, slope, "")) == column


def test_the_inertia_in_the_profile_is_a_prediction() -> None:
    heavy = replace(GROOVED, effect=(EffectTable("rotor-inertia", {"inertia": "0.4 kg m^2"}),))
    assert codes([joint(1, 1.0)[0]], heavy) == []


@pytest.mark.parametrize("inertia", ["0.07 kg m^2", "0.0004 kg m^2", "40 kg m^2"])
def test_another_inertia_is_no_wrong_unit(inertia: str) -> None:
    """The slope over a prediction that is inertia alone: an unknown load inertia, here 0.4."""
    other = replace(GROOVED, effect=(EffectTable("rotor-inertia", {"inertia": inertia}),))
    runs = [joint(seed, 1.0)[0] for seed in range(3)]
    assert codes(runs, other) == []


GRAVITY = {"amplitude": "4 N m", "phase": "1.5707963 rad", "order": 1}


@pytest.mark.parametrize("factor", [1e-3, 9.80665, 60.0])
def test_gravity_in_the_profile_determines_the_unit_without_a_load(factor: float) -> None:
    known = replace(
        GROOVED,
        effect=(
            EffectTable("motor-cogging", GRAVITY),
            EffectTable("rotor-inertia", {"inertia": "0.4 kg m^2"}),
        ),
    )
    run = joint(2, 1.0)[0]
    assert codes([run], known) == []
    assert codes([scaled(run, "motor_torque", factor)], known) == [("motor_torque", "wrong-factor")]


def test_the_error_beside_a_wrong_factor_is_that_of_the_values_in_the_file() -> None:
    """Refitted, the profile's gravity would follow the wrong sign down to the noise."""
    known = replace(
        GROOVED,
        effect=(
            EffectTable("motor-cogging", GRAVITY),
            EffectTable("rotor-inertia", {"inertia": "0.4 kg m^2"}),
        ),
    )
    right = joint(2, 1.0)[0]
    wrong = scaled(right, "motor_torque", -0.3)
    found = diagnose([wrong], known).diagnosis
    assert "inverted-sign" in found.caveats
    difference = float(np.std(right["motor_torque"] - wrong["motor_torque"]))
    error = found.outputs["motor_torque"]
    assert error.heldout_rms_before > 0.8 * difference
    assert error.heldout_rms_before > 10 * (error.noise_rms or 0.0)


def test_an_effect_of_the_user_in_the_profile_is_a_prediction() -> None:
    catalogue = load_catalogue()
    own = replace(catalogue["rotor-inertia"], id="mine")
    heavy = replace(GROOVED, effect=(EffectTable("mine", {"inertia": "0.4 kg m^2"}),))
    assert sign_and_scale([joint(1, 1.0)[0]], heavy, Catalogue([*catalogue, own])) == []
    assert sign_and_scale([joint(1, -1.0)[0]], heavy, Catalogue([*catalogue, own])) != []


@pytest.mark.parametrize(
    ("factor", "words"), [(-1.0, "inverted sign"), (1000.0, "power of ten"), (180 / pi, "degrees")]
)
def test_a_length_of_another_unit_is_refused_with_its_name(factor: float, words: str) -> None:
    with pytest.raises(RunError, match=words):
        validate_runs([scaled(made(3), "cable_length", factor)], GROOVED)


@pytest.mark.parametrize("factor", [180 / pi, 360.0, 1 / (2 * pi), 4096.0])
def test_an_angle_of_another_unit_on_a_layered_drum(factor: float) -> None:
    """The length is not proportional to the angle there."""
    run = scaled(recorded()[0], "motor_angle", factor)
    with pytest.raises(RunError, match=r"wrong factor or unit of .*'motor_angle'"):
        validate_runs([run], replace(SPIRAL, name="bench-spiral"))


def test_no_effect_explains_an_inverted_torque() -> None:
    runs = [scaled(run, "motor_torque", -1.0) for run in recorded()[:4]]
    profile = replace(SPIRAL, name="bench-spiral")
    said = diagnose(runs, profile).diagnosis
    assert (said.verdict, said.steps, said.caveats) == ("unknown", (), ("inverted-sign",))
    assert {f.channel for f in said.sanity} == {"motor_torque"}
    assert compare(runs, profile).caveats == ("inverted-sign",)


def test_a_clean_recording_has_no_finding_and_uses_nearly_all_samples() -> None:
    said = compare(recorded()[:4], replace(SPIRAL, name="bench-spiral"))
    assert said.sanity == () == said.caveats
    assert min(said.used_share.values()) > 0.9


def test_a_torque_alone() -> None:
    run = without(made(3), "tension", "cable_length")
    assert codes([scaled(run, "motor_torque", -1.0)]) == [("motor_torque", "inverted-sign")]


def one_way(seed: int, mass: float, factor: float = 1.0) -> Run:
    """A run in one direction at one speed, with a rest in its last eighth alone."""
    run = without(made(seed, load_mass=mass), "cable_length", "motor_torque")
    random = np.random.default_rng(seed)
    angle = -40.0 * np.minimum(run.time, run.time[0] + 7 / 8 * np.ptp(run.time))
    tension = factor * (mass * 9.80665 + random.normal(0, 0.5, len(run.time)))
    return with_channel(with_channel(run, "motor_angle", angle, "rad"), "tension", tension)


def test_runs_in_one_direction_are_judged_together() -> None:
    """Alone a weight and friction are the same constant; two weights separate them."""
    right = [one_way(1, 10.0), one_way(2, 25.0)]
    wrong = [one_way(1, 10.0, 1e-3), one_way(2, 25.0, 1e-3)]
    assert codes(right) == []
    assert codes(wrong[:1]) == []
    assert codes(wrong) == [("tension", "wrong-factor")] * 2


@pytest.mark.parametrize(("factor", "words"), [(2**12 / (2 * pi), "2^12"), (37.0, "no known")])
def test_an_angle_in_another_unit_is_refused_as_such(factor: float, words: str) -> None:
    with pytest.raises(RunError, match="wrong factor or unit of") as refused:
        validate_runs([scaled(made(3), "motor_angle", factor)], GROOVED)
    assert words in str(refused.value)


@pytest.mark.parametrize("seed", range(5))
def test_values_without_relation_to_the_motion_have_no_factor(seed: int) -> None:
    """A uniform tension of 150 N in the mean: three times 5 kg, one and a half times 10 kg."""
    random = np.random.default_rng(seed)
    runs = [
        with_channel(run, "tension", random.uniform(0.0, 300.0, len(run)))
        for mass in (5.0, 10.0)
        for run in (made(seed, load_mass=mass), made(seed + 9, load_mass=mass))
    ]
    assert codes(runs) == []
    assert codes(runs[:2]) == []


def test_runs_without_a_wrong_factor_beside_wrong_ones_have_a_slope_near_one() -> None:
    whole = [made(seed) for seed in range(4)]
    wrong = [scaled(run, "tension", 3.14) for run in whole[:2]]
    assert codes([*wrong, *whole[2:]]) == [("tension", "wrong-factor")] * 2
    assert codes([*wrong, *(scaled(run, "tension", 1.5) for run in whole[2:])]) == []
