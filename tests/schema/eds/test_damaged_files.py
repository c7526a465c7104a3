"""Whatever happens to an EDS, it is read or refused with a line, and never a traceback."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from eds_text import GOOD, written
from winchkit.drivers.can.canopen.node import read_eds
from winchkit.errors import Fault, FileError
from winchkit.sim.drive.object_dictionary import read_eds as read_for_simulation

ROWS = GOOD.split("\n")


@settings(
    max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    st.lists(
        st.tuples(
            st.integers(0, len(ROWS) - 1),
            st.sampled_from(["drop", "twice", "no value", "odd value", "swap", "cut"]),
            st.integers(0, len(ROWS) - 1),
        ),
        min_size=1,
        max_size=6,
    )
)
def test_no_damage_is_a_traceback(tmp_path: Path, damage: list[tuple[int, str, int]]) -> None:
    """Whatever is done to its lines: it is read, or refused with a line in this file."""
    rows = list(ROWS)
    for place, kind, other in damage:
        row = rows[place]
        if kind == "drop":
            rows[place] = ""
        elif kind == "twice":
            rows[place] = f"{row}\n{row}"
        elif kind == "no value":
            rows[place] = row.partition("=")[0] + "="
        elif kind == "odd value":
            rows[place] = row.partition("=")[0] + "=$?"
        elif kind == "swap":
            rows[place], rows[other] = rows[other], row
        else:
            rows[place] = row[: len(row) // 2]
    path = written(tmp_path, "\n".join(rows))
    faults = [*faults_of(read_eds, path), *faults_of(read_for_simulation, path)]
    assert all(fault.path == str(path) and fault.line is not None for fault in faults)


def faults_of(read: Callable[[Path, int], object], path: Path) -> tuple[Fault, ...]:
    try:
        read(path, 5)
    except FileError as error:
        return error.faults
    return ()
