"""A short version of the benchmark's long recording: decimated, with its effects named."""

from __future__ import annotations

import pytest

import diagnosis_hour as hour
from winchkit.diagnosis.data import decimation as decimate
from winchkit.diagnosis.data.spectrum import fast_count
from winchkit.diagnosis.diagnose import WinchAnswer
from winchkit.effects import load_catalogue
from winchkit.fleet.diagnosis.diagnose import diagnose_each
from winchkit.schema.read import read_profile


@pytest.fixture(scope="module")
def heard() -> list[tuple[str, float]]:
    """Calls of the progress bar."""
    return []


@pytest.fixture(scope="module")
def answer(tmp_path_factory: pytest.TempPathFactory, heard: list[tuple[str, float]]) -> WinchAnswer:
    runs = hour.recordings(minutes=4, winches=1)
    path = tmp_path_factory.mktemp("hour") / "hour.toml"
    hour.write_profile(hour.WINCH, path)
    of_winch = {"A": [run.of_winch("A") for run in runs]}
    with pytest.MonkeyPatch.context() as patched:
        # As far as the signals allow, not only as far as is needed: an hour in small.
        patched.setattr(decimate, "_TARGET_SAMPLES", 1000)
        each = diagnose_each(
            of_winch,
            read_profile(path),
            load_catalogue(),
            progress=lambda what, share: heard.append((what, share)),
        )
        ((name, found),) = each
    assert name == "A"
    return found


def test_it_is_decimated_and_says_so(answer: WinchAnswer) -> None:
    (note,) = (note for note in answer.diagnosis.notes if "sample of the runs" in note)
    factor = int("".join(filter(str.isdigit, note.split()[1])))
    assert 5 < factor < 50
    left = [len(r.signals.time) for r in answer.engine.regression.dataset.recordings]
    assert left == 2 * [fast_count(-(-120_000 // factor))]


def test_what_it_hides_is_named_with_its_size(answer: WinchAnswer) -> None:
    told = hour.told(answer.diagnosis, 0)
    assert told["verdict"] == "explained"
    assert hour.is_right([told])
    for step in answer.diagnosis.steps:
        name, true = next(iter(hour.hidden(0)[step.effects[0]].items()))
        assert step.parameters[step.effects[0]][name].value == pytest.approx(true, rel=2e-3)


def test_the_bar_moves_on(answer: WinchAnswer, heard: list[tuple[str, float]]) -> None:
    assert answer
    shares = [share for _, share in heard]
    assert shares == sorted(shares)
    assert len(set(shares)) > 3
    assert all(what.startswith("A: ") for what, _ in heard)
