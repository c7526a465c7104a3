"""Two ways to find inputs that break a parser: changes at random, and those that atheris leads."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import tempfile
from pathlib import Path
from random import Random
from time import monotonic
from types import FrameType
from typing import NoReturn

from fuzzing.targets import Failure, Target
from winchkit.errors import WinchkitError

HANG = 1.0
"""An input that takes more processor time hangs, s."""
STALLED = 20
"""So long may one take in libFuzzer, s: its clock runs also while the machine does other things."""
INSTRUMENTED = """
import os, runpy, sys, atheris
sys.path.insert(0, os.path.dirname(sys.argv[1]))
with atheris.instrument_imports(include=["winchkit"]):
    sys.argv = sys.argv[1:]
    runpy.run_path(sys.argv[0], run_name="__main__")
"""
"""Runs a program so that atheris sees which lines an input reaches."""
ROUND = 200
"""Inputs a target gets in a row."""


def try_one(target: Target, data: bytes) -> str | None:
    """What goes wrong with one input, None where nothing does."""
    signal.setitimer(signal.ITIMER_PROF, HANG)
    try:
        target.feed(data)
    except WinchkitError:
        return None
    except Exception as error:  # noqa: BLE001 - any other exception is what is looked for
        return f"{type(error).__name__}: {error}"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
    return None


def hung(_signal: int, _frame: FrameType | None) -> None:
    """Interrupt an input that takes too long."""
    raise Failure(f"takes longer than {HANG:g} s")


def with_mutation(
    targets: list[Target], seconds: float, seed: int
) -> tuple[dict[str, int], list[dict[str, str]]]:
    """Change valid inputs at random, in turn for every target."""
    signal.signal(signal.SIGPROF, hung)
    random = Random(seed)
    done = {target.name: 0 for target in targets}
    failures: list[dict[str, str]] = []
    seen: set[tuple[str, str]] = set()
    end = monotonic() + seconds
    while monotonic() < end:
        for target in targets:
            for _ in range(max(1, round(ROUND * target.weight))):
                data = mutated(random, target.seeds)
                found = try_one(target, data)
                done[target.name] += 1
                if found and (target.name, found) not in seen:
                    seen.add((target.name, found))
                    failures.append({"target": target.name, "input": data.hex(), "failed": found})
    return done, failures


def mutated(random: Random, seeds: tuple[bytes, ...]) -> bytes:
    """A valid input with some bytes lost, changed, put in, repeated, or another input in it."""
    data = bytearray(random.choice(seeds))
    for _ in range(random.randint(0, 8)):
        at = random.randint(0, len(data))
        upto = min(len(data), at + random.randint(1, 8))
        how = random.randrange(6)
        if how == 0:
            del data[at:upto]
        elif how == 1:
            data[at:upto] = random.randbytes(upto - at)
        elif how == 2:
            data[at:at] = random.randbytes(random.randint(1, 8))
        elif how == 3:
            data[at:at] = data[at:upto] * random.randint(1, 20)
        elif how == 4:
            data[at:at] = random.choice([b"\r\n", b"\n", b"\0", b"0", b"-", b"9" * 40, b"\xff"])
        else:
            data[at:at] = random.choice(seeds)[: random.randint(0, 400)]
    return bytes(data)


def with_atheris(
    program: str, targets: list[Target], seconds: float, seed: int
) -> tuple[dict[str, int], list[dict[str, str]]]:
    """Let libFuzzer lead, one process a target; each gets its share of the time.

    ``program`` is run anew for each, with ``--target`` and ``--within-atheris``.
    """
    done: dict[str, int] = {}
    failures: list[dict[str, str]] = []
    for target in targets:
        share = max(1, round(seconds / len(targets)))
        with tempfile.TemporaryDirectory() as place:
            corpus = Path(place) / "corpus"
            corpus.mkdir()
            for number, data in enumerate(target.seeds):
                (corpus / str(number)).write_bytes(data)
            command = [sys.executable, "-c", INSTRUMENTED, program, "--target", target.name]
            limits = [f"-max_total_time={share}", f"-seed={seed}", f"-timeout={STALLED}"]
            ended = subprocess.run(
                [*command, "--within-atheris", *limits, str(corpus)],
                check=False,
                capture_output=True,
                text=True,
                env={**os.environ, "TMPDIR": place},  # libFuzzer ends without tidying up
            )
        runs = re.findall(r"^#(\d+)", ended.stderr, re.MULTILINE)
        done[target.name] = int(runs[-1]) if runs else 0
        if ended.returncode:
            failures.append({"target": target.name, "failed": ended.stderr[-2000:]})
    return done, failures


def within_atheris(target: Target, limits: list[str]) -> NoReturn:
    """Fuzz one target in this process; libFuzzer ends it."""
    import atheris

    def one(data: bytes) -> None:
        try:
            target.feed(data)
        except WinchkitError:
            return

    atheris.Setup([sys.argv[0], *limits], one)
    atheris.Fuzz()
    raise SystemExit(0)
