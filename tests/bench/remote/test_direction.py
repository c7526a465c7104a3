"""The direction of what a station orders: by name only, and the same as of the bench's owner."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from slave.rig import Rig
from winchkit.bench.bench import Bench
from winchkit.bench.remote.client import RemoteStation, attach
from winchkit.bench.remote.operations import Station
from winchkit.bench.remote.station import LocalStation
from winchkit.bench.winch import Winch
from winchkit.errors import UsageError

SPEED = 0.1
LENGTH = 0.5
SEEN = 0.3
"""s: within the hold of a jog and the life sign of a move."""

STATIONS = ["local", "remote"]
OWNERS: dict[str, Callable[[Winch, str], None]] = {
    "jog": lambda winch, way: winch.jog(**{way: SPEED}, hold=1.0),
    "move_by": lambda winch, way: winch.move_by(**{way: LENGTH}, speed=SPEED, wait=False),  # type: ignore[arg-type]
}
ORDERS: dict[str, Callable[[Station, str], None]] = {
    "jog": lambda station, way: station.jog("A", **{way: SPEED}, hold=1.0),
    "step": lambda station, way: station.step("A", **{way: LENGTH}, speed=SPEED),
    "move": lambda station, way: station.move("A", **{way: LENGTH}, speed=SPEED),
    "move all": lambda station, way: station.move("all", **{way: LENGTH}, speed=SPEED),
}


@contextmanager
def at(kind: str, bench: Bench) -> Iterator[LocalStation | RemoteStation]:
    """A station of the owner's process, or one at its socket; the winch is at rest at the end."""
    station = LocalStation(bench) if kind == "local" else attach(bench.spec)
    try:
        yield station
    finally:
        bench.winch["A"].stop()
        station.close()


def velocity(rig: Rig) -> float:
    """Of the motor a moment after an order, rad/s."""
    rig.wait(SEEN)
    return rig.slaves[0].motor.velocity


@pytest.fixture(scope="module")
def owners(tmp_path_factory: pytest.TempPathFactory) -> dict[str, float]:
    """Velocity of the motor (rad/s) for each direction, as ``open_bench`` moves it."""
    found = {}
    for way, sign in (("pay_out", 1), ("wind_in", -1)):
        for name, order in OWNERS.items():
            rig = Rig(tmp_path_factory.mktemp("owner"))
            with rig.opened() as bench:
                before = bench.winch["A"].cable_length
                order(bench.winch["A"], way)
                found[f"{name} {way}"] = velocity(rig)
                assert sign * (bench.winch["A"].cable_length - before) > 1e-3
    return found


@pytest.mark.parametrize("way", ["pay_out", "wind_in"])
@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("kind", STATIONS)
def test_the_motor_turns_as_by_the_owner(
    rig: Rig, owners: dict[str, float], kind: str, order: str, way: str
) -> None:
    expected = owners[f"{'jog' if order == 'jog' else 'move_by'} {way}"]
    assert abs(expected) > 1
    with rig.opened() as bench, at(kind, bench) as station:
        ORDERS[order](station, way)
        assert velocity(rig) == pytest.approx(expected, rel=1e-6)


def test_the_two_directions_are_opposite(owners: dict[str, float]) -> None:
    for name in OWNERS:
        assert owners[f"{name} pay_out"] * owners[f"{name} wind_in"] < 0


@pytest.mark.parametrize("kind", STATIONS)
def test_a_number_without_a_name_is_refused_and_moves_nothing(rig: Rig, kind: str) -> None:
    with rig.opened() as bench, at(kind, bench) as station:
        words = {}
        for call in (station.jog, station.step, station.move):
            name = call.__name__
            for given in ((0.02,), (-0.02, 0.15), (None, 0.02)):
                shown = r"\(" + ", ".join(map(str, given)) + r"\)"
                text = rf"^{name}{shown}.*write {name}\(pay_out=...\) or {name}\(wind_in=...\)"
                with pytest.raises(UsageError, match=text):
                    call("A", *given)
            with pytest.raises(UsageError) as error:
                call("A", -0.02)
            words[name] = str(error.value)
        with pytest.raises(UsageError) as error:
            bench.winch["A"].jog(-0.02)
        assert words["jog"] == str(error.value)
        assert not bench.winch["A"].moving
        assert velocity(rig) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("kind", STATIONS)
def test_exactly_one_positive_number_is_given(rig: Rig, kind: str) -> None:
    with rig.opened() as bench, at(kind, bench) as station:
        both: dict[str, Any] = {"pay_out": 0.1, "wind_in": 0.1}
        for call in (station.jog, station.step):
            for given in ({}, both):
                with pytest.raises(UsageError, match="needs one of pay_out= and wind_in="):
                    call("A", **given)
        for wrong in ({}, {"to": 3.0, "wind_in": 0.1}, {"to": 3.0, "pay_out": 0.1}):
            with pytest.raises(UsageError, match="either to a cable length or by a change of it"):
                station.move("A", **wrong)
        with pytest.raises(UsageError, match="needs one of pay_out= and wind_in=, and has both"):
            station.move("A", **both)
        for call in (station.jog, station.step, station.move):
            for value in (-0.1, 0.0, math.inf, math.nan):
                with pytest.raises(UsageError, match=r"not a (positive|finite) number"):
                    call("A", wind_in=value)
            for text in ("0.1", "0.1 m/s", [0.1], True):
                with pytest.raises(UsageError, match=r"pass a number in SI units"):
                    call("A", wind_in=text)
        assert not bench.winch["A"].moving


def test_the_owner_refuses_the_form_of_an_earlier_client(rig: Rig) -> None:
    """Which sent a signed speed or change by its place."""
    with rig.opened() as bench, at("remote", bench) as station:
        assert isinstance(station, RemoteStation)
        for operation, sent in (
            ("jog", (0.02, 0.15)),
            ("step", (0.02, None)),
            ("move", (None, 0.02)),
        ):
            with pytest.raises(UsageError, match="a number without a name"):
                station._requests.call(operation, "A", *sent)
        assert not bench.winch["A"].moving


@pytest.mark.parametrize("kind", STATIONS)
def test_a_release_ends_a_jog_before_its_hold(rig: Rig, kind: str) -> None:
    with rig.opened() as bench, at(kind, bench) as station:
        station.jog("A", pay_out=SPEED, hold=1.0)
        assert abs(velocity(rig)) > 1
        station.release("A")
        rig.wait(0.4)
        assert rig.slaves[0].motor.velocity == pytest.approx(0.0, abs=1e-3)
        assert not bench.winch["A"].moving
