"""A simulated bench: plants, drives and instruments behind CAN buses and serial lines."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from time import monotonic
from types import TracebackType
from typing import Any, Protocol

from winchkit import wings
from winchkit.arguments import path_of
from winchkit.errors import NotPermitted, UsageError, suggest
from winchkit.regular_file import refuse_existing
from winchkit.schema.bench import BenchSpec, BusSpec
from winchkit.schema.profiles.winch import WinchProfile
from winchkit.schema.programme import ALL, ProgrammeStep
from winchkit.schema.simbench import FaultSpec, SimBench, WinchTruth
from winchkit.sim.bench import hiding, profiles_of
from winchkit.sim.clock.lines import SimulatedCanBus
from winchkit.sim.clock.simulated_clock import SimulatedClock
from winchkit.sim.live.bench_file import write_bench
from winchkit.sim.live.buses import TICK, BusWire, CanPort, Interface, serve, wired
from winchkit.sim.live.instruments import Line, Placed, open_line
from winchkit.sim.live.winch import LiveWinch
from winchkit.sim.plant.hanging_load import CableLoad


class SimulatedRobot(Protocol):
    """A platform, the ends of its cables, and its tracker; not thread-safe."""

    platform: Any
    """With ``position``, (3,), m, and ``count`` of cables."""
    profiles: Mapping[str, WinchProfile]
    """By winch, with the unstrained cable length at home as their reference."""
    truth: Mapping[str, WinchTruth]
    """By winch."""
    on_pose: Callable[[bytes], None] | None
    """Called with each datagram of the tracker, also in simulated time."""

    @property
    def ends(self) -> Mapping[str, CableLoad]:
        """End of each winch's cable."""

    def advance(self, now: float) -> None:
        """Let the tracker measure and send at a time (s)."""

    def close(self) -> None:
        """Close its socket."""


_OVERRUN = 0.02
"""Lateness of a tick from which it is counted, s."""
_RPDOS = range(0x200, 0x580)
"""Identifiers of RPDOs, each of which one drive listens to."""
_SUSPENDED = 1.0
"""Gap from which the process counts as suspended, in which simulated time stands still, s."""


class LiveBench:
    """A simulated bench that runs within a ``with`` block.

    ``bench_spec`` is the bench to open: the declaration with the channels and ports of this run.

    Parameters
    ----------
    sim_bench : SimBench
        Declaration of the bench.
    seed : int
        Seed of the noise.
    hidden : sequence of str, optional
        Effects in place of the declared hidden ones, as of :func:`winchkit.sim.bench.hiding`.
    interface : str
        python-can's ``virtual`` (within this process) or ``udp_multicast`` (between processes).
        Modbus instruments are on TCP at 127.0.0.1, serial ones at a pseudo-terminal.
    clock : callable
        Time, s.
    profiles : mapping, optional
        Profiles of winches with a load each, in place of those that the bench names.
    simulated_time : SimulatedClock, optional
        Clock on which the bench runs instead of in real time; it and its user are then in one
        process, and the user opens ``bench_spec`` on the same clock.
    compiled : bool, optional
        Compile a robot's mechanics where numba is installed, which takes a second or two; by
        default in real time only.

    Raises
    ------
    FileError
        For an inconsistent declaration.
    ConnectionLost
        Where a bus cannot be opened.
    """

    def __init__(
        self,
        sim_bench: SimBench,
        *,
        seed: int = 0,
        hidden: Sequence[str] = (),
        interface: Interface = "virtual",
        clock: Callable[[], float] = monotonic,
        profiles: Mapping[str, WinchProfile] | None = None,
        simulated_time: SimulatedClock | None = None,
        compiled: bool | None = None,
    ) -> None:
        self.sim_bench = hiding(sim_bench, hidden) if hidden else sim_bench
        self.seed = seed
        self._interface = interface
        self._profiles = profiles
        self._simulated = simulated_time
        self._compiled = simulated_time is None if compiled is None else compiled
        self._clock = clock = clock if simulated_time is None else simulated_time.now
        self._lock = threading.RLock()
        self._stopping = threading.Event()
        self._pool: ThreadPoolExecutor | None = None
        self._loops: list[Future[None]] = []
        self._threads: list[int] = []
        self._ports: dict[str, CanPort | SimulatedCanBus] = {}
        self._lines: dict[str, Line] = {}
        self.wire: dict[str, BusWire] = {}
        """Wires of the CAN buses, by bus."""
        self.winches: dict[str, LiveWinch] = {}
        self.robot: SimulatedRobot | None = None
        """Platform and tracker of a robot; None for winches with a load each."""
        self.bench_spec: BenchSpec = self.sim_bench.bench
        self.overruns = 0
        """Number of ticks that were more than 20 ms late."""
        self.worst_lateness = 0.0
        """s."""
        self._skipped = 0.0
        self._started_at = self._last = self._reached = clock()
        self._faults = sorted(self.sim_bench.fault, key=lambda fault: fault.time)

    def __enter__(self) -> LiveBench:
        try:
            self._open()
        except BaseException:
            self._close()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._close()
        if kind is None:
            self.check()

    # Interface for the user.

    def write_bench_file(self, path: str | Path, *, replace: bool = False) -> Path:
        """Write the bench file of this run; returns its path.

        Parameters
        ----------
        path : str or Path
            File to write.
        replace : bool
            Write over an existing file.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        UsageError
            Where the file exists and is not to be replaced.
        """
        path = path_of(path)
        refuse_existing(path, replace)
        return write_bench(self.bench_spec, path)

    def answer(self, step: ProgrammeStep) -> None:
        """Execute an operator request of a programme: its ``load_mass``, its ``temperature``.

        Parameters
        ----------
        step : ProgrammeStep
            A step with ``ask``.
        """
        for name in self.winches if step.winch == ALL else [step.winch]:
            if step.load_mass is not None:
                self.hang(name, step.load_mass)
            if step.temperature is not None:
                self.warm(name, step.temperature)

    def hang(self, winch: str, mass: float) -> None:
        """Attach a load (kg) to a winch; NotPermitted while it moves.

        Parameters
        ----------
        winch : str
            Winch.
        mass : float
            kg.
        """
        if self.robot is not None:
            raise NotPermitted(
                f"winch {winch} moves the platform of a robot with others and has no load of its "
                "own; the platform's mass is declared in [platform] of the simulated bench"
            )
        with self.up_to_date():
            self._winch(winch).hang(mass)

    def warm(self, winch: str, temperature: float) -> None:
        """Set the temperature (degC) of a winch; NotPermitted while it moves.

        Parameters
        ----------
        winch : str
            Winch.
        temperature : float
            degC.
        """
        with self.up_to_date():
            self._winch(winch).warm(temperature)

    def inject(self, target: str, kind: str) -> None:
        """Inject a fault into ``WINCH.ROLE``, e.g. ``A.servo`` or ``A.cell``.

        Parameters
        ----------
        target : str
            ``WINCH.ROLE``.
        kind : str
            Fault, e.g. ``silence``; an unknown one is refused with the list of all.
        """
        winch, _, role = target.partition(".")
        with self.up_to_date():
            self._winch(winch).inject(role, kind)

    def temperature(self, winch: str) -> float:
        """True temperature at a winch, degC.

        Parameters
        ----------
        winch : str
            Winch.

        Returns
        -------
        float
            degC.
        """
        with self.up_to_date():
            return self._winch(winch).plant.temperature

    def check(self) -> None:
        """Raise the error that ended the simulation, if there was one."""
        for loop in self._loops:
            if loop.done():
                loop.result()

    @property
    def bus_threads(self) -> list[int]:
        """Native ids of the threads that serve the CAN buses; empty in simulated time."""
        return list(self._threads)

    @contextmanager
    def up_to_date(self) -> Iterator[None]:
        """Advance the simulation to the present time and lock it; a robot's is at its last tick."""
        with self._lock:
            if self.robot is None:
                now = self._instant(0.0)
                for winch in self.winches.values():
                    winch.advance(now)
            yield

    def _winch(self, name: str) -> LiveWinch:
        if name not in self.winches:
            known = list(self.winches)
            raise UsageError(
                f"there is no winch '{name}' on {self.bench_spec.name}; it has {', '.join(known)}"
                + suggest(name, known)
            )
        return self.winches[name]

    # Opening and closing.

    def _open(self) -> None:
        declared = self.sim_bench.bench
        buses: dict[str, BusSpec] = {}
        for name, bus in declared.bus.items():
            if bus.kind == "can":
                buses[name] = wired(bus, f"{declared.name}-{name}", self._interface)
                self.wire[name] = BusWire(self._clock, seed=self.seed)
                self._ports[name] = self._can_port(name, buses[name])
        self._make_winches()
        for fault in self._faults:
            winch, _, role = fault.target.partition(".")
            self._winch(winch).check_fault(role, fault.kind)
        time = self._simulated or self._now
        for name in declared.bus:
            if name not in buses:
                self._lines[name], buses[name] = open_line(
                    declared.bus[name], self._placed(name), self.up_to_date, time
                )
        self.bench_spec = replace(declared, bus=buses)
        self._started_at = self._now()
        if self._simulated is not None:
            self._tick_simulated(self._simulated)
            return
        ports = {name: port for name, port in self._ports.items() if isinstance(port, CanPort)}
        begun = threading.Barrier(len(ports) + 1)

        def note_thread() -> None:
            self._threads.append(threading.get_native_id())
            begun.wait()

        self._pool = ThreadPoolExecutor(max(1, len(ports)), "sim-can", note_thread)
        self._loops = [self._pool.submit(self._serve, name, port) for name, port in ports.items()]
        begun.wait()

    def _can_port(self, name: str, spec: BusSpec) -> CanPort | SimulatedCanBus:
        if self._simulated is None:
            return CanPort(spec, self.wire[name])

        def deliver(identifier: int, data: bytes) -> None:
            self._deliver(self._on_bus(name), identifier, data)

        bus = SimulatedCanBus(self._simulated, self.wire[name], spec.bitrate, deliver)
        self._simulated.serve_can(spec.channel or "", bus.connect)
        return bus

    def _make_winches(self) -> None:
        sim, now = self.sim_bench, self._now()
        loads: Mapping[str, CableLoad] = {}
        truth: Mapping[str, WinchTruth] = sim.truth
        if sim.platform is None:
            profiles = profiles_of(sim) if self._profiles is None else self._profiles
        else:
            robot: SimulatedRobot = wings.part("robot", "simulated")(
                sim,
                sim.platform,
                self.seed,
                now,
                sends=self._simulated is None,
                compiled=self._compiled,
            )
            self.robot = robot
            profiles, loads, truth = robot.profiles, robot.ends, robot.truth
            tracker = None if sim.bench.robot is None else sim.bench.robot.tracker
            if self._simulated is not None and tracker is not None:
                robot.on_pose = partial(self._simulated.send_datagram, tracker.listen)
        for name, wiring in sim.bench.winch.items():
            port = self._ports.get(wiring.servo.bus)
            if port is None:
                raise UsageError(
                    f"winch {name}: the bus '{wiring.servo.bus}' of its servo is no CAN bus"
                )
            self.winches[name] = LiveWinch(
                name,
                wiring,
                profiles[name],
                truth[name],
                sim.noise,
                seed=self.seed,
                send=port.send,
                beside=sim.bench.path,
                now=now,
                clocks_deviate=self._simulated is not None,
                load=loads.get(name),
            )

    def _placed(self, bus: str) -> Iterator[Placed]:
        """Instruments on one bus."""
        for name, winch in self.winches.items():
            wiring = self.sim_bench.bench.winch[name]
            for role, instrument in winch.instruments.items():
                ref = getattr(wiring, role)
                if ref.bus == bus:
                    yield Placed(f"winch {name}: {role}", ref, instrument)

    def _close(self) -> None:
        self._stopping.set()
        for line in self._lines.values():
            line.stop()
        if self._pool is not None:
            self._pool.shutdown()
        if self.robot is not None:
            self.robot.close()
        for port in self._ports.values():
            if isinstance(port, CanPort):
                port.close()

    def _on_bus(self, bus: str) -> list[LiveWinch]:
        wiring = self.sim_bench.bench.winch
        return [one for name, one in self.winches.items() if wiring[name].servo.bus == bus]

    # Time.

    def _tick_simulated(self, clock: SimulatedClock) -> None:
        """A tick of everything, and the next one scheduled."""
        if self._stopping.is_set():
            return
        for port in self._ports.values():
            if isinstance(port, SimulatedCanBus):
                port.tick()
        self._tick(list(self.winches.values()))
        clock.call_at(clock.now() + TICK, lambda: self._tick_simulated(clock))

    def _now(self) -> float:
        """Simulated time; it stands still while the process is suspended."""
        now = self._clock() - self._skipped
        if now - self._last > _SUSPENDED:
            self._skipped += now - self._last
            now = self._last
        self._last = max(self._last, now)
        return self._last

    def _instant(self, ago: float) -> float:
        """Simulated time so long ago (s), but no earlier than what the drives have come to."""
        self._reached = max(self._reached, self._now() - ago)
        return self._reached

    def _serve(self, bus: str, port: CanPort) -> None:
        winches = self._on_bus(bus)
        serve(
            port,
            self._clock,
            self._stopping.is_set,
            deliver=partial(self._deliver, winches),
            tick=partial(self._tick, winches),
            late=self._note_lateness,
        )

    def _deliver(
        self, winches: list[LiveWinch], identifier: int, data: bytes, ago: float = 0.0
    ) -> None:
        with self._lock:
            now = self._instant(ago)
            concerned = winches
            if identifier in _RPDOS:
                concerned = [one for one in winches if one.listens(identifier)]
            for winch in concerned:
                winch.receive(identifier, data, now)

    def _tick(self, winches: list[LiveWinch], all_heard: bool = True, ago: float = 0.0) -> None:
        with self._lock:
            now = self._instant(ago)
            while self._faults and now - self._started_at >= self._faults[0].time:
                self._go_wrong(self._faults.pop(0))
            for winch in winches:
                winch.tick(now, all_heard)
            if self.robot is not None:
                self.robot.advance(now)

    def _go_wrong(self, fault: FaultSpec) -> None:
        winch, _, role = fault.target.partition(".")
        self._winch(winch).inject(role, fault.kind)

    def _note_lateness(self, late: float) -> None:
        self.worst_lateness = max(self.worst_lateness, late)
        self.overruns += late > _OVERRUN
