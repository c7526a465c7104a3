"""Proof that a disabled drive detects a silent host, and the known reaction of an enabled one."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

from winchkit.drivers.can.canopen.emergency import Emergency
from winchkit.drivers.can.canopen.nmt import HeartbeatConsumer, NmtCommand, NmtState
from winchkit.drivers.can.canopen.node import SdoNode
from winchkit.drivers.can.cia402.option_codes import BY_6007, OptionCode
from winchkit.drivers.can.cia402.state_machine import (
    DISABLE_VOLTAGE,
    FAULT_RESET,
    FAULTS,
    DriveState,
    state_of,
)
from winchkit.drivers.can.host_loss.guarding import Guarding
from winchkit.drivers.can.host_loss.mechanism import Mechanism, Silence
from winchkit.drivers.clock import Clock
from winchkit.errors import NoReply, NotPermitted

_TIMEOUT = 0.4
"""For its answer beyond its limit, s."""
_GUARDED_TIMEOUT = 0.1
"""After which a guarded drive is asked by a poll, s."""
_SETTLING = 1.0
"""s: for the transition after a fault reset or a quick stop at rest; drives take some tenths."""
_POLL = 0.002
"""s: resolution of the measured delay, 2 % of the shortest limit (0.1 s)."""
_STOPPING = (1, 2, 3)
"""Of 6007h: fault, disable voltage, quick stop."""


@dataclass(frozen=True)
class Proof:
    """Reaction of a disabled drive to a silent host."""

    emergency: Emergency | None
    """The EMCY that said so, where it sent one."""
    nmt: int
    """NMT state that it showed then."""
    delay: float
    """From the last life sign to its answer, s."""
    limit: float
    """Its set time-out, s."""
    fault: bool = False
    """Whether it went into the state fault, in which no drive stays enabled."""
    noticed: bool = True
    """False where nothing was seen; only a mechanism that acts on enabled drives may be so."""


@dataclass(frozen=True)
class HostLoss:
    """Mechanism by which a drive detects a lost host, and whether it is known to stop then."""

    mechanism: str = "heartbeat"
    """As declared: heartbeat, guarding, rpdo-timeout, sync-loss, vendor:NAME, hardware."""
    silence: Silence = Silence.HEARTBEAT
    """Which frames of the host have to end for the drive to notice."""
    limit: float = 0.0
    """Time without a life sign that the drive tolerates, s."""
    certain: bool = True
    """Whether an enabled drive is known to leave *operation enabled* when it notices."""
    words: str = ""
    """What was proved, and what ``winchkit commission`` has to show."""


def prove(
    mechanism: Mechanism, watch: HeartbeatConsumer, emergencies: Collection[Emergency]
) -> Proof:
    """Withhold the life signs from a disabled, operational drive until it reports their absence.

    What the drive did is undone: it is disabled, and started again by the caller. Raises
    NotPermitted where it does not notice though it should, NoReply, DeviceRefused.
    """
    node = mechanism.node
    # A fault that stood before is no evidence, and the operator's to look at and to reset.
    faultless = state_of(node.read(0x6041)) not in FAULTS
    try:
        limit = mechanism.withhold()
        start = mechanism.clock.now()
        proof = _await_reaction(mechanism, watch, emergencies, start, limit, faultless=faultless)
    finally:
        mechanism.release()
        # A drive that stopped (1029h:1 = 2) answers SDO only once it is pre-operational.
        node.bus.nmt(NmtCommand.ENTER_PRE_OPERATIONAL, node.node)
        mechanism.restore()
    state = state_of(node.read(0x6041))
    if faultless and state in FAULTS:
        proof = replace(proof, fault=True, noticed=True)
    bring_back(node, mechanism.clock, clears=faultless)
    if not proof.noticed and mechanism.noticed_disabled:
        words = _unnoticed(mechanism, proof)
        if not faultless:
            words += "; it was in fault before: clear that (power it off and on) and try again"
        raise NotPermitted(words)
    return proof


def reaction(
    mechanism: Mechanism,
    proof: Proof | None,
    options: Mapping[str, OptionCode],
    *,
    seen: bool,
    hardware: str = "",
) -> HostLoss:
    """Known reaction of an enabled drive: by its fault, by 6007h, or by observation."""
    lost = options.get("connection_lost")
    code = None if lost is None else lost.value
    by_option = mechanism.name in BY_6007 and code in _STOPPING
    if seen:
        certain, words = True, "seen to stop the moving winch at commissioning"
    elif proof is not None and proof.fault:
        certain, words = True, "the drive goes into the state fault, which ends operation enabled"
    elif by_option:
        certain, words = True, f"6007h is {code}"
    elif hardware:
        certain, words = False, f"the drive watches nothing; {hardware} stops the winch"
    else:
        noticed = proof is None or proof.noticed
        what = "notices the silence" if noticed else "shows nothing while it is disabled"
        certain = False
        words = f"the drive {what}; that it then stops was not seen: run `winchkit commission`"
    return HostLoss(mechanism.name, mechanism.silence, mechanism.limit, certain, words)


def bring_back(node: SdoNode, clock: Clock, *, clears: bool) -> None:
    """Reset the fault that the silence caused, without enabling, and start the node again."""
    if state_of(node.read(0x6041)) is DriveState.FAULT_REACTION_ACTIVE:
        _await_state(node, clock, DriveState.FAULT)
    if clears and state_of(node.read(0x6041)) is DriveState.FAULT:
        node.write(0x6040, 0, DISABLE_VOLTAGE)
        node.write(0x6040, 0, FAULT_RESET)
        _await_state(node, clock, DriveState.SWITCH_ON_DISABLED)
        node.write(0x6040, 0, DISABLE_VOLTAGE)
    node.bus.nmt(NmtCommand.START, node.node)


def _await_reaction(
    mechanism: Mechanism,
    watch: HeartbeatConsumer,
    emergencies: Collection[Emergency],
    start: float,
    limit: float,
    *,
    faultless: bool,
) -> Proof:
    """Reaction of the drive; a fault counts where it was ``faultless`` before the silence."""
    clock, asked = mechanism.clock, False
    while (delay := clock.now() - start) <= limit + _TIMEOUT:
        new = [e for e in tuple(emergencies) if e.time >= start and _fits(mechanism, e)]
        nmt = watch.state if watch.state is not None else NmtState.OPERATIONAL
        if new or nmt != NmtState.OPERATIONAL:
            return Proof(new[0] if new else None, nmt, delay, limit)
        if isinstance(mechanism, Guarding) and delay > limit + _GUARDED_TIMEOUT and not asked:
            # Its state shows in an answer only, and the poll is one life sign more: ask once.
            asked = True
            mechanism.poll()
        clock.sleep(_POLL)
    fault = faultless and _shows_fault(mechanism.node)
    return Proof(None, NmtState.OPERATIONAL, delay, limit, fault, noticed=fault)


def _fits(mechanism: Mechanism, emergency: Emergency) -> bool:
    if not mechanism.codes:
        return emergency.code != 0
    return emergency.code in mechanism.codes


def _shows_fault(node: SdoNode) -> bool:
    """Whether the silent drive is in fault; one that answers no SDO shows nothing."""
    try:
        return state_of(node.read(0x6041)) in FAULTS
    except NoReply:
        return False


def _unnoticed(mechanism: Mechanism, proof: Proof) -> str:
    index, sub, sign = {
        "heartbeat": (0x1016, 1, "a heartbeat was withheld"),
        "guarding": (0x100D, 0, "no guarding poll was sent"),
    }.get(mechanism.name, (0x6040, 0, "no RPDO was sent"))
    codes = " or ".join(f"{code:04X}h" for code in sorted(mechanism.codes)) or "any EMCY"
    return (
        f"{mechanism.node.place(index, sub)}: {sign} for {proof.delay:.2f} s, the limit is "
        f"{proof.limit:g} s, and the drive sent neither EMCY {codes} nor left operational; it "
        "would go on moving when the host dies"
    )


def _await_state(node: SdoNode, clock: Clock, wanted: DriveState) -> None:
    deadline = clock.now() + _SETTLING
    while (state := state_of(node.read(0x6041))) is not wanted:
        if clock.now() > deadline:
            raise NotPermitted(
                f"{node.place(0x6041)}: still {state} {_SETTLING:g} s after its watchdog was "
                f"proved, {wanted} was expected; look at the drive's errors"
            )
        clock.sleep(_POLL)
