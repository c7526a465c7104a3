"""What a motion programme says of its own beginning and of its questions."""

from __future__ import annotations

from pathlib import Path

import pytest

from winchkit.errors import FileError
from winchkit.schema.programme import Programme, ProgrammeStep, write_programme
from winchkit.schema.read import read_programme


def move(to: float | None = None, by: float | None = None, winch: str = "all") -> ProgrammeStep:
    return ProgrammeStep(to=to, by=by, speed=0.2, winch=winch)


@pytest.mark.parametrize(
    ("steps", "way"),
    [
        ([move(1.0), move(3.0)], (2.9, 3.0)),
        ([move(3.0), move(2.95)], (3.0, 2.95)),
        ([move(2.0), move(by=-0.5), ProgrammeStep(hold=1.0)], (1.6, 1.5)),
        ([move(2.0), move(2.0)], (2.0,)),
        ([move(by=-0.5), move(by=0.5)], ()),
        ([move(by=-0.5), move(3.0)], (3.0,)),
        ([move(1.0), move(4.0, winch="B")], (1.0,)),
        ([ProgrammeStep(hold=1.0)], ()),
    ],
)
def test_it_begins_where_it_ends_and_comes_from_the_same_side(
    steps: list[ProgrammeStep], way: tuple[float, ...]
) -> None:
    assert Programme("p", tuple(steps)).approach("A") == pytest.approx(way)


def test_a_question_is_asked_once_while_it_stays_true() -> None:
    load = ProgrammeStep(ask="hang it", load_mass=10.0)
    warm = ProgrammeStep(ask="warm it", temperature=35.0)
    both = ProgrammeStep(ask="both", load_mass=10.0, temperature=35.0)
    other = ProgrammeStep(ask="grease the drum")
    assert load.asks_beyond(None, None)
    assert not load.asks_beyond(10.0, None)
    assert warm.asks_beyond(10.0, 20.0)
    assert not warm.asks_beyond(None, 35.0)
    assert both.asks_beyond(10.0, 20.0)
    assert not both.asks_beyond(10.0, 35.0)
    assert other.asks_beyond(10.0, 35.0)
    assert not move(1.0).asks_beyond(None, None)


def test_a_temperature_is_written_and_read_and_belongs_to_a_question(tmp_path: Path) -> None:
    path = tmp_path / "warm.toml"
    programme = Programme("warm", (ProgrammeStep(ask="warm it", temperature=35.0), move(1.0)))
    write_programme(programme, path)
    assert 'temperature = "35 degC"' in path.read_text(encoding="utf-8")
    assert read_programme(path).step[0].temperature == 35.0
    path.write_text(path.read_text(encoding="utf-8").replace("ask =", "hold = '1 s' #"))
    with pytest.raises(FileError, match="belongs to a step with 'ask', not to 'hold'"):
        read_programme(path)
