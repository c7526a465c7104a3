"""Modbus cells over lines that fail, against a libmodbus server, in real time.

``python benchmarks/modbus_campaign.py --readings 100000 --seed 1 --json``: wrong numbers must be 0.
The server (``modbus_peers/clock_server.c``, compiled here) shows the time as its measurement; the
line (``modbus_peers/faulty_line.py``) delays, cuts, joins, copies and reorders replies. A number is
wrong where the server did not have it at any moment from the earliest sampling moment that the
reading states (``t_sample - t_uncertainty``) to its receipt. Needs libmodbus-dev and a C compiler.
"""

from __future__ import annotations

import argparse
import json
import logging
import math
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from summaries import print_summary
from winchkit import catalog
from winchkit.drivers.clock import MonotonicClock
from winchkit.drivers.modbus.instrument import Instrument
from winchkit.drivers.modbus.line import ModbusLine
from winchkit.drivers.reading import InstrumentReading
from winchkit.drivers.slow import SlowDevices
from winchkit.schema.bench import BusSpec
from winchkit.schema.read import read_device

PEERS = Path(__file__).parent / "modbus_peers"
MODULUS, OFFSET, TICK = 900_000, 100, 1e-4
"""As in clock_server.c: counts, counts, s."""
TIMEOUT = 0.03


@dataclass(frozen=True)
class Case:
    """A device file, the server's layout, and what may go wrong on the line."""

    device: str
    layout: str
    kind: str
    count: float
    """Value of one count as the manual has it, SI."""
    without: tuple[str, ...] = ()


CASES = (
    Case("laumas-tlb", "tlb", "tcp", 0.01),
    Case("pt113", "pt113", "tcp", 0.1),
    Case("generic-length", "generic", "tcp", 1e-5),
    # Over TCP only its length shows an old answer that a gateway passes off as a new one.
    Case("mantracourt-dsc", "dsc", "tcp", 1.0, ("retag",)),
    Case("laumas-tlb", "tlb", "rtu", 0.01),
    Case("generic-modbus", "generic", "rtu", 0.01),
    Case("generic-length", "generic", "rtu", 1e-5),
    Case("mantracourt-dsc", "dsc", "rtu", 1.0),
)


@dataclass
class Judge:
    """Compares every reading of one case with the server's clock."""

    case: Case
    numbers: int = 0
    readings: int = 0
    flags: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)

    def __call__(self, reading: InstrumentReading) -> None:
        """Take in a reading."""
        self.readings += 1
        self.flags.update(str(reading.quality).split(", "))
        if math.isnan(reading.value) and math.isnan(reading.gross):
            return
        self.numbers += 1
        begin, end = reading.t_sample - reading.t_uncertainty, reading.t_receive
        for name in ("value", "gross"):
            counts = getattr(reading, name) / self.case.count
            if abs(counts - round(counts)) > 1e-3:
                self.wrong.append(f"{name} {counts!r} is no whole count")
                continue
            # Age at receipt, by the clock in the number itself; it repeats every 90 s.
            age = (end / TICK - (round(counts) - OFFSET)) % MODULUS * TICK
            if age > MODULUS * TICK - 2 * TICK:
                age -= MODULUS * TICK
            if age > end - begin + 2 * TICK:
                self.wrong.append(
                    f"{name} is {age * 1e3:.1f} ms old, stated {(end - begin) * 1e3:.1f} ms "
                    f"({reading.quality})"
                )


class Peer:
    """Server and line of one case, as processes."""

    def __init__(self, case: Case, server: Path, seed: str, share: float) -> None:
        spec = read_device(catalog.find("devices", case.device)).modbus
        assert spec is not None
        copies = 0.0 if spec.read.fixed else 0.5 / spec.rate
        more = [
            "--seed", seed, "--share", str(share), "--timeout", str(TIMEOUT),
            "--latest", str(8 * spec.longest_reply), "--copy-within", str(copies),
            "--without", *case.without,
        ]  # fmt: skip
        line = [sys.executable, str(PEERS / "faulty_line.py"), case.kind]
        if case.kind == "tcp":
            self.server, told = _start([str(server), "tcp", case.layout])
            self.line, port = _start([*line, told, *more])
            self.bus = BusSpec("modbus-tcp", host="127.0.0.1", port=int(port), timeout=TIMEOUT)
        else:
            self.line, told = _start([*line, *more])
            near, far = told.split()
            self.server, _ = _start([str(server), near, case.layout])
            self.bus = BusSpec("modbus-rtu", port=far, baudrate=115200, timeout=TIMEOUT)

    def stop(self) -> dict[str, int]:
        """End both; what went wrong on the line and how often."""
        told, _ = self.line.communicate(timeout=10)
        self.server.kill()
        self.server.communicate()
        return json.loads(told or "{}")


def _start(words: list[str]) -> tuple[subprocess.Popen[str], str]:
    process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    return process, process.stdout.readline().strip()


def compiled(folder: Path) -> Path:
    """The libmodbus server; raises CalledProcessError, FileNotFoundError."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None or not Path("/usr/include/modbus/modbus.h").is_file():
        raise FileNotFoundError(
            "needs a C compiler and libmodbus: apt-get install libmodbus-dev gcc"
        )
    target = folder / "clock_server"
    words = ["-Wall", "-Werror", "-I/usr/include/modbus", str(PEERS / "clock_server.c"), "-lmodbus"]
    subprocess.run([compiler, *words, "-o", str(target)], check=True, timeout=60)
    return target


def play(
    numbers: int, seed: int, share: float, seconds: float, cases: Sequence[Case] = CASES
) -> dict[str, object]:
    """Read until so many numbers came or the time is over, then say what they were."""
    logging.getLogger("pymodbus").setLevel(logging.CRITICAL)
    clock, judges, begin = MonotonicClock(), [Judge(case) for case in cases], time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        server = compiled(Path(folder))
        peers = [Peer(case, server, f"{seed}/{number}", share) for number, case in enumerate(cases)]
        lines, instruments = [], []
        for case, peer, judge in zip(cases, peers, judges, strict=True):
            device = read_device(catalog.find("devices", case.device))
            cell = Instrument(case.device, device, 1, clock, timeout=TIMEOUT)
            cell.listeners.append(judge)
            instruments.append(cell)
            lines.append(ModbusLine(f"{case.device} {case.kind}", peer.bus, (cell,), clock))
        slow = SlowDevices(lines)
        while sum(judge.numbers for judge in judges) < numbers:
            time.sleep(0.05)
            if time.monotonic() - begin > seconds:
                break
        slow.close()
        faults = [peer.stop() for peer in peers]
    return {
        "schema": 1,
        "readings": sum(judge.readings for judge in judges),
        "numbers": sum(judge.numbers for judge in judges),
        "wrong_numbers": sum(len(judge.wrong) for judge in judges),
        "wrong": [f"{j.case.device} {j.case.kind}: {w}" for j in judges for w in j.wrong][:20],
        "faults": dict(sum((Counter(done) for done in faults), Counter[str]())),
        "cases": [
            {
                "device": judge.case.device,
                "line": judge.case.kind,
                "numbers": judge.numbers,
                "flags": dict(judge.flags),
                "faults": sum(done.values()),
                "late": cell.counters.late,
                "timeouts": cell.counters.timeouts,
                "reconnects": cell.counters.reconnects,
            }
            for judge, cell, done in zip(judges, instruments, faults, strict=True)
        ],
        "seconds": round(time.monotonic() - begin, 1),
    }


def main() -> int:
    """Exit 1 where a single wrong number was published."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--readings", type=int, default=100_000, help="numbers to be published")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--share", type=float, default=0.05, help="of replies that go wrong")
    parser.add_argument("--copies", type=int, default=2, help="lines of each case")
    parser.add_argument("--seconds", type=float, default=1200.0, help="end after this time")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    try:
        found = play(
            arguments.readings,
            arguments.seed,
            arguments.share,
            arguments.seconds,
            CASES * arguments.copies,
        )
    except (FileNotFoundError, subprocess.CalledProcessError) as error:
        print(error, file=sys.stderr)
        return 4
    print_summary(found, as_json=arguments.json)
    return 1 if found["wrong_numbers"] else 0


if __name__ == "__main__":
    sys.exit(main())
