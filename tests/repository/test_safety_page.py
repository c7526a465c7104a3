"""docs/safety.md has the supervisor's conditions and the ways to stop as the code has them."""

from __future__ import annotations

import re
import runpy
from collections.abc import Callable

from snippets import ROOT
from winchkit.bench.control.conditions import BENCH_CONDITIONS


def test_the_tables_are_what_the_code_declares() -> None:
    written: Callable[[str], str] = runpy.run_path(str(ROOT / "docs/make_safety.py"))["tables"]
    there = (ROOT / "docs/safety.md").read_text(encoding="utf-8")
    assert there == written(there), "run: python docs/make_safety.py"


_RECORDS = ("records/latch.py", "records/position_file.py")


def test_every_trip_of_the_control_loop_stands_in_the_table() -> None:
    source = "".join(
        (ROOT / "winchkit" / name).read_text(encoding="utf-8")
        for name in (
            *(f"bench/{own}" for own in ("control/loop.py", "hardware.py", *_RECORDS, "winch.py")),
            *(f"robot/bench/{own}.py" for own in ("correction", "force_loop", "pose_loop")),
        )
    )
    raised = set(re.findall(r'Trip\(\s*"([a-z ]+)"', source))
    assert raised == {row.kind for row in BENCH_CONDITIONS}
