"""Drives of five makers, simulated from the makers' own EDS: which mechanism each has."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import pytest

from guarded_rig import CYCLE, HEARTBEAT, HOST, generic, rig
from slave import Reactions, Slave
from winchkit.drivers.can.canopen.node import SdoNode
from winchkit.drivers.can.host_loss.mechanism import Terms
from winchkit.drivers.can.host_loss.watch import HostWatch
from winchkit.errors import NotPermitted
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.devices.servo import PdoSpec

FOLDER = Path(os.environ.get("WINCHKIT_MAKERS_EDS", Path(__file__).parents[5] / "shared/data/eds"))
pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason="the makers' EDS files are not here")
LIMIT, SLACK = 2.5 * HEARTBEAT, 0.01
STOPS = Reactions(leaves_operational="quick stop")
"""Of a drive without 6007h; which of them stop so only a trial shows."""

KRIA, ELMO, EPOS, ANIMATICS, ZEROERR = (
    "amd-kria.eds",
    "elmo-gold.dcf",
    "maxon-epos4.eds",
    "animatics-smartmotor.eds",
    "zeroerr-erob.eds",
)


def device(file: str, host_loss: str) -> DeviceSpec:
    """A device file for this EDS: PV where the drive has no CSV."""
    mode = "PV" if file in (KRIA, ANIMATICS) else "CSV"
    spec = generic(
        eds=file,
        host_loss=host_loss,
        modes=(mode,),
        motion_mode=mode,
        units="file",
        tpdo=(PdoSpec(3, ("0x6041", "0x606C")), PdoSpec(4, ("0x6041", "0x6064"))),
        # Those that are fixed in the Kria's EDS.
        rpdo=(PdoSpec(3 if file == KRIA else 1, ("0x6040", "0x60FF")),),
    )
    return replace(spec, path=str(FOLDER / "device.toml"))


def drive(file: str) -> Slave:
    """The slave of an EDS; 6502h is that of the drive, not of the file."""
    slave = Slave.from_file(FOLDER / file, 1, reactions=STOPS)
    if not slave.objects.get(0x6502):
        slave.objects.set(0x6502, 0, 0x3FF)
    # Elmo's file limits this entry to its 16 bits of time; its node number lies above them.
    if (0x1016, 1) in slave.objects.entries:
        slave.objects.entries[0x1016, 1].high = None
    return slave


@pytest.mark.parametrize(
    ("file", "mechanism", "certain"),
    [
        (ELMO, "heartbeat", True),
        (EPOS, "heartbeat", True),
        (KRIA, "heartbeat", False),
        (KRIA, "rpdo-timeout", True),
        (ZEROERR, "heartbeat", False),
        (ZEROERR, "guarding", False),
        (ZEROERR, "rpdo-timeout", True),
    ],
)
def test_what_a_drive_has_is_proved_and_stops_it(file: str, mechanism: str, certain: bool) -> None:
    """``certain``: by 6007h, or because it goes into fault while it is disabled already."""
    slave = drive(file)
    with rig(slave) as bench:
        axis = bench.axis(device(file, mechanism))
        found = axis.commission()
        assert found.proof.noticed
        assert found.host_loss.certain is certain
        bench.moving(axis)
        assert bench.until_left(LIMIT + SLACK) < LIMIT + SLACK


@pytest.mark.parametrize(
    ("file", "mechanism", "lacks"),
    [
        (EPOS, "guarding", "100Ch"),
        (ELMO, "guarding", "100Ch"),
        (KRIA, "guarding", "100Ch"),
        (EPOS, "rpdo-timeout", "1400h:5"),
    ],
)
def test_what_a_drive_lacks_is_named(file: str, mechanism: str, lacks: str) -> None:
    with rig(drive(file)) as bench, pytest.raises(NotPermitted, match=f"it has no {lacks}"):
        bench.axis(device(file, mechanism)).commission()


@pytest.mark.parametrize(
    ("mechanism", "lacks"), [("heartbeat", "1016h"), ("guarding", "100Ch"), ("sync-loss", "1006h")]
)
def test_the_drive_without_any_is_refused_but_for_hardware(mechanism: str, lacks: str) -> None:
    """Its file has no RPDO and no 6064h either, so that the set-up of the watch is all there is."""
    spec = generic(host_loss=mechanism)
    assert spec.servo is not None
    terms = Terms(HOST, LIMIT, HEARTBEAT, CYCLE)
    with rig(drive(ANIMATICS)) as bench:
        bench.world.wait(0.1)
        node = SdoNode(bench.bus, 1, FOLDER / ANIMATICS)
        with pytest.raises(NotPermitted, match=f"it has no {lacks}.*hardware"):
            HostWatch(node, spec.servo, terms, bench.clock).set_up()
        HostWatch(node, spec.servo, terms, bench.clock, "watchdog relay").set_up()
        assert bench.slaves[0].objects.get(0x1017) == round(HEARTBEAT * 1e3)
