"""A simulated bench with its truth, in simulated or in real time."""

from __future__ import annotations

import os
import shutil
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from heapq import heappop, heappush
from itertools import count
from pathlib import Path

import can

from fault_cases.independent_drive import (
    IndependentDrive,
    carry_remote_frames,
    replace_drives,
)
from winchkit import find
from winchkit.bench.bench import Bench
from winchkit.bench.open import open_bench
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.drive.drive import SimDrive
from winchkit.sim.drive.nmt import NodeState
from winchkit.sim.drive.power import Order
from winchkit.sim.drive.power import PowerState as SimState
from winchkit.sim.live.bench import LiveBench
from winchkit.sim.live.buses import Carried
from winchkit.sim.live.paced_clock import PacedClock
from winchkit.testing.declared import declared

HEARTBEAT = 0.05
LIMITS = {"speed": 0.6, "acceleration": 1.5, "tension_high": 400.0, "tension_slack": 15.0}
"""Of ``spiral-bench``."""
_SAMPLED = 2e-3
_OPEN = 30.0


@dataclass(frozen=True, slots=True)
class Sample:
    """What is true of one winch at one moment."""

    time: float
    velocity: float
    """Of the motor, rad/s."""
    speed: float
    """Of the cable by the motor, m/s, without sign."""
    tension: float
    """N."""
    enabled: bool
    """Whether the drive is in operation enabled."""
    follows: bool
    """Whether it is in operation enabled and follows set-points, no ramp of its own."""


@dataclass
class Strange:
    """A foreign frame to one winch's drive."""

    winch: str
    identifier: int
    data: bytes
    heard: bool | None = None
    """Whether the drive took it from the bus; None before it has come that far."""


@dataclass
class World:
    """An open bench, what is true of it, and what can be done to it from outside."""

    clock: SimulatedClock | PacedClock
    live: LiveBench
    folder: Path
    bench: Bench
    truth: dict[str, list[Sample]] = field(default_factory=dict)
    strange: list[Strange] = field(default_factory=list)
    """Foreign frames, in their order."""
    _later: list[tuple[float, int, Callable[[], None]]] = field(default_factory=list)
    _order: count[int] = field(default_factory=count)
    _stopping: threading.Event = field(default_factory=threading.Event)
    _bus: can.BusABC | None = None

    @property
    def simulated(self) -> SimulatedClock | None:
        """The clock of simulated time; None in real time."""
        return self.clock if isinstance(self.clock, SimulatedClock) else None

    @property
    def now(self) -> float:
        """s."""
        return self.clock.now()

    def call_at(self, moment: float, function: Callable[[], None]) -> None:
        """Call a function at a time."""
        if self.simulated is not None:
            self.simulated.call_at(moment, function)
        else:
            heappush(self._later, (moment, next(self._order), function))

    def inject_frame(self, winch: str, identifier: int, data: bytes) -> None:
        """Another host on the bus sends a frame to the drive of a winch."""
        self.strange.append(Strange(winch, identifier, data))
        wire = self.live.wire["can"]
        if self._note_heard not in wire.taps:
            wire.taps.append(self._note_heard)
        if self.simulated is not None:
            self.live._ports["can"].inject(identifier, data)  # type: ignore[union-attr]
            return
        if self._bus is None:
            channel = self.live.bench_spec.bus["can"].channel
            self._bus = can.Bus(interface="virtual", channel=channel)
        self._bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))

    def begin_sampling(self) -> None:
        """Note from now on what is true."""
        self.truth = {name: [] for name in self.live.winches}
        if self.simulated is not None:
            self._sample_and_go_on()
        else:
            threading.Thread(target=self._run_real, name="truth", daemon=True).start()

    def close(self) -> None:
        """Sample no more."""
        self._stopping.set()
        if self._bus is not None:
            self._bus.shutdown()

    def sample(self) -> None:
        """Note what is true now."""
        with self.live.up_to_date():
            now = self.now
            for name, winch in self.live.winches.items():
                plant, arm = winch.plant, winch.plant._state.arm
                enabled, follows, velocity = _seen(winch.drive, plant.motor_velocity)
                speed = abs(velocity * arm)
                self.truth[name].append(
                    Sample(now, velocity, speed, plant.tension, enabled, follows)
                )

    def _note_heard(self, carried: Carried) -> None:
        """A frame arrives: where it is a foreign one, note whether the drive takes it."""
        for one in self.strange:
            same = (one.identifier, one.data) == (carried.identifier, carried.data)
            if one.heard is None and same and not carried.from_drive:
                drive = self.live.winches[one.winch].drive
                one.heard = not carried.lost and _hears(drive, carried)
                return

    def _sample_and_go_on(self) -> None:
        if not self._stopping.is_set():
            self.sample()
            self.call_at(self.now + _SAMPLED, self._sample_and_go_on)

    def _run_real(self) -> None:
        while not self._stopping.is_set():
            self.sample()
            while self._later and self._later[0][0] <= self.now:
                heappop(self._later)[2]()
            time.sleep(_SAMPLED)


def _hears(drive: SimDrive | IndependentDrive, carried: Carried) -> bool:
    """Whether a drive takes a frame: not off the bus, nor while it boots."""
    if isinstance(drive, IndependentDrive):
        return drive.hears(carried.identifier, carried.data)
    return not drive._line.cut and drive.nmt is not NodeState.BOOTING


def _seen(drive: SimDrive | IndependentDrive, velocity: float) -> tuple[bool, bool, float]:
    """Whether a drive is enabled, whether it follows set-points, and how fast its motor turns."""
    if isinstance(drive, IndependentDrive):
        return drive.enabled, drive.follows, drive.velocity
    enabled = drive.state is SimState.OPERATION_ENABLED
    return enabled, enabled and drive._power.order is Order.FOLLOW, velocity


def _guarded_device(folder: Path) -> Path:
    """The generic drive, guarded."""
    home = folder / "guarded"
    shutil.copytree(find("devices", "generic-cia402").parent, home)
    device = home / "device.toml"
    text = device.read_text(encoding="utf-8")
    device.write_text(text.replace("[servo]\n", '[servo]\nhost_loss = "guarding"\n'))
    return device


@contextmanager
def opened_world(
    winches: int,
    seed: int | str,
    folder: Path,
    *,
    real_time: bool = False,
    independent: bool = False,
    incremental: bool = False,
    guarded: bool = False,
) -> Iterator[World]:
    """A bench of ``spiral-bench``'s winches with a heartbeat of 50 ms, opened.

    ``independent``: with the slaves of ``tests/support/slave`` for drives; ``incremental``: their
    encoders are, and are homed; ``guarded``: by node guarding, not heartbeat.
    """
    folder.mkdir(parents=True, exist_ok=True)
    servo = {"encoder": "incremental"} if incremental else {}
    if guarded:
        servo["device"] = str(_guarded_device(folder))
    bench = declared(None, {name: {"servo": servo} for name in "ABCDEFGH"[:winches]}, folder)
    buses = {
        name: replace(bus, heartbeat=HEARTBEAT) if bus.kind == "can" else bus
        for name, bus in bench.bench.bus.items()
    }
    bench = replace(bench, bench=replace(bench.bench, bus=buses, name=f"case-{os.getpid()}"))
    number = int.from_bytes(str(seed).encode()[-6:], "little")
    clock: SimulatedClock | PacedClock = PacedClock() if real_time else SimulatedClock()
    live = (
        LiveBench(bench, seed=number, clock=clock.simulation)
        if isinstance(clock, PacedClock)
        else LiveBench(bench, seed=number, simulated_time=clock)
    )
    with live:
        if independent:
            replace_drives(live)
        if guarded and isinstance(clock, SimulatedClock):
            carry_remote_frames(live, clock)
        opened = open_bench(live.bench_spec, clock)
        if isinstance(clock, PacedClock):
            opened.on_cycle(clock.control)
        world = World(clock, live, folder, opened)
        try:
            if incremental:
                for name, winch in opened.winch.items():
                    winch.home(at=live.winches[name].plant.cable_length)
            world.begin_sampling()
            yield world
        finally:
            try:
                opened.close()
            finally:
                world.close()
