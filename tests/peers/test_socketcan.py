"""The conformance suite once more on real SocketCAN, with can-utils' candump as witness.

The machine is emulated and slow: all cases are run by ``pytest -m campaign``.
"""

from __future__ import annotations

import re
import sys
from collections import defaultdict
from pathlib import Path

import pytest

from socketcan.machine import CHANNELS, Finished, Unavailable, run

pytestmark = pytest.mark.realtime

SUITE = Path(__file__).parents[1] / "support" / "socketcan" / "suite.py"
STALL = "decides nothing: this computer did not run the test's processes"
"""In the reason of a skip by tests/conftest.py; the machine has one processor inside a busy one."""
_LINE = re.compile(rf"\(\d+\.\d+\) {CHANNELS[0]} ([0-9A-F]{{3}}#[0-9A-F]*)")


def by_identifier(frames: list[str]) -> dict[str, list[str]]:
    """Data of the frames in their order, by identifier."""
    found = defaultdict(list)
    for frame in frames:
        identifier, _, data = frame.partition("#")
        found[identifier].append(data)
    return dict(found)


def boot(folder: Path, *words: str) -> Finished:
    """Run the suite in the machine, which leaves its logs in a folder."""
    folder.mkdir()
    try:
        return run([sys.executable, str(SUITE), str(folder), *words], timeout=800)
    except Unavailable as error:
        pytest.skip(f"no machine with SocketCAN here: {error}")


@pytest.mark.timeout(900)
@pytest.mark.parametrize(
    ("words", "cases", "frames"),
    [
        pytest.param((), 20, 500, id="short"),
        pytest.param(("whole",), 45, 2000, id="whole", marks=pytest.mark.campaign),
    ],
)
def test_the_conformance_suite_passes_and_candump_saw_it(
    words: tuple[str, ...], cases: int, frames: int, tmp_path: Path
) -> None:
    logs = tmp_path / "logs"
    done = boot(logs, *words)
    assert done.returncode == 0, done.output
    passed = re.search(r"(\d+) passed", done.output)
    assert passed is not None
    skipped = re.findall(r"^SKIPPED .*", done.output, re.MULTILINE)
    assert (
        int(passed[1]) + sum(int(line.partition("[")[2].partition("]")[0]) for line in skipped)
        >= cases
    )
    assert all(STALL in line for line in skipped), skipped
    log = (logs / "candump.log").read_text(encoding="ascii")
    assert "DROPCOUNT" not in log
    dumped = [match[1] for match in map(_LINE.fullmatch, log.splitlines()) if match]
    assert len(dumped) == len(log.splitlines())
    seen = (logs / "seen.log").read_text(encoding="ascii").splitlines()
    assert len(seen) > frames
    assert by_identifier(seen) == by_identifier(dumped)
    if skipped:
        pytest.skip(f"in the machine: {'; '.join(skipped)}")
