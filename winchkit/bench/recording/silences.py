"""Silences of the sources of a log: drives and instruments whose samples cease."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from winchkit.runs.align import patience_of
from winchkit.runs.layout import Layout, Samples


@dataclass
class _Silence:
    """Intervals without a sample that are longer than rows wait for one, of one source."""

    times: int = 0
    longest: float = 0.0
    """s."""
    now: float = 0.0
    """s; 0 while samples come."""


class Silences:
    """Notes when the samples of a source cease, and when they come again."""

    def __init__(self, layout: Layout) -> None:
        """Every source is awaited from the beginning of the log on."""
        self._longest = {source.topic: patience_of(source) for source in layout.sources}
        self._last = dict.fromkeys(self._longest, layout.rule.opened)
        self._silences = {topic: _Silence() for topic in self._longest}

    def note(self, pieces: Mapping[str, Samples], now: float) -> None:
        """Take what has arrived until ``now`` (s)."""
        for topic, silence in self._silences.items():
            arrived = pieces[topic].received if topic in pieces else np.empty(0)
            longest, last = self._longest[topic], self._last[topic]
            if len(arrived):
                steps = np.diff(arrived, prepend=last)
                over = steps[steps > longest]
                # The first of them may be the one that was under way.
                silence.times += len(over) - bool(silence.now and len(over) and over[0] == steps[0])
                silence.longest = max(silence.longest, *over, 0.0)
                self._last[topic] = last = max(last, float(arrived[-1]))
            silent = now - last if now - last > longest else 0.0
            silence.times += bool(silent and (len(arrived) or not silence.now))
            silence.now, silence.longest = silent, max(silence.longest, silent)

    def counted(self) -> dict[str, dict[str, Any]]:
        """Number, longest and present silence of each source (``A.cell``) that had one."""
        return {
            topic[1:].replace("/", "."): asdict(silence)
            for topic, silence in self._silences.items()
            if silence.times
        }
