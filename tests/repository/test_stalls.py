"""A failure in real time is a failure, unless this computer did not run the test meanwhile."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import pytest

from command_line import own_process
from stalls import StallWatch, stolen

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="schedstat of Linux")
pytest_plugins = ["pytester"]

TESTS = Path(__file__).parents[1]
SUPPORT = TESTS / "support"
STARVED = """
import os, subprocess, sys, time
sys.path.insert(0, {tests!r})
from stalls import StallWatch
processor = min(os.sched_getaffinity(0))
os.sched_setaffinity(0, [processor])
busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range({busy})]
os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
with StallWatch() as watch:
    end = time.monotonic() + 2.0
    while time.monotonic() < end:
        time.sleep(0.001)
for process in busy:
    process.kill()
    process.wait()
print(watch.largest)
"""


@pytest.mark.slow
def test_a_thread_that_waits_for_the_processor_shows() -> None:
    """A process of the lowest class on one processor, beside busy ones."""
    script = STARVED.format(tests=str(SUPPORT), busy=2)
    run = own_process(sys.executable, "-c", script)
    assert float(run.stdout) > 0.05


@pytest.mark.realtime
def test_processor_time_and_locks_of_the_program_are_no_stall(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Half a second of the sampling thread without the interpreter lock, then of waiting."""
    proc = fake_proc(tmp_path, os.getpid(), wait=1.0)
    with StallWatch(proc) as watch:
        begun = time.process_time()
        while time.process_time() - begun < 0.3:
            sum(range(10**6))
    assert watch.largest < 0.2


def test_a_processor_that_the_host_took_away_shows(tmp_path: Path) -> None:
    """Steal of one processor, while every thread of the test goes on; that of all is not added."""
    proc = fake_proc(tmp_path, os.getpid(), wait=1.0)
    ticks = os.sysconf("SC_CLK_TCK")

    def count(first: float, second: float) -> None:
        rows = [("cpu", first + second), ("cpu0", first), ("cpu1", second)]
        lines = [f"{name} 1 2 3 4 5 6 7 {taken * ticks:.0f} 0 0" for name, taken in rows]
        (proc / "stat").write_text("\n".join([*lines, "intr 1 2 3"]) + "\n")

    count(7.0, 3.0)
    watch = StallWatch(proc)
    watch._stolen = stolen(proc)
    count(7.0, 3.02)
    watch.sample()
    assert watch.largest == pytest.approx(0.02)
    count(7.4, 3.35)
    watch.sample()
    assert watch.largest == pytest.approx(0.4)


def test_a_wait_of_a_process_with_the_mark_shows(tmp_path: Path) -> None:
    proc = fake_proc(tmp_path, os.getpid(), wait=1.0)
    with StallWatch(proc) as watch:
        fake_proc(tmp_path, 4711, wait=2.0, mark=f"WINCHKIT_TESTS_OF={os.getpid()}")
        fake_proc(tmp_path, 4712, wait=2.0, mark="WINCHKIT_TESTS_OF=1")
        time.sleep(1.2)
        fake_proc(tmp_path, 4712, wait=9.0)
        time.sleep(0.1)
        assert watch.largest < 0.5
        fake_proc(tmp_path, 4711, wait=2.75)
        time.sleep(0.1)
    assert watch.largest == pytest.approx(0.75)


def fake_proc(folder: Path, process: int, wait: float, mark: str = "") -> Path:
    """What proc(5) shows of a process of one thread."""
    task = folder / str(process) / "task" / str(process)
    task.mkdir(parents=True, exist_ok=True)
    (task / "schedstat").write_text(f"12345 {round(wait * 1e9)} 6\n")
    if mark:
        (folder / str(process) / "environ").write_bytes(f"A=1\0{mark}\0".encode())
    return folder


def trip(cause: str, where: str = "between two cycles") -> str:
    """What a bench says of a standstill (winchkit.bench.control.standstill)."""
    return f"LimitTripped: this computer stood still for 0.41 s (limit 0.40 s): {cause} ({where})"


def configure(pytester: pytest.Pytester, sample: str) -> None:
    """This project's conftest.py, whose watch samples what is given."""
    pytester.makepyprojecttoml("[tool.pytest.ini_options]\nmarkers = ['realtime']\n")
    text = (TESTS / "conftest.py").read_text()
    pytester.makeconftest(
        text.replace(
            "from stalls import", f"sys.path.insert(0, {str(SUPPORT)!r})\nfrom stalls import"
        )
        + f"\nStallWatch.sample = lambda self, seen=[]: {sample}\n"
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("stall", "body", "outcome"),
    [
        (0.0, "assert not 'wrong'", "failed"),
        (0.2, "assert not 'wrong'", "skipped"),
        (0.2, "pytest.fail('Timeout (>1.0s) from pytest-timeout.')", "failed"),
        (0.2, "pass", "passed"),
        (0.0, f"pytest.fail({trip('other programs had the processor for 0.38 s')!r})", "skipped"),
        (0.0, f"pytest.fail({trip('a suspended process')!r})", "skipped"),
        (0.0, f"pytest.fail({trip('the control thread computed for 0.38 s')!r})", "failed"),
        (0.0, f"pytest.fail({trip('a suspended process', 'within a cycle')!r})", "failed"),
    ],
)
def test_what_a_stall_makes_of_a_test(
    pytester: pytest.Pytester, stall: float, body: str, outcome: str
) -> None:
    configure(pytester, f"setattr(self, 'largest', {stall})")
    pytester.makepyfile(
        f"import pytest\n@pytest.mark.realtime\ndef test_it():\n    {body}\n"
        "def test_of_no_real_time():\n    assert not 'wrong'\n"
    )
    result = pytester.runpytest_subprocess("-rs", "-p", "no:cacheprovider")
    counts = result.parseoutcomes()
    assert counts.pop("failed") == 1 + (outcome == "failed")
    if outcome != "failed":
        assert counts.pop(outcome) == 1
    if outcome == "skipped" and stall:
        result.stdout.fnmatch_lines(["*did not run the test's processes for 0.200 s*wrong*"])


@pytest.mark.slow
def test_what_outlives_a_test_may_have_been_stalled_in_an_earlier_one(
    pytester: pytest.Pytester,
) -> None:
    """The first of three tests is stalled; the second shares a fixture with it."""
    first = "seen[0] is self"
    configure(pytester, f"(seen.append(self), setattr(self, 'largest', 0.2 if {first} else 0.0))")
    pytester.makepyfile(
        "import pytest\n"
        "pytestmark = pytest.mark.realtime\n"
        "@pytest.fixture(scope='module')\ndef peer():\n    return []\n"
        "def test_stalled(peer):\n    pass\n"
        "def test_with_the_peer(peer):\n    assert not 'wrong'\n"
        "def test_alone():\n    assert not 'wrong'\n"
    )
    result = pytester.runpytest_subprocess("-rs", "-p", "no:cacheprovider")
    result.assert_outcomes(passed=1, skipped=1, failed=1)
    result.stdout.fnmatch_lines(
        ["*___ test_alone ___*", "*for 0.200 s in an earlier test with the same fixture*"]
    )
