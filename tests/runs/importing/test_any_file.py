"""Whatever a file holds, it is read or refused in words."""

from __future__ import annotations

import contextlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from logger_layouts import LAYOUTS
from winchkit.errors import WinchkitError
from winchkit.runs.importing.formats.source import read_table
from winchkit.runs.importing.guess import guess_columns
from winchkit.runs.importing.runs import run_of
from winchkit.runs.importing.streams import streams_of

CELLS = st.sampled_from(
    [
        *(
            "0",
            "1",
            "2,5",
            "-3.25",
            "1e9",
            "nan",
            "",
            "x",
            "Zeit [ms]",
            "time",
            "pos",
            "torque (Nm)",
        ),
        *(
            "12:30:00",
            "2026-03-04 12:00:00.5",
            "04.03.2026",
            "Frame",
            "X",
            "Y",
            "Z",
            "W",
            "qw",
            "[N]",
        ),
        *(
            "#",
            "# a: b",
            "inf",
            "1.234,5",
            "Name",
            "Unit",
            "100",
            "Trajectories",
            '"',
            "m1_pos",
            "%",
        ),
    ]
)
LINES = st.lists(CELLS, min_size=0, max_size=6)
SETTINGS = settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def whole(path: Path) -> None:
    """All steps of an import; errors in words are permitted."""
    with contextlib.suppress(WinchkitError):
        guess = guess_columns(read_table(path))
        if not guess.questions:
            run_of(streams_of(guess), {})


@given(
    lines=st.lists(LINES, max_size=25),
    mark=st.sampled_from(",;\t |"),
    end=st.sampled_from(["\n", "\r\n", ""]),
)
@SETTINGS
def test_any_text_is_read_or_refused(
    lines: list[list[str]], mark: str, end: str, tmp_path: Path
) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes((end or "\n").join(mark.join(cells) for cells in lines).encode())
    whole(path)


@given(data=st.binary(max_size=200), head=st.sampled_from([
    b"", b"PK\x03\x04", b"MATLAB 5.0 MAT-file", b"\x89HDF\r\n\x1a\n", b"PAR1", b"\x93NUMPY\x01\x00",
    b"\x89MCAP0\r\n", b"\xff\xfe", b"\xef\xbb\xbf"]))  # fmt: skip
@SETTINGS
def test_any_bytes_are_read_or_refused(data: bytes, head: bytes, tmp_path: Path) -> None:
    path = tmp_path / "log"
    path.write_bytes(head + data)
    whole(path)


@pytest.mark.slow
@pytest.mark.parametrize("layout", LAYOUTS[::6], ids=lambda layout: layout.name)
def test_a_file_that_is_cut_anywhere_is_read_or_refused(layout: object, tmp_path: Path) -> None:
    path = tmp_path / f"log{layout.suffix}"  # type: ignore[attr-defined]
    layout.write(path)  # type: ignore[attr-defined]
    data = path.read_bytes()
    for share in np.linspace(0.0, 1.0, 14):
        path.write_bytes(data[: int(share * len(data))])
        whole(path)
