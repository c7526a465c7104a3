"""docs/devices.md, docs/effects.md and docs/safety.md are what the code declares."""

from __future__ import annotations

import re
import runpy
from collections.abc import Callable, Sequence

import pytest

from snippets import ROOT
from winchkit.catalog import find, names
from winchkit.effects import Catalogue, load_catalogue
from winchkit.effects.card import card
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.read import read_device


def test_the_page_is_what_the_device_files_say() -> None:
    made = runpy.run_path(str(ROOT / "docs/make_devices.py"))
    page: Callable[[Sequence[DeviceSpec]], str] = made["page"]
    devices = [read_device(find("devices", name)) for name in names("devices")]
    there = (ROOT / "docs/devices.md").read_text(encoding="utf-8")
    assert there == page(devices), "run: python docs/make_devices.py"
    drive_page = (ROOT / "docs/howto/drive.md").read_text(encoding="utf-8")
    assert drive_page == made["drive_page"](), "run: python docs/make_devices.py"
    for device in devices:
        assert (f"## {device.name}\n" in there) == (device.servo is None)


@pytest.fixture(scope="module")
def catalogue() -> Catalogue:
    return load_catalogue()


@pytest.fixture(scope="module")
def page(catalogue: Catalogue) -> str:
    written: Callable[[Catalogue], str] = runpy.run_path(str(ROOT / "docs/make_effects.py"))["page"]
    return written(catalogue)


def test_the_page_is_up_to_date(page: str) -> None:
    there = (ROOT / "docs/effects.md").read_text(encoding="utf-8")
    assert there == page, "run: python docs/make_effects.py"


def test_every_effect_has_its_card_once(page: str, catalogue: Catalogue) -> None:
    titles = [line.removeprefix("### ") for line in page.splitlines() if line.startswith("### ")]
    assert sorted(titles) == sorted(effect.id for effect in catalogue)


def test_cards_stand_there_line_by_line(page: str, catalogue: Catalogue) -> None:
    for effect in catalogue:
        lines = card(effect).split("Signature over")[0].splitlines()[1:]
        assert "\n".join(lines).strip() in page


def test_the_tables_are_what_the_code_declares() -> None:
    written: Callable[[str], str] = runpy.run_path(str(ROOT / "docs/make_safety.py"))["tables"]
    there = (ROOT / "docs/safety.md").read_text(encoding="utf-8")
    assert there == written(there), "run: python docs/make_safety.py"


_RECORDS = ("records/latch.py", "records/position_file.py")


def test_every_trip_of_the_control_loop_stands_in_the_table() -> None:
    source = "".join(
        (ROOT / "winchkit" / name).read_text(encoding="utf-8")
        for name in (
            *(
                f"bench/{own}"
                for own in ("control/loop.py", "hardware.py", *_RECORDS, "held_winch.py")
            ),
            *(f"robot/bench/{own}.py" for own in ("correction", "force_loop", "pose_loop")),
        )
    )
    raised = set(re.findall(r'Trip\(\s*"([a-z ]+)"', source))
    rows = runpy.run_path(str(ROOT / "docs/make_safety.py"))["BENCH_CONDITIONS"]
    assert raised == {row.kind for row in rows}
