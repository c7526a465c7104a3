"""Loops that numba has compiled, once for all tests: compiling takes seconds."""

from __future__ import annotations

from importlib.util import find_spec

import pytest

from winchkit.estimation import PLAIN, Kernels, compiled


@pytest.fixture(scope="session")
def compiled_kernels() -> Kernels:
    pytest.importorskip("numba")
    return compiled()


@pytest.fixture(scope="session")
def kernels(request: pytest.FixtureRequest) -> Kernels:
    """Compiled where numba is installed: for long identifications, whose loops are not tested."""
    if find_spec("numba") is None:
        return PLAIN
    found: Kernels = request.getfixturevalue("compiled_kernels")
    return found
