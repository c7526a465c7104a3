"""A simulated bench, opened for a test: the bench, its truth, faults, frames and assertions."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Container, Mapping, Sequence
from contextlib import ExitStack
from typing import Self

from winchkit.bench.bench import Bench
from winchkit.bench.open import open_bench
from winchkit.catalog import find
from winchkit.drivers.can.cia402.state_machine import state_of
from winchkit.errors import UsageError, suggest
from winchkit.schema.bench import BenchSpec
from winchkit.schema.read import read_device
from winchkit.schema.simbench import SimBench
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.live.bench import LiveBench
from winchkit.sim.live.buses import BusWire, Carried
from winchkit.sim.live.paced_clock import PacedClock
from winchkit.testing.frames import CarriedFrame, FrameNames

_POLL = 2e-3
"""s: half a cycle of the usual 4 ms."""
_WALL = 10.0
"""How many times longer than on the bench's clock a wait may last on a machine that is busy."""
_LEAST_WALL = 20.0
"""s: a process that starts, and a machine that stands still, are no failure."""


class OpenedBench:
    """A bench on simulated winches; a context manager.

    ``bench`` is what ``open_bench`` gives, ``spec`` its wiring, ``live`` the simulation behind
    it, ``clock`` the clock of both. Times are on that clock, s. Faults last until ``recover``.

    Time is simulated: it advances while the test waits on ``clock``, as fast as the computer can,
    and stands still otherwise. With ``real_time`` it runs by itself, for tests in which other
    processes or threads take part, and stands still only while this machine is busy elsewhere.
    """

    def __init__(
        self,
        declared: SimBench,
        *,
        hidden: Sequence[str] = (),
        seed: int = 0,
        real_time: bool = False,
    ) -> None:
        """Open it at once; raises FileError, UsageError and what ``open_bench`` raises."""
        self.clock: SimulatedClock | PacedClock = PacedClock() if real_time else SimulatedClock()
        self._disturbances: list[Callable[[], None]] = []
        self._faulty: set[str] = set()
        with ExitStack() as stack:
            live = _live(self.clock, declared, seed, hidden)
            self.live = stack.enter_context(live)
            self.spec: BenchSpec = live.bench_spec
            self._recording = WireRecording(self.spec, live.wire)
            self.bench: Bench = stack.enter_context(open_bench(self.spec, self.clock))
            if isinstance(self.clock, PacedClock):
                self.bench.on_cycle(self.clock.control)
            self._start: dict[str, float] = {}
            self.mark()
            self._stack = stack.pop_all()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the faults, stop the winches and end the simulation. Twice does no harm.

        Raises what a callback has raised.
        """
        self.recover()
        stack, self._stack = self._stack, ExitStack()
        stack.close()

    # What goes wrong.

    def drop(self, frames: str | int, *, share: float = 1.0) -> Callable[[], None]:
        """Lose a share of some frames on their way, ``drop("A.tpdo1")``; see ``CarriedFrame.name``.

        A winch's name stands for everything from and to its drive, ``host`` for all that the
        host sends, a number for an identifier. Returns a function that ends it.
        """
        return self._disturb(self._recording.identifiers(frames), share, None)

    def delay(
        self, frames: str | int, duration: float, *, share: float = 1.0
    ) -> Callable[[], None]:
        """Let a share of some frames come ``duration`` s late; else as :meth:`drop`."""
        return self._disturb(self._recording.identifiers(frames), share, duration)

    def drive_fault(self, winch: str, kind: str = "over-current") -> None:
        """Let a drive report a fault, e.g. ``following error``."""
        self.fault(f"{winch}.servo", kind)

    def lose_heartbeat(self, winch: str) -> None:
        """Let a drive stop its heartbeat and go on otherwise."""
        self.fault(f"{winch}.servo", "heartbeat stop")

    def lose_host(self) -> None:
        """Let nothing that the host sends reach the drives, as if its process were killed."""
        self.drop("host")

    def cut_wire(self) -> None:
        """Let no frame through on any bus, either way."""
        self._disturb(dict.fromkeys(self.live.wire, range(0x800)), 1.0, None)

    def reboot(self, winch: str) -> None:
        """Let a drive start again, as after a short loss of power."""
        self.fault(f"{winch}.servo", "reboot")

    def freeze_cell(self, winch: str, role: str = "cell") -> None:
        """Let an instrument go on answering with its last conversion."""
        self.fault(f"{winch}.{role}", "frozen")

    def silence_cell(self, winch: str, role: str = "cell") -> None:
        """Let an instrument answer no more."""
        self.fault(f"{winch}.{role}", "silence")

    def fault(self, target: str, kind: str) -> None:
        """Let any device go wrong: ``fault("A.length", "late reply")``; raises UsageError."""
        self.live.inject(target, kind)
        self._faulty.add(target)

    def recover(self) -> None:
        """End every lasting fault and disturbance; latched trips stay."""
        for end in self._disturbances:
            end()
        self._disturbances.clear()
        for target in self._faulty:
            self.live.inject(target, "recover")
        self._faulty.clear()

    def hang(self, winch: str, mass: float) -> None:
        """Hang another load (kg); NotPermitted while the winch moves."""
        self.live.hang(winch, mass)

    # What is true.

    def state(self, winch: str) -> str:
        """State of a drive as itself has it, in the words of CiA 402."""
        with self.live.up_to_date():
            return str(state_of(int(self.live.winches[winch].drive.state)))

    def length(self, winch: str) -> float:
        """True cable length, m."""
        with self.live.up_to_date():
            return self.live.winches[winch].plant.cable_length

    def tension(self, winch: str) -> float:
        """True tension at the cell, N."""
        with self.live.up_to_date():
            return self.live.winches[winch].plant.tension

    def mark(self) -> None:
        """Count :meth:`assert_moved` from here."""
        self._start = {winch: self.length(winch) for winch in self.live.winches}

    @property
    def frames(self) -> list[CarriedFrame]:
        """Frames so far in their order, those of the opening included; the last 200 000."""
        return self._recording.frames()

    def frames_of(self, name: str | int, since: float = 0.0) -> list[CarriedFrame]:
        """Frames by name, e.g. ``A.rpdo1``, from a time on; raises UsageError for none such."""
        return self._recording.frames(name, since)

    # What a test expects.

    def wait_until(self, condition: Callable[[], bool], within: float = 5.0) -> bool:
        """Whether it comes true within a time on the bench's clock, s."""
        deadline = self.clock.now() + within
        # A test must not hang where the clock of real time does.
        wall = time.monotonic() + max(_LEAST_WALL, _WALL * within)
        simulated = isinstance(self.clock, SimulatedClock)
        while not condition():
            if self.clock.now() > deadline or (time.monotonic() > wall and not simulated):
                return False
            self.clock.sleep(_POLL)
        return True

    def assert_state(self, winch: str, state: str, within: float = 2.0) -> None:
        """The drive itself comes to a state, e.g. ``switch on disabled``, within a time, s."""
        arrived = self.wait_until(lambda: self.state(winch) == state, within)
        known = self.bench.snapshot.winch[winch]
        assert arrived, (
            f"winch {winch}: its drive is in '{self.state(winch)}', not in '{state}', after "
            f"{within:g} s (the bench's state: '{known.state}', {known.phase.value})"
        )

    def assert_moved(self, winch: str, by: float, tolerance: float = 5e-3) -> None:
        """The true cable length changed by so much (m) since the opening or :meth:`mark`."""
        moved = self.length(winch) - self._start[winch]
        assert abs(moved - by) <= tolerance, (
            f"winch {winch}: the cable moved by {moved:+.4f} m, expected {by:+.4f} m "
            f"within {tolerance:g} m"
        )

    def assert_tension(
        self,
        winch: str,
        tension: float,
        tolerance: float = 5.0,
        *,
        within: float = 2.0,
        lasting: float = 0.2,
    ) -> None:
        """The true tension comes to a value (N) and stays there for ``lasting`` s."""
        since: list[float] = []

        def stays() -> bool:
            if abs(self.tension(winch) - tension) > tolerance:
                since.clear()
                return False
            since.append(self.clock.now())
            return since[-1] - since[0] >= lasting

        assert self.wait_until(stays, within + lasting), (
            f"winch {winch}: the tension is {self.tension(winch):.1f} N, expected {tension:g} N "
            f"within {tolerance:g} N for {lasting:g} s, after {within:g} s"
        )

    def _disturb(
        self, buses: Mapping[str, Container[int]], share: float, delay: float | None
    ) -> Callable[[], None]:
        """Disturb identifiers by bus; returns a function that ends it."""
        ends = ExitStack()
        for bus, identifiers in buses.items():
            ends.callback(self.live.wire[bus].disturb(identifiers, share=share, delay=delay))
        self._disturbances.append(ends.close)
        return ends.close


def _live(
    clock: SimulatedClock | PacedClock, declared: SimBench, seed: int, hidden: Sequence[str]
) -> LiveBench:
    """The simulation, on the clock of the bench."""
    if isinstance(clock, SimulatedClock):
        return LiveBench(declared, seed=seed, hidden=hidden, simulated_time=clock)
    return LiveBench(declared, seed=seed, hidden=hidden, clock=clock.simulation)


_KEPT = 200_000
"""Frames: half a minute of a full bus at 1 Mbit/s (7700 frames of eight bytes a second)."""


class WireRecording:
    """Listens to every wire of a bench from now on."""

    def __init__(self, spec: BenchSpec, wires: Mapping[str, BusWire]) -> None:
        self._names = {bus: FrameNames(spec.bus[bus].node) for bus in wires}
        self._carried: deque[tuple[str, Carried]] = deque(maxlen=_KEPT)
        for name, wiring in spec.winch.items():
            ref = wiring.servo
            device = read_device(find("devices", ref.device, beside=spec.path or None))
            assert ref.node is not None, "the simulation has checked it"
            self._names[ref.bus].add(name, ref.node, device)
        for bus, wire in wires.items():
            wire.taps.append(self._tap(bus))

    def identifiers(self, what: str | int) -> dict[str, frozenset[int]]:
        """Identifiers of named frames by bus, see :meth:`FrameNames.identifiers`; UsageError."""
        found = {bus: names.identifiers(what) for bus, names in self._names.items()}
        if not any(found.values()):
            known = sorted({name for names in self._names.values() for name in names.all})
            near = suggest(str(what), known)
            raise UsageError(f"no frame is named '{what}'; there are {', '.join(known)}{near}")
        return found

    def frames(self, what: str | int | None = None, since: float = 0.0) -> list[CarriedFrame]:
        """Frames in their order, by name where one is given, from a time (s) on."""
        wanted = None if what is None else self.identifiers(what)
        return [
            self._names[bus].frame(carried)
            for bus, carried in tuple(self._carried)
            if carried.time >= since and (wanted is None or carried.identifier in wanted[bus])
        ]

    def _tap(self, bus: str) -> Callable[[Carried], None]:
        return lambda carried: self._carried.append((bus, carried))
