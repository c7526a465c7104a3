"""What an MCAP file holds, as far as it can be read: declarations, metadata and messages."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from winchkit.runs.layout import Layout, Samples, Source
from winchkit.runs.mcap_layout import CDR, MARK
from winchkit.runs.mcap_records import (
    Body,
    Damage,
    Messages,
    Op,
    Record,
    chunk_content,
    is_intact,
    records,
)

__all__ = ["McapContent", "read_content", "samples_of"]


@dataclass
class McapContent:
    """Everything of a file that counts here."""

    topics: dict[int, str] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    """Metadata records by name."""
    messages: dict[str, list[Messages]] = field(default_factory=dict)
    """By topic, in the order of the file."""
    complete: bool = False
    damage: str = ""
    """Why the reading ended before the file did, where it was not merely cut off."""

    def count(self, topic: str) -> int:
        """Messages of a topic."""
        return sum(len(batch.log_times) for batch in self.messages.get(topic, ()))


def read_content(data: bytes) -> McapContent:
    """Read an MCAP file that begins with its mark. Raises nothing: damage is told in the result."""
    content = McapContent()
    try:
        for item in records(data, len(MARK)):
            if isinstance(item, Record) and item.op == Op.FOOTER:
                content.complete = data[item.end :] == MARK
                break
            if isinstance(item, Record) and item.op == Op.DATA_END and not is_intact(item, data):
                content.damage = "the checksum of its data is wrong"
                break
            _take(content, item)
    except Damage as error:
        content.damage = str(error)
    return content


def _take(content: McapContent, item: Record | Messages) -> None:
    if isinstance(item, Messages):
        if item.channel in content.topics:
            content.messages.setdefault(content.topics[item.channel], []).append(item)
    elif item.op == Op.CHUNK:
        packed = chunk_content(item.body)
        end = 0
        for inner in records(packed):
            _take(content, inner)
            end = inner.end
        if end != len(packed):
            raise Damage("a chunk ends within a record")
    elif item.op == Op.CHANNEL:
        fields = Body(item.body)
        number = fields.number(2)
        fields.number(2)
        content.topics[number] = fields.text()
    elif item.op == Op.METADATA:
        fields = Body(item.body)
        name = fields.text()
        content.metadata[name] = fields.texts()


def samples_of(content: McapContent, source: Source, layout: Layout) -> Samples:
    """Samples of a source; raises Damage where its messages are not what the layout says."""
    size = len(CDR) + 8 * len(source.signals)
    pieces = []
    for batch in content.messages.get(source.topic, ()):
        if batch.data.shape[1] != size:
            raise Damage(f"a message of {source.topic} has {batch.data.shape[1]} bytes, not {size}")
        values = np.ascontiguousarray(batch.data[:, len(CDR) :]).view("<f8")
        times = _seconds(batch.log_times, layout)
        pieces.append(Samples(times, _seconds(batch.publish_times, layout), values))
    return Samples.joined(pieces, len(source.signals))


def _seconds(stamps: NDArray[np.uint64], layout: Layout) -> NDArray[np.float64]:
    """On the bench's clock."""
    return (stamps.astype(np.int64) - layout.clock_offset) / 1e9
