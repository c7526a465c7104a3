"""The slave's PDOs, SYNC and EMCY against the bytes of CiA 301."""

from __future__ import annotations

import pytest

from slave import Frame
from slave.wire import Wire, emergencies

_INVALID, _NO_RTR = 1 << 31, 1 << 30


def mapped(first: int, entries: tuple[int, ...], kind: int, wire: Wire | None = None) -> Wire:
    """A slave, operational, with RPDO 1 (1400h) or TPDO 1 (1800h) set up by the rules."""
    wire = wire or Wire()
    cob = 0x201 if first == 0x1400 else _NO_RTR | 0x181
    steps = [
        (first, 1, cob | _INVALID, 4),
        (first, 2, kind, 1),
        (first + 0x200, 0, 0, 1),
        *((first + 0x200, n, entry, 4) for n, entry in enumerate(entries, 1)),
        (first + 0x200, 0, len(entries), 1),
        (first, 1, cob, 4),
    ]
    for index, sub, value, size in steps:
        assert wire.write(index, sub, value, size).startswith("60"), f"{index:04X}h:{sub}"
    wire.start()
    wire.frames.clear()
    return wire


def first(wire: Wire, syncs: int = 1) -> list[Frame]:
    """What TPDO 1 says to a SYNC, or to several."""
    frames = [frame for _ in range(syncs) for frame in wire.send(0x080)]
    return [frame for frame in frames if frame.identifier == 0x181]


def test_set_up_has_an_order() -> None:
    wire = Wire()
    assert wire.write(0x1600, 0, 0, 1).endswith("00000106"), "mapping of a valid PDO"
    assert wire.write(0x1400, 1, 0x222, 4).endswith("30000906"), "COB-ID of a valid PDO"
    wire.write(0x1400, 1, _INVALID | 0x201, 4)
    assert wire.write(0x1600, 1, 0x60400010, 4).endswith("00000106"), "entries while sub 0 is set"
    wire.write(0x1600, 0, 0, 1)
    assert wire.write(0x1600, 1, 0x60410010, 4).endswith("41000406"), "a read-only object"
    assert wire.write(0x1600, 1, 0x59990010, 4).endswith("00000206"), "no such object"
    for sub in (1, 2, 3):
        wire.write(0x1600, sub, 0x60FF0020, 4)
    assert wire.write(0x1600, 0, 3, 1).endswith("42000406"), "96 bits"


def test_a_synchronous_rpdo_acts_with_the_next_sync() -> None:
    wire = mapped(0x1400, (0x60400010, 0x60FF0020), 1)
    wire.send(0x201, "0600e8030000")
    assert (wire.status(), wire.read(0x60FF)) == (0x40, 0)
    wire.send(0x080)
    assert (wire.status(), wire.read(0x60FF)) == (0x21, 1000)


def test_an_asynchronous_rpdo_acts_at_once() -> None:
    wire = mapped(0x1400, (0x60400010,), 255)
    wire.send(0x201, "0600")
    assert wire.status() == 0x21


def test_a_short_rpdo_is_reported_and_not_taken() -> None:
    wire = mapped(0x1400, (0x60400010, 0x60FF0020), 255)
    assert emergencies(wire.send(0x201, "0600")) == [0x8210]
    assert wire.status() == 0x40


def test_a_synchronous_tpdo_answers_every_nth_sync() -> None:
    wire = mapped(0x1800, (0x60410010, 0x60610008), 3)
    sent = [len(first(wire)) for _ in range(6)]
    assert sent == [0, 0, 1, 0, 0, 1]
    assert first(wire, 3) == [Frame(0x181, bytes.fromhex("500200"))]


def test_type_0_answers_a_sync_after_a_change() -> None:
    wire = mapped(0x1800, (0x60410010,), 0)
    assert [len(first(wire)) for _ in range(3)] == [1, 0, 0]
    wire.write(0x6040, 0, 6, 2)
    wire.wait(0.002)
    assert [len(first(wire)) for _ in range(2)] == [1, 0]


def test_an_event_tpdo_comes_on_change_and_by_its_timer() -> None:
    wire = mapped(0x1800, (0x60410010,), 255)
    wire.wait(0.01)
    wire.frames.clear()
    wire.write(0x6040, 0, 6, 2)
    assert [f.data.hex() for f in wire.wait(0.01)] == ["3102"]
    wire.write(0x1800, 5, 20, 2)
    assert len(wire.wait(0.1)) == pytest.approx(5, abs=1)


def test_an_rpdo_that_stays_away_is_reported() -> None:
    wire = Wire()
    wire.slave.objects.declare(0x1400, 5, 6, 50)
    wire = mapped(0x1400, (0x60400010,), 255, wire)
    assert emergencies(wire.wait(1.0)) == [], "not armed before the first"
    wire.send(0x201, "0600")
    assert emergencies(wire.wait(0.049)) == []
    assert emergencies(wire.wait(0.003)) == [0x8250]
    assert wire.status() == 0x08


def test_a_lost_sync_is_a_fault_in_a_cyclic_mode() -> None:
    wire = Wire()
    wire.write(0x1006, 0, 4000, 4)
    wire.start()
    for _ in range(20):
        wire.send(0x080)
        wire.wait(0.004)
    assert emergencies(wire.wait(1.0)) == [], "not enabled"
    wire.enable(9)
    wire.send(0x080)
    wire.wait(0.004)
    wire.send(0x080)
    assert emergencies(wire.wait(0.008)) == [0x8700]
    assert wire.status() in (0x0F, 0x08)


@pytest.mark.parametrize(("lost", "left"), [(None, []), ({1}, [0x281]), ({2}, [0x181])])
def test_tpdos_are_lost_by_number(lost: set[int] | None, left: list[int]) -> None:
    wire = Wire()
    for number in (1, 2):
        wire.write(0x1800 + number - 1, 1, 1 << 31, 4)
        wire.write(0x1800 + number - 1, 2, 1, 1)
        wire.write(0x1800 + number - 1, 1, 0x180 + 0x100 * (number - 1) + 1, 4)
    wire.start()
    wire.slave.inject("tpdo lost", lost)
    assert [f.identifier for f in wire.send(0x080) if f.identifier < 0x300] == left
