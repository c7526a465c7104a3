"""The recorder's MCAP writer beside the mcap library's: CPU for the same messages, in one run.

``python benchmarks/mcap_writers.py --seconds 20``: eight drives at 1 kHz, one message per drive and
cycle, a compressed chunk every quarter of a second. The library is given messages that are encoded
already, the recorder's writer encodes them itself. Turns alternate; prints JSON with the CPU of
each as a share of one core and their ratio. See docs/decisions/0020-own-mcap-writer.md.
"""

from __future__ import annotations

import argparse
import io
import json
import statistics
import time
from collections.abc import Callable

import numpy as np
from mcap.writer import Writer
from numpy.typing import NDArray

from winchkit.runs.formats.mcap_file import CDR, McapFile
from winchkit.runs.formats.mcap_records import pack_messages

DRIVES, RATE, CHUNK, SIGNALS = 8, 1000, 0.25, 5

Block = tuple[NDArray[np.int64], NDArray[np.float64]]
"""Times of one drive's messages in a chunk, ns, shape (n,), and values, shape (n, SIGNALS)."""


def blocks(random: np.random.Generator, number: int) -> list[Block]:
    """One chunk: a block for each drive; noise in every bit, so that nothing compresses well."""
    count = round(RATE * CHUNK)
    times = ((number * count + np.arange(count)) * 1_000_000_000) // RATE
    return [(times, random.standard_normal((count, SIGNALS))) for _ in range(DRIVES)]


def of_recorder(chunks: list[list[Block]]) -> tuple[float, int]:
    """CPU time of the recorder's writer, s, and bytes."""
    stream = io.BytesIO()
    begun = time.process_time()
    file = McapFile(stream, "benchmark", "winchkit")
    for number in range(1, DRIVES + 1):
        file.put_schema(number, f"drive{number}", "ros2msg", b"float64 value")
        file.put_channel(number, number, f"/{number}/drive", "cdr")
    first = 0
    for chunk in chunks:
        content = []
        for number, (times, values) in enumerate(chunk, start=1):
            data = np.empty((len(values), len(CDR) + 8 * SIGNALS), np.uint8)
            data[:, : len(CDR)] = np.frombuffer(CDR, np.uint8)
            data[:, len(CDR) :] = values.view(np.uint8)
            content.append(pack_messages(number, first, times, times, data))
        file.put_chunk(b"".join(content))
        first += len(chunk[0][0])
    file.finish()
    return time.process_time() - begun, stream.tell()


def of_library(chunks: list[list[Block]]) -> tuple[float, int]:
    """CPU time of ``mcap.writer.Writer``, s, and bytes; encoding is not counted."""
    encoded = [
        [(times.tolist(), [CDR + row.tobytes() for row in values]) for times, values in chunk]
        for chunk in chunks
    ]
    stream = io.BytesIO()
    size = round(DRIVES * RATE * CHUNK) * (31 + len(CDR) + 8 * SIGNALS)
    begun = time.process_time()
    writer = Writer(stream, chunk_size=size)
    writer.start("benchmark", "winchkit")
    channels = [
        writer.register_channel(
            f"/{number}/drive",
            "cdr",
            writer.register_schema(f"drive{number}", "ros2msg", b"float64 value"),
        )
        for number in range(1, DRIVES + 1)
    ]
    sequence = 0
    for chunk in encoded:
        for channel, (times, messages) in zip(channels, chunk, strict=True):
            for k, (stamp, data) in enumerate(zip(times, messages, strict=True)):
                writer.add_message(channel, stamp, data, stamp, sequence + k)
        sequence += len(chunk[0][0])
    writer.finish()
    return time.process_time() - begun, stream.tell()


def main() -> None:
    """Measure in alternating turns."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=20.0, help="of recording in each turn")
    parser.add_argument("--turns", type=int, default=5)
    options = parser.parse_args()
    random = np.random.default_rng(1)
    chunks = [blocks(random, number) for number in range(round(options.seconds / CHUNK))]
    writers: dict[str, Callable[[list[list[Block]]], tuple[float, int]]] = {
        "recorder": of_recorder,
        "library": of_library,
    }
    spent: dict[str, list[float]] = {name: [] for name in writers}
    size = {}
    for _ in range(options.turns):
        for name, write in writers.items():
            used, size[name] = write(chunks)
            spent[name].append(used / options.seconds)
    shares = {name: statistics.median(values) for name, values in spent.items()}
    found = {
        "schema": 1,
        "core_share": {name: round(value, 4) for name, value in shares.items()},
        "library_over_recorder": round(shares["library"] / shares["recorder"], 2),
        "bytes": size,
    }
    print(json.dumps(found))


if __name__ == "__main__":
    main()
