"""Frames as manuals and our page show them, the numbers worked by hand."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from stream_rig import DEVICES, device, stream
from winchkit.drivers.reading import Quality
from winchkit.drivers.stream.decoder import FrameType, StreamContent, check_sum
from winchkit.drivers.stream.parser import StreamParser
from winchkit.schema.devices.stream import ChecksumSpec
from winchkit.schema.read import read_device

G = 9.80665
GOOD, UNSTABLE = Quality.GOOD, Quality.UNSTABLE


def heard(name: str, data: bytes, address: int | None = None) -> StreamContent | None:
    """What a device's frame says, where it says something."""
    parser = StreamParser(device(name), address)
    parser.begin()
    items = parser.feed(data)
    assert len(items) < 2
    return items[0].frame.decoded if items else None


def meaning(name: str, data: bytes) -> FrameType:
    parser = StreamParser(device(name))
    parser.begin()
    (item,) = parser.feed(data)
    return item.frame.meaning


@pytest.mark.parametrize(
    ("name", "data", "value", "quality"),
    [
        # Laumas: T and P differ in 0x54 ^ 0x50 = 0x04, equal digits cancel out.
        ("laumas-tlb-ascii", b"&T012345P012345\\04\r", 123.45, GOOD),
        ("laumas-tlb-ascii", b"&T000000P000000\\04\r", 0.0, GOOD),
        # A minus in the first place of both: 0x2d cancels out as well.
        ("laumas-tlb-ascii", b"&T-00123P-00123\\04\r", -1.23, GOOD),
        # N000100L000250: 0x4e ^ 0x4c = 0x02, '1' ^ '0' = 1, '0' ^ '2' = 2, '0' ^ '5' = 5: 0x04.
        ("laumas-tlb-ascii", b"&N000100L000250\\04\r", 1.00, GOOD),
        ("mantracourt-dsc-ascii", b"123.456\r", 123.456, GOOD),
        ("mantracourt-dsc-ascii", b"-0.5\r", -0.5, GOOD),
        # HBM: nominal load is 1000000 digits, here of 1 kN; status 008 is standstill.
        ("hbm-aed-ascii", b"+1000000,01,008\r\n", 1000.0, GOOD),
        ("hbm-aed-ascii", b"-0500000,31,000\r\n", -500.0, UNSTABLE),
        ("hbm-aed-ascii", b" 1000000\r\n", 1000.0, GOOD),
        # 5120000 = 4e2000h is nominal with NOV0.
        ("hbm-aed-binary", b"\x4e\x20\x00\x08\r\n", 1000.0, GOOD),
        ("hbm-aed-binary", b"\xb1\xe0\x00\x08\r\n", -1000.0, GOOD),
        # CR LF within the value: 0d0a0dh = 854541, of 1/5120 N each.
        ("hbm-aed-binary", b"\x0d\x0a\x0d\x08\r\n", 854541 / 5120, GOOD),
        ("hbm-aed-binary", b"\x0d\x0a\x0d\x00\r\n", 854541 / 5120, UNSTABLE),
        ("flintec-ldu", b"N+01.000\r\n", 1.0, GOOD),
        ("flintec-ldu", b"N+123.45\r\n", 123.45, GOOD),
        ("and-ad-4406", b"ST,GS,+0012.34kg\r\n", 12.34 * G, GOOD),
        ("and-ad-4406", b"US,NT,-0000.50 t\r\n", -500 * G, UNSTABLE),
        ("and-ad-4406", b"ST,GS,+0021.30 kg\r\n", 21.30 * G, GOOD),
        ("mettler-mt-sics", b"S S     100.00 g\r\n", 0.1 * G, GOOD),
        ("mettler-mt-sics", b"S D      -0.02 kg\r\n", -0.02 * G, UNSTABLE),
        ("sartorius-sbi", b"+   123.56 g  \r\n", 0.12356 * G, GOOD),
        ("sartorius-sbi", b"N     +   123.56 g  \r\n", 0.12356 * G, GOOD),
        ("sartorius-sbi", b"N     -     0.10    \r\n", -1e-4 * G, UNSTABLE),
        # Status words after Rice Lake's table: bits 0 to 2 of A for the point, 0 1 1 is x 0.1 and
        # 1 1 0 is x 0.0001; of B bit 1 the sign, 3 motion, 4 kg. Bit 5 is 1 in each.
        ("toledo-continuous", b"\x02\x2b\x30\x20000123000000\r", 12.3 * G, GOOD),
        ("toledo-continuous", b"\x02\x2a\x32\x20   450     0\r", -450.0 * G, GOOD),
        ("toledo-continuous", b"\x02\x2e\x3a\x20012345\r", -1.2345 * G, UNSTABLE),
        ("toledo-continuous", b"\x02\x28\x30\x20000012000000\r", 1200.0 * G, GOOD),
        # A pound is 0.45359237 kg; the check sum behind CR comes before the next frame.
        ("toledo-continuous", b"Q\x02\x2b\x20\x20000100000000\r", 4.5359237 * G, GOOD),
        ("hx711-line", b"-12.34\r\n", -12.34, GOOD),
        ("hx711-line", b"7\n", 7.0, GOOD),
        ("generic-line", b"+00123.45\n", 123.45, GOOD),
    ],
)
def test_the_numbers_of_the_manuals(name: str, data: bytes, value: float, quality: Quality) -> None:
    found = heard(name, data)
    assert found.value == pytest.approx(value, rel=1e-12, abs=1e-12)
    assert found.quality == quality


@pytest.mark.parametrize(
    ("name", "data", "quality"),
    [
        # O-L in the middle of both places: T and P, the rest cancels out.
        ("laumas-tlb-ascii", b"&T  O-L P  O-L \\04\r", Quality.OVERLOAD),
        ("laumas-tlb-ascii", b"&T__O-F_P__O-F_\\04\r", Quality.FAULT),
        # A text that is not declared, but a right check sum: an alarm, and no number.
        ("laumas-tlb-ascii", b"&T EEPr P EEPr \\04\r", Quality.FAULT),
        ("hbm-aed-ascii", b"+1599999,01,001\r\n", Quality.OVERLOAD),
        ("hbm-aed-binary", b"\x7f\xff\xff\x04\r\n", Quality.OVERLOAD),
        ("and-ad-4406", b"OL,GS,        kg\r\n", Quality.OVERLOAD),
        ("and-ad-4406", b"OL,GS,     .  kg\r\n", Quality.OVERLOAD),
        ("and-ad-4406", b"HD,GS,+0012.34kg\r\n", Quality.STALE),
        ("mettler-mt-sics", b"S +\r\n", Quality.OVERLOAD),
        ("mettler-mt-sics", b"S -\r\n", Quality.UNDERLOAD),
        ("sartorius-sbi", b"     High     \r\n", Quality.OVERLOAD),
        ("sartorius-sbi", b"Stat       Low      \r\n", Quality.UNDERLOAD),
        ("sartorius-sbi", b"   Err 101    \r\n", Quality.FAULT),
        ("sartorius-sbi", b"Stat     ERR 054    \r\n", Quality.FAULT),
        ("hx711-line", b"2000.5\n", Quality.OVERLOAD),
    ],
)
def test_what_is_no_measurement_is_not_a_number(name: str, data: bytes, quality: Quality) -> None:
    found = heard(name, data)
    assert math.isnan(found.value)
    assert math.isnan(found.gross)
    assert quality in found.quality
    assert not found.quality.usable


@pytest.mark.parametrize(
    ("name", "data", "expected"),
    [
        ("and-ad-4406", b"I\r\n", FrameType.BUSY),
        ("and-ad-4406", b"?\r\n", FrameType.REFUSED),
        ("and-ad-4406", b"MT\r\n", FrameType.ANSWER),
        ("mettler-mt-sics", b"S I\r\n", FrameType.BUSY),
        ("mettler-mt-sics", b"ES\r\n", FrameType.REFUSED),
        ("mettler-mt-sics", b"Z A\r\n", FrameType.ANSWER),
        ("mettler-mt-sics", b"T S     100.00 g\r\n", FrameType.ANSWER),
        ("hbm-aed-ascii", b"0\r\n", FrameType.ANSWER),
        ("hbm-aed-ascii", b"?\r\n", FrameType.REFUSED),
        ("mantracourt-dsc-ascii", b"?\r", FrameType.REFUSED),
        ("flintec-ldu", b"OK\r\n", FrameType.ANSWER),
        ("flintec-ldu", b"ERR\r\n", FrameType.REFUSED),
    ],
)
def test_answers_that_are_no_values(name: str, data: bytes, expected: FrameType) -> None:
    assert meaning(name, data) is expected


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("laumas-tlb-ascii", b"&T012345P012345\\05\r"),
        ("laumas-tlb-ascii", b"&T012346P012345\\04\r"),
        ("laumas-tlb-ascii", b"012345\r"),
        ("mantracourt-dsc-ascii", b"12a.456\r"),
        ("mantracourt-dsc-ascii", b"1.2.3\r"),
        ("mantracourt-dsc-ascii", b"\xb2\r"),
        ("hbm-aed-ascii", b"+10000O0,01,008\r\n"),
        ("hbm-aed-ascii", b"+1000000,01,0x8\r\n"),
        ("hbm-aed-ascii", b"+100000\r\n"),
        ("hbm-aed-binary", b"\x00\x4e\x20\x00\x08\r"),
        ("flintec-ldu", b"N+011.000\r\n"),
        ("flintec-ldu", b"G+01.100\r\n"),
        ("and-ad-4406", b"ST,GS,+0012.34lb\r\n"),
        ("and-ad-4406", b"XX,GS,+0012.34kg\r\n"),
        ("and-ad-4406", b"ST,TR,+0012.34kg\r\n"),
        ("and-ad-4406", b"ST,GS,        kg\r\n"),
        ("and-ad-4406", b"ST,GS,+0012.4kg\r\n"),
        ("mettler-mt-sics", b"S S    100.00 g\r\n"),
        ("mettler-mt-sics", b"S S     100.00 oz\r\n"),
        ("sartorius-sbi", b"+  123.56 g  \r\n"),
        ("generic-line", b"1e5\n"),
        ("generic-line", b"nan\n"),
        ("generic-line", b"inf\n"),
        ("generic-line", b"1_000\n"),
    ],
)
def test_spoilt_frames_say_nothing_and_are_counted(name: str, data: bytes) -> None:
    parser = StreamParser(device(name))
    parser.begin()
    assert parser.feed(data) == []
    counts = parser.counts
    assert counts.malformed + counts.bad_checksums == 1
    assert counts.spoilt == len(data)


def test_a_frame_of_another_address_is_not_taken() -> None:
    assert heard("hbm-aed-ascii", b"+1000000,02,008\r\n", address=1) is None
    assert heard("hbm-aed-ascii", b"+1000000,01,008\r\n", address=1) is not None


def test_gross_and_net_are_kept_apart() -> None:
    found = heard("laumas-tlb-ascii", b"&N000100L000250\\04\r")
    assert (found.value, found.gross) == (1.0, 2.5)
    net = heard("and-ad-4406", b"ST,NT,+0012.34kg\r\n")
    assert net.net is True


def test_mantracourt_says_by_a_bit_that_its_value_is_old() -> None:
    from winchkit.drivers.stream.parser import asking_whether_fresh

    parser = StreamParser(asking_whether_fresh(device("mantracourt-dsc-ascii")))
    parser.begin()
    old, new, over = parser.feed(b"8192\r0\r512\r")
    assert old.frame.meaning is FrameType.STATUS
    assert new.frame.decoded is not None
    assert over.frame.decoded is not None
    assert Quality.STALE in old.frame.decoded.quality
    assert new.frame.decoded.quality == GOOD
    assert over.frame.decoded.quality == Quality.OVERLOAD


@pytest.mark.parametrize(
    ("kind", "expected"),
    # "12": 31h, 32h.
    [("xor", 0x03), ("sum", 0x63), ("sum-complement", 0x9C)],
)
def test_check_sums_by_hand(kind: object, expected: int) -> None:
    assert check_sum(ChecksumSpec(kind, "&", "\\"), "&12\\xx", 2) == expected  # type: ignore[arg-type]
    assert check_sum(ChecksumSpec(kind), "12xx", 2) == expected  # type: ignore[arg-type]


@pytest.mark.parametrize("name", DEVICES)
def test_the_example_of_every_device_file_is_read(name: str) -> None:
    spec = device(name).stream
    raw = bytes.fromhex(spec.example) if spec.binary else spec.example.encode("latin-1")
    found = heard(name, raw + spec.terminator.encode("latin-1"))
    assert math.isfinite(found.value)


@pytest.mark.parametrize("name", DEVICES)
def test_every_device_says_where_its_numbers_come_from(name: str) -> None:
    found = device(name)
    assert len(found.source) > 20
    assert found.trust in ("manual", "generic")
    assert found.description


def test_the_tare_of_a_net_value_gives_the_gross_one() -> None:
    found = heard("toledo-continuous", b"\x02\x2b\x33\x20000020000300\r")
    assert found.net
    assert found.value == pytest.approx(-2.0 * G)
    assert found.gross == pytest.approx(28.0 * G)


@pytest.mark.parametrize(
    "frame",
    [
        b"\x02\x2b\x30\x21000123000000\r",  # grams, by word C
        b"\x02\x2b\x30\x30000123000000\r",  # the display with ten times the resolution
        b"\x02\x2b\x30\x200012.3000000\r",  # a point in the digits beside that of word A
        b"\x02\x2b\x30\x20\r",
    ],
)
def test_a_status_word_that_is_not_declared_gives_no_number(frame: bytes) -> None:
    assert heard("toledo-continuous", frame) is None


def test_out_of_range_is_no_number() -> None:
    found = heard("toledo-continuous", b"\x02\x2b\x34\x20000123000000\r")
    assert math.isnan(found.value)
    assert found.quality == Quality.OVERLOAD


PAGE = (Path(__file__).parents[3] / "docs/howto/serial-instrument.md").read_text(encoding="utf-8")


def test_the_line_of_your_own_is_read(tmp_path: Path) -> None:
    blocks = re.findall(r"^```toml\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    (text,) = [block for block in blocks if 'name = "my-cell"' in block]
    path = tmp_path / "device.toml"
    path.write_text(text, encoding="utf-8")
    parser = StreamParser(read_device(path))
    parser.begin()
    good, moving, over = parser.feed(
        b"scale: 12.34 kg, ok\nscale: -0.5 kg, moving\nscale: 412.34 kg, over\nscale: 1 lb, ok\n"
    )
    assert moving.frame.decoded is not None
    assert over.frame.decoded is not None
    assert good.frame.decoded.value == pytest.approx(12.34 * 9.80665)
    assert moving.frame.decoded.quality == Quality.UNSTABLE
    assert over.frame.decoded.quality == Quality.OVERLOAD
    assert parser.counts.malformed == 1


def test_the_table_has_every_device_and_how_it_speaks() -> None:
    rows = dict(re.findall(r"^\| (`.+?`) \|.+\| (continuous|polled)", PAGE, re.MULTILINE))
    said = {name: how for names, how in rows.items() for name in re.findall(r"`(.+?)`", names)}
    assert said == {
        name: "continuous" if stream(name).mode == "continuous" else "polled" for name in DEVICES
    }
