"""Units of another dimension than that of a field: the sentence says what the field takes."""

from __future__ import annotations

from pathlib import Path

import pytest

from winchkit.catalog import find
from winchkit.errors import FileError
from winchkit.schema.read import load

_PER_SECOND = "'Hz' is a unit of frequency; write a number per second without a unit"


@pytest.mark.parametrize(
    ("kind", "name", "old", "new", "sentence"),
    [
        ("devices", "laumas-tlb", "rate = 300.0", 'rate = "50 Hz"', _PER_SECOND),
        ("devices", "generic-line", "rate = 100.0", 'rate = "50 Hz"', _PER_SECOND),
        (
            "devices",
            "generic-modbus",
            "rate = 100.0",
            'rate = "50 %"',
            "'%' is a unit of ratio; write a number per second without a unit",
        ),
        (
            "devices",
            "laumas-tlb",
            "rate = 300.0",
            'rate = "50 foo"',
            "unknown unit 'foo'; write a number per second without a unit",
        ),
        (
            "devices",
            "laumas-tlb",
            "rate = 300.0",
            "rate = true",
            "expected a number per second, not bool",
        ),
        (
            "profiles",
            "bench-spiral",
            "ratio = 20.4",
            'ratio = "20.4 mm"',
            "'mm' is a unit of length; write a number without a unit",
        ),
        (
            "profiles",
            "bench-spiral",
            '"60 mm"',
            '"60 N"',
            "'N' is a unit of force, not of length; use one of m, mm, cm, um, km",
        ),
        (
            "profiles",
            "winding-device-winch",
            "efficiency = 0.68",
            'efficiency = "0.68 W"',
            "'W' is a unit of power; write a ratio without a unit, or in %, ppm",
        ),
        (
            "sim",
            "cabtive-robot",
            'rotation_speed = "20 deg/s"',
            'rotation_speed = "20 deg"',
            "'deg' is a unit of angle, not of angular speed; use one of rad/s, deg/s",
        ),
    ],
)
def test_the_sentence_fits_the_field(
    tmp_path: Path, kind: str, name: str, old: str, new: str, sentence: str
) -> None:
    text = find(kind, name).read_text(encoding="utf-8")
    assert old in text
    file = tmp_path / "declared.toml"
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(FileError) as caught:
        load(file)
    assert any(sentence in fault.message for fault in caught.value.faults)
