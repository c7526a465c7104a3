"""Ends, stops or hangs the process that moves a winch, in real time: does the drive stop, and when?

    python benchmarks/process_faults.py --times 25 --json

The drive is the slave of tests/slave, which shares no code with winchkit, in a thread of this
process; the bench is open in another process, which jogs. CAN between them is UDP multicast. Each
case: the drive has left operation enabled (or ramps down) no later than the bound of its fault,
and stands still a ramp later. ``lateness`` is by how much this process itself was late meanwhile.
Exits 1 where one drive stopped too late.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median

TESTS = Path(__file__).parents[1] / "tests"
sys.path.insert(0, str(TESTS))

from slave import Slave, State  # noqa: E402 - from the tests' folder
from slave.on_bus import SlavesOnBus  # noqa: E402
from slave.rig import bench_text  # noqa: E402
from slave.wire import GENERIC  # noqa: E402

GROUP = "239.74.163.9"
SPEED, ACCELERATION = 0.2, 1.0
"""Of the cable, m/s and m/s^2."""
DEAD_MAN, FIRST_STOP = 0.2, 0.15
RAMP = 628.0
"""6085h of the slave, rad/s^2."""
SETTLING = 0.05
REST = 0.5
"""Of the motor, rad/s."""
PATIENCE = 30.0
HEARTBEAT = "100 ms"
ATTEMPTS = 5
"""A bench that stopped before the fault, since this computer stood still, is opened anew."""
FAULTS = ("SIGKILL", "SIGSTOP", "loop hung", "key repeat stalled")


class OwnerStopped(Exception):
    """The process stopped the winch itself before the fault."""


@dataclass(frozen=True)
class Stop:
    """One case; times from the fault, s."""

    fault: str
    rest: float
    allowed: float
    lateness: float

    @property
    def in_time(self) -> bool:
        """Whether it stopped as it must."""
        return self.rest <= self.allowed + self.lateness


def owner(bench_file: str) -> None:
    """Jog until told otherwise: SIGUSR1 lets the control loop hang, SIGUSR2 ends the repeats."""
    from winchkit import open_bench
    from winchkit.bench.control.snapshot import BenchSnapshot
    from winchkit.errors import WinchkitError

    told: set[int] = set()
    for number in (signal.SIGUSR1, signal.SIGUSR2):
        signal.signal(number, lambda number, _frame: told.add(number))

    def hang(_snapshot: BenchSnapshot) -> None:
        while signal.SIGUSR1 in told:
            time.sleep(1.0)

    with open_bench(bench_file) as bench:
        bench.on_cycle(hang)
        while True:
            if not told:
                try:
                    bench.winch["A"].jog(pay_out=SPEED)
                except WinchkitError as error:
                    sys.exit(str(error))
            time.sleep(0.05)


def trial(running: SlavesOnBus, bench_file: Path, fault: str, moment: float) -> Stop:
    """One process and its fault."""
    slave = running.slaves[0]
    process = subprocess.Popen(
        [sys.executable, __file__, "--owner", str(bench_file)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )
    try:
        deadline = time.monotonic() + PATIENCE
        while abs(slave.motor.velocity) < 60:
            if process.poll() is not None or time.monotonic() > deadline:
                words = process.stderr.read().decode() if process.stderr else ""
                raise OwnerStopped(words)
            time.sleep(0.005)
        time.sleep(moment)
        with running.lock:
            consumer = (slave.objects.get(0x1016, 1) & 0xFFFF) * 1e-3
            speed = abs(slave.motor.velocity)
        running.worst_gap = 0.0
        signals = {"SIGKILL": signal.SIGKILL, "SIGSTOP": signal.SIGSTOP}
        signals |= {"loop hung": signal.SIGUSR1, "key repeat stalled": signal.SIGUSR2}
        os.kill(process.pid, signals[fault])
        start = time.monotonic()
        while not (abs(slave.motor.velocity) < REST and slave.power.state is not State.ENABLED):
            if time.monotonic() - start > PATIENCE:
                break
            time.sleep(0.001)
        rest = time.monotonic() - start
    finally:
        process.send_signal(signal.SIGKILL)
        process.communicate()
    if fault == "key repeat stalled":
        allowed = DEAD_MAN + SPEED / ACCELERATION + FIRST_STOP + SETTLING
    else:
        allowed = consumer + speed / RAMP + SETTLING
    time.sleep(1.0)
    return Stop(fault, rest, allowed, running.worst_gap)


def case(bench_file: Path, text: str, port: int, fault: str, moment: float) -> Stop:
    """One fault on a new drive; opened anew where the bench stopped before."""
    words = ""
    for _ in range(ATTEMPTS):
        bench_file.write_text(text, encoding="utf-8")
        # A trip of the case before is none of this one's.
        bench_file.with_name("bench.trip.json").unlink(missing_ok=True)
        slaves = [Slave.from_file(GENERIC, 1)]
        with SlavesOnBus(slaves, GROUP, "udp_multicast", port=port) as running:
            try:
                return trial(running, bench_file, fault, moment)
            except OwnerStopped as error:
                words = str(error)
    sys.exit(f"the bench did not move the winch in {ATTEMPTS} attempts: {words}")


def main() -> None:
    """Run the cases."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--owner", help=argparse.SUPPRESS)
    parser.add_argument("--times", type=int, default=25, help="cases of each fault")
    parser.add_argument("--faults", nargs="*", default=list(FAULTS), choices=FAULTS)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    if options.owner:
        owner(options.owner)
        return
    chance = random.Random(options.seed)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("", 0))
        port = probe.getsockname()[1]
    with tempfile.TemporaryDirectory() as folder:
        bench_file = Path(folder) / "bench.toml"
        text = bench_text(GROUP, heartbeat=HEARTBEAT).replace('"virtual"', '"udp_multicast"')
        text = text.replace("heartbeat =", f"port = {port}\nheartbeat =")
        stops = []
        for fault in options.faults:
            for _ in range(options.times):
                stops.append(case(bench_file, text, port, fault, chance.uniform(0, 0.3)))
    report(stops, as_json=options.json)
    sys.exit(0 if all(stop.in_time for stop in stops) else 1)


def report(stops: list[Stop], *, as_json: bool) -> None:
    """Print what came of the cases, by fault."""
    found = {}
    for fault in dict.fromkeys(stop.fault for stop in stops):
        own = [stop for stop in stops if stop.fault == fault]
        found[fault] = {
            "cases": len(own),
            "stopped": sum(stop.in_time for stop in own),
            "median_s": round(median(stop.rest for stop in own), 3),
            "worst_s": round(max(stop.rest for stop in own), 3),
            "allowed_s": round(max(stop.allowed for stop in own), 3),
            "lateness_s": round(max(stop.lateness for stop in own), 3),
            "late": [asdict(stop) for stop in own if not stop.in_time],
        }
    if as_json:
        print(json.dumps({"schema": 1, "faults": found}))
        return
    for fault, row in found.items():
        print(f"{fault:20s} {row['stopped']} of {row['cases']} in time, worst {row['worst_s']} s")


if __name__ == "__main__":
    main()
