"""What a user's own effect promises is tried when its file is read."""

from __future__ import annotations

from pathlib import Path

import pytest

from command_line import done
from winchkit.effects import Effect, load_catalogue
from winchkit.effects.empirical import EMPIRICAL
from winchkit.effects.user_effects import broken_promises
from winchkit.errors import FileError

FILE = '''"""An effect of one's own."""

import numpy as np

from winchkit.effects import Effect, Parameter
from winchkit.model.stages import Stage


def apply(value, at, values):
    """Under test."""
    return {formula}


EFFECT = Effect(
    id="mine",
    stage=Stage.CELL,
    parameters=(Parameter("scale", "1", null=0.0, typical=1.0, low=-10.0, high=10.0),),
    apply=apply,
    outputs=("tension",),
    what="Mine.",
    formula="as in apply",
    source="this test",
    looks_like="An error of the tension.",
    told_apart="Not at all.",
)
'''


def written(folder: Path, formula: str) -> Path:
    file = folder / "mine.py"
    file.write_text(FILE.format(formula=formula))
    return file


@pytest.mark.parametrize(
    "effect", [*load_catalogue(), *EMPIRICAL.values()], ids=lambda effect: effect.id
)
def test_every_effect_of_the_catalogue_keeps_them(effect: Effect) -> None:
    assert broken_promises(effect) == []


@pytest.mark.parametrize(
    "formula",
    [
        'value + values["scale"]',
        'value * (1 + values["scale"]) - value * values["scale"] * 0.5',
        # The square root of what is below zero here and there is the user's own affair.
        'np.where(at.speed > 0, value + values["scale"] * np.sqrt(np.abs(at.speed)), value)',
        '(value * 3 + values["scale"]) / 3',
    ],
)
def test_what_keeps_them_is_read(tmp_path: Path, formula: str) -> None:
    assert "mine" in load_catalogue([written(tmp_path, formula)])


@pytest.mark.parametrize(
    ("formula", "told"),
    [
        (
            'value + 1 + values["scale"]',
            r"mine.py: effect 'mine' changes the tension by up to 1 N where it should vanish "
            r"\(scale = 0\); at its null it must return its input",
        ),
        (
            'value + values["scale"] * np.nan',
            "changes the tension to a value that is not finite where it should",
        ),
        ("value / 0.0", "changes the tension to a value that is not finite where it should vanish"),
        (
            'value + (np.log(-values["scale"]) if values["scale"] else 0.0)',
            r"gives no finite tension anywhere on the standard motion, with scale = 1",
        ),
    ],
)
def test_what_breaks_them_is_reported_with_its_file(
    tmp_path: Path, formula: str, told: str, recwarn: pytest.WarningsRecorder
) -> None:
    with pytest.raises(FileError, match=told):
        load_catalogue([written(tmp_path, formula)])
    assert not recwarn.list


def test_a_command_ends_with_a_bad_file(tmp_path: Path) -> None:
    file = written(tmp_path, "value + 1")
    result = done("effects", "mine", "--effects", file, code=3)
    assert "at its null" in result.stderr
