"""Libraries of an interface: one that is not installed, and those that no process has to import."""

from __future__ import annotations

import importlib
import pty
import sys
from os import ttyname

import can.interfaces
import pytest

from command_line import own_process
from winchkit.drivers.can.bus.interface import open_interface
from winchkit.errors import ConnectionLost
from winchkit.schema.bench import BusSpec

_WITHOUT_LIBRARY = {"socketcan", "virtual", "udp_multicast", "socketcand"}
_ON_SERIAL_PORT = {"serial", "robotell", "slcan", "seeedstudio"}


def _refusal(spec: BusSpec) -> str:
    with pytest.raises(ConnectionLost) as refused:
        open_interface(spec, "can")
    return str(refused.value)


@pytest.mark.parametrize(
    "name", sorted(set(can.interfaces.BACKENDS) - _WITHOUT_LIBRARY - _ON_SERIAL_PORT)
)
def test_each_interface_of_python_can_without_its_library(name: str) -> None:
    said = _refusal(BusSpec("can", interface=name, channel="0"))
    assert said.startswith(f"bus 'can': cannot open {name} channel '0': it needs ")
    assert "\n" not in said
    assert "Error" not in said
    assert "not defined" not in said


@pytest.mark.parametrize("name", sorted(_ON_SERIAL_PORT))
def test_an_adapter_on_a_serial_port_without_pyserial(
    monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    place, kind = can.interfaces.BACKENDS[name]
    module = importlib.import_module(getattr(importlib.import_module(place), kind).__module__)
    monkeypatch.setattr(module, "serial", None)
    _, line = pty.openpty()
    said = _refusal(BusSpec("can", interface=name, channel=ttyname(line)))
    assert said.endswith("it needs the package pyserial: pip install pyserial")


@pytest.mark.parametrize("name", sorted(_ON_SERIAL_PORT))
def test_a_serial_port_that_is_not_there_is_no_missing_library(name: str) -> None:
    said = _refusal(BusSpec("can", interface=name, channel="/dev/ttyNONE7"))
    assert "/dev/ttyNONE7" in said
    assert "pip install" not in said


def test_socketcand_without_its_daemon_in_the_bench_file() -> None:
    bare = BusSpec("can", interface="socketcand", channel="can0")
    assert "needs `host` and `port`" in _refusal(bare)
    assert [key for key, _ in bare.rules()] == ["host", "port"]
    whole = BusSpec("can", interface="socketcand", channel="can0", host="127.0.0.1", port=9)
    assert not list(whole.rules())


def test_an_empty_channel_is_a_fault_of_the_bench_file() -> None:
    empty = BusSpec("can", interface="serial", channel="")
    assert [key for key, _ in empty.rules()] == ["channel"]


HEAVY = ("asammdf", "pandas", "canmatrix", "openpyxl")


@pytest.mark.slow
@pytest.mark.parametrize(
    "module", ["winchkit.drivers.can.bus.bus", "winchkit.sim.live.bench", "winchkit.bench.open"]
)
def test_a_bus_imports_no_package_of_mf4(module: str) -> None:
    code = (
        f"import sys, {module}; assert 'can' in sys.modules; print({set(HEAVY)} & set(sys.modules))"
    )
    done = own_process(sys.executable, "-c", code)
    assert done.stdout.strip() == "set()"


@pytest.mark.slow
def test_asammdf_can_be_imported_afterwards() -> None:
    pytest.importorskip("asammdf")
    code = "import winchkit.drivers.can.bus.bus, asammdf; print(asammdf.MDF.__name__)"
    done = own_process(sys.executable, "-c", code)
    assert done.stdout.strip() == "MDF"
