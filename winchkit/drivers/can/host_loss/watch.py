"""Mutual supervision of one drive and the host, from set-up to the control loop's life signs."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from contextlib import suppress

from winchkit.drivers.can.canopen.emergency import Emergency
from winchkit.drivers.can.canopen.nmt import HeartbeatConsumer, HeartbeatProducer, NmtState
from winchkit.drivers.can.canopen.node import SdoNode
from winchkit.drivers.can.canopen.pdo_parameters import codecs
from winchkit.drivers.can.cia402.option_codes import OptionCode
from winchkit.drivers.can.host_loss.cyclic import RpdoTimeout, SyncLoss
from winchkit.drivers.can.host_loss.guarding import Guarding, GuardingWatch
from winchkit.drivers.can.host_loss.mechanism import MS, Heartbeat, Mechanism, Silence, Terms
from winchkit.drivers.can.host_loss.proof import HostLoss, Proof, bring_back, prove, reaction
from winchkit.drivers.can.host_loss.vendor import VendorWatch
from winchkit.drivers.clock import Clock
from winchkit.errors import ConnectionLost, NotPermitted
from winchkit.schema.devices.servo import ServoSpec
from winchkit.schema.host_loss import HARDWARE, VENDOR

_POLL = 0.005
"""s: a tenth of the shortest usual heartbeat (50 ms)."""
_BEATS = 4
"""Of the drive, within which the first must come after its start."""
_KINDS: dict[str, type[Mechanism]] = {
    kind.name: kind for kind in (Heartbeat, Guarding, RpdoTimeout, SyncLoss)
}


class HostWatch:
    """Host-loss mechanism of one drive; ``heartbeat`` supervises the drive in turn."""

    def __init__(
        self, node: SdoNode, servo: ServoSpec, terms: Terms, clock: Clock, hardware: str = ""
    ) -> None:
        """Nothing is sent yet; ``hardware`` describes what stops the winch in place of objects."""
        self.silent = False
        """Whether life signs of the kind that the drive watches are withheld, to stop it."""
        self.hardware = hardware
        self._node, self._servo, self._terms, self._clock = node, servo, terms, clock
        guarded = not hardware and servo.host_loss == Guarding.name
        self.heartbeat: HeartbeatConsumer = (
            GuardingWatch(terms.limit) if guarded else HeartbeatConsumer(terms.limit)
        )
        self.mechanism: Mechanism = Mechanism(node, terms, clock)
        self._polls: HeartbeatProducer | None = None
        self._begun = 0

    def set_up(self) -> None:
        """Write the mechanism's objects, pre-operational, PDOs mapped; raises NotPermitted."""
        self._polls = None
        self.silent = False
        self.mechanism = self._chosen()
        if lacking := self.mechanism.require():
            raise NotPermitted(
                f"bus '{self._node.bus.name}' node {self._node.node}: host_loss = "
                f'"{self.mechanism.name}", but {lacking}; declare another mechanism in its '
                "device file, or name the hardware that stops the winch in the bench file "
                '(host_loss = "hardware"); `winchkit check` lists what its EDS offers'
            )
        beats = self.mechanism.supervised_by_heartbeat
        period = round(self._terms.period / MS) if beats else 0
        if beats:
            self.mechanism.set_up()
        self._node.write_verified(0x1017, 0, period)
        if not beats:
            self.mechanism.set_up()

    def prove(self, emergencies: Collection[Emergency]) -> Proof | None:
        """Prove that the drive notices, and leave it operational and disabled."""
        if self.mechanism.silence is Silence.NOTHING:
            return None
        proof = prove(self.mechanism, self.heartbeat, emergencies)
        self.heartbeat.forget()
        self.await_operational()
        return proof

    def reaction(
        self, proof: Proof | None, options: Mapping[str, OptionCode], *, seen: bool
    ) -> HostLoss:
        """Known reaction of the enabled drive."""
        return reaction(self.mechanism, proof, options, seen=seen, hardware=self.hardware)

    def arm(self) -> None:
        """Let the control loop's life signs begin."""
        if isinstance(self.mechanism, Guarding) and isinstance(self.heartbeat, GuardingWatch):
            # Armed by the loop's first poll: others are commissioned before it starts.
            self.mechanism.arm()
            self._begun = self.heartbeat.replies
            self._polls = HeartbeatProducer(self.mechanism.guard_time)

    def settle(self) -> None:
        """Bring the drive back after the proof of another drive, in which the host was silent."""
        bring_back(self._node, self._clock, clears=True)
        self.heartbeat.forget()
        self.await_operational()
        self.arm()

    @property
    def disturbs(self) -> bool:
        """Whether its proof is a silence towards all drives of the bus."""
        silence = self.mechanism.silence
        by_vendor = silence is Silence.HEARTBEAT and not isinstance(self.mechanism, Heartbeat)
        return by_vendor or silence in (Silence.SYNC, Silence.ALL)

    @property
    def withholds_rpdos(self) -> bool:
        """Whether no RPDO is sent now, so that the drive notices."""
        return self.silent and self.mechanism.silence in (Silence.RPDO, Silence.ALL)

    def begin_cycle(self, now: float) -> None:
        """Poll a guarded drive when that is due: from the control loop's progress only."""
        polls = self._polls
        if polls is None or self.silent or not polls.due(now):
            return
        assert isinstance(self.mechanism, Guarding)
        # A frame that cannot be sent is the bus's fault, which the loop looks at in each cycle.
        with suppress(ConnectionLost):
            self.mechanism.poll()

    def begun(self, beats: int) -> bool:
        """Whether the drive has had its first life sign; ``beats`` of the host's heartbeat."""
        if isinstance(self.heartbeat, GuardingWatch):
            return self.heartbeat.replies > self._begun
        return self.mechanism.silence is not Silence.HEARTBEAT or beats > 0

    def disarm(self) -> None:
        """Let the drive, at rest, stop watching the host; raises ConnectionLost."""
        self._polls = None
        self.mechanism.disarm()

    def await_operational(self) -> None:
        """Wait for the heartbeat or reply that confirms the start; proves that it comes at all."""
        timeout = max(self._terms.limit, _BEATS * self._terms.period)
        deadline = self._clock.now() + timeout
        while self.heartbeat.state != NmtState.OPERATIONAL:
            if self._clock.now() > deadline:
                guarded = isinstance(self.heartbeat, GuardingWatch)
                what = "guarding reply" if guarded else "heartbeat"
                look = "100Ch and remote frames" if guarded else "1017h"
                raise NotPermitted(
                    f"bus '{self._node.bus.name}' node {self._node.node}: no {what} says "
                    f"operational within {timeout:g} s of the start; check {look} and "
                    "the drive's errors"
                )
            if isinstance(self.mechanism, Guarding):
                self.mechanism.poll()
            self._clock.sleep(_POLL)

    def _chosen(self) -> Mechanism:
        node, terms, clock, servo = self._node, self._terms, self._clock, self._servo
        if self.hardware:
            return Mechanism(node, terms, clock)
        if servo.host_loss.startswith(VENDOR):
            name = servo.host_loss.removeprefix(VENDOR)
            vendor = VendorWatch(node, terms, clock, codecs(node, servo.rpdo), servo.motion_mode)
            return vendor.declare(name, servo.vendor_watchdog[name])
        assert servo.host_loss != HARDWARE, "the reader has checked it"
        kind = _KINDS[servo.host_loss]
        rpdo = codecs(node, servo.rpdo) if kind is RpdoTimeout else ()
        mechanism = kind(node, terms, clock, rpdo, servo.motion_mode)
        if isinstance(mechanism, Guarding) and isinstance(self.heartbeat, GuardingWatch):
            mechanism.watch = self.heartbeat
        return mechanism
