"""What each fault of the slave's table does, seen from outside."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from slave import FAULTS, Nmt, State
from slave.wire import Wire, moving

_OWN = ("winchkit",)
SLAVE = Path(__file__).parents[1] / "support" / "slave"


def test_the_slave_shares_nothing_with_winchkit() -> None:
    names = {
        "__init__", "dictionary", "emergency", "faults", "frames", "motion", "motor", "network",
        "on_bus", "pdo", "power", "sdo", "slave", "wire",
    }  # fmt: skip
    for name in names:
        tree = ast.parse((SLAVE / f"{name}.py").read_text(encoding="utf-8"))
        imported = [n.module or "" for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)]
        imported += [a.name for n in ast.walk(tree) if isinstance(n, ast.Import) for a in n.names]
        assert not [module for module in imported if module.split(".")[0] in _OWN], name


@pytest.mark.parametrize("name", sorted(FAULTS))
def test_every_fault_can_be_set_and_taken_back(name: str) -> None:
    wire = moving()
    wire.slave.inject(name)
    wire.wait(0.05)
    assert (name in wire.slave.faults) is FAULTS[name].lasts
    wire.slave.mend_all()
    assert not wire.slave.faults
    wire.wait(0.05)


@pytest.mark.parametrize(
    ("name", "state"),
    [
        ("second master disables", State.SWITCH_ON_DISABLED),
        ("reboots", State.SWITCH_ON_DISABLED),
        ("reset by a stranger", State.SWITCH_ON_DISABLED),
        ("stopped by a stranger", State.SWITCH_ON_DISABLED),
        ("pre-operational by a stranger", State.ENABLED),
        ("emergency", State.ENABLED),
        ("mode changed", State.ENABLED),
    ],
)
def test_the_state_that_a_fault_leads_to(name: str, state: State) -> None:
    wire = moving()
    wire.slave.inject(name)
    wire.wait(1.0)
    assert wire.slave.power.state is state


@pytest.mark.parametrize("name", ["second master enables", "enables itself"])
def test_it_is_enabled_without_its_host(name: str) -> None:
    wire = Wire()
    wire.slave.inject(name)
    wire.wait(0.01)
    assert wire.slave.power.state is State.ENABLED


@pytest.mark.parametrize("name", ["quick stop ignored", "control word unheeded", "unresponsive"])
def test_a_quick_stop_changes_nothing(name: str) -> None:
    wire = moving()
    wire.slave.inject(name)
    wire.write(0x6040, 0, 0x02, 2)
    wire.wait(1.0)
    assert wire.slave.power.state is State.ENABLED
    assert wire.slave.motor.velocity > 19


def test_an_unresponsive_slave_ignores_a_lost_heartbeat() -> None:
    wire = moving()
    wire.write(0x1016, 1, 0x007F0064, 4)
    wire.send(0x77F, "05")
    wire.slave.inject("unresponsive")
    wire.wait(1.0)
    assert wire.slave.network.state is Nmt.OPERATIONAL


def test_host_frames_lost_trips_the_slaves_own_watchdog() -> None:
    wire = moving()
    wire.write(0x6007, 0, 3, 2)
    wire.write(0x1016, 1, 0x007F0064, 4)
    wire.send(0x77F, "05")
    wire.slave.inject("host frames lost")
    for _ in range(10):
        wire.send(0x77F, "05")
        wire.wait(0.05)
    assert wire.slave.power.state is State.SWITCH_ON_DISABLED


@pytest.mark.parametrize("multiple", [-1.0, 0.5, 2.0, 0.0])
def test_it_follows_wrongly(multiple: float) -> None:
    wire = moving(10.0)
    wire.slave.inject("follows wrongly", multiple)
    wire.wait(0.2)
    assert wire.slave.motor.velocity == pytest.approx(10.0 * multiple, abs=1e-3)


@pytest.mark.parametrize(
    ("name", "index"),
    [("velocity stuck", 0x606C), ("position stuck", 0x6064), ("status frozen", 0x6041)],
)
def test_an_object_is_stuck_while_the_shaft_is_not(name: str, index: int) -> None:
    wire = moving()
    wire.slave.inject(name)
    before = wire.read(index)
    angle = wire.slave.motor.angle
    wire.wait(0.1)
    wire.write(0x60FF, 0, 0, 4)
    wire.slave.inject("second master disables")
    wire.wait(0.5)
    assert wire.read(index) == before
    assert wire.slave.motor.angle > angle + 1


def test_it_turns_while_disabled() -> None:
    wire = Wire()
    wire.slave.inject("turns while disabled", 3.0)
    wire.wait(0.1)
    assert wire.slave.motor.velocity == pytest.approx(3.0, rel=1e-3)
    wire.slave.mend("turns while disabled")
    wire.wait(0.2)
    assert wire.slave.motor.velocity == 0


def test_two_nodes_answer_with_one_number() -> None:
    wire = Wire()
    wire.slave.inject("two nodes with one number")
    wire.wait(0.1)
    replies = wire.send(0x601, "4018100400000000")
    serials = {int.from_bytes(frame.data[4:], "little") for frame in replies}
    assert len(replies) == len(serials) == 2
