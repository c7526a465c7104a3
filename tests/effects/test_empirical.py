"""Curves for what is not understood: known by name, never candidates, exactly nothing at null."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from effect_lines import profile_with, standard_on
from winchkit.effects import load_catalogue
from winchkit.effects.effect_template import write_own, write_wave_on_drum
from winchkit.effects.empirical import EMPIRICAL, KNOTS, empirical_id, knots, placed, variable_of
from winchkit.effects.term import Term
from winchkit.errors import FileError
from winchkit.model.line import Line, Motion
from winchkit.model.variables import ANGLES, COMPOUND, VARIABLES


def motion_of(drum: str) -> Motion:
    return standard_on(drum)[1]


def predicted_with(drum: str, term: Term | None, motion: Motion) -> dict[str, np.ndarray]:
    modifiers = () if term is None else (term.modifier(),)
    return Line(profile_with(drum), modifiers).predict(motion)


def sizes(count: int) -> dict[str, float]:
    return {f"value_{index}": 0.1 * index for index in range(1, count + 1)}


SIZES = sizes(KNOTS)


def test_they_are_known_by_name_and_stand_in_no_list() -> None:
    catalogue = load_catalogue()
    assert len(EMPIRICAL) == 3 * len(VARIABLES)
    for effect_id, effect in EMPIRICAL.items():
        assert catalogue[effect_id] is effect
        assert effect_id in catalogue
        assert effect_id == empirical_id(effect.outputs[0], variable_of(effect))
    assert not {effect.id for effect in catalogue} & set(EMPIRICAL)


@pytest.mark.parametrize("effect_id", sorted(EMPIRICAL))
def test_at_null_nothing_changes_and_a_curve_is_added_where_it_says(effect_id: str) -> None:
    effect = EMPIRICAL[effect_id]
    (output,) = effect.outputs
    motion = motion_of("spiral")
    x = VARIABLES[variable_of(effect)](motion.at)
    bare = predicted_with("spiral", None, motion)
    null = predicted_with("spiral", Term(effect, effect.null), motion)
    assert all(np.array_equal(bare[name], null[name], equal_nan=True) for name in bare)
    if variable_of(effect) in ANGLES:
        values = {"amplitude": 0.5, "phase": 0.3, "order": 3.0}
        expected = 0.5 * np.sin(3 * x + 0.3)
    else:
        low, high = float(np.min(x)), float(np.max(x)) + 1e-9
        count = 2 * KNOTS if variable_of(effect) in COMPOUND else KNOTS
        values = {"low": low, "high": high, **sizes(count)}
        assert knots(values) == pytest.approx(np.linspace(low, high, count))
        expected = 0.1 * (1 + (count - 1) * (x - low) / (high - low))
    found = predicted_with("spiral", Term(effect, values), motion)
    assert found[output] - bare[output] == pytest.approx(expected, abs=1e-9, nan_ok=True)
    for other in set(bare) - {output}:
        assert np.array_equal(found[other], bare[other], equal_nan=True)


def test_a_spline_is_placed_over_what_the_data_cover() -> None:
    effect = placed(EMPIRICAL["empirical-tension-speed"], -0.2, 0.4)
    assert (effect.parameter("low").grid, effect.parameter("high").grid) == ((-0.2,), (0.4,))
    wave = EMPIRICAL["empirical-tension-drum-angle"]
    assert placed(wave, -1.0, 1.0) == wave


@pytest.mark.parametrize("effect_id", ["empirical-tension-drum-angle", "empirical-tension-speed"])
def test_a_file_of_ones_own_says_the_same(effect_id: str, tmp_path: Path) -> None:
    effect = EMPIRICAL[effect_id]
    values = {"low": -0.5, "high": 0.5, **SIZES}
    if variable_of(effect) in ANGLES:
        values = {"amplitude": 2.0, "phase": 0.4, "order": 3.0}
    file = tmp_path / "own_idea.py"
    write_own(Term(effect, values), "own-idea", file)
    own = load_catalogue([file])["own-idea"]
    same = {name: values[name] for name in ("amplitude", "phase") if name in values}
    motion = motion_of("spiral")
    begun = predicted_with("spiral", Term(effect, values), motion)["tension"]
    mine = predicted_with("spiral", Term(own, same or {"scale": 1.0}), motion)["tension"]
    assert mine == pytest.approx(begun, rel=1e-5)
    null = predicted_with("spiral", Term(own, own.null), motion)["tension"]
    assert np.array_equal(null, predicted_with("spiral", None, motion)["tension"])
    with pytest.raises(FileError, match="exists already"):
        write_own(Term(effect, values), "own-idea", file)


def test_a_wave_of_the_drum_does_the_same_work_in_length_and_torque(tmp_path: Path) -> None:
    file = tmp_path / "corners.py"
    write_wave_on_drum(5, "corners", file)
    effect = load_catalogue([file])["corners"]
    motion = motion_of("spiral")
    bare = predicted_with("spiral", None, motion)
    found = predicted_with("spiral", Term(effect, {"amplitude": 1e-4, "phase": 0.5}), motion)
    phi = motion.at.drum_angle
    wave = 1e-4 * (np.sin(5 * phi + 0.5) - np.sin(0.5))
    assert bare["cable_length"] - found["cable_length"] == pytest.approx(wave, abs=1e-12)
    with pytest.raises(FileError, match="cannot be written"):
        write_wave_on_drum(5, "corners", tmp_path / "nowhere" / "x.py")
