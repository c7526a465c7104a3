"""Random stalls of clients: commands that move a winch are suspended (SIGSTOP) and continued.

``python benchmarks/client_stalls.py --count 200`` serves a simulated bench in a process of its own
and starts ``jog --for``, ``jog`` by keys, ``hold-tension`` and ``move`` against it. Each is
suspended at a random moment of its motion for a random time, the arrow key being released and typed
meanwhile at random. The witness is the simulated drive: after the command continues it must never
be in operation enabled again, and the command must end with exit code 5 (the keyboard goes on, and
says that it ignores the keys). Stalls shorter than the dead-man are not made.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import pty
import random
import re
import select
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from winchkit.sim.live.client import send

WINCHKIT = [sys.executable, "-c", "from winchkit.cli import main; main()"]
KINDS = ("jog", "keys", "hold-tension", "move")
_UP = b"\x1b[A"
_STARTS, _ENDS = 60.0, 30.0
"""For a command to begin, and to end, on a busy computer, s."""
_WATCHED = 0.8
"""After the stall, s."""
_STOPPED = 3.0
"""For the dead-man or the life sign, and the ramp, on a busy computer, s."""


@dataclass(frozen=True)
class Stalled:
    """What came of one stall."""

    kind: str
    stall: float
    """s."""
    wrong: str
    """Empty where nothing was wrong."""


@contextmanager
def served(folder: Path) -> Iterator[Path]:
    """A simulated bench in its own process; yields its bench file."""
    path = folder / "bench.toml"
    command = [*WINCHKIT, "sim", "serve", "spiral-bench", "--bench-file", str(path)]
    with subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None, "it is a pipe"
        process.stdout.readline()
        # The computer of a benchmark may be busy: late readings of a cell are not its subject.
        text = path.read_text().replace('heartbeat = "0.2 s"', 'heartbeat = "0.5 s"')
        text = text.replace("[winch.A.limits]", '[winch.A.limits]\nresponse_time = "1 s"')
        path.write_text(text.replace("[winch.A]", 'cycle = "0.01 s"\n[winch.A]', 1))
        try:
            yield path
        finally:
            process.send_signal(signal.SIGINT)
            process.wait()


def state(bench: Path) -> tuple[float, str]:
    """True cable length, m, and the drive's state, by the simulation."""
    found = re.match(r"A: ([\d.]+) m, .* kg, ([a-z ]+)", send(bench, "status"))
    assert found is not None, "the simulation answers with its status"
    return float(found[1]), found[2].strip()


def stall(bench: Path, kind: str, rng: random.Random) -> Stalled:
    """Suspend one command of a kind for a while."""
    duration = rng.choice([0.4, 0.6, 1.0, 2.0, 4.0])
    length, _ = state(bench)
    way = "--wind-in" if length > 3.0 else "--pay-out"
    command = {
        "jog": ["jog", "A", way, "30 mm/s", "--for", "20s"],
        "keys": ["jog", "A", "--speed", "0.05 m/s"],
        "hold-tension": ["hold-tension", "A", "99 N", "--travel", "0.4 m", "--for", "20s"],
        "move": ["move", "A", way, "1 m", "--speed", "30 mm/s"],
    }[kind]
    master, slave = pty.openpty()
    with subprocess.Popen(
        [*WINCHKIT, *command, "-b", str(bench)],
        stdin=slave,
        stdout=slave,
        stderr=subprocess.PIPE,
        start_new_session=True,
    ) as process:
        os.close(slave)
        try:
            times = (rng.uniform(0.0, 0.7), duration, rng.uniform(0.0, duration))
            wrong = _suspend(bench, kind, process, master, times)
        finally:
            with contextlib.suppress(OSError):
                os.close(master)
            if process.poll() is None:
                process.kill()
    return Stalled(kind, duration, wrong)


def _suspend(
    bench: Path,
    kind: str,
    process: subprocess.Popen[bytes],
    master: int,
    times: tuple[float, float, float],
) -> str:
    """Suspend the command in its motion; returns what was wrong.

    ``times``: of motion before it, of the stall, and in it until the key is released, s.
    """
    before, duration, held = times
    begun = time.monotonic()
    while state(bench)[1] != "operation enabled":
        if process.poll() is not None or time.monotonic() - begun > _STARTS:
            errors = process.stderr.read().decode() if process.poll() is not None else ""  # type: ignore[union-attr]
            return f"it did not begin: exit code {process.poll()}: {errors[-600:]}"
        _type(master, _UP if kind == "keys" else b"")
        time.sleep(0.05)
    end = time.monotonic() + before
    while time.monotonic() < end:
        _type(master, _UP if kind == "keys" else b"")
        time.sleep(0.03)
    process.send_signal(signal.SIGSTOP)
    end = time.monotonic() + duration
    released = time.monotonic() + held
    while time.monotonic() < end:
        if kind == "keys" and time.monotonic() < released:
            _type(master, _UP)
        time.sleep(0.03)
    waited = time.monotonic()
    while state(bench)[1] == "operation enabled":
        if time.monotonic() - waited > _STOPPED:
            return "the drive stays enabled while its client is suspended"
        time.sleep(0.01)
    process.send_signal(signal.SIGCONT)
    end = time.monotonic() + _WATCHED
    while time.monotonic() < end:
        if state(bench)[1] == "operation enabled":
            return "the drive was enabled by the client that continued"
        _drain(master)
        time.sleep(0.005)
    return _ended(kind, process, master)


def _ended(kind: str, process: subprocess.Popen[bytes], master: int) -> str:
    """What was wrong with the end of the command."""
    if kind == "keys":
        if process.poll() is not None:
            return f"it ended with exit code {process.returncode}"
        _type(master, b"q")
    end = time.monotonic() + _ENDS
    while process.poll() is None and time.monotonic() < end:
        _drain(master)
        time.sleep(0.02)
    code, expected = process.poll(), 0 if kind == "keys" else 5
    return "" if code == expected else f"exit code {code}, expected {expected}"


def _type(master: int, keys: bytes) -> None:
    """Type keys, and read what the terminal shows."""
    if keys:
        os.write(master, keys)
    _drain(master)


def _drain(master: int) -> None:
    with contextlib.suppress(OSError):
        while select.select([master], [], [], 0)[0] and os.read(master, 65536):
            pass


def main() -> None:
    """Make the stalls of the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=None)
    asked = parser.parse_args()
    seed = random.randrange(10**6) if asked.seed is None else asked.seed
    rng, found = random.Random(seed), []
    print(f"seed {seed}", flush=True)
    with tempfile.TemporaryDirectory() as folder, served(Path(folder)) as bench:
        for number in range(asked.count):
            one = stall(bench, KINDS[number % len(KINDS)], rng)
            found.append(one)
            if one.wrong:
                print(f"{number}: {one.kind}, {one.stall:g} s: {one.wrong}", flush=True)
    made = Counter(one.kind for one in found)
    wrong = [one for one in found if one.wrong]
    counts = ", ".join(f"{count} of {kind}" for kind, count in made.items())
    print(f"{len(found)} stalls ({counts}): {len(wrong)} wrong")
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
