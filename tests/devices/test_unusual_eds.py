"""Drives whose EDS departs from the usual, as makers' files do: they move, or are refused in words.

``Schunk_0_63.dcf`` and Pilz's have the mode IP alone; ``ElmoSimplIQ.dcf`` has read-only COB-IDs.
The slave is built from the EDS and shares no code with winchkit.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from drive_trial import moves, stopped
from slave import Slave
from slave.rig import Rig, bench_text
from winchkit import catalog
from winchkit.errors import NotPermitted

_RAMP = 50_000_000


def device(
    folder: Path, change: Callable[[str], str], servo: tuple[tuple[str, str], ...] = ()
) -> Path:
    """The generic device with another EDS; ``servo`` are texts of its file and their successors."""
    source = catalog.find("devices", "generic-cia402").parent
    home = folder / "unusual"
    home.mkdir()
    text = (source / "device.toml").read_text(encoding="utf-8")
    for old, new in servo:
        assert old in text
        text = text.replace(old, new)
    (home / "device.toml").write_text(text, encoding="utf-8")
    eds = (source / "generic-cia402.eds").read_text(encoding="utf-8")
    changed = change(eds)
    assert changed != eds
    (home / "generic-cia402.eds").write_text(changed, encoding="utf-8")
    return home


def rig_of(folder: Path, home: Path) -> Rig:
    slave = Slave.from_file(home / "generic-cia402.eds", 1)
    for ramp in (0x6084, 0x6085):
        slave.objects.declare(ramp, 0, 0x07, _RAMP)
    return Rig(folder, [slave])


def section(name: str, old: str, new: str) -> Callable[[str], str]:
    """Replace a line in every section whose head matches."""

    def change(eds: str) -> str:
        head = re.compile(rf"(?ms)^\[(?:{name})\]\n.*?(?=^\[|\Z)", re.IGNORECASE)
        return head.sub(lambda found: found[0].replace(old, new), eds)

    return change


def test_a_drive_that_only_interpolates_moves_without_a_jump(tmp_path: Path) -> None:
    """In IP the drive holds until control bit 4; its first target is then where it stands."""
    only = section("6502", "DefaultValue=", "DefaultValue=0x40\n;")
    home = device(
        tmp_path,
        only,
        (
            ('modes = ["PP", "PV", "PT", "HM", "IP", "CSP", "CSV", "CST"]', 'modes = ["IP"]'),
            ('motion_mode = "CSV"', 'motion_mode = "IP"'),
            ('"0x60FF"]', '"0x60C1:1"]'),
            ('\n[[servo.rpdo]]\nnumber = 2\nobjects = ["0x607A"]', "\n#"),
        ),
    )
    rig = rig_of(tmp_path, home)
    slave = rig.slaves[0]
    slave.motor.angle = 12.3
    moves(rig, bench_text(rig.channel, device=str(home)), stopped)
    speeds = np.array([sample.velocity for sample in rig.samples[0]])
    steps = np.abs(np.diff(speeds))
    assert slave.motion.mode == 7
    assert np.max(np.abs(speeds)) > 1.0
    assert np.max(steps[: np.argmax(np.abs(speeds) > 1.0)]) < 0.1 * np.max(np.abs(speeds))


IDENTIFIERS = section("1[48]00sub1|1[48]01sub1|1[48]02sub1|1[48]03sub1", "=rw", "=ro")


def test_a_drive_whose_identifiers_cannot_be_written_moves(tmp_path: Path) -> None:
    home = device(tmp_path, IDENTIFIERS)
    rig = rig_of(tmp_path, home)
    moves(rig, bench_text(rig.channel, device=str(home)), stopped)
    slave = rig.slaves[0]
    assert slave.objects.get(0x1A00) == 3, "mapped as the device file has it"
    assert [slave.objects.get(index) for index in (0x1A02, 0x1A03, 0x1602, 0x1603)] == [0] * 4


def test_a_drive_with_rpdos_by_event_and_a_fixed_exponent_moves(tmp_path: Path) -> None:
    """Trinamic's RPDOs are of the type 255 for good, Yiyou's 60C2h:2 is read-only."""

    def change(eds: str) -> str:
        eds = section("1400sub2", "=rw\nDefaultValue=", "=ro\nDefaultValue=255\n;")(eds)
        return section("60C2sub2", "=rw\nDefaultValue=", "=ro\nDefaultValue=-3\n;")(eds)

    home = device(tmp_path, change, (('"0x60FF"]', '"0x60FF"]\ntransmission = 255'),))
    rig = rig_of(tmp_path, home)
    moves(rig, bench_text(rig.channel, device=str(home)), stopped)
    slave = rig.slaves[0]
    assert [slave.objects.get(0x60C2, sub) for sub in (1, 2)] == [4, -3]
    assert slave.objects.get(0x1400, 2) == 255


def fixed(name: str, value: str) -> Callable[[str], str]:
    """An object that cannot be written and has this default."""
    return section(name, "=rw\nDefaultValue=", f"=ro\nDefaultValue={value}\n;")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (fixed("1400sub1", "0x321"), r"1400h:1 .*cannot be written .* is 321h, not 201h"),
        (fixed("1801sub1", "0x80000281"), r"1801h:1 .*cannot be written .* is not in use"),
        (fixed("1800sub2", "254"), r"1800h:2 .*cannot be written .* is 254, not 1"),
    ],
)
def test_a_pdo_that_cannot_be_set_up_is_refused(
    tmp_path: Path, change: Callable[[str], str], said: str
) -> None:
    home = device(tmp_path, change)
    rig = rig_of(tmp_path, home)
    text = bench_text(rig.channel, device=str(home))
    with pytest.raises(NotPermitted, match=said), rig.opened(text):
        pass
