"""Drives whose EDS says little: what the standard asks instead, and what cannot be done without."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from drive_rig import ENTRIES, NODE, SERVO, Flywheel
from winchkit.errors import FileError
from winchkit.sim.drive.drive import SimDrive
from winchkit.sim.drive.object_dictionary import Entry, Key, ObjectDictionary, read_eds

LEAST = {0x1000, 0x1001, 0x1018, 0x6040, 0x6041, 0x6060, 0x6061, 0x6064}
TARGETS = {"CSV": 0x60FF, "PV": 0x60FF, "CSP": 0x607A, "PP": 0x607A, "CST": 0x6071, "PT": 0x6071}
EXTRA = {"PP": {0x6081}}
MODES = {"PP": 1, "PV": 3, "PT": 4, "CSP": 8, "CSV": 9, "CST": 10}


def entries(*indices: int) -> dict[Key, Entry]:
    return {key: entry for key, entry in ENTRIES.items() if key[0] in indices}


def drive(mode: str, indices: set[int]) -> SimDrive:
    servo = replace(SERVO, modes=(mode,))
    objects = ObjectDictionary(entries(*indices))
    made = SimDrive(lambda _id, _data: None, NODE, servo, objects, Flywheel(), brake=True)
    made.power_on(0.0, boot_time=0.0)
    made.tick(0.001)
    return made


def write(made: SimDrive, index: int, value: int) -> None:
    entry = made.objects.entry((index, 0))
    assert isinstance(entry, Entry)
    assert made.objects.write((index, 0), entry.pack(value)) is None


@pytest.mark.parametrize("mode", list(TARGETS))
def test_the_least_of_objects_is_enough_to_run_and_to_stop(mode: str) -> None:
    made = drive(mode, LEAST | {TARGETS[mode]} | EXTRA.get(mode, set()))
    write(made, 0x6060, MODES[mode])
    for word in (0x06, 0x07, 0x0F):
        write(made, 0x6040, word)
    write(made, TARGETS[mode], 500)
    for step in range(1, 50):
        made.tick(0.001 + step * 0.004)
    assert made.state.name == "OPERATION_ENABLED"
    for place, kind in enumerate(("emergency storm", "host lost", "map lost", "recover")):
        made.inject(kind)
        made.tick(0.3 + place * 0.01)
    write(made, 0x6040, 0x02)
    for step in range(1, 50):
        made.tick(0.4 + step * 0.004)
    assert made.state.name == "SWITCH_ON_DISABLED"


@pytest.mark.parametrize(
    ("mode", "index"), [("PP", 0x607A), ("HM", 0x6098), ("IP", 0x60C1), ("CST", 0x6071)]
)
def test_a_mode_without_its_object_is_refused(mode: str, index: int) -> None:
    with pytest.raises(FileError, match=rf"{index:04X}h:\d \(the mode {mode}\)"):
        drive(mode, {key[0] for key in ENTRIES} - {index})


def test_a_drive_without_a_control_word_is_refused() -> None:
    with pytest.raises(FileError, match=r"6040h:0 \(every drive\)"):
        drive("CSV", {key[0] for key in ENTRIES} - {0x6040})


def test_a_limit_without_a_default_does_not_limit(tmp_path: Path) -> None:
    text = ""
    for index, kind in ((0x6072, 6), (0x6080, 7), (0x6083, 7), (0x607D, 4)):
        text += f"[{index:04X}]\nParameterName=x\nDataType={kind}\nAccessType=rw\n"
    path = tmp_path / "small.eds"
    path.write_text(text, encoding="utf-8")
    found = read_eds(path, 1)
    assert found[0x6072, 0].default == 0xFFFF
    assert found[0x6080, 0].default == 0xFFFFFFFF
    assert found[0x6083, 0].default == 0
