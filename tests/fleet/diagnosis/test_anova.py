"""What errors of several winches follow, alike or each in its own way: known shares."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from winchkit.fleet.diagnosis.anova import SharedAttribution, WinchErrors, shared_errors
from winchkit.fleet.report.comparison import error_texts

NAMES = "ABCDEFGH"
N = 8000


def direction(random: np.random.Generator) -> NDArray[np.float64]:
    return np.sign(np.sin(np.arange(N) / 50 + random.uniform(0, 6)))


def told(
    sizes: dict[str, float], levels: dict[str, float] | None = None, noise: float = 0.1
) -> dict[str, SharedAttribution]:
    """What errors follow that are a size times the direction, a level and noise."""
    winches = {}
    for index, name in enumerate(sizes):
        random = np.random.default_rng(index)
        way = direction(random)
        error = sizes[name] * way + (levels or {}).get(name, 0.0)
        error = error + noise * random.standard_normal(N)
        variables = {"direction": way, "load": random.uniform(50, 300, N)}
        winches[name] = {
            "motor_torque": WinchErrors("N m", float(np.mean(error**2)), error, variables, N)
        }
    shared = shared_errors(winches)["motor_torque"]
    assert sum(shared.winches.values()) == pytest.approx(1.0)
    return {one.variable: one for one in shared.follows}


def test_what_all_do_is_common() -> None:
    one = told(dict.fromkeys(NAMES, 1.0))["direction"]
    assert one.share == pytest.approx(1 / 1.01, abs=0.005)
    assert one.common == pytest.approx(one.share, abs=0.005)
    assert one.outlying == ()


def test_what_one_of_eight_does_is_not() -> None:
    one = told({name: float(name == "H") for name in NAMES})["direction"]
    whole = 1 / (1 + 8 * 0.01)
    assert one.share == pytest.approx(whole, abs=0.005)
    # The mean of eight has an eighth of the one's size, and eight have it.
    assert one.common == pytest.approx(whole / 8, abs=0.005)
    assert one.outlying == ("H",)


def test_a_level_of_one_winch_follows_the_winch() -> None:
    found = told(dict.fromkeys(NAMES, 0.0), {"C": 1.0})
    assert found["winch"].share == pytest.approx(1 / 1.08, abs=0.005)
    assert found["winch"].common == pytest.approx(1 / 1.08 / 8, abs=0.005)
    assert found["winch"].outlying == ("C",)


def test_winches_that_all_differ_name_none() -> None:
    found = told({name: (-1.0) ** i for i, name in enumerate(NAMES)})
    assert found["direction"].share > 0.95
    assert found["direction"].common < 0.01
    assert found["direction"].outlying == ()


def test_noise_follows_nothing() -> None:
    assert told(dict.fromkeys(NAMES, 0.0)) == {}


def test_one_winch_has_nothing_in_common() -> None:
    assert told({"A": 1.0}) == {}


def test_an_output_that_some_winches_lack() -> None:
    error, way = np.ones(N), np.ones(N)
    one = WinchErrors("N", 1.0, error, {"direction": way}, N)
    shared = shared_errors({"A": {"tension": one}, "B": {}})
    assert shared["tension"].winches == {"A": 1.0}
    assert shared["tension"].follows == ()


def test_in_words() -> None:
    winches = {}
    for name in NAMES:
        random = np.random.default_rng(5)
        way = direction(random)
        error = (name == "H") * way
        winches[name] = {
            "motor_torque": WinchErrors(
                "N m", float(np.mean(error**2)), error, {"direction": way}, N
            )
        }
    (text,) = error_texts(shared_errors(winches))
    assert "100 % of the variance in H" in text
    assert "direction 100 %, 12 % common to all, outlying: H" in text
