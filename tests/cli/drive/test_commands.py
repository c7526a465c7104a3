"""``scan``, ``info`` and ``config`` against a simulated drive: what they read, write and refuse."""

from __future__ import annotations

import configparser
import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from can_commands import Served, served
from command_line import done, invoke
from winchkit.bench.emergency_stop import stop_on_bus
from winchkit.sim.drive.nmt import NodeState


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with served(tmp_path_factory.mktemp("drive"), "AB", paced=True) as running:
        yield running


def test_scan_finds_every_drive_and_the_file_that_fits(bench: Served) -> None:
    result = done("scan", "-b", bench.file, "--json")
    nodes = json.loads(result.stdout)["nodes"]
    assert [(item["node"], item["winch"], item["device"]) for item in nodes] == [
        (1, "A", "generic-cia402"),
        (2, "B", "generic-cia402"),
    ]
    assert nodes[0]["device_type"] == bench.number(0x1000)
    assert nodes[0]["identity"]["revision"] == bench.number(0x1018, 3)
    assert "no heartbeat" in invoke("scan", "-b", bench.file).stdout
    assert bench.number(0x1016, 1) == 0, "a scan writes nothing"


def test_scan_by_interface_needs_no_bench(bench: Served) -> None:
    channel = bench.live.bench_spec.bus["can"].channel
    result = done("scan", "--interface", "virtual", "--channel", channel)
    assert result.stdout.count("fits generic-cia402") == 2
    assert "winch" not in result.stdout


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (("scan",), 2, "no bus is given"),
        (("scan", "--interface", "virtual"), 2, "no bus is given"),
        (("scan", "-b", "none.toml"), 3, "there is no such file"),
        (("scan", "--interface", "nothing", "--channel", "x"), 4, "cannot open nothing"),
        (("scan", "--interface", "virtual", "--channel", "nobody"), 4, "no node answers"),
        (("info", "9", "--interface", "virtual", "--channel", "nobody"), 4, "no answer within"),
        (("info", "--interface", "virtual", "--channel", "nobody"), 2, "no node is given"),
    ],
)
def test_wrong_input_to_commands_of_the_bus(
    arguments: tuple[str, ...], code: int, words: str
) -> None:
    result = done(*arguments, code=code)
    assert words in result.stderr


def test_info_says_what_the_drive_holds(bench: Served) -> None:
    drive = bench.live.winches["A"].drive
    drive.objects.put(0x1003, 1, 0x8611)
    drive.objects.put(0x1003, 0, 1)
    result = done("info", "A", "-b", bench.file, "--json")
    info = json.loads(result.stdout)
    assert info["name"] == "winch A"
    assert info["state"] == "switch on disabled"
    assert info["errors"][0] == {"code": 0x8611, "meaning": "following error"}
    options = {item["index"]: item for item in info["noted"]["options"]}
    assert options[0x6007]["value"] == bench.number(0x6007)
    assert options[0x6007]["meaning"] == "quick stop"
    units = {(item["index"], item["sub"]): item["value"] for item in info["noted"]["units"]}
    assert units[0x608F, 1] == bench.number(0x608F, 1)
    text = invoke("info", "1", "-b", bench.file).stdout
    assert "8611h following error" in text
    assert "brake: declared" in text
    drive.objects.put(0x1003, 0, 0)


def test_a_drive_that_is_nmt_stopped_is_named_as_such(bench: Served) -> None:
    drive = bench.live.winches["B"].drive
    with bench.live.up_to_date():
        drive.receive(0x602, bytes.fromhex("2B17100032000000"), bench.live._now())  # 1017h = 50 ms
        drive.receive(0x000, bytes([0x02, 2]), bench.live._now())
    assert drive.nmt is NodeState.STOPPED
    try:
        result = done("info", "B", "-b", bench.file, code=4)
        assert "NMT stopped" in result.stderr
        assert "wiring" not in result.stderr
        (_, stopped) = stop_on_bus(bench.live.bench_spec)
        assert not stopped.confirmed
        assert "NMT stopped" in stopped.message
    finally:
        restart(bench)


def test_info_of_a_node_by_its_identity_alone(bench: Served) -> None:
    channel = bench.live.bench_spec.bus["can"].channel
    result = done("info", "2", "--interface", "virtual", "--channel", channel)
    assert "node 2: generic" in result.stdout
    assert "brake" not in result.stdout


@pytest.mark.parametrize("who", ["C", "a", "200", "0"])
def test_who_is_not_there(bench: Served, who: str) -> None:
    result = done("info", who, "-b", bench.file, code=2)
    assert "there is A, B, or a node number from 1 to 127" in result.stderr


@pytest.mark.parametrize("suffix", ["json", "dcf"])
def test_settings_make_the_round_trip(bench: Served, tmp_path: Path, suffix: str) -> None:
    file = tmp_path / f"a.{suffix}"
    objects = bench.live.winches["A"].drive.objects
    objects.put(0x6085, 0, 123_456)
    objects.put(0x607D, 1, -1_000_000)
    done("config", "save", "A", "-b", bench.file, "-o", file)
    assert invoke("config", "diff", "A", file, "-b", bench.file).exit_code == 0
    objects.put(0x6085, 0, 99)
    objects.put(0x607D, 1, -7)
    differs = done("config", "diff", "A", file, "-b", bench.file, "--json", code=1)
    found = {item["object"]: item for item in json.loads(differs.stdout)["differences"]}
    assert found["6085h"]["file"] == 123_456
    assert found["6085h"]["drive"] == 99
    assert set(found) == {"6085h", "607Dh:1"}
    loaded = done("config", "load", "A", file, "-b", bench.file)
    assert bench.number(0x6085) == 123_456
    assert bench.number(0x607D, 1) == -1_000_000
    assert "2 settings written and read back" in loaded.stderr


def test_what_a_bench_or_a_motion_sets_is_no_setting(bench: Served, tmp_path: Path) -> None:
    file = tmp_path / "a.json"
    invoke("config", "save", "A", "-b", bench.file, "-o", file)
    saved = json.loads(file.read_text())["objects"]
    for name in ("6040h", "6060h", "607Ah", "60FFh", "1016h:1", "1010h:1", "1400h:1", "1A00h:1"):
        assert name not in saved
    for name in ("6065h", "605Ah", "6007h", "6085h", "6072h"):
        assert name in saved


def test_a_dcf_is_the_eds_with_values(bench: Served, tmp_path: Path) -> None:
    file = tmp_path / "a.dcf"
    invoke("config", "save", "B", "-b", bench.file, "-o", file)
    parser = configparser.RawConfigParser(strict=False)
    parser.read(file)
    assert parser["DeviceComissioning"]["NodeID"] == "2"
    assert parser["DeviceComissioning"]["Baudrate"] == "1000"
    assert int(parser["6085"]["ParameterValue"], 0) > 0
    assert "ParameterValue" not in parser["6041"]


def test_a_dry_run_writes_nothing(bench: Served, tmp_path: Path) -> None:
    file = tmp_path / "a.json"
    invoke("config", "save", "A", "-b", bench.file, "-o", file)
    tree = json.loads(file.read_text())
    tree["objects"] = {"6085h": 4321}
    file.write_text(json.dumps(tree))
    before = bench.number(0x6085)
    shown = done("config", "load", "A", file, "-b", bench.file, "--dry-run")
    assert "write 6085h Quick stop deceleration = 4321 (10E1h)" in shown.stdout
    assert bench.number(0x6085) == before
    stored = invoke("config", "store", "A", "-b", bench.file, "--dry-run")
    assert "601 [23 10 10 01 73 61 76 65]" in stored.stdout


@pytest.mark.parametrize(
    ("objects", "words"),
    [
        ({"6041h": 1}, "6041h: is no setting of this drive"),
        ({"nonsense": 1}, "nonsense: is no setting"),
        ({"6085h": -1}, "6085h: -1 does not fit its type"),
        ({"6085h": "fast"}, "does not fit its type"),
        ({"605Ah": 99}, "refused to write"),
    ],
)
def test_bad_settings_are_refused(
    bench: Served, tmp_path: Path, objects: dict[str, object], words: str
) -> None:
    file = tmp_path / "bad.json"
    file.write_text(json.dumps({"schema": 1, "kind": "drive-config", "objects": objects}))
    result = invoke("config", "load", "A", file, "-b", bench.file)
    assert result.exit_code in (3, 4), result.output
    assert words in result.stderr


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("x.json", "{", "is no JSON"),
        ("x.json", "[]", "is no drive configuration"),
        ("x.dcf", "no section\n", "is no DCF"),
        ("x.dcf", "[6085]\nParameterName=a\n", "has no ParameterValue"),
        ("x.dcf", "[6085]\nParameterValue=much\n", "'much' does not fit its type"),
        ("x.txt", "", "is none of .dcf, .json"),
    ],
)
def test_files_that_are_no_settings(
    bench: Served, tmp_path: Path, name: str, text: str, words: str
) -> None:
    (tmp_path / name).write_text(text)
    result = done("config", "diff", "A", tmp_path / name, "-b", bench.file, code=3)
    assert words in result.stderr


def test_settings_of_another_kind_of_drive_are_refused(bench: Served, tmp_path: Path) -> None:
    file = tmp_path / "other.json"
    identity = {"vendor": 0x26C, "product": 1}
    tree = {"schema": 1, "kind": "drive-config", "identity": identity, "objects": {"6085h": 5}}
    file.write_text(json.dumps(tree))
    result = done("config", "load", "A", file, "-b", bench.file, code=3)
    assert "is of vendor 026Ch product 00000001h" in result.stderr


def test_store_and_restore_change_what_the_next_start_finds(bench: Served) -> None:
    drive = bench.live.winches["B"].drive
    default = drive.objects.number(0x6085)
    drive.objects.put(0x6085, 0, 7777)
    done("config", "store", "B", "-b", bench.file, input="n\n", code=1)
    done("config", "store", "B", "-b", bench.file, "--yes")
    restart(bench)
    assert drive.objects.number(0x6085) == 7777
    done("config", "restore", "B", "-b", bench.file, input="y\n")
    restart(bench)
    assert drive.objects.number(0x6085) == default


def restart(bench: Served) -> None:
    """Power-cycle the drive of B."""
    with bench.live.up_to_date():
        drive = bench.live.winches["B"].drive
        now = bench.live._now()
        drive.power_on(now, boot_time=0.0)
        drive.tick(now)
    assert drive.nmt is NodeState.PRE_OPERATIONAL
