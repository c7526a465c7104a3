"""A browser, and served simulated benches that pages move."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from browsing import Served, chromium
from stalls import LATE_CYCLES
from winchkit import find


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with chromium() as found:
        yield found


@contextmanager
def moving(
    name: str, folders: pytest.TempPathFactory, *, cycle: str | None = None
) -> Iterator[Served]:
    """A simulated bench that pages may move, in a folder of its own.

    Another ``cycle`` than its own takes another share of the computer.
    """
    folder = folders.mktemp("work")
    if cycle is not None:
        text = find("sim", name).read_text()
        changed = re.sub(r"(?m)^cycle = .*$", f'cycle = "{cycle}"', text)
        assert changed != text
        (folder / f"{name}.toml").write_text(changed)
        name = f"{name}.toml"
    found = Served("--sim", name, folder=folder)
    yield found
    found.end()


def judged(served: Served, request: pytest.FixtureRequest) -> Served:
    """The bench; a failure of the test decides nothing where late cycles of its control tripped it.

    Late cycles without a trip change nothing that a page shows, and excuse no failure.
    """
    before = late_cycles(served.status())

    def late() -> int:
        status = served.status()
        return late_cycles(status) - before if status.get("tripped") else 0

    request.node.stash[LATE_CYCLES] = late
    return served


def late_cycles(status: dict[str, Any]) -> int:
    """Cycles of the control that began three periods or more after the one before, so far.

    None before the bench is open, when its status is empty.
    """
    return int(status["cycle_time"]["counts"][-1]) if status else 0


@pytest.fixture(scope="module")
def winch_served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with moving("demo-adequate", tmp_path_factory) as found:
        yield found


@pytest.fixture
def bench(winch_served: Served, request: pytest.FixtureRequest) -> Served:
    """A bench of one winch."""
    return judged(winch_served, request)


@pytest.fixture
def robot(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Served]:
    """A bench of a robot of eight cables, which ends with its test.

    With its own cycle of 8 ms it takes a processor, and a browser needs most of the other.
    """
    with moving("cabtive-robot", tmp_path_factory, cycle="16 ms") as found:
        yield judged(found, request)


@pytest.fixture
def hanging_robot(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """A bench of a robot of four cables, which do not determine its rotation."""
    with moving("hanging-robot", tmp_path_factory) as found:
        yield found
