"""Each mechanism against a slave that shares no code with the stack: set up, proved, and used."""

from __future__ import annotations

import dataclasses

import pytest

from guarded_rig import CYCLE, HEARTBEAT, eds_of, generic, rig
from slave import Nmt, Reactions, Slave, State
from winchkit.drivers.can.bus.bus import CanBus
from winchkit.drivers.can.cia402.state_machine import RequestedState
from winchkit.drivers.can.host_loss.guarding import GuardingWatch
from winchkit.errors import NotPermitted
from winchkit.schema.host_loss import VendorObject, VendorWatchdog

LIMIT = 2.5 * HEARTBEAT
SLACK = 0.01
"""Steps of the simulated bus, s."""


def drive(**options: object) -> Slave:
    return Slave.from_file(eds_of(generic()), 1, **options)


def lacking(slave: Slave, *indices: int) -> Slave:
    """A slave without these objects."""
    for key in [key for key in slave.objects.entries if key[0] in indices]:
        del slave.objects.entries[key]
    return slave


@pytest.mark.parametrize("mechanism", ["heartbeat", "guarding", "rpdo-timeout"])
@pytest.mark.parametrize("reaction", [0, 2])
def test_a_mechanism_is_proved_and_stops_the_moving_drive(mechanism: str, reaction: int) -> None:
    slave = drive()
    slave.objects.set(0x1029, 1, reaction)
    with rig(slave) as bench:
        axis = bench.axis(generic(host_loss=mechanism))
        drive_now = axis.commission()
        assert drive_now.proof.noticed
        assert drive_now.host_loss.mechanism == mechanism
        assert slave.network.state is Nmt.OPERATIONAL
        assert slave.power.state is State.SWITCH_ON_DISABLED
        bench.moving(axis)
        assert LIMIT / 3 < bench.until_left(LIMIT + SLACK) < LIMIT + SLACK


@pytest.mark.parametrize(
    ("mechanism", "fault"),
    [
        ("heartbeat", "EMCY 8130h nor left operational"),
        ("guarding", "no guarding poll was sent.*8130h"),
        ("rpdo-timeout", "no RPDO was sent.*8250h"),
    ],
)
def test_a_drive_that_takes_the_values_and_never_looks_is_refused(
    mechanism: str, fault: str
) -> None:
    slave = drive()
    slave.inject("monitoring fails")
    with rig(slave) as bench, pytest.raises(NotPermitted, match=fault):
        bench.axis(generic(host_loss=mechanism)).commission()


@pytest.mark.parametrize(
    ("mechanism", "index", "words"),
    [
        ("heartbeat", 0x1016, "it has no 1016h and cannot watch"),
        ("guarding", 0x100D, r"it has no 100Dh \(life time factor\)"),
        ("sync-loss", 0x1006, "it has no 1006h"),
    ],
)
def test_an_object_that_is_missing_is_named_and_nothing_is_to_be_set(
    mechanism: str, index: int, words: str
) -> None:
    with rig(lacking(drive(), index)) as bench:
        with pytest.raises(NotPermitted, match=words) as caught:
            bench.axis(generic(host_loss=mechanism)).commission()
        assert "set it to" not in str(caught.value)
        assert 'host_loss = "hardware"' in str(caught.value)


def test_without_6007h_the_proof_is_of_the_notice_and_the_rest_is_said() -> None:
    """As of the drives that have 1016h alone: they leave operational."""
    with rig(lacking(drive(), 0x6007)) as bench:
        found = bench.axis(generic()).commission()
        assert found.proof.noticed
        assert not found.host_loss.certain
        assert "winchkit commission" in found.host_loss.words


def test_with_6007h_or_a_fault_the_reaction_of_the_enabled_drive_is_known() -> None:
    with rig(drive()) as bench:
        assert bench.axis(generic()).commission().host_loss.certain
    slave = lacking(drive(reactions=Reactions(rpdo_late="fault")), 0x6007)
    with rig(slave) as bench:
        found = bench.axis(generic(host_loss="rpdo-timeout")).commission()
        assert found.proof.fault
        assert found.host_loss.certain
        assert slave.power.state is State.SWITCH_ON_DISABLED


def test_a_fault_that_stood_before_the_silence_proves_nothing() -> None:
    """A drive in fault that does not watch its host stays in fault whoever falls silent."""
    slave = drive()
    with rig(slave) as bench:
        slave.inject("monitoring fails")
        slave.inject("drive fault")
        slave.mend("drive fault")
        assert slave.power.state is State.FAULT
        with pytest.raises(NotPermitted, match="it was in fault before"):
            bench.axis(generic()).commission()
        assert slave.power.state is State.FAULT, "it is the operator's to reset"


@pytest.mark.parametrize("silence", ["heartbeat", "rpdo"])
def test_6007h_says_nothing_of_a_makers_watchdog(silence: str) -> None:
    watchdog = VendorWatchdog(silence, (VendorObject("0x605E", value=2),))
    with rig(drive()) as bench:
        device = generic(host_loss="vendor:own", vendor_watchdog={"own": watchdog})
        found = bench.axis(device).commission()
        assert found.options["connection_lost"].value in (1, 2, 3)
        assert not found.host_loss.certain


@pytest.mark.parametrize("pause", [0.0, 0.02, 0.04, 0.08, 0.12])
def test_a_pause_of_the_host_before_it_sets_a_drive_up_again_is_no_loss(pause: float) -> None:
    """A drive that monitors on where its entry of 1016h is written again as it was."""
    slave = drive()
    slave.network.same_consumer_goes_on = True
    with rig(slave) as bench:
        axis = bench.axis(generic())
        axis.commission()
        bench.cycles(axis, RequestedState.DISABLE, 60)
        bench.world.wait(pause)
        axis.commission()
        bench.world.wait(0.1)
        assert list(axis.emergencies) == []
        assert slave.network.state is Nmt.OPERATIONAL


@pytest.mark.parametrize("polls_need_life_time", [False, True])
def test_a_guarded_drive_sends_no_heartbeat_and_is_supervised_by_its_replies(
    polls_need_life_time: bool,
) -> None:
    slave = drive()
    slave.network.polls_need_life_time = polls_need_life_time
    with rig(slave) as bench:
        axis = bench.axis(generic(host_loss="guarding"))
        axis.commission()
        assert slave.objects.get(0x1017) == 0
        assert slave.objects.get(0x100C) * slave.objects.get(0x100D) == pytest.approx(
            LIMIT * 1e3, abs=3
        )
        assert isinstance(axis.heartbeat, GuardingWatch)
        bench.world.wait(2 * LIMIT)  # other drives of the bench are commissioned meanwhile
        bench.moving(axis)
        assert bench.polls()
        assert axis.heartbeat.stuck == 0
        assert not axis.heartbeat.lost(bench.time)
        slave.inject("silent")
        bench.world.wait(LIMIT + SLACK)
        assert axis.heartbeat.lost(bench.time)


def test_polls_come_from_the_control_loop_and_end_with_it() -> None:
    slave = drive()
    with rig(slave) as bench:
        axis = bench.axis(generic(host_loss="guarding"))
        axis.commission()
        bench.cycles(axis, RequestedState.DISABLE, 60)
        begun = bench.time
        assert bench.polls()
        bench.world.wait(0.5)
        assert bench.polls(since=begun + 0.01) == 0


@pytest.mark.parametrize("mechanism", ["guarding", "rpdo-timeout"])
def test_silence_stops_a_drive_while_the_loop_goes_on(mechanism: str) -> None:
    """The last method: the control loop runs, SYNC goes on, and what the drive watches ends."""
    slave = drive()
    with rig(slave) as bench:
        axis = bench.axis(generic(host_loss=mechanism))
        axis.commission()
        bench.moving(axis)
        assert axis.fall_silent() is False, "SYNC may go on"
        bench.cycles(axis, RequestedState.ENABLE, round((LIMIT + SLACK) / CYCLE), velocity=3.0)
        assert slave.power.state is not State.ENABLED


def test_loss_of_sync_shows_nothing_while_the_drive_is_disabled() -> None:
    """What was proved is said; that the moving drive stops is left to the commissioning."""
    slave = drive(reactions=Reactions(sync_lost="quick stop"))
    with rig(slave) as bench:
        axis = bench.axis(generic(host_loss="sync-loss"))
        found = axis.commission()
        assert slave.objects.get(0x1006) == 5000
        assert not found.proof.noticed
        assert not found.host_loss.certain
        assert axis.fall_silent() is True
        axis.host.silent = False
        bench.moving(axis)
        bench.world.wait(0.2)
        assert slave.power.state is not State.ENABLED


def test_a_makers_watchdog_is_declared_by_its_objects() -> None:
    """Here the RPDO timer under another name: written in its unit, read back, proved."""
    watchdog = VendorWatchdog(
        silence="rpdo",
        object=(VendorObject(object="0x1400:5", time_unit=1e-3, off=0),),
        emergency=0x8250,
    )
    device = generic(host_loss="vendor:deadline", vendor_watchdog={"deadline": watchdog})
    slave = drive()
    with rig(slave) as bench:
        axis = bench.axis(device)
        found = axis.commission()
        assert slave.objects.get(0x1400, 5) == round(LIMIT * 1e3)
        assert found.proof.noticed
        assert found.host_loss.mechanism == "vendor:deadline"
        axis.host.disarm()
        assert slave.objects.get(0x1400, 5) == 0


def test_hardware_is_taken_at_its_word_and_nothing_is_written() -> None:
    slave = lacking(drive(), 0x1016, 0x6007, 0x100C, 0x100D)
    with rig(slave) as bench:
        axis = bench.axis(generic(), hardware="watchdog relay K3")
        found = axis.commission()
        assert found.proof is None
        assert found.host_loss.mechanism == "hardware"
        assert "watchdog relay K3" in found.host_loss.words
        bench.moving(axis)


def test_guarding_is_refused_where_the_adapter_sends_no_remote_frames(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with rig(drive()) as bench:
        monkeypatch.setattr(bench.bus, "sends_remote", False)
        with pytest.raises(NotPermitted, match=r"remote frames \(RTR\).*sends none"):
            bench.axis(generic(host_loss="guarding")).commission()
    with rig(drive()) as bench:
        # An adapter without a note of it: the polls go nowhere.
        monkeypatch.setattr(CanBus, "remote", lambda *_: None)
        with pytest.raises(NotPermitted, match=r"no guarding reply|no answer to 3 guarding polls"):
            bench.axis(generic(host_loss="guarding")).commission()


def test_the_proof_of_one_guarded_drive_leaves_others_alone() -> None:
    first, second = drive(), Slave.from_file(eds_of(generic()), 2)
    with rig(first, second) as bench:
        one = bench.axis(generic(host_loss="guarding"))
        one.commission()
        two = bench.axis(dataclasses.replace(generic(host_loss="guarding")), 2)
        two.commission()
        assert first.network.state is second.network.state is Nmt.OPERATIONAL
        assert list(one.emergencies) == []
