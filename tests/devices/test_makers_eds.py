"""EDS and DCF files that makers wrote: read, described and checked by ``winchkit check``.

The files are not part of the project; the tests are skipped where they are not at hand.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
from click.testing import CliRunner

from winchkit import catalog
from winchkit.cli.files.check import command
from winchkit.drivers.can.canopen.declared import declared, unmappable
from winchkit.drivers.can.canopen.node import read_eds
from winchkit.drivers.can.canopen.pdo import parse_object
from winchkit.schema.read import read_device

FOLDER = Path(os.environ.get("WINCHKIT_MAKERS_EDS", Path(__file__).parents[3] / "shared/data/eds"))
pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason="the makers' files are not at hand")

FILES = {
    # file: objects by `grep -ci '^\[[0-9a-f]\{4\}\]'`, modes of 6502h or of the objects there
    "amd-kria.eds": (["PV", "PT"], ["heartbeat", "rpdo-timeout"]),
    "animatics-smartmotor.eds": (["PP", "PV", "PT", "HM", "CSP", "CSV", "CST"], []),
    "elmo-gold.dcf": (
        ["PP", "PV", "PT", "HM", "IP", "CSP", "CSV", "CST"],
        ["heartbeat", "sync-loss"],
    ),
    "maxon-epos4.eds": (["PP", "PV", "PT", "HM", "CSP", "CSV", "CST"], ["heartbeat"]),
    "zeroerr-erob.eds": (
        ["PP", "PV", "PT", "CSP", "CSV", "CST"],
        ["heartbeat", "guarding", "rpdo-timeout", "sync-loss"],
    ),
}


def described(name: str) -> dict[str, object]:
    result = CliRunner().invoke(command, ["--json", str(FOLDER / name)])
    assert result.exit_code == 0, result.output
    (entry,) = json.loads(result.stdout)["files"]
    assert (entry["ok"], entry["faults"]) == (True, [])
    drive = entry["drive"]
    assert isinstance(drive, dict)
    return drive


@pytest.mark.parametrize("name", FILES)
def test_every_object_of_the_file_is_read(name: str) -> None:
    """Object sections counted by hand in the text, case ignored."""
    text = (FOLDER / name).read_text(encoding="latin-1").lower().replace("\r", "")
    heads = [row.strip() for row in text.split("\n") if row.startswith("[")]
    objects = {head[1:5] for head in heads if len(head) == 6 and head[1] in "123456789abcdef"}
    dictionary, _ = read_eds(FOLDER / name, 5)
    dummies = {f"{index:04x}" for index in range(8)}
    assert {f"{index:04x}" for index in dictionary} - dummies == objects


@pytest.mark.parametrize("name", FILES)
def test_check_reports_modes_and_host_loss(name: str) -> None:
    modes, ways = FILES[name]
    drive = described(name)
    assert drive["modes"] == modes
    assert [way["way"] for way in drive["host_loss"]] == ways


def test_what_a_drive_lacks_is_reported() -> None:
    animatics = described("animatics-smartmotor.eds")["obstacles"]
    assert "the EDS lacks 6064h, which every motion needs" in animatics
    assert "the EDS declares no receive PDO (1 to 4)" in animatics
    assert any("no way to notice a dead host" in text for text in animatics)
    for name in FILES.keys() - {"animatics-smartmotor.eds"}:
        assert described(name)["obstacles"] == []
    assert any("607Ch" in text for text in described("maxon-epos4.eds")["differences"])
    assert any("603Fh" in text for text in described("elmo-gold.dcf")["differences"])
    assert "RPDO 3 has a fixed mapping: 0x6040, 0x60FF" in described("amd-kria.eds")["differences"]


def test_elmo_gold_maps_only_what_the_makers_file_allows() -> None:
    dictionary, _ = read_eds(FOLDER / "elmo-gold.dcf", 1)
    servo = read_device(catalog.find("devices", "elmo-gold")).servo
    for receive, specs in ((False, servo.tpdo), (True, servo.rpdo)):
        for spec in specs:
            for text in spec.objects:
                variable = declared(dictionary, *parse_object(text))
                assert not unmappable(variable, receive=receive), text
