"""Processes that open a bus import python-can and none of the packages of its MF4 logs."""

from __future__ import annotations

import subprocess
import sys

import pytest

HEAVY = ("asammdf", "pandas", "canmatrix", "openpyxl")


@pytest.mark.slow
@pytest.mark.parametrize(
    "module", ["winchkit.drivers.can.bus.bus", "winchkit.sim.live.bench", "winchkit.bench.open"]
)
def test_a_bus_imports_no_package_of_mf4(module: str) -> None:
    code = (
        f"import sys, {module}; assert 'can' in sys.modules; print({set(HEAVY)} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


@pytest.mark.slow
def test_asammdf_can_be_imported_afterwards() -> None:
    pytest.importorskip("asammdf")
    code = "import winchkit.drivers.can.bus.bus, asammdf; print(asammdf.MDF.__name__)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "MDF"
