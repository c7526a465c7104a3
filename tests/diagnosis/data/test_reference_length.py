"""A profile without its free length takes it from runs that measure it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis_runs import SPIRAL, made, with_channel
from winchkit.diagnosis.data.preparation import prepare

UNKNOWN = replace(SPIRAL, reference=replace(SPIRAL.reference, cable_length=None))


def test_the_free_length_is_that_of_the_runs() -> None:
    dataset = prepare([made(1, SPIRAL), made(2, SPIRAL)], UNKNOWN)
    assert dataset.profile.reference.cable_length == pytest.approx(
        SPIRAL.reference.cable_length, abs=1e-3
    )
    known = prepare([made(1, SPIRAL)], SPIRAL).motions[0].free_length
    np.testing.assert_allclose(dataset.motions[0].free_length, known, atol=1e-3)


def test_an_instrument_that_was_zeroed_on_the_way_measures_no_free_length() -> None:
    run = made(1, SPIRAL)
    zeroed = with_channel(run, "cable_length", run["cable_length"] - run["cable_length"].mean())
    assert prepare([zeroed], UNKNOWN).profile.reference.cable_length is None


def test_a_stated_length_stays() -> None:
    other = replace(SPIRAL, reference=replace(SPIRAL.reference, cable_length=2.0))
    assert prepare([made(1, SPIRAL)], other).profile.reference.cable_length == 2.0
