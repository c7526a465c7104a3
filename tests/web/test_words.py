"""Texts of the command line on the page."""

from __future__ import annotations

from pathlib import Path

import pytest

from winchkit.errors import UsageError
from winchkit.regular_file import refuse_existing
from winchkit.web.words import free_path, page_text


def test_a_refusal_to_write_over_a_file_offers_no_option(tmp_path: Path) -> None:
    taken = tmp_path / "bench.csv"
    taken.write_text("x")
    with pytest.raises(UsageError) as refused:
        refuse_existing(taken, replace=False)
    said = page_text(str(refused.value))
    assert said == f"{taken} exists already; name another file"
    assert page_text("name it by --sample-rate") == "name it by sample rate"
    unit = "'F' has no unit; one of N, kN; --column \"tension=\" where it is none of them"
    assert page_text(unit) == "'F' has no unit; one of N, kN"
    unused = (
        '--rated-torque is not used: no column is in A; --column "tension=COLUMN [A]" where one is'
    )
    assert page_text(unused) == "rated torque is not used: no column is in A"
    alone = "a run of a load cell alone, for `winchkit cell diagnose --run`; import the other file"
    assert page_text(alone) == "a run of a load cell alone; import the other file"


def test_a_new_file_takes_the_first_free_name(tmp_path: Path) -> None:
    assert free_path(tmp_path, "bench.csv").name == "bench.csv"
    for name in ("bench.csv", "bench-2.csv"):
        (tmp_path / name).touch()
    assert free_path(tmp_path, "bench.csv").name == "bench-3.csv"
