"""Device files of serial instruments: what is refused, and what the message says."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from winchkit.errors import FileError, UsageError
from winchkit.schema.devices.stream import LinkSpec, StreamSpec
from winchkit.schema.read import read_bench, read_device
from winchkit.schema.template import Part, length_of, parts_of

HEAD = """schema = 1
kind = "device"
name = "x"
maker = "x"
model = "x"
source = "x"
trust = "generic"
[stream]
"""
GOOD = 'mode = "continuous"\nexample = "1"\nframe = ["{value}"]\nunit = "N"\n'


def refused(folder: Path, body: str) -> str:
    path = folder / "device.toml"
    path.write_text(HEAD + body, encoding="utf-8")
    with pytest.raises(FileError) as caught:
        read_device(path)
    return str(caught.value)


def test_a_small_file_is_enough(tmp_path: Path) -> None:
    path = tmp_path / "device.toml"
    path.write_text(HEAD + GOOD, encoding="utf-8")
    spec = read_device(path).stream
    assert spec == StreamSpec("continuous", "1", frame=("{value}",), unit="N")


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (GOOD + 'terminater = "x"', "device.toml:13: stream.terminater: unknown key; did you mean"),
        (GOOD + 'poll = "x"', "a polled device needs its request here"),
        (GOOD.replace("continuous", "polled"), "a polled device needs its request here"),
        (GOOD.replace('"N"', '"NN"'), "stream.unit: NN: unknown, or not of one dimension"),
        (GOOD + "scale = 0", "stream.scale: must not be zero"),
        (GOOD + 'terminator = ""', "stream.terminator: empty"),
        (GOOD.replace('["{value}"]', "[]"), "give either 'frame'"),
        (
            GOOD.replace("{value}", "{valu}"),
            "no field is called {valu}; use value, gross, tare, unit, address, checksum, bits, "
            "skip, or declare the texts of a status field in a table 'letter.valu'; did you mean",
        ),
        (GOOD.replace("{value}", "{bits:3}"), "has no field {value}"),
        (GOOD.replace("{value}", "{value"), "is not a template"),
        (GOOD.replace("{value}", "{value:x}"), "the width of {value} is 'x'"),
        (GOOD.replace("{value}", "{value:0}"), "the width of {value} is '0'"),
        (GOOD.replace("{value}", "{}"), "a field is written {name} or {name:8}"),
        (GOOD.replace("{value}", "{value!r}"), "a field is written {name} or {name:8}"),
        (GOOD.replace("{value}", "{value}{gross}"), "the end of {value} and the start of"),
        (GOOD.replace("{value}", "{value},{value}"), "{value} stands twice"),
        (GOOD.replace("{value}", "{value:99}"), "its 99 characters are more than 'longest', 64"),
        (GOOD.replace("{value}", "{value}{checksum:2}"), "the end of {value} and the start of"),
        (GOOD.replace("{value}", "{value:8}{checksum:2}"), "and the table 'checksum' go together"),
        (GOOD.replace("{value}", "{value} {unit}"), "{unit} needs the table 'units'"),
        (GOOD + '[stream.units]\nkg = { scale = 1, unit = "N" }', "and no field {unit}"),
        (GOOD + 'stop = "{unit}"', "stream.stop: '{unit}': {unit} is unknown; use {address}"),
        (GOOD + 'stop = "{address:x}"', "the width of {address} is 'x'"),
        (GOOD + 'stop = "\u20ac"', "has characters that are not bytes"),
        (GOOD.replace('"1"', '""'), "stream.example: '' does not fit '{value}'"),
        (
            GOOD + '[stream.command]\ntare = { send = "{x" }',
            "stream.command.tare.send: '{x' is not a",
        ),
        (GOOD + "[stream.bits]\noverlod = [1]", "overlod: unknown key; did you mean 'overload'?"),
        (GOOD + '[stream.words]\nx = "overlod"', "did you mean 'overload'"),
        (GOOD + "[stream.binary]\nlength = 4\nvalue = [0, 3]", "give either 'frame'"),
        (
            'mode = "continuous"\nexample = "00"\n[stream.binary]\nlength = 4\nvalue = [0, 3]',
            "the start of a binary frame is not marked; it can only be polled",
        ),
        (
            'mode = "polled"\npoll = "x"\nexample = "00"\n'
            "[stream.binary]\nlength = 4\nvalue = [2, 3]",
            "bytes 2 to 4 are not within 4 bytes",
        ),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, body: str, message: str) -> None:
    assert message in refused(tmp_path, body)


def test_a_device_is_of_one_kind(tmp_path: Path) -> None:
    body = GOOD + '[servo]\neds = "x.eds"\nmodes = ["CSV"]\n'
    assert "exactly one of the tables" in refused(tmp_path, body)


BENCH = """schema = 1
kind = "bench"
[bus.can]
kind = "can"
interface = "virtual"
channel = "x"
[bus.cells]
kind = "{kind}"
port = "/dev/ttyUSB0"
[winch.A]
profile = "bench-spiral"
servo = {{ device = "generic-cia402", bus = "can", node = 1 }}
cell = {{ device = "{device}", bus = "cells"{unit} }}
limits = {{ speed = "1 m/s" }}
"""


@pytest.mark.parametrize(
    ("device", "kind", "unit", "message"),
    [
        ("laumas-tlb-ascii", "modbus-rtu", "", "'laumas-tlb-ascii' needs serial"),
        ("laumas-tlb", "serial", ", unit = 1", "'laumas-tlb' needs modbus-rtu or modbus-tcp"),
        ("mantracourt-dsc-ascii", "serial", "", "unit: missing; 'mantracourt-dsc-ascii'"),
        ("laumas-tlb-ascii", "serial", ", node = 1", "has no node; it is reached by unit"),
        ("laumas-tlb-ascii", "serial", "", ""),
        ("mantracourt-dsc-ascii", "serial", ", unit = 1", ""),
    ],
)
def test_wiring_fits_the_device(
    tmp_path: Path, device: str, kind: str, unit: str, message: str
) -> None:
    path = tmp_path / "bench.toml"
    path.write_text(BENCH.format(kind=kind, device=device, unit=unit), encoding="utf-8")
    if not message:
        assert read_bench(path).winch["A"].cell is not None
        return
    with pytest.raises(FileError) as caught:
        read_bench(path)
    assert message in str(caught.value)


def test_a_template_in_pieces() -> None:
    parts = parts_of("ST,{kind:2},{value}k{{")
    assert parts == (
        Part("ST,"),
        Part(field="kind", width=2),
        Part(","),
        Part(field="value"),
        Part("k{"),
    )
    assert length_of(parts) is None
    assert length_of(parts[:3]) == 6


@settings(deadline=None)
@given(st.text(max_size=30))
def test_any_text_is_a_template_or_refused(text: str) -> None:
    try:
        parts = parts_of(text)
    except UsageError:
        return
    assert all(part.literal or part.field for part in parts)


def test_a_line_is_named_as_engineers_do() -> None:
    assert str(LinkSpec(9600, "E", 1, 7)) == "9600 7E1"
