"""What docs/howto/serial-instrument.md shows is a device file that is read as the page says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from stream_rig import DEVICES, stream
from winchkit.drivers.reading import Quality
from winchkit.drivers.stream.parser import StreamParser
from winchkit.schema.read import read_device

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
    assert good.frame.decoded is not None
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
