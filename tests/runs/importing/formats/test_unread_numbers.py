"""Columns of a channel whose cells are written as no number are reported, not only dropped."""

from __future__ import annotations

from pathlib import Path

import pytest

from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns


@pytest.mark.parametrize("cell", ["0x{:04X}", "({}.5)", "{}.5-", "{},5"])
def test_a_torque_that_cannot_be_read_is_reported(cell: str, tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    rows = "\n".join(f"{k / 100};{k % 13};{cell.format(k % 7 + 1)}" for k in range(60))
    path.write_text(f"time [s];angle [rad];torque [Nm]\n{rows}\n")
    guess = guess_columns(read_table(str(path)))
    used = {item.channel for item in guess.used}
    told = [note for note in guess.notes if "'torque' is named like motor_torque" in note]
    assert bool(told) == ("motor_torque" not in used)


def test_the_cell_that_is_no_number_is_the_one_that_is_shown(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("time [s],tension [N]\n0,1\n1,x\n2,3\n")
    (note,) = guess_columns(read_table(str(path))).notes
    assert note.endswith("such as 'x'")
