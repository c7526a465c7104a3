"""Effects of a user's own: files, entry points, and what is refused."""

from __future__ import annotations

import re
from importlib.metadata import EntryPoint
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import winchkit.effects.catalogue as module
from effect_lines import ALL_IDS, MINE
from winchkit.effects import Effect, Term, line_of, load_catalogue
from winchkit.effects.effect_template import check_own
from winchkit.effects.reference_motion import STANDARD_PROFILE, standard_motion
from winchkit.errors import FileError, UsageError
from winchkit.model.line import Line


def write(tmp_path: Path, text: str, name: str = "mine.py") -> Path:
    path = tmp_path / name
    path.write_text(text)
    return path


def test_a_file_adds_its_effects_to_the_catalogue(tmp_path: Path) -> None:
    catalogue = load_catalogue([write(tmp_path, MINE)])
    assert len(catalogue) == len(ALL_IDS) + 1
    effect = catalogue["my-own"]
    line = Line(STANDARD_PROFILE, (Term(effect, {"size": 0.25}).modifier(),))
    motion = standard_motion()
    moved = (
        line.predict(motion)["cable_length"]
        - line_of(STANDARD_PROFILE).predict(motion)["cable_length"]
    )
    assert np.allclose(moved, 0.25)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("def broken(:\n", "mine.py:1"),
        ("x = 1 / 0\n", "ZeroDivisionError"),
        ("import no_such_module_at_all\n", "no_such_module_at_all"),
        ("x = 1\n", "has no"),
        (MINE.replace('"m", null', '"furlong", null'), "unknown unit 'furlong'"),
        (MINE.replace("null=0.0", "null=0.0, low=1.0"), "null 0 lies outside"),
        (
            MINE.replace("what=", 'needs=("rope-force",), what='),
            "needs: unknown name 'rope-force'; known are cable,",
        ),
        (MINE.replace("what=", 'needs="load", what='), "needs = 'load': must be a tuple of names"),
        (MINE.replace('("cable_length",)', '("length",)'), "outputs: unknown name 'length'"),
        (MINE.replace('("cable_length",)', "()"), "outputs: empty"),
        (MINE.replace("null=0.0", "null=0.0, onset=0.5"), "onset 0.5: role 'amplitude', unit m"),
        (
            MINE.replace(
                "parameters=(",
                'parameters=(Parameter("t0", "s", null=0.0, typical=9.0, low=0.0, role="shape", '
                'onset=0.5), Parameter("more", "m", null=0.0, typical=1e-3), ',
            ),
            "onset: the effect has 2 amplitudes (more, size) and 0 probes",
        ),
    ],
)
def test_a_broken_file_is_named_with_what_is_wrong(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(FileError) as caught:
        load_catalogue([write(tmp_path, text)])
    assert said in str(caught.value)


def test_a_missing_file_and_one_that_is_not_python_are_named(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="no such file"):
        load_catalogue([tmp_path / "nothing.py"])
    with pytest.raises(FileError, match="not a Python file"):
        load_catalogue([write(tmp_path, MINE, "mine.txt")])


@pytest.mark.parametrize("whole_module", [True, False])
def test_an_entry_point_brings_effects(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, whole_module: bool
) -> None:
    effect: Effect = load_catalogue([write(tmp_path, MINE)])["my-own"]

    class Point(EntryPoint):
        def load(self) -> object:
            return SimpleNamespace(MINE=effect) if whole_module else effect

    def entry_points(*, group: str) -> list[EntryPoint]:
        assert group == "winchkit.effects"
        return [Point("mine", "mine_package:MINE", group)]

    monkeypatch.setattr(module, "entry_points", entry_points)
    monkeypatch.setattr(module, "_installed", module._installed.__wrapped__)
    assert load_catalogue()["my-own"] is effect


def test_entry_points_are_searched_once_in_a_process(monkeypatch: pytest.MonkeyPatch) -> None:
    first = load_catalogue()

    def entry_points(*, group: str) -> list[EntryPoint]:
        raise AssertionError(group)

    monkeypatch.setattr(module, "entry_points", entry_points)
    assert list(load_catalogue()) == list(first)


def test_an_unknown_effect_suggests_a_name() -> None:
    with pytest.raises(UsageError, match="did you mean 'cell-gain'"):
        load_catalogue()["cell-gian"]


def test_simple_effects_come_first() -> None:
    counts = [len(effect.parameters) for effect in load_catalogue()]
    assert counts == sorted(counts)


def test_an_id_that_is_taken_is_refused_and_a_file_given_twice_is_one(tmp_path: Path) -> None:
    mine = write(tmp_path, MINE)
    assert len(load_catalogue([mine, mine])) == len(ALL_IDS) + 1
    taken = write(tmp_path, MINE.replace('"my-own"', '"cell-gain"'), "taken.py")
    with pytest.raises(FileError, match=r"taken.py: there is an effect 'cell-gain' already"):
        load_catalogue([taken])


@pytest.mark.parametrize(
    ("effect_id", "name", "said"),
    [
        ("my-own", "mine.txt", "is not a Python file; name it mine.py"),
        ("my own", "mine.py", "'my own' is not an id of an effect"),
        ("Mine", "mine.py", "'Mine' is not an id of an effect"),
        ("cell-gain", "mine.py", "there is an effect 'cell-gain' already"),
        ("my-own", "there.py", "there.py: exists already"),
    ],
)
def test_a_new_file_is_refused_before_any_work(
    tmp_path: Path, effect_id: str, name: str, said: str
) -> None:
    write(tmp_path, MINE, "there.py")
    with pytest.raises((UsageError, FileError), match=re.escape(said)):
        check_own(effect_id, tmp_path / name, ALL_IDS)
    check_own("my-own-2", tmp_path / "mine.py", ALL_IDS)
