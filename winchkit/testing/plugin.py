"""The pytest plugin: ``sim_bench`` opens simulated benches for a test.

It imports nothing but pytest until a test asks for the fixture.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from winchkit.testing.opened import OpenedBench

__all__ = ["SimBenchFixture", "sim_bench"]


class SimBenchFixture:
    """Value of the fixture ``sim_bench``: call it to open a simulated bench."""

    def __init__(self, stack: ExitStack, folder: Path) -> None:
        self._stack, self._folder = stack, folder

    def __call__(
        self,
        name: str | Path | None = None,
        *,
        winches: Mapping[str, Mapping[str, Any]] | None = None,
        hidden: Sequence[str] = (),
        seed: int = 0,
        real_time: bool = False,
    ) -> OpenedBench:
        """Open a bench of ``sim/`` by name or path, or one with the declared ``winches``.

        A winch is a table as in a file, ``{"load_mass": "20 kg", "limits": {"speed": "1 m/s"}}``;
        what it leaves out is as on ``spiral-bench``. With both, the winches stand on the named
        bench instead of its own. ``hidden`` is physics that the profile does not know, ``seed``
        that of the noise. With ``real_time`` time runs by itself, see :class:`OpenedBench`. The
        bench is closed at the end of the test. Raises FileError, UsageError, and the errors of
        ``open_bench``.
        """
        from winchkit.testing.declared import declared
        from winchkit.testing.opened import OpenedBench

        bench = declared(name, winches, self._folder)
        return self._stack.enter_context(
            OpenedBench(bench, hidden=hidden, seed=seed, real_time=real_time)
        )


@pytest.fixture
def sim_bench(tmp_path: Path) -> Iterator[SimBenchFixture]:
    """Open simulated benches: ``sim = sim_bench("spiral-bench")``, then ``sim.bench``.

    Whatever a test leaves open is stopped and closed after it.
    """
    with ExitStack() as stack:
        yield SimBenchFixture(stack, tmp_path)
