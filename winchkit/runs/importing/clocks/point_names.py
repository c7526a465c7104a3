"""Rows of two files that are of one point by its name, in any order: ``P001;x;y;z``."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from winchkit.errors import Fault, RunError
from winchkit.runs.importing.streams import Streams

_SHARED = 0.5
"""Share of the names of the shorter file that the other one has, at least (rule of thumb): with
fewer the two are lists of different points."""
_LEADING = re.compile(r"(?<![\d.])0+(?=\d)")
"""Zeros before a number: P001 is P1."""
_SHOWN = 6
"""Names listed in a text."""


def by_names(first: Streams, other: Streams) -> tuple[Streams, Streams, str] | None:
    """Rows of both files whose names both have, and a text; None without any; raises RunError."""
    if len(first.streams) != 1 or len(other.streams) != 1:
        return None
    pairs = list(product(_of_samples(first), _of_samples(other)))
    pairs += [(_plain(own), _plain(theirs)) for own, theirs in pairs]
    shared = [(len(set(own) & set(theirs) - {""}), own, theirs) for own, theirs in pairs]
    count, own, theirs = max(shared, key=lambda item: item[0], default=(0, [], []))
    if not count > max(1.0, _SHARED * min(len(own), len(theirs))):
        return None
    rows, others = _places(first, own), _places(other, theirs)
    both = [name for name in rows if name in others]
    text = f"joined by the names of {len(both)} points"
    for streams, here, there in ((first, rows, others), (other, others, rows)):
        if alone := [name for name in here if name not in there]:
            more = "" if len(alone) <= _SHOWN else f" and {len(alone) - _SHOWN} others"
            listed = ", ".join(alone[:_SHOWN]) + more
            text += f"; {listed} of {streams.path} left out, which the other file does not have"
    return (
        _at(first, np.array([rows[name] for name in both])),
        _at(other, np.array([others[name] for name in both])),
        text,
    )


def _plain(names: Sequence[str]) -> list[str]:
    """Names without capitals and leading zeros, which two programs write differently."""
    return [_LEADING.sub("", name.casefold()) for name in names]


def unlike_names(first: Streams, other: Streams) -> str:
    """Words for files that are not joined by the names of points which both have; else empty."""
    if not first.names or not other.names:
        return ""
    return f"; by names such as '{first.names[0][0]}' and '{other.names[0][0]}' they are not"


def _of_samples(streams: Streams) -> list[list[str]]:
    """Columns of names, of the samples that are used."""
    (stream,) = streams.streams
    return [[names[row] for row in stream.rows.tolist()] for names in streams.names]


def _places(streams: Streams, names: Sequence[str]) -> dict[str, int]:
    """Place of each name among the samples; raises RunError for one that stands in several."""
    (stream,), counts = streams.streams, Counter(names)
    faults = [
        Fault(
            f"the point '{name}' stands in {counts[name]} rows, one of which is joined: give each "
            "measurement a name of its own, or leave one",
            streams.path,
            streams.line_of(int(stream.rows[names.index(name)])),
        )
        for name in counts
        if name and counts[name] > 1
    ]
    if faults:
        raise RunError(faults)
    return {name: place for place, name in enumerate(names) if name}


def _at(streams: Streams, places: NDArray[np.intp]) -> Streams:
    """Some samples of a file with one stream, in another order."""
    (stream,) = streams.streams
    return replace(streams, streams=(stream.at(places),))
