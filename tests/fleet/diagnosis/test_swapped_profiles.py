"""Exchanged profiles: enumeration of all permutations, and the null distribution by simulation."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from scipy.stats import norm

from winchkit.catalog import find
from winchkit.effects.catalogue import load_catalogue
from winchkit.fleet.diagnosis.history import FleetParameter, fleet_history
from winchkit.fleet.diagnosis.sessions import SessionEstimate
from winchkit.fleet.diagnosis.swapped_profiles import swapped_by_radius, swapped_profiles
from winchkit.schema.profiles.winch import EffectTable, WinchProfile
from winchkit.schema.read import read_profile

NAMES = "ABCDE"
CATALOGUE = load_catalogue()
SHIPPED = read_profile(find("profiles", "bench-spiral"))
TRUE = np.random.default_rng(1).normal(0.0, 20.0, (5, 2))
ONE = np.eye(2)


def drawn(order: tuple[int, ...], seed: int, scale: float = 1.0) -> tuple[dict, dict, dict]:
    random = np.random.default_rng(seed)
    identified = {n: scale * TRUE[i] + random.normal(size=2) for i, n in enumerate(NAMES)}
    return (
        identified,
        dict.fromkeys(NAMES, ONE),
        {n: scale * TRUE[i] for n, i in zip(NAMES, order, strict=True)},
    )


def test_two_exchanged_profiles_are_found() -> None:
    (swap,) = swapped_profiles(*drawn((0, 3, 2, 1, 4), 2))
    assert swap.winches == ("B", "D")
    assert swap.p_value < 1e-6


def test_three_exchanged_profiles_are_one_cycle_and_the_best_permutation() -> None:
    identified, covariances, profiles = drawn((1, 2, 0, 3, 4), 3)
    (swap,) = swapped_profiles(identified, covariances, profiles)
    assert set(swap.winches) == {"A", "B", "C"}

    def square(order: tuple[int, ...]) -> float:
        pairs = zip(NAMES, order, strict=True)
        return float(sum(np.sum((identified[n] - profiles[NAMES[i]]) ** 2) for n, i in pairs))

    best = min(permutations(range(5)), key=square)
    assert swap.chi_square_decrease == pytest.approx(square((0, 1, 2, 3, 4)) - square(best))


@pytest.mark.parametrize("scale", [0.2, 0.02])
def test_right_profiles_are_called_swapped_in_at_most_one_of_100(scale: float) -> None:
    found = [swapped_profiles(*drawn((0, 1, 2, 3, 4), seed, scale)) for seed in range(500)]
    assert np.mean([bool(swaps) for swaps in found]) <= 0.01 + 3 * np.sqrt(0.01 / 500)


def test_a_mistyped_profile_is_no_exchange() -> None:
    # The profile of A has a wrong number; A is nearer to that of B, and B not far from that of A.
    identified = {"A": np.array([0.105]), "B": np.array([0.115]), "C": np.array([0.15])}
    profiles = {**identified, "A": np.array([0.13])}
    assert swapped_profiles(identified, dict.fromkeys("ABC", np.array([[1e-6]])), profiles) == ()


@pytest.mark.parametrize("apart", [0.0, 1e-12, 1e-4])
def test_winches_with_equal_profiles_are_no_exchange(apart: float) -> None:
    # A and B have one drum, mistyped by ten standard deviations in the profile of either.
    identified = {"A": np.array([0.11]), "B": np.array([0.09]), "C": np.array([0.15])}
    profiles = {"A": np.array([0.1]), "B": np.array([0.1 + apart]), "C": np.array([0.15])}
    assert swapped_profiles(identified, dict.fromkeys("ABC", np.array([[1e-6]])), profiles) == ()


def test_the_p_value_of_two_winches_is_the_closed_form() -> None:
    identified = {"A": np.array([2.0]), "B": np.array([0.0])}
    profiles = {"A": np.array([0.0]), "B": np.array([2.0])}
    (swap,) = swapped_profiles(identified, dict.fromkeys("AB", np.array([[0.25]])), profiles)
    # D = 32 and d² = 32 with two distances of 2 and a standard deviation of 1/2.
    assert swap.chi_square_decrease == pytest.approx(32.0)
    assert swap.p_value == pytest.approx(norm.cdf(-(32 + 32) / (2 * np.sqrt(32))))


@pytest.mark.parametrize("seed", range(10))
def test_a_pair_is_found_alone_in_a_fleet_whose_profiles_are_close(seed: int) -> None:
    # A hundred winches whose neighbours in radius differ by less than they are known.
    random = np.random.default_rng(seed)
    true, std = random.normal(0.0, 3e-4, 100), 5e-6
    names = [f"W{index:03}" for index in range(100)]
    order = np.argsort(true)
    pair = sorted((int(order[20 + seed]), int(order[70 + seed])))
    declared = true.copy()
    declared[pair] = true[pair[::-1]]
    identified = {
        n: np.array([x + random.normal(0.0, std)]) for n, x in zip(names, true, strict=True)
    }
    covariances = dict.fromkeys(names, np.array([[std**2]]))
    profiles = {name: np.array([x]) for name, x in zip(names, declared, strict=True)}
    found = swapped_profiles(identified, covariances, profiles)
    assert [sorted(swap.winches) for swap in found] == [[names[index] for index in pair]]


RADII = 0.06 + np.random.default_rng(7).normal(0.0, 3e-4, 8)


def fleet(effect: str, declared: np.ndarray, seed: int) -> tuple[FleetParameter, ...]:
    """Estimates of eight winches of the radii RADII whose profiles declare others."""
    random, own = np.random.default_rng(seed), []
    common = 1e-4  # of all winches: the diameter of the cable, say
    for winch, (true, radius) in enumerate(zip(RADII, declared, strict=True)):
        error = true + common + random.normal(0.0, 3e-6) - radius
        value = error if effect == "drum-radius" else radius / (radius + error) - 1.0
        std = 2e-6 if effect == "drum-radius" else 2e-6 / 0.06
        own.append(SessionEstimate(f"W{winch}", 0.0, effect, "error", float(value), std, "1"))
    return fleet_history(own).parameters


def profiles(declared: np.ndarray) -> dict[str, WinchProfile]:
    return {
        f"W{winch}": replace(SHIPPED, drum=replace(SHIPPED.drum, winding_radius=float(radius)))
        for winch, radius in enumerate(declared)
    }


@pytest.mark.parametrize("effect", ["drum-radius", "gear-ratio"])
def test_exchanged_profiles_of_drums_are_found_by_either_effect(effect: str) -> None:
    declared = RADII.copy()
    declared[[2, 6]] = RADII[[6, 2]]
    (swap,) = swapped_by_radius(fleet(effect, declared, 1), profiles(declared), CATALOGUE)
    assert sorted(swap.winches) == ["W2", "W6"]
    assert swapped_by_radius(fleet(effect, RADII, 2), profiles(RADII), CATALOGUE) == ()
    both = (*fleet("drum-radius", declared, 1), *fleet("gear-ratio", declared, 1))
    assert swapped_by_radius(both, profiles(declared), CATALOGUE) == ()


def test_the_error_of_a_radius_that_a_profile_has_belongs_to_the_profile() -> None:
    declared = RADII.copy()
    declared[[2, 6]] = RADII[[6, 2]]
    written = {
        name: replace(
            SHIPPED,
            drum=replace(SHIPPED.drum, winding_radius=0.06),
            effect=(EffectTable("drum-radius", {"radius_error": f"{1e3 * (r - 0.06):.6f} mm"}),),
        )
        for name, r in zip(profiles(declared), declared, strict=True)
    }
    # The estimates are whole errors, from the one radius that all profiles have.
    found = fleet("drum-radius", np.full(8, 0.06), 1)
    (swap,) = swapped_by_radius(found, written, CATALOGUE)
    assert sorted(swap.winches) == ["W2", "W6"]
