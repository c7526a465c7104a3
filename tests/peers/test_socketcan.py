"""The conformance suite once more on real SocketCAN, with can-utils' candump as witness."""

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


def boot(folder: Path) -> Finished:
    """Run the suite in the machine, which leaves its logs in a folder."""
    folder.mkdir()
    try:
        return run([sys.executable, str(SUITE), str(folder)], timeout=400)
    except Unavailable as error:
        pytest.skip(f"no machine with SocketCAN here: {error}")


@pytest.mark.timeout(900)
def test_the_conformance_suite_passes_and_candump_saw_it(tmp_path: Path) -> None:
    logs = tmp_path / "logs"
    done = boot(logs)
    assert done.returncode == 0, done.output
    passed = re.search(r"(\d+) passed", done.output)
    assert passed is not None
    assert int(passed[1]) > 30
    skipped = re.findall(r"^SKIPPED .*", done.output, re.MULTILINE)
    assert all(STALL in line for line in skipped), skipped
    log = (logs / "candump.log").read_text(encoding="ascii")
    assert "DROPCOUNT" not in log
    dumped = [match[1] for match in map(_LINE.fullmatch, log.splitlines()) if match]
    assert len(dumped) == len(log.splitlines())
    seen = (logs / "seen.log").read_text(encoding="ascii").splitlines()
    assert len(seen) > 2000
    assert by_identifier(seen) == by_identifier(dumped)
    if skipped:
        pytest.skip(f"in the machine: {'; '.join(skipped)}")
