"""Ends, stops or hangs the process that moves a winch, in real time: does the drive stop, and when?

    python benchmarks/process_faults.py --times 25 --json

The drive is the slave of tests/support/slave, which shares no code with winchkit, in a thread
of this process; the bench is open in another process, which jogs. CAN between them is UDP
multicast. SIGTERM, SIGHUP and a closed terminal meet ``winchkit jog`` beside ``winchkit log``: ramp
without quick stop, exit code, a log that is whole up to rest. A full disk (a tmpfs) stops nothing,
is reported in a warning, and leaves whole rows. Each case: the drive has left operation enabled (or
ramps down) no later than the bound of its fault, and stands still a ramp later. ``lateness`` is by
how much this process itself was late meanwhile.
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
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from statistics import median

from process_commands import COMMAND_FAULTS, Commands, NotMoving, log_problems

SUPPORT = Path(__file__).parents[1] / "tests" / "support"
sys.path.insert(0, str(SUPPORT))

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
DISK_FULL = "disk full"
OWNER_FAULTS = ("SIGKILL", "SIGSTOP", "loop hung", "key repeat stalled", DISK_FULL)
FAULTS = (*OWNER_FAULTS, *COMMAND_FAULTS)
RAMPED = DEAD_MAN + SPEED / ACCELERATION + FIRST_STOP + SETTLING
RAMP_ENDS = 1.0
"""Of the motor, rad/s: a drive is disabled at rest, below the resolution of 606Ch."""
UNANSWERED = 5 * 0.004
"""s: where this process, and with it the drive, is late by five cycles, a ramp rightly ends in a
quick stop (docs/safety.md)."""
MOVES_ON = 2.0
"""Beside a full disk, s: longer than a log takes to find it."""
DISK = "512k"
PRIORITY = 60
"""Of the slave under SCHED_FIFO: above the bench's."""


class OwnerStopped(Exception):
    """The process stopped the winch itself before the fault."""


@dataclass(frozen=True)
class Stop:
    """One case; times from the fault, s."""

    fault: str
    rest: float
    allowed: float
    lateness: float
    problems: tuple[str, ...] = ()
    """What was wrong besides the time: exit code, log, warning, way of stopping."""

    @property
    def in_time(self) -> bool:
        """Whether it stopped as it must."""
        return self.rest <= self.allowed + self.lateness and not self.problems


def owner(bench_file: str, disk: str = "") -> None:
    """Jog until a signal: SIGUSR1 lets the control loop hang, SIGUSR2 ends the repeats.

    With a ``disk`` it logs there, SIGUSR1 fills the disk, and stdout gets the warnings.
    """
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
        if disk:
            bench.log(Path(disk) / "full.csv")
        else:
            bench.on_cycle(hang)
        shown = 0
        order = partial(bench.winch["A"].jog, pay_out=SPEED)
        while True:
            if disk and signal.SIGUSR1 in told and not (Path(disk) / "filler").exists():
                fill(Path(disk) / "filler")
            for warning in bench.snapshot.warnings[shown:]:
                print(warning, flush=True)
                shown += 1
            if signal.SIGUSR2 not in told and (disk or not told):
                try:
                    order()
                    order = bench.winch["A"].refresh
                except WinchkitError as error:
                    sys.exit(str(error))
            time.sleep(0.05)


def fill(path: Path) -> None:
    """Take all that is left of a file system."""
    with suppress(OSError), path.open("wb", buffering=0) as file:
        while True:
            file.write(bytes(4096))
    with suppress(OSError), path.open("ab", buffering=0) as file:
        while True:
            file.write(b"0")


def command_trial(running: SlavesOnBus, bench_file: Path, fault: str, moment: float) -> Stop:
    """Commands of the command line, and their fault."""
    slave = running.slaves[0]
    with Commands(bench_file, bench_file.with_name("lift.csv"), fault, SPEED) as commands:
        try:
            commands.move(lambda: abs(slave.motor.velocity) > 60, moment)
        except NotMoving as error:
            raise OwnerStopped(str(error)) from error
        running.worst_gap = 0.0
        commands.inject()
        rest, seen = until_rest(running)
        problems = list(commands.problems(running.worst_gap))
    answered = running.worst_gap < UNANSWERED
    if answered and seen.get(State.QUICK_STOP, 0.0) > RAMP_ENDS:
        problems.append(f"quick stop at {seen[State.QUICK_STOP]:.1f} rad/s and not the ramp")
    return Stop(fault, rest, RAMPED, running.worst_gap, tuple(problems))


def until_rest(running: SlavesOnBus) -> tuple[float, dict[State, float]]:
    """Time until the drive stands still and is not enabled, s; speed at which each state began."""
    slave, start = running.slaves[0], time.monotonic()
    seen: dict[State, float] = {}
    while not (abs(slave.motor.velocity) < REST and slave.power.state is not State.ENABLED):
        seen.setdefault(slave.power.state, abs(slave.motor.velocity))
        if time.monotonic() - start > PATIENCE:
            break
        time.sleep(0.001)
    return time.monotonic() - start, seen


def disk_trial(running: SlavesOnBus, bench_file: Path, moment: float) -> Stop:
    """A full disk disturbs no motion; the key is released afterwards."""
    slave, disk = running.slaves[0], bench_file.with_name("disk")
    disk.mkdir(exist_ok=True)
    mount = f'mount -t tmpfs -o size={DISK} tmpfs {disk} || exit 99; exec "$0" "$@"'
    process = subprocess.Popen(
        [
            *("unshare", "--user", "--map-root-user", "--mount", "sh", "-c", mount),
            *(sys.executable, __file__, "--owner", str(bench_file), "--disk", str(disk)),
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        await_motion(running, process)
        time.sleep(0.5 + moment)
        running.worst_gap, slowest = 0.0, float("inf")
        os.kill(process.pid, signal.SIGUSR1)
        end = time.monotonic() + MOVES_ON
        while time.monotonic() < end:
            slowest = min(slowest, abs(slave.motor.velocity))
            time.sleep(0.005)
        os.kill(process.pid, signal.SIGUSR2)
        rest, _ = until_rest(running)
        log = bench_file.with_name("full.csv")
        log.write_bytes(Path(f"/proc/{process.pid}/root{disk}/full.csv").read_bytes())
    finally:
        process.kill()
        told, words = process.communicate()
    problems = list(disk_problems(told, slowest, log, running.worst_gap))
    if process.returncode != -signal.SIGKILL:
        problems.append(f"it ended with {process.returncode}: {words}")
    time.sleep(1.0)
    return Stop(DISK_FULL, rest, RAMPED, running.worst_gap, tuple(problems))


def disk_problems(told: str, slowest: float, log: Path, lateness: float) -> Iterator[str]:
    """What a full disk did that it must not do."""
    if slowest < 60:
        yield f"the motor fell to {slowest:.1f} rad/s beside a full disk"
    if "logging failed" not in told or "No space left" not in told:
        yield f"no warning of the full disk: {told!r}"
    yield from log_problems(log, None, lateness, to_rest=False)


def await_motion(running: SlavesOnBus, process: subprocess.Popen[str]) -> None:
    """Return when the motor turns; raises OwnerStopped."""
    deadline = time.monotonic() + PATIENCE
    while abs(running.slaves[0].motor.velocity) < 60:
        if process.poll() is not None or time.monotonic() > deadline:
            process.kill()
            assert process.stderr is not None
            raise OwnerStopped(process.stderr.read())
        time.sleep(0.005)


def trial(running: SlavesOnBus, bench_file: Path, fault: str, moment: float) -> Stop:
    """One process and its fault."""
    slave = running.slaves[0]
    process = subprocess.Popen(
        [sys.executable, __file__, "--owner", str(bench_file)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        await_motion(running, process)
        time.sleep(moment)
        with running.lock:
            consumer = (slave.objects.get(0x1016, 1) & 0xFFFF) * 1e-3
            speed = abs(slave.motor.velocity)
        running.worst_gap = 0.0
        signals = {"SIGKILL": signal.SIGKILL, "SIGSTOP": signal.SIGSTOP}
        signals |= {"loop hung": signal.SIGUSR1, "key repeat stalled": signal.SIGUSR2}
        os.kill(process.pid, signals[fault])
        rest, _ = until_rest(running)
    finally:
        process.send_signal(signal.SIGKILL)
        process.communicate()
    silent = consumer + speed / RAMP + SETTLING
    allowed = RAMPED if fault == "key repeat stalled" else silent
    time.sleep(1.0)
    return Stop(fault, rest, allowed, running.worst_gap)


def case(bench_file: Path, text: str, port: int, fault: str, moment: float) -> Stop:
    """One fault on a new drive; opened anew where the bench stopped before."""
    words = ""
    for _ in range(ATTEMPTS):
        bench_file.write_text(text, encoding="utf-8")
        # A trip of the case before, or its owner that was killed in motion, is none of this one's.
        for record in ("trip", "position"):
            bench_file.with_name(f"bench.{record}.json").unlink(missing_ok=True)
        slaves = [Slave.from_file(GENERIC, 1)]
        with SlavesOnBus(slaves, GROUP, "udp_multicast", port=port, priority=PRIORITY) as running:
            try:
                if fault in COMMAND_FAULTS:
                    return command_trial(running, bench_file, fault, moment)
                if fault == DISK_FULL:
                    return disk_trial(running, bench_file, moment)
                return trial(running, bench_file, fault, moment)
            except OwnerStopped as error:
                words = str(error)
    sys.exit(f"the bench did not move the winch in {ATTEMPTS} attempts: {words}")


def main() -> None:
    """Run the cases."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--owner", help=argparse.SUPPRESS)
    parser.add_argument("--disk", default="", help=argparse.SUPPRESS)
    parser.add_argument("--times", type=int, default=25, help="cases of each fault")
    parser.add_argument("--faults", nargs="*", default=list(FAULTS), choices=FAULTS)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    if options.owner:
        owner(options.owner, options.disk)
        return
    # A job in the background ignores them, and so would every command that it starts.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
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
        print(f"{fault:28s} {row['stopped']} of {row['cases']} right, worst {row['worst_s']} s")


if __name__ == "__main__":
    main()
