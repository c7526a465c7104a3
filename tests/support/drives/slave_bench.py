"""A bench file of one winch whose drive is the independent slave, in simulated time."""

from __future__ import annotations

import itertools
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from event_timer_eds import with_event_timer
from slave import Slave
from slave.rig import Rig
from winchkit import catalog
from winchkit.bench.bench import Bench
from winchkit.bench.open import open_bench
from winchkit.schema.bench import BenchSpec
from winchkit.schema.read import read_bench
from winchkit.sim.clock.simulated_clock import SimulatedClock

_channels = itertools.count()

_BENCH = """\
schema = 1
kind = "bench"
name = "slave-bench"
cycle = "{cycle}"

[bus.can]
kind = "can"
interface = "virtual"
channel = "{channel}"
heartbeat = "0.1 s"

[winch.A]
profile = "bench-spiral"
brake = true
{more}

[winch.A.servo]
device = "drive/device.toml"
bus = "can"
node = 1
encoder = "absolute"

[winch.A.limits]
speed = "0.5 m/s"
acceleration = "2 m/s^2"
length = ["0.5 m", "4.7 m"]
"""

ANSWERS = """\
by = "T. Ester"
sign = "yes"
[safety]
emergency_stop = "yes"
area = "yes"
[A]
brake = "unloaded"
host_loss = "yes"
try_in_motion = "no"
host_loss_in_motion = "yes"
direction_go = "yes"
direction = "yes"
units_go = "yes"
units = "yes"
limits = "yes"
"""


@dataclass
class SlaveBench:
    """A bench file with its slave, on the rig's clock."""

    path: Path
    slave: Slave
    rig: Rig

    @property
    def clock(self) -> SimulatedClock:
        return self.rig.clock

    def open(self) -> Bench:
        """Open the bench; whoever does so closes it."""
        return open_bench(self.path, self.clock)

    @property
    def spec(self) -> BenchSpec:
        return read_bench(self.path)

    @property
    def answers(self) -> Path:
        return self.path.with_name("answers.toml")

    @property
    def record(self) -> Path:
        return self.path.with_name("bench.commissioned.json")

    @property
    def device(self) -> Path:
        return self.path.parent / "drive" / "device.toml"


def write_bench(
    folder: Path, *, more: str = "", host_loss: str = "heartbeat", cycle: str = "10 ms"
) -> Path:
    """A bench file, with the generic drive's files beside it; its RPDO 1 has an event timer."""
    drive = folder / "drive"
    source = catalog.find("devices", "generic-cia402").parent
    shutil.copytree(source, drive, dirs_exist_ok=True)
    eds, device = drive / "generic-cia402.eds", drive / "device.toml"
    eds.write_text(with_event_timer(eds.read_text()))
    device.write_text(
        device.read_text().replace("[servo]\n", f'[servo]\nhost_loss = "{host_loss}"\n')
    )
    channel = f"bench-{os.getpid()}-{next(_channels)}"
    path = folder / "bench.toml"
    path.write_text(_BENCH.format(channel=channel, more=more, cycle=cycle))
    (folder / "answers.toml").write_text(ANSWERS)
    return path


@contextmanager
def served(path: Path, serial: int = 4711, **options: Any) -> Iterator[SlaveBench]:
    """The slave of a bench file that was written before."""
    spec = read_bench(path)
    slave = Slave.from_file(path.parent / "drive" / "generic-cia402.eds", 1, **options)
    slave.objects.set(0x1018, 4, serial)
    rig = Rig(path.parent, [slave])
    rig.clock.serve_can(str(spec.bus["can"].channel), rig._connect)
    rig.wait(0.1)
    yield SlaveBench(path, slave, rig)
