"""Choice of the columns of each channel, for one winch or several."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from winchkit.runs.importing.assignment import ChannelCandidate, Choice, Question
from winchkit.runs.importing.names import words_of
from winchkit.runs.importing.table import FileColumn
from winchkit.schema.mapping import DATE

_SIDES = ({"left", "right"}, {"links", "rechts"}, {"gauche", "droite"}, {"front", "rear"})
_MOVING = ("motor_angle", "motor_velocity", "motor_torque")
_LINEAR = ("position", "velocity", "force")
_SINGLE = ("motor_angle", "motor_torque", "tension", "cable_length", "load", "position", "force")
"""Channels whose column is asked for where several fit equally well; others are left out."""
FEWEST = 20
"""Values of a column below which that they are equal or increase evenly may be chance."""


def choose_channels(
    others: Sequence[ChannelCandidate], choice: Choice, without: Collection[str]
) -> None:
    """Choose one column for each channel of each winch.

    What the user says of a column of one winch holds for those of the others that are named alike.
    """
    given = [item for item in choice.chosen if item.channel not in {"time", DATE}]
    # A channel without a winch's name that the user gives: the file is of one winch.
    is_of_one = any(item.channel in (*_SINGLE, *_MOVING, *_LINEAR) for item in given)
    labels = () if is_of_one else _winch_labels(others, given)
    by_channel: dict[str, list[ChannelCandidate]] = {}
    for item in others:
        label = _label_of(item, labels)
        channel = _channel_as_given(item, label, given) if label else item.channel
        by_channel.setdefault(f"{label}.{channel}" if label else channel, []).append(item)
    _leave_constant(by_channel, given, choice)
    none = {stem_of(item.column, name) for name in without for item in by_channel.get(name, ())}
    by_channel = {name: items for name, items in by_channel.items() if items}
    labelled = {name.rpartition(".")[2] for name in by_channel if "." in name}
    asked: set[tuple[tuple[str, ...], ...]] = set()
    for channel, items in by_channel.items():
        reason = ""
        if labels and channel in labelled:
            reason = f"of none of the winches {', '.join(labels)}"
        elif any(item.channel == channel for item in given):
            reason = f"{channel} is given otherwise"
        elif none.intersection(stem_of(item.column, channel) for item in items):
            reason = "has no column, by --column"
        if reason:
            choice.leave(items, reason)
            continue
        items.sort(key=lambda item: item.order)
        best = [item for item in items if item.order == items[0].order]
        base = channel.rpartition(".")[2]
        alike = [item for item in items if _is_as_given(item, channel, given)]
        if len(alike) == 1:
            items.remove(alike[0])
            items.insert(0, alike[0])
        elif len(best) > 1 and (same := _named_alike(best, given)) is not None:
            items.remove(same)
            items.insert(0, same)
        elif len(best) > 1:
            names = [item.column.source for item in best]
            # The answer for one winch holds for the columns of the others that are named alike.
            stems = tuple(stem_of(item.column, channel) for item in best)
            if base in _SINGLE and stems not in asked:
                asked.add(stems)
                choice.questions.append(
                    Question(
                        f"which column is {channel}? {' and '.join(map(repr, names))} fit equally",
                        tuple(f'--column "{channel}={name}"' for name in (*names, "")),
                    )
                )
            choice.leave(items, f"one of several: --column {channel}=…")
            continue
        choice.chosen.append(replace(items[0], channel=channel))
        choice.leave(items[1:], f"'{items[0].column.source}' is {channel}")


def stem_of(column: FileColumn, channel: str) -> tuple[str, ...]:
    """Words of a column's name, with ``*`` for the name of its winch, as ``channel`` has it."""
    label = channel.rpartition(".")[0]
    words = words_of(" ".join((*column.labels, column.name))).split()
    return tuple("*" if label and word == label else word for word in words)


def _is_as_given(item: ChannelCandidate, channel: str, given: Sequence[ChannelCandidate]) -> bool:
    """Whether a column is named like the one that the user gives for the channel of a winch."""
    base = channel.rpartition(".")[2]
    label = channel.rpartition(".")[0]
    return bool(label) and any(
        other.channel.rpartition(".")[2] == base
        and "." in other.channel
        and stem_of(other.column, other.channel) == stem_of(item.column, channel)
        for other in given
    )


def _channel_as_given(item: ChannelCandidate, label: str, given: Sequence[ChannelCandidate]) -> str:
    """Channel that the user gives to a column of another winch that is named alike."""
    stem = stem_of(item.column, f"{label}.{item.channel}")
    for other in given:
        winch, _, base = other.channel.rpartition(".")
        if winch and stem_of(other.column, other.channel) == stem:
            return base
    return item.channel


def _leave_constant(
    by_channel: Mapping[str, list[ChannelCandidate]],
    given: Sequence[ChannelCandidate],
    choice: Choice,
) -> None:
    """Leave out constant columns of a motor that moves: a flag, a set point, or another joint."""
    for winch in dict.fromkeys(name.rpartition(".")[0] for name in by_channel):
        names = _MOVING if not {f"{winch}.position", "position"} & set(by_channel) else _LINEAR
        own = [f"{winch}.{base}" if winch else base for base in names]
        moving = [item for name in own[:2] for item in by_channel.get(name, ())]
        moving += [item for item in given if item.channel in own[:2]]
        if all(_is_constant(item) for item in moving):
            continue
        for name in own:
            constant = [item for item in by_channel.get(name, ()) if _is_constant(item)]
            for item in constant:
                by_channel[name].remove(item)
            choice.leave(constant, "constant while it moves")


def _is_constant(item: ChannelCandidate) -> bool:
    values = item.column.known
    return len(values) >= FEWEST and bool(np.all(values == values[0]))


def _named_alike(
    best: Sequence[ChannelCandidate], given: Sequence[ChannelCandidate]
) -> ChannelCandidate | None:
    """Of equal candidates the one that has the most words of the columns that the user gives."""
    words = {word for item in given for word in _words(item)}
    shared = [len(words & set(_words(item))) for item in best]
    most = max(shared)
    if not most or shared.count(most) > 1:
        return None
    return best[shared.index(most)]


def _winch_labels(
    others: Sequence[ChannelCandidate], given: Sequence[ChannelCandidate]
) -> tuple[str, ...]:
    """Words that distinguish equal columns of several winches: ``1 2 3``, ``a b``; else none.

    None where two sets of labels are equally large, as in ``a1 a2 c1 c2``.
    """
    for channel in _SINGLE:
        items = sorted((i for i in others if i.channel == channel), key=lambda i: i.order)
        best = [item for item in items if item.order == items[0].order]
        best += [item for item in given if _base_of(item) == channel]
        if len(best) < 2:
            # Cells of one winch are no winches.
            if channel in {"motor_angle", "position"} and best:
                return ()
            continue
        sets: dict[tuple[str, ...], list[str]] = {}
        for item in best:
            words = _words(item)
            for n, word in enumerate(words):
                sets.setdefault((*words[:n], "*", *words[n + 1 :]), []).append(word)
        series = [
            tuple(labels)
            for labels in sets.values()
            if len(labels) > 1 and len(set(labels)) == len(labels) and _is_series(labels)
        ]
        largest = {labels for labels in series if len(labels) == max(map(len, series))}
        if len(largest) == 1:
            return largest.pop()
        if largest:
            return ()
    return ()


def _base_of(item: ChannelCandidate) -> str:
    """Channel without a winch's name; a current is in place of the torque."""
    base = item.channel.rpartition(".")[2]
    return "motor_torque" if base == "motor_current" else base


def _is_series(labels: Sequence[str]) -> bool:
    """Whether labels are numbered or lettered, and not ``motor`` and ``load``."""
    stems = {label.rstrip("0123456789") for label in labels}
    numbered = len(stems) == 1 and all(label[-1:].isdecimal() for label in labels)
    return numbered or all(len(label) == 1 for label in labels) or set(labels) in _SIDES


def _words(item: ChannelCandidate) -> list[str]:
    return words_of(" ".join((*item.column.labels, item.column.name))).split()


def _label_of(item: ChannelCandidate, labels: Sequence[str]) -> str:
    found = [label for label in labels if label in _words(item)]
    return found[0] if len(found) == 1 else ""
