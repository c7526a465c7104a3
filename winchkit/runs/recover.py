"""Recovery of the complete records of a file that was cut off or damaged."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator
from dataclasses import dataclass
from dataclasses import replace as replaced
from pathlib import Path

from winchkit.arguments import path_of
from winchkit.errors import Fault, RunError, UsageError
from winchkit.regular_file import refuse_existing
from winchkit.runs.files import write_whole
from winchkit.runs.formats.csv_read import read_bytes
from winchkit.runs.formats.mcap_file import COUNTERS, EVENTS, PROFILE, McapFile
from winchkit.runs.formats.mcap_read import read_content
from winchkit.runs.formats.mcap_records import (
    MARK,
    Damage,
    McapRecord,
    MessageBlock,
    Op,
    RecordBody,
    is_intact,
    joint_after,
    next_chunk,
    records,
    whole_chunk,
)
from winchkit.runs.run_writer import CSV_MARK, EVENT_MARK

_COPIED = (Op.SCHEMA, Op.CHANNEL, Op.METADATA)
_NO_SAMPLES = (EVENTS, COUNTERS)
_CSV_BEGIN = f"{CSV_MARK}\n".encode()


@dataclass(frozen=True)
class Recovered:
    """Result of a recovery."""

    output: str
    kept: int
    """Messages, or rows of a CSV file."""
    dropped_pieces: int
    """Number of damaged chunks or rows, which were left out."""
    dropped_bytes: int
    was_whole: bool
    """Whether there was nothing to recover."""
    further: tuple[Recovered, ...] = ()
    """Of the other logs in the file, where several were joined (``cat``), each in a file."""


def recovered_path(path: Path) -> Path:
    """``lift.mcap`` becomes ``lift.recovered.mcap``."""
    return path.with_suffix(f".recovered{path.suffix}")


def recover(
    source: str | Path, path: str | Path | None = None, *, replace: bool = False
) -> Recovered:
    """Write the complete records of a file to another, complete one.

    Logs that were joined in one file (``cat``) are written to a file each: ``lift.recovered.mcap``,
    ``lift.recovered-2.mcap``.

    Parameters
    ----------
    source : str or Path
        MCAP or CSV file of winchkit, cut off at any position or damaged.
    path : str or Path, optional
        By default ``lift.recovered.mcap`` for ``lift.mcap``.
    replace : bool
        Write over a file of that name.

    Returns
    -------
    Recovered
        Numbers of records saved and left out, of the first log and of ``further`` ones.

    Raises
    ------
    RunError
        For a file that is neither MCAP nor CSV, and one without a complete sample.
    FileError
        Where the output cannot be written.
    UsageError
        Where the output is the file itself, or exists and is not to be replaced.
    """
    source = path_of(source, "source")
    target = path_of(path) if path else recovered_path(source)
    suffix = source.suffix.lower()
    if target.resolve() == source.resolve():
        raise UsageError(f"{target}: would replace the file that is to be recovered; name another")
    refuse_existing(target, replace)
    data = read_bytes(source, may_be_empty=True)
    if suffix == ".mcap":
        _require_mcap(data, source)
        logs = [(saved, found) for saved, found in map(_mcap, _mcap_logs(data)) if _samples(saved)]
    elif suffix == ".csv":
        logs = [(saved, found) for saved, found in map(_csv, _csv_logs(data)) if found.kept]
    else:
        raise RunError(Fault(f"'{suffix}' is no format of a log; use .mcap or .csv", str(path)))
    if not logs:
        message = "holds no complete sample; there is nothing to recover"
        raise RunError(Fault(message, str(path)))
    targets = [target, *(target.with_stem(f"{target.stem}-{n + 2}") for n in range(len(logs) - 1))]
    for one in targets[1:]:
        refuse_existing(one, replace)
    for one, (saved, _) in zip(targets, logs, strict=True):
        write_whole(one, saved)
    first, *further = (
        replaced(found, output=str(one)) for one, (_, found) in zip(targets, logs, strict=True)
    )
    return replaced(first, further=tuple(further))


def _require_mcap(data: bytes, source: Path) -> None:
    if not data.startswith(MARK) and not MARK.startswith(data):
        message = "is not an MCAP file: it does not start with its magic bytes"
        raise RunError(Fault(message, str(source)))


def _mcap_logs(data: bytes) -> Iterator[bytes]:
    """The logs that were joined in one file."""
    start, end = 0, joint_after(data, 1)
    while end < len(data):
        yield data[start:end]
        start, end = end, joint_after(data, end + 1)
    yield data[start:]


def _csv_logs(data: bytes) -> Iterator[bytes]:
    """The logs that were joined in one file; the last line of each but the last may be cut."""
    first, *others = data.split(_CSV_BEGIN)
    if first or not others:
        yield first
    for rest in others:
        yield _CSV_BEGIN + rest


def _mcap(data: bytes) -> tuple[bytes, Recovered]:
    stream = io.BytesIO()
    file = McapFile(stream, PROFILE, "winchkit recover")
    kept = damaged = end = 0
    closed = intact = False
    for item in _whole(data):
        damaged += item.offset > max(end, len(MARK))
        end = item.end
        if isinstance(item, MessageBlock):
            file.put_messages(item, data[item.offset : item.end])
            kept += len(item.log_times)
        elif item.op in _COPIED:
            readable = _is_readable(item)
            damaged += not readable
            if readable:
                file.put(item.op, bytes(item.body))
        elif item.op == Op.CHUNK:
            content = whole_chunk(item)
            if content is None:
                damaged += 1
            else:
                file.put_chunk(content)
                kept += sum(
                    len(m.log_times) for m in records(content) if isinstance(m, MessageBlock)
                )
        elif item.op == Op.DATA_END:
            closed, intact = True, is_intact(item, data)
            break
    file.finish()
    whole = intact and not damaged and data.endswith(MARK)
    lost = 0 if closed else len(data) - max(end, min(len(data), len(MARK)))
    return stream.getvalue(), Recovered("", kept, damaged, lost, whole)


def _samples(saved: bytes) -> int:
    """Number of messages that are samples, and no event or counters."""
    content = read_content(saved)
    return sum(content.count(topic) for topic in content.messages if topic not in _NO_SAMPLES)


def _whole(data: bytes) -> Iterator[McapRecord | MessageBlock]:
    """All complete records; after damage the search continues at the next complete chunk."""
    at = len(MARK)
    while at < len(data):
        try:
            for item in records(data, at):
                yield item
                at = item.end
                if isinstance(item, McapRecord) and item.op == Op.DATA_END:
                    return
        except Damage:
            pass
        at = next_chunk(data, at + 1)


def _is_readable(item: McapRecord) -> bool:
    """Whether a declaration or metadata can be read."""
    fields = RecordBody(item.body)
    try:
        if item.op == Op.METADATA:
            fields.text()
            fields.texts()
        else:
            fields.take(2 if item.op == Op.SCHEMA else 4)
            fields.text()
            fields.text()
            fields.take(fields.number(4))
    except Damage:
        return False
    return True


def _csv(data: bytes) -> tuple[bytes, Recovered]:
    """Complete lines: comments, header, and rows of numbers with increasing time."""
    lines = data.split(b"\n")
    # Text after the last line feed was cut off: a number there may lack digits.
    cut = lines.pop()
    kept: list[bytes] = []
    rows = dropped = 0
    header: list[bytes] | None = None
    time_at, last = 0, -math.inf
    for line in lines:
        text = line.strip()
        if header is None:
            if b"\0" in line:
                dropped += 1
                continue
            if text and not text.startswith(b"#"):
                header = text.split(b",")
                time_at = next((n for n, c in enumerate(header) if c.startswith(b"time")), -1)
            kept.append(line)
            continue
        if text.startswith(EVENT_MARK.encode()) and b"\0" not in text:
            kept.append(line)
            continue
        numbers = _numbers(text, len(header))
        time = numbers[time_at] if numbers and time_at >= 0 else math.inf
        if numbers is None or (time_at >= 0 and not time > last):
            dropped += bool(text)
            continue
        last = time if time_at >= 0 else last
        rows += 1
        kept.append(line)
    saved = b"".join(line + b"\n" for line in kept)
    return saved, Recovered("", rows, dropped, len(cut), not cut and not dropped)


def _numbers(line: bytes, width: int) -> list[float] | None:
    """A row's numbers, NaN for an empty cell; None for an invalid row."""
    cells = line.split(b",")
    if len(cells) != width:
        return None
    try:
        return [float(cell) if cell.strip() else math.nan for cell in cells]
    except ValueError:
        return None
