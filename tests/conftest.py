"""What every test may take for granted."""

from __future__ import annotations

import signal

import pytest
from hypothesis import settings

# No test is judged by the clock: machines are shared and noisy.
settings.register_profile("winchkit", deadline=None)
# A change is judged by the same examples each time; those who work on it look for new ones.
settings.register_profile("landing", deadline=None, derandomize=True)
settings.load_profile("winchkit")


def pytest_configure() -> None:
    """Let children be interrupted even where the tests themselves run in the background.

    A shell starts what it puts into the background with SIGINT ignored, and children inherit it.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """A machine that stands still for a moment shakes a simulated load for real; twice is a defect.

    The summary counts every such second run.
    """
    if not config.pluginmanager.hasplugin("rerunfailures"):
        return
    for item in items:
        if item.get_closest_marker("realtime"):
            item.add_marker(pytest.mark.flaky(reruns=1))
