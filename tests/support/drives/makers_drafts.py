"""Device files as a user writes them by docs/howto/drive.md, from a maker's EDS alone."""

from __future__ import annotations

import os
from pathlib import Path

FOLDER = Path(os.environ.get("WINCHKIT_MAKERS_EDS", Path(__file__).parents[4] / "shared/data/eds"))

_HEAD = """\
schema = 1
kind = "device"
name = "{name}"
maker = "{name}"
model = "from its EDS"
source = "{eds}"
trust = "eds"
[servo]
eds = "{path}"
"""
_TWO = """\
[[servo.tpdo]]
number = 1
objects = ["0x6041", "0x6064", "0x6061"]
[[servo.tpdo]]
number = 2
objects = [{second}]
[[servo.rpdo]]
number = 1
objects = ["0x6040", "0x60FF"]
"""

DRAFTS: dict[str, tuple[str, str]] = {
    "zeroerr": (
        "zeroerr-erob.eds",
        'modes = ["PP", "PV", "PT", "CSP", "CSV", "CST"]\nmotion_mode = "CSV"\n'
        "increments_per_turn = 524288\n" + _TWO.format(second='"0x606C", "0x6077", "0x603F"'),
    ),
    "maxon": (
        "maxon-epos4.eds",
        'modes = ["PP", "PV", "HM", "CSP", "CSV", "CST"]\nmotion_mode = "CSV"\n'
        'increments_per_turn = 2000\nspeed_unit = "rpm"\nunits = "file"\nhome_offset = "0x30B0"\n'
        + _TWO.format(second='"0x606C", "0x6077", "0x603F"'),
    ),
    "elmo": (
        "elmo-gold.dcf",
        'modes = ["PP", "PV", "PT", "HM", "IP", "CSP", "CSV", "CST"]\nmotion_mode = "CSV"\n'
        'increments_per_turn = 65536\nunits = "file"\n' + _TWO.format(second='"0x606C", "0x6077"'),
    ),
    "kria": (
        "amd-kria.eds",
        'modes = ["PV", "PT"]\nmotion_mode = "PV"\nincrements_per_turn = 4096\n'
        'speed_unit = "rpm"\n'
        '[[servo.tpdo]]\nnumber = 3\nobjects = ["0x6041", "0x606C"]\n'
        '[[servo.tpdo]]\nnumber = 4\nobjects = ["0x6041", "0x6064"]\n'
        '[[servo.rpdo]]\nnumber = 3\nobjects = ["0x6040", "0x60FF"]\n',
    ),
    "animatics": (
        "animatics-smartmotor.eds",
        'modes = ["PP", "PV", "CSP", "CSV"]\nmotion_mode = "CSV"\n'
        'increments_per_turn = 4000\nunits = "file"\n' + _TWO.format(second='"0x606C"'),
    ),
}


def draft(folder: Path, name: str, *, eds: Path | None = None, servo: str = "") -> Path:
    """Write the device file of a drive; returns its folder, as a bench file names it."""
    file, body = DRAFTS[name]
    path = eds or FOLDER / file
    home = folder / name
    home.mkdir()
    text = _HEAD.format(name=name, eds=file, path=path) + servo + body
    (home / "device.toml").write_text(text, encoding="utf-8")
    return home


_OBJECT = """
[{name}]
ParameterName={name}
ObjectType=0x7
DataType={kind}
AccessType={access}
PDOMapping={mapped}
DefaultValue={value}
"""


def completed_animatics(folder: Path) -> Path:
    """The EDS with what it leaves out of the drive: 6064h, RPDO 1, and PDOs that can be mapped."""
    lines = (FOLDER / "animatics-smartmotor.eds").read_text(encoding="latin-1")
    text = lines.replace("\r", "")
    for number in (0x1A00, 0x1A01):
        begin = text.index(f"[{number:04X}]")
        end = text.index(f"[{number + 1:04X}]")
        text = text[:begin] + text[end:]
    text += _OBJECT.format(name="6064", kind="0x0004", access="ro", mapped=1, value=0)
    records = {
        0x1400: ["0x200+$NODEID", "255"],
        0x1600: ["0x60400010", "0x60FF0020", "0", "0"],
        0x1A00: ["0x60410010", "0x60640020", "0x60610008", "0"],
        0x1A01: ["0x606C0020", "0", "0", "0"],
    }
    counts = {0x1400: 2, 0x1600: 2, 0x1A00: 3, 0x1A01: 1}
    for index, values in records.items():
        text += f"\n[{index:04X}]\nParameterName=PDO\nObjectType=0x9\n"
        kinds = ["0x0005", *("0x0007" if index != 0x1400 else k for k in ("0x0007", "0x0005"))]
        for sub, value in enumerate((str(counts[index]), *values)):
            kind = kinds[sub] if index == 0x1400 or sub == 0 else "0x0007"
            text += _OBJECT.format(
                name=f"{index:04X}sub{sub}", kind=kind, access="rw", mapped=0, value=value
            )
    path = folder / "animatics-completed.eds"
    path.write_text(text, encoding="utf-8")
    return path
