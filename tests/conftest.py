"""What every test may take for granted, and what a failure beside a busy computer counts."""

from __future__ import annotations

import gc
import os
import re
import signal
import sys
from collections.abc import Generator
from pathlib import Path

import pytest

if sys.dont_write_bytecode:
    # The tests start hundreds of processes, and each would compile the same modules again. Where
    # no bytecode may be written beside the sources, it is kept with pytest's own cache.
    sys.dont_write_bytecode = False
    sys.pycache_prefix = str(Path(__file__).parents[1] / ".pytest_cache" / "bytecode")
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    os.environ["PYTHONPYCACHEPREFIX"] = sys.pycache_prefix

from hypothesis import settings

from stalls import LATE_CYCLES, StallWatch
from winchkit.extras import import_python_can

# Threads of small matrices only spin, and take the processors of the other tests.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
# Before a test imports it: with all that it imports of MF4, each process starts seconds later.
import_python_can()
# No test is judged by the clock: machines are shared and noisy. A change is judged by the same 100
# examples of each property; those who work on it look for 30 new ones at each run.
settings.register_profile("winchkit", deadline=None, max_examples=30)
settings.register_profile("landing", deadline=None, derandomize=True)
settings.load_profile("winchkit")

TOLERATED = 0.05
"""A longer stall (s) may trip a bench in real time: limits.response_time is 0.06 s."""
DEFAULT = "not realtime and not slow"
"""What ``pytest`` runs without ``-m`` (pyproject.toml)."""
SLOW = frozenset(
    map(
        Path,
        (
            "bench/control/test_fault_campaign.py",
            "bench/slave",
            "cli/core/test_examples.py",
            "cli/model/test_html_option.py",
            "cli/model/test_plan.py",
            "cli/model/test_promises.py",
            "cli/model/test_unknown_effect.py",
            "cli/model/test_whole_procedure.py",
            "devices/test_makers_drives.py",
            "diagnosis/design",
            "diagnosis/regression/test_dispersion.py",
            "diagnosis/residuals/test_orders.py",
            "diagnosis/selection",
            "diagnosis/test_campaign.py",
            "diagnosis/test_hidden_effects.py",
            "diagnosis/test_real_emps.py",
            "diagnosis/test_slow_joint.py",
            "diagnosis/verdict",
            "drivers/modbus/test_cell_fault_campaign.py",
            "drivers/modbus/test_modbus_campaign.py",
            "drivers/stream/test_faults.py",
            "fleet/diagnosis",
            "papers/test_ipanema3.py",
            "report/notebook",
            "report/pages/test_diagnosis.py",
            "report/test_text.py",
            "repository/test_examples.py",
            "repository/test_pages.py",
            "repository/test_wheel.py",
            "repository/test_words.py",
            "robot/bench/test_computation.py",
            "robot/bench/test_platform.py",
            "robot/calibration/test_benchmark.py",
            "robot/calibration/test_hanging_robot.py",
            "robot/calibration/test_tracker.py",
            "robot/diagnosis",
            "robot/forces/test_forces.py",
            "robot/report/test_diagnosis.py",
            "testing/test_sessions.py",
        ),
    )
)
"""Files and folders whose tests the default run leaves out: diagnoses of many runs, campaigns,
tables of faults, sessions of the pages, and the words of all texts."""
_WATCH = pytest.StashKey[StallWatch]()
_EARLIER = pytest.StashKey[dict[str, float]]()
"""Of the session: by fixture of a module, the largest stall (s) in the tests that used it."""
_ASLEEP = re.compile(
    r"this computer stood still for [\d.]+ s(?!.* computed for).*\(between two cycles\)"
)
"""A trip of a bench whose control thread slept too long while no thread of its process computed:
the kernel or the host of this virtual machine did not wake it."""


def pytest_configure() -> None:
    """Let children be ended by signals even where the tests themselves run in the background.

    A shell starts what it puts into the background with SIGINT ignored, nohup with SIGHUP
    ignored, and children inherit it.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    for name in ("SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """``-n auto``: more processes than processors for the whole suite, else this process.

    Half as many more, since some tests wait for peers. Those that move a bench in real time
    (``realtime``) want a processor to themselves.
    """
    whole = config.args == config.getini("testpaths")
    if not whole or "not realtime" not in config.option.markexpr:
        return 0
    here = hasattr(os, "sched_getaffinity")
    processors = len(os.sched_getaffinity(0)) if here else os.cpu_count() or 1
    return processors + max(1, processors // 2)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Collect without looking for garbage: of ten thousand tests and their modules, none is.

    Nor is it looked for there later: it would take 0.4 s, in which drives and benches of this
    process stand still.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark the tests of ``SLOW``, and leave campaigns to those who ask for them.

    A file or a folder of ``SLOW`` that the command line names is run.
    """
    tests = Path(__file__).parent
    named = {Path(each.partition("::")[0]).resolve() for each in config.args}
    parts = {tests / part for part in SLOW}
    if config.option.markexpr == DEFAULT:
        parts -= {part for part in parts for each in named if each.is_relative_to(part)}
    slow = {place for part in parts for place in (part, *part.rglob("test_*.py"))}
    left = []
    for item in items:
        if item.path in slow:
            item.add_marker(pytest.mark.slow)
        if item.get_closest_marker("campaign"):
            left.append(item)
    if left and "campaign" not in config.option.markexpr:
        items[:] = [item for item in items if not item.get_closest_marker("campaign")]
        config.hook.pytest_deselected(items=left)


def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> None:
    """How to run what the default selection leaves out."""
    if config.option.markexpr == DEFAULT and not hasattr(config, "workerinput"):
        terminalreporter.write_line(
            'Not run: long tests, pytest -m "slow and not realtime"; '
            "tests in real time, on a quiet computer, pytest -m realtime; "
            "further cases of campaigns, pytest -m campaign."
        )


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Watch for stalls of this computer while a test in real time runs."""
    if not item.get_closest_marker("realtime") or sys.platform != "linux":
        return (yield)
    with StallWatch() as watch:
        item.stash[_WATCH] = watch
        result = yield
    earlier = item.session.stash.setdefault(_EARLIER, {})
    for place in _shared(item):
        earlier[place] = max(earlier.get(place, 0.0), watch.largest)
    return result


def _shared(item: pytest.Item) -> list[str]:
    """The test's fixtures that outlive it: those of its module."""
    if not isinstance(item, pytest.Function):
        return []
    found = item._fixtureinfo.name2fixturedefs.items()
    return [f"{item.path}:{name}" for name, (*_, used) in found if used.scope == "module"]


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """A failure in real time beside a stall of this computer decides nothing: a skip, with it.

    A failure without a stall stays a failure, and a test that hangs is one.
    """
    report = yield
    watch = item.stash.get(_WATCH, None)
    if watch is None or not report.failed or call.excinfo is None:
        return report
    path, line, _ = item.location
    if (cycles := item.stash.get(LATE_CYCLES, None)) is not None:
        if late := cycles():
            words = f"the bench tripped, {late} cycles of its control began three periods late"
            report.outcome = "skipped"
            said = f"Skipped: decides nothing: {words}, and then: {call.excinfo.exconly()[:500]}"
            report.longrepr = (path, (line or 0) + 1, said)
        return report
    if found := _ASLEEP.search(call.excinfo.exconly()):
        report.outcome = "skipped"
        report.longrepr = (path, (line or 0) + 1, f"Skipped: decides nothing: {found[0]}")
        return report
    watch.sample()
    stall, when = watch.largest, ""
    if stall <= TOLERATED:
        # What outlives a test (a peer, a served bench) may have been stalled in an earlier one.
        earlier = item.session.stash.get(_EARLIER, {})
        stall = max((earlier.get(place, 0.0) for place in _shared(item)), default=0.0)
        when = " in an earlier test with the same fixture"
    if stall <= TOLERATED or "from pytest-timeout" in str(call.excinfo.value):
        return report
    reason = (
        f"Skipped: decides nothing: this computer did not run the test's processes for "
        f"{stall:.3f} s{when} (tolerated {TOLERATED:g} s), and then: {call.excinfo.exconly()[:500]}"
    )
    report.outcome = "skipped"
    report.longrepr = (path, (line or 0) + 1, reason)
    return report
