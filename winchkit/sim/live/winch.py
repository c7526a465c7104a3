"""One winch of a live simulated bench: plant, drive and instruments with a common time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from math import inf
from pathlib import Path
from random import Random

from winchkit.errors import FileError, NotPermitted, UsageError, suggest
from winchkit.schema.bench import DeviceRef, WinchWiring
from winchkit.schema.devices.servo import ServoSpec
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.simbench import NoiseSpec, WinchTruth
from winchkit.sim.drive.drive import SimDrive, known
from winchkit.sim.drive.object_dictionary import ObjectDictionary, read_eds
from winchkit.sim.instruments.process import SimulatedProcessInstrument
from winchkit.sim.live.instruments import device_of, instruments_of
from winchkit.sim.plant.hanging_load import CableLoad
from winchkit.sim.plant.plant import WinchPlant

_QUANTITIES = {
    "cell": "tension",
    "load": "load",
    "length": "cable_length",
    "temperature": "temperature",
}
"""Measured quantity of each role in a bench file."""
_SMOOTHING = 0.024
"""Set-point filter of the drives, s: the cycle of an ordinary computer has 1 ms of jitter."""
_TO_ALL, _REQUEST = 0x080, 0x600
"""Highest identifier for all nodes (SYNC); SDO request to node 0."""
_DEVIATION = (1e-3, 3e-3)
"""Deviation of an instrument's clock in simulated time: without it its conversions would be
synchronous with the host's polls, with a constant age that no time stamp shows."""
_TOLERANCE = 5e-3
"""Time by which a winch of a robot may be behind at a tick, s: between two SYNCs nothing is
computed that only the next one needs."""
_STEP, _ROBOT_STEP = 1e-3, 2.5e-3
"""Longest step of a winch with a load of its own, and of one of a robot, s."""
_AT_REST = 0.5
"""Motor speed below which a load can be changed, rad/s."""


class LiveWinch:
    """Drive, cable and instruments, advanced together; not thread-safe."""

    def __init__(
        self,
        name: str,
        wiring: WinchWiring,
        profile: WinchProfile,
        truth: WinchTruth,
        noise: NoiseSpec,
        *,
        seed: int | str,
        send: Callable[[int, bytes], None],
        beside: str,
        now: float,
        clocks_deviate: bool = False,
        load: CableLoad | None = None,
    ) -> None:
        self.name = name
        step = _STEP if load is None else _ROBOT_STEP
        self.plant = WinchPlant(
            profile, truth, seed=f"{seed}/{name}", noise=noise, load=load, longest_step=step
        )
        servo, eds = _servo(wiring.servo, beside)
        if wiring.servo.node is None:
            raise UsageError(f"winch {name}: its servo has no node; give it one, e.g. node = 1")
        node = wiring.servo.node
        objects = ObjectDictionary(read_eds(eds, node))
        self.drive = SimDrive(
            send,
            node,
            servo,
            objects,
            self.plant,
            brake=wiring.brake,
            smoothing=_SMOOTHING,
            tolerance=0.0 if load is None else _TOLERANCE,
            longest_step=step,
            now=now,
        )
        self.drive.power_on(now, boot_time=0.0)
        read = self.plant.read
        measuring = {role: partial(read, quantity) for role, quantity in _QUANTITIES.items()}
        self.instruments = instruments_of(wiring, beside, measuring, send, now=now)
        devices = list(self.instruments.values())
        self._on_can = [one for one in devices if isinstance(one, SimulatedProcessInstrument)]
        self._devices = devices
        self._conversion_due = self._next_conversion()
        if clocks_deviate:
            for role, one in self.instruments.items():
                random = Random(f"{seed}/{name}/{role}/clock")
                one.deviate(random.choice((-1.0, 1.0)) * random.uniform(*_DEVIATION))

    def advance(self, now: float) -> None:
        """Advance to ``now``, with each conversion at its own instant."""
        self._convert(now)
        self.drive.advance(now)
        for one in self._devices:
            one.show(now)

    def _convert(self, now: float) -> None:
        """Advance to the conversions that are due."""
        while (due := self._conversion_due) <= now:
            self.drive.advance(due)
            for one in self._devices:
                if one.next_conversion <= due:
                    one.convert()
            self._conversion_due = self._next_conversion()

    def _next_conversion(self) -> float:
        return min([one.next_conversion for one in self._devices], default=inf)

    def listens(self, identifier: int) -> bool:
        """Whether it is an RPDO of the drive."""
        return self.drive.listens(identifier)

    def receive(self, identifier: int, data: bytes, now: float) -> None:
        """Take a frame from the CAN bus."""
        if identifier <= _TO_ALL or identifier == _REQUEST + self.drive.node:
            self.advance(now)
        self.drive.receive(identifier, data, now)
        for one in self._on_can:
            one.receive(identifier, data, now)

    def tick(self, now: float, all_heard: bool = True) -> None:
        """Make due conversions and evaluate the timers; a lost master once all was heard."""
        self._convert(now)
        self.drive.tick(now, all_heard)
        for one in self._devices:
            one.show(now)
        for one in self._on_can:
            one.tick(now)

    def hang(self, mass: float) -> None:
        """Attach another load (kg); NotPermitted while the winch moves."""
        self._at_rest("a load")
        self.plant.hang(mass)

    def warm(self, temperature: float) -> None:
        """Set the temperature (degC) of cable and machine; NotPermitted while the winch moves."""
        self._at_rest("the temperature")
        self.plant.warm(temperature)

    def _at_rest(self, what: str) -> None:
        speed = self.plant.motor_velocity
        if abs(speed) > _AT_REST:
            raise NotPermitted(
                f"winch {self.name}: its motor turns at {speed:.3g} rad/s; {what} can be "
                f"changed below {_AT_REST:g} rad/s only; stop it first"
            )

    def check_fault(self, role: str, kind: str) -> None:
        """Raise UsageError for an unknown device of this winch, or an unknown fault."""
        if role == "servo":
            known(kind)
            return
        if role not in self.instruments:
            roles = ["servo", *self.instruments]
            raise UsageError(
                f"winch {self.name} has no '{role}'; it has {', '.join(roles)}"
                + suggest(role, roles)
            )
        self.instruments[role].check_fault(kind)

    def inject(self, role: str, kind: str) -> None:
        """Inject a fault into a device of this winch; raises as :meth:`check_fault`."""
        self.check_fault(role, kind)
        if role == "servo":
            self.drive.inject(kind)
        else:
            self.instruments[role].inject(kind)


def _servo(ref: DeviceRef, beside: str) -> tuple[ServoSpec, Path]:
    path, device = device_of(ref, beside)
    if device.servo is None:
        raise FileError(f"{path}: '{ref.device}' is not a servo drive; it has no [servo] table")
    servo = device.servo if ref.encoder is None else replace(device.servo, encoder=ref.encoder)
    return servo, path.parent / device.servo.eds
