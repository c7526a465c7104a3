"""Kills the process that jogs a winch, again and again: does the drive stop by itself, and when?

    python benchmarks/sigkill_stop.py --times 100

The simulated drive is in this process, the bench's owner (``winchkit jog``) in another one,
which is killed with SIGKILL at a random moment of its jog. CAN between them is UDP multicast.
A drive must stand still no later than the time after which it misses the host's heartbeat, plus
the ramp of its quick stop from the speed that it had. Prints one JSON object; exits 1 where one
drive stopped too late.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from math import pi
from pathlib import Path
from statistics import median

from winchkit.bench.ownership import owner_process
from winchkit.catalog import find
from winchkit.schema.read import read_bench, read_simbench
from winchkit.sim.live.bench import LiveBench
from winchkit.sim.live.buses import Carried

JOG = [sys.executable, "-c", "from winchkit.cli import main; main()", "jog", "A"]
SPEED = 0.2
"""Of the cable, m/s."""
SETTLING = 0.05
"""Set-point filter and inner loops of the simulated drive, s."""
REST = 0.5
"""Of the motor, rad/s."""
PATIENCE = 30.0
POLL = 5e-4
STALLED = ("no complete feedback", "no load cell reading", "heartbeat is gone", "no answer within")
"""What an owner says that stops by itself, rightly, because this machine stood still."""


class OwnerStopped(Exception):
    """It ended before it was killed."""


@dataclass(frozen=True)
class Stop:
    """One killed owner."""

    silence: float
    """From the last heartbeat that the drive heard until it left operation enabled, s."""
    after_kill: float
    """From the kill until it stood still, s."""
    allowed: float
    """For that, s."""
    lateness: float
    """By how much the simulation itself was late meanwhile, because the machine was busy, s."""

    @property
    def in_time(self) -> bool:
        """Whether it stopped as it must."""
        return self.after_kill <= self.allowed + self.lateness


class Bench:
    """The simulated bench, and when its drive last heard the host."""

    def __init__(self, live: LiveBench, bench_file: Path) -> None:
        self.live, self.bench_file = live, bench_file
        self.drive = live.winches["A"].drive
        self.plant = live.winches["A"].plant
        self.heard = 0.0
        self._host = 0x700 + live.bench_spec.bus["can"].node
        live.wire["can"].taps.append(self._listen)

    def _listen(self, frame: Carried) -> None:
        if frame.identifier == self._host:
            self.heard = frame.time

    def state(self) -> tuple[str, float]:
        """The drive's state, and the speed of its motor, rad/s."""
        with self.live.up_to_date():
            return self.drive.state.name, self.plant.motor_velocity

    def owner(self, speed: float) -> subprocess.Popen[bytes]:
        """A command that jogs for longer than its bench process will live.

        A killed owner is a trip of the next one, which is reset.
        """
        way = "--wind-in" if speed > 0 else "--pay-out"
        options = [
            "--bench",
            str(self.bench_file),
            way,
            f"{abs(speed)} m/s",
            "--for",
            "60s",
            "--reset",
        ]
        return subprocess.Popen(
            [*JOG, *options],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
        )

    def trial(self, speed: float, moment: float) -> Stop:
        """Kill the bench process of a jog once the cable has its speed; watch the drive."""
        owner = self.owner(speed)
        try:
            self._until_moving(owner)
            time.sleep(moment)
            self.live.worst_lateness = 0.0
            process = owner_process(read_bench(self.bench_file))
            assert process is not None, "the jog's bench process has written it"
            os.kill(process, signal.SIGKILL)
            killed = time.monotonic()
        finally:
            owner.kill()
            owner.communicate()
        return self._watch(killed)

    def _until_moving(self, owner: subprocess.Popen[bytes]) -> None:
        deadline = time.monotonic() + PATIENCE
        while abs(self.state()[1]) < SPEED / 0.06 * 20.4 * 0.9:
            if owner.poll() is not None:
                assert owner.stderr is not None
                raise OwnerStopped(owner.stderr.read().decode())
            if time.monotonic() > deadline:
                raise RuntimeError("the winch does not move")
            time.sleep(POLL)

    def _watch(self, killed: float) -> Stop:
        left = speed = 0.0
        while True:
            state, velocity = self.state()
            now = time.monotonic()
            if state == "OPERATION_ENABLED":
                speed = abs(velocity)
            elif not left:
                left = now
            if left and abs(velocity) < REST:
                break
            if now > killed + PATIENCE:
                raise RuntimeError(f"the drive is still {state} {PATIENCE:g} s after the kill")
            time.sleep(POLL)
        objects = self.drive.objects
        counts = objects.number(0x608F, 1) / objects.number(0x608F, 2)
        ramp = speed / (objects.number(0x6085) * 2 * pi / counts)
        watch = (objects.number(0x1016, 1) & 0xFFFF) * 1e-3
        allowed = watch + ramp + SETTLING
        return Stop(left - self.heard, now - killed, allowed, self.live.worst_lateness)


def trials(times: int, seed: int) -> tuple[list[Stop], int]:
    """Kill that many owners, half of them while they wind in.

    Also counts how many more had stopped by themselves before, on a machine that is busy.
    """
    moments = random.Random(seed)
    declared = read_simbench(find("sim", "spiral-bench"))
    stops: list[Stop] = []
    stalled = 0
    with (
        tempfile.TemporaryDirectory() as folder,
        LiveBench(declared, seed=seed, interface="udp_multicast") as live,
    ):
        bench = Bench(live, live.write_bench_file(Path(folder) / "bench.toml"))
        while len(stops) < times:
            speed = SPEED if len(stops) % 2 else -SPEED
            try:
                stops.append(bench.trial(speed, moments.uniform(0.0, 0.3)))
            except OwnerStopped as error:
                stalled += 1
                if stalled > times or not any(word in str(error) for word in STALLED):
                    raise
    return stops, stalled


def main() -> int:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--times", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    stops, stalled = trials(asked.times, asked.seed)
    in_time = sum(stop.in_time for stop in stops)
    figures = {
        "times": len(stops),
        "stalled": stalled,
        "in_time": in_time,
        "worst_after_kill": max(stop.after_kill for stop in stops),
        "median_after_kill": median(stop.after_kill for stop in stops),
        "worst_silence": max(stop.silence for stop in stops),
        "allowed": max(stop.allowed for stop in stops),
        "worst_lateness": max(stop.lateness for stop in stops),
        "unit": "s",
    }
    print(json.dumps(figures))
    return 0 if in_time == len(stops) else 1


if __name__ == "__main__":
    sys.exit(main())
