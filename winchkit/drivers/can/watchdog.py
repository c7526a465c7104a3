"""Who watches whom: heartbeats both ways, and the proof that the drive notices a dead host."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from winchkit.drivers.can.cia402 import DISABLE_VOLTAGE, FAULT_RESET, State, state_of
from winchkit.drivers.can.emergency import Emergency
from winchkit.drivers.can.heartbeat import HeartbeatWatch, NmtState
from winchkit.drivers.can.node import SdoNode
from winchkit.drivers.clock import Clock
from winchkit.errors import NotPermitted

__all__ = ["Proof", "prove_watchdog", "set_error_behaviour", "set_heartbeats"]

_HEARTBEAT_LOST = 0x8130
_PRE_OPERATIONAL, _START = 0x80, 0x01
_NODES = range(127, 0, -1)
_PROOF_TIME = 0.1
"""The drive's limit during the proof at most, s: what is proved is that it watches."""
_PATIENCE = 0.4
"""For its answer beyond that limit, s."""
_SETTLING = 1.0
_POLL = 0.002
_MS = 1e3


@dataclass(frozen=True)
class Proof:
    """How a drive noticed that a heartbeat was withheld."""

    emergency: Emergency | None
    """EMCY 8130h, where it sent one."""
    nmt: int
    """State that its heartbeat showed then."""
    delay: float
    """From the last heartbeat to its answer, s."""
    limit: float
    """What it had been told to tolerate, s."""


def set_heartbeats(node: SdoNode, host: int, timeout: float, period: float) -> None:
    """Let the drive watch the host (1016h) and tell the host that it lives (1017h).

    Raises NoReply, DeviceRefused.
    """
    node.write_verified(0x1016, 1, entry(host, timeout))
    node.write_verified(0x1017, 0, round(period * _MS))


def set_error_behaviour(node: SdoNode) -> int | None:
    """Have the drive leave operational when a heartbeat is gone (1029h:1 = 0).

    Returns what it keeps: 0 pre-operational, 2 stopped, 1 no change where it takes nothing else,
    None without such an object. Raises NoReply, DeviceRefused.
    """
    kept = node.read_if_there(0x1029, 1)
    if kept == 1 and node.writes(0x1029, 1):
        node.write(0x1029, 1, 0)
        kept = node.read(0x1029, 1)
    return kept


def entry(host: int, timeout: float) -> int:
    """A heartbeat consumer's entry: node and time in ms."""
    return host << 16 | round(timeout * _MS)


def prove_watchdog(
    node: SdoNode,
    watch: HeartbeatWatch,
    emergencies: Collection[Emergency],
    clock: Clock,
    *,
    host: int,
    timeout: float,
) -> Proof:
    """Withhold a heartbeat from a disabled, operational drive until it complains.

    The heartbeat is that of a node id which nobody has, so that neither other drives nor the
    host's own heartbeat are touched by it; the host's entry (``host``, ``timeout``) is in 1016h
    again afterwards. What the drive did is undone: it is operational and disabled. Raises
    NotPermitted when it does not notice, NoReply, DeviceRefused.
    """
    limit = min(timeout, _PROOF_TIME)
    # A fault that stood before is the operator's to look at and to reset.
    clears = state_of(node.read(0x6041)) is not State.FAULT
    stranger = _free_node(node, host)
    node.write_verified(0x1016, 1, entry(stranger, limit))
    try:
        node.bus.heartbeat(stranger, NmtState.OPERATIONAL)
        proof = _await_complaint(node, watch, emergencies, clock, limit)
    finally:
        _await_sdo(node)
        node.write_verified(0x1016, 1, entry(host, timeout))
    _bring_back(node, watch, clock, clears=clears)
    return proof


def _await_complaint(
    node: SdoNode,
    watch: HeartbeatWatch,
    emergencies: Collection[Emergency],
    clock: Clock,
    limit: float,
) -> Proof:
    start = clock.now()
    while (delay := clock.now() - start) <= limit + _PATIENCE:
        new = [e for e in tuple(emergencies) if e.code == _HEARTBEAT_LOST and e.time >= start]
        nmt = watch.state if watch.state is not None else NmtState.OPERATIONAL
        if new or nmt != NmtState.OPERATIONAL:
            return Proof(new[0] if new else None, nmt, delay, limit)
        clock.sleep(_POLL)
    raise NotPermitted(
        f"{node.place(0x1016, 1)}: a heartbeat was withheld for {delay:.2f} s, the limit is "
        f"{limit:g} s, and the drive sent neither EMCY 8130h nor left operational; it would go on "
        "moving when the host dies"
    )


def _free_node(node: SdoNode, host: int) -> int:
    """A node id that no frame on this bus has shown; from the top, where few devices are."""
    return next(number for number in _NODES if number not in (host, node.node, *node.bus.nodes))


def _await_sdo(node: SdoNode) -> None:
    """A drive that stopped (1029h:1 = 2) answers SDO only once it is pre-operational."""
    node.bus.nmt(_PRE_OPERATIONAL, node.node)


def _bring_back(node: SdoNode, watch: HeartbeatWatch, clock: Clock, *, clears: bool) -> None:
    """Clear the fault that 6007h may have made of it, without enabling, and start it again."""
    if state_of(node.read(0x6041)) is State.FAULT_REACTION_ACTIVE:
        _await_state(node, clock, State.FAULT)
    if clears and state_of(node.read(0x6041)) is State.FAULT:
        node.write(0x6040, 0, DISABLE_VOLTAGE)
        node.write(0x6040, 0, FAULT_RESET)
        _await_state(node, clock, State.SWITCH_ON_DISABLED)
        node.write(0x6040, 0, DISABLE_VOLTAGE)
    watch.last = watch.state = None
    node.bus.nmt(_START, node.node)


def _await_state(node: SdoNode, clock: Clock, wanted: State) -> None:
    deadline = clock.now() + _SETTLING
    while (state := state_of(node.read(0x6041))) is not wanted:
        if clock.now() > deadline:
            raise NotPermitted(
                f"{node.place(0x6041)}: still {state} {_SETTLING:g} s after its watchdog was "
                f"proved, {wanted} was expected; look at the drive's errors"
            )
        clock.sleep(_POLL)
