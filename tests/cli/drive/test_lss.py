"""``winchkit lss`` against a device written from CiA 305."""

from __future__ import annotations

import itertools
import json
import os
from collections.abc import Iterator

import pytest
from click.testing import Result

from command_line import done
from lss_device import LssDevice

IDENTITY = (0x26C, 0x12345, 0x10002, 0xDEADBEEF)
_channels = itertools.count()


@pytest.fixture
def device() -> Iterator[LssDevice]:
    with LssDevice(f"lss-{os.getpid()}-{next(_channels)}", IDENTITY) as running:
        yield running


def lss(device: LssDevice, *arguments: object, code: int = 0) -> Result:
    bus = ("--interface", "virtual", "--channel", device.channel)
    return done("lss", *arguments, *bus, code=code)


def address() -> list[str]:
    names = ("--vendor", "--product", "--revision", "--serial")
    return [word for name, part in zip(names, IDENTITY, strict=True) for word in (name, hex(part))]


def test_a_device_without_a_number_is_found_bit_by_bit(device: LssDevice) -> None:
    found = lss(device, "list", "--json")
    (identity,) = json.loads(found.stdout)["unconfigured"]
    assert tuple(identity.values()) == IDENTITY
    assert not device.selected, "it takes part in the network again"


def test_a_configured_device_is_not_listed(device: LssDevice) -> None:
    device.node = 4
    found = lss(device, "list")
    assert found.stdout == "no device without a node number\n"


def test_set_by_identity_and_store(device: LssDevice) -> None:
    lss(device, "set", *address(), "--node", 9, "--new-bitrate", 500_000, "--store")
    assert (device.node, device.rate) == (9, 2)
    assert device.stored == (9, 2)
    assert not device.selected
    told = lss(device, "identify", *address(), "--json")
    assert json.loads(told.stdout)["node"] == 9


def test_the_only_device_needs_no_address(device: LssDevice) -> None:
    done = lss(device, "set", "--only", "--node", 5)
    assert device.node == 5
    assert device.stored is None
    assert "vendor 026Ch" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (("set", "--only"), 2, "nothing to set"),
        (("set", "--node", "5"), 2, "no device is given"),
        (("set", "--vendor", "1", "--node", "5"), 2, "--product, --revision, --serial"),
        (("set", "--only", "--node", "200"), 2, "200 is no node id"),
        (("set", "--only", "--new-bitrate", "100000"), 2, "is not in the standard's table"),
        (("set", "--vendor", "x", "--node", "5"), 2, "'x' is no number"),
    ],
)
def test_wrong_input(device: LssDevice, arguments: tuple[str, ...], code: int, words: str) -> None:
    result = lss(device, *arguments, code=code)
    assert words in result.stderr
    assert (device.node, device.rate) == (255, 0)


def test_another_identity_does_not_answer(device: LssDevice) -> None:
    wrong = [*address()[:-1], "7"]
    result = lss(device, "set", *wrong, "--node", 5, code=4)
    assert "no device answers" in result.stderr
    assert device.node == 255


def test_a_dry_run_shows_the_frames_and_sends_none(device: LssDevice) -> None:
    result = lss(device, "set", *address(), "--node", 9, "--store", "--dry-run")
    for words in ("select vendor 26Ch", "set node id 9", "store"):
        assert words in result.stdout
    assert device.node == 255
