"""What is fuzzed: every parser of bytes that come from outside, with valid inputs to begin with."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from winchkit.calibration.cell.files import read_points
from winchkit.catalog import find, folder, names
from winchkit.drivers.modbus.decoder import RegisterDecoder
from winchkit.drivers.modbus.frames import AnswerGate, Framing, crc16
from winchkit.drivers.modbus.tcp_frames import TcpAnswerGate
from winchkit.drivers.reading import Quality
from winchkit.drivers.stream.decoder import FrameType
from winchkit.drivers.stream.parser import StreamParser
from winchkit.errors import WinchkitError
from winchkit.runs.info import info_of
from winchkit.runs.layout import Layout, RowRule, SignalSource, SourceSamples, SourceSignal
from winchkit.runs.read import read_log, read_run
from winchkit.runs.recording.open_log import open_log
from winchkit.runs.recover import recover
from winchkit.schema.devices.device import DeviceSpec
from winchkit.schema.eds.eds import read_eds_text
from winchkit.schema.read import read_any, read_device
from winchkit.schema.template import parts_of
from winchkit.units import UNITS, parse


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


def every(scratch: Path) -> Iterator[Target]:
    """All parsers; those of files work in ``scratch``."""
    for name in names("devices"):
        device = read_device(find("devices", name))
        if device.stream is not None:
            yield stream_target(device)
        if device.modbus is not None:
            yield modbus_target(device)
    yield from gate_targets()
    yield from file_targets(scratch)
    yield Target("quantity", quantity, (b"60 mm", b"-1.2e-5 1/K", b"0.5 m/s"))
    yield Target("template", template, (b"ST,{kind:2},{value:8}kg", b"{{{value}}}"))


def file_targets(scratch: Path) -> Iterator[Target]:
    """Declarations, object dictionaries, calibration points, runs, logs whole and cut off."""
    texts = tuple(path.read_bytes() for path in sorted(folder("devices").glob("*/device.toml")))
    yield Target("declaration", in_file(scratch / "x.toml", read_any), texts, 0.05)
    eds = sorted(folder("devices").glob("*/*.eds"), key=lambda path: path.stat().st_size)
    text = eds[0].read_bytes()
    yield Target("eds", in_file(scratch / "x.eds", read_eds_text), (text, text[:2000]), 0.05)
    points = b"load [kg],indicated [N],series\n0,0.1,1\n5,49.0,1\n10,98.0,1\n"
    yield Target("points", in_file(scratch / "p.csv", read_points), (points,), 0.3)
    csv = b"# load_mass: 15 kg\ntime [s],motor_angle [rad],tension [N]\n0.0,0.0,147\n0.02,0.1,148\n"
    yield Target("run csv", in_file(scratch / "x.csv", read_run), (csv,), 0.05)
    for kind in ("mcap", "csv"):
        log = (a_log(scratch / f"seed.{kind}"),)
        yield Target(f"log {kind}", in_file(scratch / f"l.{kind}", log_info), log, 0.05)
        yield Target(f"recover {kind}", in_file(scratch / f"r.{kind}", recovered), log, 0.05)


def a_log(path: Path) -> bytes:
    """A short log of one winch, as the recorder writes it."""
    motor = SignalSource("/A/drive", (SourceSignal("motor_angle", "rad", "motor_angle"),), 0.1)
    cell = SignalSource(
        "/A/cell", (SourceSignal("tension", "N", "tension"), SourceSignal("quality", "1")), 0.1
    )
    layout = Layout((motor, cell), RowRule("/A/cell", 0.0), 1_700_000_000_000_000_000)
    times = np.arange(4) / 100
    values = np.stack([times, times], axis=1)
    log = open_log(path, layout, {"load_mass": "15 kg"}, None)
    log.write(
        {
            "/A/drive": SourceSamples(times, times, values[:, :1]),
            "/A/cell": SourceSamples(times, times, values),
        },
        times[-1],
    )
    log.close({})
    return path.read_bytes()


def log_info(path: str | Path) -> None:
    """What ``winchkit log info`` reads."""
    info_of(read_log(path))


def recovered(path: str | Path) -> None:
    """What is saved of a damaged log; what was saved of an MCAP log is whole."""
    there = Path(path)
    saved = recover(there, there.with_name(f"saved{there.suffix}")).output
    if there.suffix == ".mcap" and not recover(saved, there.with_name("again.mcap")).was_whole:
        raise Failure("what was recovered is not whole")
    with suppress(WinchkitError):
        read_log(saved)


def gate_targets() -> Iterator[Target]:
    """What distinguishes the answer from all else on a Modbus line: on a serial one, over TCP."""
    body = bytes((1, 3, 0, 5, 0, 4))
    answer = bytes((1, 3, 8)) + bytes(range(8))
    yield gate_target("rtu", body + crc16(body), answer + crc16(answer))
    head = bytes((0, 7, 0, 0, 0))
    yield gate_target("tcp", head + b"\6" + body, head + b"\x0b" + answer)


def gate_target(framing: Framing, request: bytes, answer: bytes) -> Target:
    """Whatever comes after a request: what is let through has the form of its answer."""

    def feed(data: bytes) -> None:
        gate = AnswerGate() if framing == "rtu" else TcpAnswerGate()
        step = 1 + data[0] % 16 if data else 1
        for _ in range(2):
            gate.sent(request)
            for at in range(1, len(data), step):
                found = gate.received(data[at : at + step])
                if found:
                    answers_it(framing, found)
            gate.expire()
            gate.events()

    def answers_it(framing: Framing, found: bytes) -> None:
        body = found[:-2] if framing == "rtu" else found[6:]
        refused = len(body) == 3 and body[:2] == b"\1\x83"
        if not refused and (len(body) != 11 or body[:3] != b"\1\3\x08"):
            raise Failure(f"{found.hex()} was taken for the answer")
        if framing == "rtu" and crc16(body) != found[-2:]:
            raise Failure(f"{found.hex()} has a wrong check sum")
        if framing == "tcp" and found[:4] != request[:4]:
            raise Failure(f"{found.hex()} is of another transaction")

    refusal = bytes((1, 0x83, 2))
    whole = refusal + crc16(refusal) if framing == "rtu" else request[:5] + b"\3" + refusal
    seeds = (answer, request + answer, whole, answer[:4] + answer)
    return Target(f"gate {framing}", feed, tuple(b"\x0f" + seed for seed in seeds))


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
            if heard.decoded is not None and heard.meaning is FrameType.READING:
                sound(heard.decoded.value, heard.decoded.quality)

    seeds = tuple(b"\x01" + text + end for text in (example, example + end + example, *words))
    return Target(f"stream {device.name}", feed, seeds)


def modbus_target(device: DeviceSpec) -> Target:
    """A Modbus instrument: whatever stands in its registers."""
    decoder = RegisterDecoder(device)
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
