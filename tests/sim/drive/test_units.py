"""What a simulated drive's counts mean, worked by hand."""

from __future__ import annotations

from dataclasses import replace
from math import pi
from typing import Any

import pytest

from drive_rig import ENTRIES, SERVO, Flywheel, Rig
from winchkit.sim.drive.object_dictionary import Entry, Key, ObjectDictionary
from winchkit.sim.drive.units import SCALES, units_of

CSV = 9


def test_units_follow_the_feed_and_the_gear() -> None:
    """CiA 402: position units a motor turn = feed constant / gear ratio."""
    rig = Rig(Flywheel(motor_angle=10.0))
    rig.write(0x6092, 1, 10_000)
    rig.write(0x6091, 1, 5)
    turns = 10.0 / 6.283185307179586
    assert rig.read(0x6064) == round(turns * 10_000 / 5)
    rig.enable(CSV)
    rig.write(0x60FF, 0, 2_000)
    rig.run(0.1)
    assert rig.shaft.motor_velocity == pytest.approx(6.283185307179586, rel=1e-9)


def entries_with(**numbers: int) -> dict[Key, Entry]:
    """The generic drive's objects without scales, and with those named ``x608F_1``."""
    kept = {key: entry for key, entry in ENTRIES.items() if key[0] not in SCALES}
    for name, number in numbers.items():
        index, _, sub = name[1:].partition("_")
        kept[int(index, 16), int(sub)] = Entry(name, "I", "rw", number)
    return kept


@pytest.mark.parametrize(
    ("numbers", "changes", "per_turn", "rpm"),
    [
        ({}, {}, 65536, 60 / 65536),
        ({"x608F_1": 4000, "x608F_2": 1}, {}, 4000, 60 / 4000),
        ({"x608F_1": 4000, "x608F_2": 1, "x6092_1": 360, "x6092_2": 1}, {}, 360, 60 / 360),
        ({"x6092_1": 360, "x6092_2": 1, "x6091_1": 3, "x6091_2": 1}, {}, 120, 60 / 120),
        ({"x6092_1": 360, "x6092_2": 1}, {"units": "file"}, 65536, 60 / 65536),
        ({}, {"speed_unit": "rpm"}, 65536, 1),
        ({}, {"speed_unit": "0.1 rpm"}, 65536, 0.1),
        ({}, {"speed_unit": "0.1 counts/s"}, 65536, 6 / 65536),
        ({}, {"speed_unit": "counts / 65536 / 250 us"}, 65536, 60 / 65536 / 65536 / 250e-6),
        ({}, {"speed_unit": "1875 rpm / 512 / encoder"}, 65536, 1875 / 512 / 65536),
        (
            {"x608F_1": 4000, "x608F_2": 1},
            {"speed_unit": "1875 rpm / 512 / encoder"},
            *(4000, 1875 / 512 / 4000),
        ),
        ({}, {"units": "file", "position_unit": "0.1 deg"}, 3600, 60 / 3600),
        ({}, {"units": "file", "position_unit": "10 counts"}, 6553.6, 60 / 6553.6),
        ({"x60A8_0": 0xFF410000}, {}, 3600, 60 / 3600),
        ({"x60A9_0": 0x00B44700}, {}, 65536, 1),
        ({"x60A9_0": 0x00B40300, "x6091_1": 2, "x6091_2": 1}, {}, 32768, 120),
        ({"x60A9_0": 0xFD100300}, {}, 65536, 0.001 * 30 / pi),
    ],
)
def test_units_by_what_the_drive_says_and_what_its_file_does(
    numbers: dict[str, int], changes: dict[str, Any], per_turn: float, rpm: float
) -> None:
    """Worked by hand: position units of a motor turn, and rpm of one unit of speed."""
    units = units_of(ObjectDictionary(entries_with(**numbers)), replace(SERVO, **changes))
    assert 2 * pi / units.angle == pytest.approx(per_turn)
    assert units.speed * 30 / pi == pytest.approx(rpm)
    assert units.torque == pytest.approx(SERVO.rated_torque / 1000)


def test_torque_is_in_thousandths_of_the_rated_torque() -> None:
    rig = Rig(Flywheel(motor_torque=0.75))
    rig.write(0x6076, 0, 3_000)
    assert rig.read(0x6077) == 250
