"""The public names, found lazily."""

import subprocess
import sys

import pytest

import winchkit
from winchkit.bench.open import open_bench

HEAVY = {"numpy", "scipy", "can", "canopen", "pymodbus", "pydantic", "rich"}


def test_importing_winchkit_stays_light_and_knows_its_names() -> None:
    code = "import sys, winchkit; print(*dir(winchkit)); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    names, modules = (set(line.split()) for line in done.stdout.splitlines())
    assert set(winchkit.__all__) <= names
    assert not HEAVY & modules


def test_public_names_are_the_real_things() -> None:
    assert winchkit.open_bench is open_bench
    with pytest.raises(AttributeError, match="has no attribute 'open_becnh'"):
        _ = winchkit.open_becnh
