"""Words of effects, and one unit for the errors of an output."""

from __future__ import annotations

import pytest

from winchkit.diagnosis.results import OutputFit
from winchkit.effects.catalogue import load_catalogue
from winchkit.quantity_text import significant
from winchkit.report.words.effect_names import EFFECTS
from winchkit.report.words.vocabulary import error_scale


def test_every_effect_of_the_catalogue_has_words() -> None:
    assert not [one.id for one in load_catalogue() if one.id not in EFFECTS]


@pytest.mark.parametrize(
    ("before", "after", "text"),
    [(1.84, 7e-4, "1840 0.700 mm"), (3.93e-3, 3.16e-4, "3.93 0.316 mm"), (0.0, 0.0, "0 0 m")],
)
def test_both_errors_of_an_output_are_readable_in_one_unit(
    before: float, after: float, text: str
) -> None:
    fit = OutputFit("m", None, 1.0, before, after, before, after, None)
    scale = error_scale(fit)
    assert f"{significant(before / scale.worth)} {scale.text(after)}" == text
