"""Feeds every parser with what nobody would send; prints JSON, exits 1 when one of them fails.

``python benchmarks/fuzz_parsers.py --minutes 60``: serial instruments (every device file), Modbus
registers (every device file), declarations, quantities and runs. Failed means: an exception that is
not one of winchkit's own, an input that takes longer than a second, a number that is no finite one
and has no flag. With atheris installed (``pip install atheris``) its coverage leads the way, else
valid inputs are changed at random; ``--seed`` brings the same inputs back.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import re
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from random import Random
from time import monotonic
from types import FrameType
from typing import NoReturn

from winchkit.catalog import find, folder, names
from winchkit.drivers.modbus.decoder import Decoder
from winchkit.drivers.reading import Quality
from winchkit.drivers.stream.decoder import Meaning
from winchkit.drivers.stream.parser import StreamParser
from winchkit.errors import WinchkitError
from winchkit.runs.read import read_run
from winchkit.schema.device import DeviceSpec
from winchkit.schema.read import read_any, read_device
from winchkit.schema.template import parts_of
from winchkit.units import UNITS, parse

HANG = 1.0
"""An input that takes longer hangs, s."""
INSTRUMENTED = """
import runpy, sys, atheris
with atheris.instrument_imports(include=["winchkit"]):
    sys.argv = sys.argv[1:]
    runpy.run_path(sys.argv[0], run_name="__main__")
"""
"""Runs this file so that atheris sees which lines an input reaches."""
ROUND = 200
"""Inputs a target gets in a row."""


class Failure(Exception):
    """A parser did what it must not."""


@dataclass(frozen=True)
class Target:
    """One parser; ``feed`` raises nothing but winchkit's own errors and Failure."""

    name: str
    feed: Callable[[bytes], None]
    seeds: tuple[bytes, ...]
    weight: float = 1.0
    """Share of the inputs: what reads files is slow."""


def main() -> int:
    """Fuzz for the time given."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--engine", choices=["auto", "atheris", "mutation"], default="auto")
    parser.add_argument("--target", help="only those whose name holds this")
    parser.add_argument("--within-atheris", action="store_true", help=argparse.SUPPRESS)
    options, limits = parser.parse_known_args()
    if limits and not options.within_atheris:
        parser.error(f"unknown: {' '.join(limits)}")
    with tempfile.TemporaryDirectory() as scratch:
        targets = [one for one in every(Path(scratch)) if (options.target or "") in one.name]
        if options.within_atheris:
            within_atheris(targets[0], limits)
        engine = options.engine
        if engine == "auto":
            engine = "atheris" if find_spec("atheris") else "mutation"
        run = with_atheris if engine == "atheris" else with_mutation
        done, failures = run(targets, 60.0 * options.minutes, options.seed)
    print(json.dumps({"engine": engine, "inputs": done, "failures": failures}, indent=1))
    return 1 if failures else 0


def every(scratch: Path) -> Iterator[Target]:
    """All parsers."""
    for name in names("devices"):
        device = read_device(find("devices", name))
        if device.stream is not None:
            yield stream_target(device)
        if device.modbus is not None:
            yield modbus_target(device)
    texts = tuple(path.read_bytes() for path in sorted(folder("devices").glob("*/device.toml")))
    yield Target("declaration", in_file(scratch / "x.toml", read_any), texts, 0.05)
    csv = b"# load_mass: 15 kg\ntime [s],motor_angle [rad],tension [N]\n0.0,0.0,147\n0.02,0.1,148\n"
    yield Target("run csv", in_file(scratch / "x.csv", read_run), (csv,), 0.05)
    yield Target("run mcap", in_file(scratch / "x.mcap", read_run), (b"\x89MCAP0\r\n",), 0.05)
    yield Target("quantity", quantity, (b"60 mm", b"-1.2e-5 1/K", b"0.5 m/s"))
    yield Target("template", template, (b"ST,{kind:2},{value:8}kg", b"{{{value}}}"))


def stream_target(device: DeviceSpec) -> Target:
    """A serial instrument: whatever comes, in whatever chunks."""
    spec = device.stream
    assert spec is not None
    example = bytes.fromhex(spec.example) if spec.binary else spec.example.encode("latin-1")
    end = spec.terminator.encode("latin-1")
    words = [text.replace("*", " ").encode("latin-1") for text in (*spec.replies, *spec.words)]

    def feed(data: bytes) -> None:
        if not data:
            return
        whole, parts = StreamParser(device), StreamParser(device)
        for parser in (whole, parts):
            if data[0] & 1:
                parser.begin()
        said = [item.heard for item in whole.feed(data[1:])]
        step = 1 + (data[0] >> 1) % 16
        again = []
        for at in range(1, len(data), step):
            again += [item.heard for item in parts.feed(data[at : at + step])]
        if repr(said) != repr(again) or whole.counts != parts.counts:
            raise Failure("chunks matter")
        for heard in said:
            if heard.decoded is not None and heard.meaning is Meaning.READING:
                sound(heard.decoded.value, heard.decoded.quality)

    seeds = tuple(b"\x01" + text + end for text in (example, example + end + example, *words))
    return Target(f"stream {device.name}", feed, seeds)


def modbus_target(device: DeviceSpec) -> Target:
    """A Modbus instrument: whatever stands in its registers."""
    decoder = Decoder(device)
    own = decoder.spec.read.count
    block = decoder.spec.status_read
    count = own + (block.count if block else 0)

    def feed(data: bytes) -> None:
        padded = data[: 2 * count].ljust(2 * count, b"\0")
        words = [int.from_bytes(padded[at : at + 2], "big") for at in range(0, 2 * count, 2)]
        decoded = decoder.decode(words[:own], words[own:])
        sound(decoded.value, decoded.quality)

    return Target(f"modbus {device.name}", feed, (bytes(2 * count), b"\x7f\xff" * count))


def sound(value: float, quality: Quality) -> None:
    """A number exactly where the flags allow one."""
    if math.isfinite(value) != quality.usable:
        raise Failure(f"{value} is flagged '{quality}'")


def in_file(path: Path, read: Callable[[str | Path], object]) -> Callable[[bytes], None]:
    """A parser of files as one of bytes."""

    def feed(data: bytes) -> None:
        path.write_bytes(data)
        read(path)

    return feed


def quantity(data: bytes) -> None:
    """A quantity of every dimension."""
    text = data.decode("utf-8", "replace")
    for dimension in UNITS:
        try:
            parse(text, dimension)
        except WinchkitError:
            continue


def template(data: bytes) -> None:
    """A template of a line."""
    parts_of(data.decode("utf-8", "replace"))


def try_one(target: Target, data: bytes) -> str | None:
    """What goes wrong with one input, None where nothing does."""
    signal.setitimer(signal.ITIMER_REAL, HANG)
    try:
        target.feed(data)
    except WinchkitError:
        return None
    except Exception as error:  # noqa: BLE001 - any other exception is what is looked for
        return f"{type(error).__name__}: {error}"
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    return None


def hung(_signal: int, _frame: FrameType | None) -> None:
    """Interrupt an input that takes too long."""
    raise Failure(f"takes longer than {HANG:g} s")


def with_mutation(
    targets: list[Target], seconds: float, seed: int
) -> tuple[dict[str, int], list[dict[str, str]]]:
    """Change valid inputs at random, in turn for every target."""
    signal.signal(signal.SIGALRM, hung)
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
    targets: list[Target], seconds: float, seed: int
) -> tuple[dict[str, int], list[dict[str, str]]]:
    """Let libFuzzer lead, one process a target; each gets its share of the time."""
    done: dict[str, int] = {}
    failures: list[dict[str, str]] = []
    for target in targets:
        share = max(1, round(seconds / len(targets)))
        with tempfile.TemporaryDirectory() as place:
            corpus = Path(place) / "corpus"
            corpus.mkdir()
            for number, data in enumerate(target.seeds):
                (corpus / str(number)).write_bytes(data)
            command = [sys.executable, "-c", INSTRUMENTED, __file__, "--target", target.name]
            limits = [f"-max_total_time={share}", f"-seed={seed}", f"-timeout={HANG:g}"]
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


if __name__ == "__main__":
    sys.exit(main())
