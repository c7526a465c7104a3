"""Copies of a recording are no repeats, and repeats are no copies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from diagnosis_runs import GROOVED, NOISE, Ride, made
from winchkit.diagnosis.data.copies import without_copies
from winchkit.diagnosis.data.preparation import prepare
from winchkit.runs.run import Run

LONG = Ride(samples=900, period=6.0)


def rows(run: Run, index: slice, name: str = "part") -> Run:
    """Some rows of a run under another name, on a clock of their own."""
    channels = {n: replace(c, values=c.values[index]) for n, c in run.channels.items()}
    time = run.time[index]
    return replace(run, name=name, time=time - time[0], channels=channels)


def rounded(run: Run, sizes: dict[str, float], name: str = "rounded") -> Run:
    channels = {
        n: replace(c, values=np.round(c.values / sizes[n]) * sizes[n]) if n in sizes else c
        for n, c in run.channels.items()
    }
    return replace(run, name=name, channels=channels)


def kept(*runs: Run) -> list[str]:
    return [run.name for run in without_copies(runs, GROOVED)[0]]


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 300), st.integers(200, 600), st.integers(1, 4), st.booleans())
def test_an_excerpt_or_every_kth_row_is_left_out(
    first: int, count: int, every: int, first_given: bool
) -> None:
    whole = made(1, ride=LONG)
    part = rows(whole, slice(first, first + every * (count // every), every))
    given_runs = (part, whole) if first_given else (whole, part)
    left, (finding,) = without_copies(given_runs, GROOVED)
    assert [run.name for run in left] == ["run-1"]
    assert (finding.code, finding.run, finding.value) == ("repeats-are-copies", "part", 1.0)


@pytest.mark.parametrize("share", [0.001, 0.5, 4.0])
def test_a_rounded_copy_is_left_out_and_the_finer_one_kept(share: float) -> None:
    """Rounding to less than the noise; its own error is q/√12."""
    whole = made(1, ride=LONG)
    sizes = {name: share * size / 5 for name, size in NOISE.items()}
    assert kept(rounded(whole, sizes), whole) == ["run-1"]
    zeroed = rounded(whole, sizes)
    length = zeroed.channels["cable_length"]
    moved = {**zeroed.channels, "cable_length": replace(length, values=length.values + 0.2)}
    assert kept(whole, replace(zeroed, channels=moved)) == ["run-1"]


@pytest.mark.parametrize("seed", range(0, 40, 2))
def test_two_recordings_of_one_motion_are_both_kept(seed: int) -> None:
    """Also where both are rounded alike, by three times their noise."""
    a, b = made(seed, ride=LONG, encoder=0.0), made(seed + 1, ride=LONG, encoder=0.0)
    assert len(kept(a, b)) == 2
    coarse = {name: 3 * size for name, size in NOISE.items()}
    assert len(kept(rounded(a, coarse, "a"), rounded(b, coarse, "b"))) == 2
    assert len(kept(a, rows(b, slice(0, 900, 2)))) == 2


def test_a_run_that_shares_less_than_half_of_its_rows_is_kept() -> None:
    whole = made(1, ride=LONG)
    assert len(kept(rows(whole, slice(0, 500), "a"), rows(whole, slice(400, 800), "b"))) == 2
    assert len(kept(rows(whole, slice(0, 500), "a"), rows(whole, slice(200, 600), "b"))) == 1


def test_one_output_that_agrees_by_chance_makes_no_copy() -> None:
    """A length instrument without noise; torque and tension are independent."""
    quiet = {**NOISE, "cable_length": 0.0}
    runs = [made(k, ride=LONG, noise=quiet, encoder=0.0) for k in (1, 2)]
    assert len(kept(*runs)) == 2


def test_the_data_set_says_what_it_left_out() -> None:
    whole = made(1, ride=LONG)
    dataset = prepare([whole, rows(whole, slice(0, 700))], GROOVED)
    assert len(dataset.recordings) == 1
    assert dataset.caveats == ("repeats-are-copies", "no-repeats")
    repeats = prepare([whole, made(2, ride=LONG), rows(whole, slice(0, 700))], GROOVED)
    assert [group.runs for group in repeats.repeats] == [(0, 1)]
    assert repeats.caveats == ("repeats-are-copies",)
    assert prepare([whole, made(2, ride=LONG)], GROOVED).caveats == ()


def test_repeats_that_round_alike_show_no_noise() -> None:
    """Rounded to ten times the noise, two runs differ in few samples."""
    sizes = {name: 10 * size for name, size in NOISE.items()}
    runs = [rounded(made(k, ride=LONG, encoder=0.0), sizes, f"run-{k}") for k in (1, 2)]
    dataset = prepare(runs, GROOVED)
    assert len(dataset.recordings) == 2
    found = {f.channel: f for f in dataset.sanity if f.code == "noise-floor-implausible"}
    assert set(found) == {"cable_length", "tension", "motor_torque"}
    for name, finding in found.items():
        assert finding.value < sizes[name] / np.sqrt(12)
    assert "noise-floor-implausible" in dataset.caveats
    plausible = [rounded(made(k, ride=LONG), dict(NOISE), f"run-{k}") for k in (1, 2)]
    assert prepare(plausible, GROOVED).caveats == ()
