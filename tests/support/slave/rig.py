"""winchkit's bench against misbehaving slaves, in simulated time.

Slaves advance in steps of 1 ms and a frame takes one step to arrive; only winchkit's clock is used
of winchkit's simulation. Two runs of a test are identical.
"""

from __future__ import annotations

import itertools
import os
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from slave.frames import Frame
from slave.power import State
from slave.slave import Slave
from slave.wire import GENERIC
from winchkit import open_bench
from winchkit.bench.bench import Bench
from winchkit.sim.clock.simulated_clock import SimulatedClock

STEP = 1e-3
CYCLE = 0.004
_LONGEST = 600_000
"""Steps of a test: what waits for ever fails."""
_numbers = itertools.count()


@dataclass(frozen=True)
class Sample:
    """What a slave truly did at one step."""

    time: float
    velocity: float
    """rad/s."""
    state: State


class _Port:
    """A port of winchkit's on the rig's bus; what is sent arrives at the slaves one step later."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._received: deque[Frame] = deque()
        self._arrived = rig.clock.event()
        self.dead = False
        """The process behind it was killed."""

    def take(self, frame: Frame) -> None:
        """A frame has arrived; a port of winchkit's takes no remote frames."""
        if not self.dead and not frame.remote:
            self._received.append(frame)
            self._arrived.set()

    def receive(self, timeout: float) -> tuple[int, bytes] | None:
        """Next frame, waiting at most ``timeout`` s."""
        if not self._received:
            self._arrived.clear()
            self._arrived.wait(timeout)
        if not self._received:
            return None
        frame = self._received.popleft()
        return frame.identifier, frame.data

    def transmit(self, identifier: int, data: bytes) -> None:
        """Send a data frame."""
        self._send(Frame(identifier, bytes(data)))

    def send(self, message: Any, timeout: float | None = None) -> None:
        """Send a message of python-can."""
        data = bytes(message.data)
        self._send(Frame(message.arbitration_id, data, bool(message.is_remote_frame)))

    def close(self) -> None:
        """Let the port go."""
        self.dead = True
        self._arrived.set()

    def _send(self, frame: Frame) -> None:
        if not self.dead and not self._rig.host_mute(frame):
            self._rig.from_host(frame)


@dataclass
class Rig:
    """Slaves and their bus on the clock that is handed to winchkit."""

    folder: Path
    slaves: list[Slave] = field(default_factory=lambda: [Slave.from_file(GENERIC, 1)])
    host_mute: Callable[[Frame], bool] = lambda _frame: False
    """Frames of the host that are lost before any node receives them."""
    each: list[Callable[[], None]] = field(default_factory=list)
    """Called every step of :meth:`wait`, e.g. by a person who holds a key."""

    def __post_init__(self) -> None:
        self.clock = SimulatedClock()
        self.channel = f"rig-{os.getpid()}-{next(_numbers)}"
        self.bench_file = self.folder / f"{self.channel}.toml"
        self.samples: list[list[Sample]] = [[] for _ in self.slaves]
        self.frames: list[tuple[float, Frame]] = []
        """Everything on the bus, as it arrives."""
        self.ports: list[_Port] = []
        self._to_slaves: list[Frame] = []
        self._to_host: list[Frame] = []
        self._begun = self.clock.now()
        self._steps = 0
        self.clock.serve_can(self.channel, self._connect)
        self._schedule()

    @property
    def time(self) -> float:
        """Seconds of simulated time."""
        return self.clock.now()

    def wait(self, duration: float) -> None:
        """Let the world go on for this long, at least one step."""
        for _ in range(max(1, round(duration / STEP))):
            self.clock.sleep(STEP)
            for call in list(self.each):
                call()

    def until(self, condition: Callable[[], bool], within: float = 10.0) -> None:
        """Let the world go on until something is true."""
        end = self.time + within
        while not condition():
            assert self.time < end, "it did not come to that"
            self.wait(STEP)

    def power_cycle(self) -> None:
        """The first drive is switched off for half a second."""
        self.slaves[0].inject("switched off")
        self.wait(0.5)
        self.slaves[0].mend("switched off")
        self.wait(0.5)

    def from_host(self, frame: Frame) -> None:
        """A frame that winchkit sends."""
        self._to_slaves.append(frame)

    def from_stranger(self, identifier: int, data: bytes) -> None:
        """A frame that somebody else sends."""
        self._to_slaves.append(Frame(identifier, data))
        self._to_host.append(Frame(identifier, data))

    def kill(self, bench: Bench) -> None:
        """End the process of a bench as SIGKILL does: it says nothing and closes nothing."""
        for port in self.ports:
            port.dead = True
        kept = [Path(bench.spec.latch_file), Path(bench.spec.position_file)]
        before = {path: path.read_bytes() for path in kept if path.is_file()}
        bench.loop.close()
        bench.stations.close()
        bench._stack.close()
        for path, data in before.items():
            path.write_bytes(data)

    def write_bench(self, text: str) -> Path:
        """Write a bench file whose bus is the rig's."""
        self.bench_file.write_text(text, encoding="utf-8")
        return self.bench_file

    @contextmanager
    def opened(self, text: str | None = None) -> Iterator[Bench]:
        """The bench, open."""
        with self.open(text) as bench:
            yield bench

    def open(self, text: str | None = None) -> Bench:
        """Open the bench; whoever does so closes it."""
        if text is not None or not self.bench_file.exists():
            self.write_bench(text or bench_text(self.channel, len(self.slaves)))
        return open_bench(self.bench_file, self.clock)

    def _connect(self) -> _Port:
        self.ports.append(_Port(self))
        return self.ports[-1]

    def _schedule(self) -> None:
        self._steps += 1
        self.clock.call_at(self._begun + self._steps * STEP, self._step)

    def _step(self) -> None:
        """Frames of the last step arrive, in the order of their priority; slaves go on."""
        self._schedule()
        assert self._steps < _LONGEST, "it takes for ever"
        now = self.time
        to_slaves, self._to_slaves = self._to_slaves, []
        to_host, self._to_host = self._to_host, []
        self.frames += [(now, frame) for frame in (*to_slaves, *to_host)]
        for number, slave in enumerate(self.slaves):
            for frame in to_slaves:
                self._to_host += slave.receive(frame)
            self._to_host += slave.advance(STEP)
            state = Sample(now, slave.motor.velocity, slave.power.state)
            self.samples[number].append(state)
        for frame in to_host:
            for port in self.ports:
                port.take(frame)


def bench_text(
    channel: str,
    winches: int = 1,
    *,
    device: str = "generic-cia402",
    encoder: str = "absolute",
    heartbeat: str = "50 ms",
    limits: Mapping[str, str] | None = None,
    extra: Sequence[str] = (),
) -> str:
    """A bench file on python-can's ``virtual`` bus, one winch a node."""
    lines = [
        "schema = 1",
        'kind = "bench"',
        'name = "rig"',
        f'cycle = "{CYCLE * 1e3:g} ms"',
        *extra,
        "[bus.can]",
        'kind = "can"',
        'interface = "virtual"',
        f'channel = "{channel}"',
        f'heartbeat = "{heartbeat}"',
    ]
    given = {"speed": "0.3 m/s", "acceleration": "1 m/s^2", **(limits or {})}
    for number in range(winches):
        name = "ABCDEFGH"[number]
        on = f'bus = "can", node = {number + 1}, encoder = "{encoder}"'
        servo = f'{{ device = "{device}", {on} }}'
        lines += [f"[winch.{name}]", 'profile = "bench-spiral"', f"servo = {servo}", "brake = true"]
        lines += [f"[winch.{name}.limits]", *(f'{k} = "{v}"' for k, v in given.items())]
    return "\n".join(lines) + "\n"
